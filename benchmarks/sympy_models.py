"""SymPy's own models, compiled and compared with SymPy's own numbers.

    python benchmarks/sympy_models.py [module ...]

Every object whose equations are formed in SymPy's tests of ``sympy.physics.mechanics`` is compiled
at two random states on its constraints.  Columns: sizes, largest relative difference of the rates
(and of the multipliers, where SymPy solves for them), seconds until the first value, and again from
the cache.
"""

from __future__ import annotations

import importlib
import inspect
import os
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from _scene import write
from sympy import Rational, sin
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc import jit

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "jit"))
import sympy_models

MODULES = (
    *("test_kane", "test_kane2", "test_kane3", "test_kane4", "test_kane5", "test_lagrange"),
    *("test_lagrange2", "test_linearize", "test_models", "test_jointsmethod"),
)
LIMIT = 120  # seconds for one test of SymPy's, which may simplify for long
EACH = 3  # objects of one test


def main(modules: list[str]) -> None:
    warnings.simplefilter("ignore")
    rows = [compared(label, thing) for label, thing in objects(modules or list(MODULES))]
    good = [row for row in rows if row.get("difference", 1.0) < 1e-12]
    refused = [row for row in rows if "refused" in row]
    print(f"{len(rows)} objects: {len(good)} equal to 1e-12, {len(refused)} refused")
    write("sympy_models", rows)


def objects(modules: list[str]) -> Iterator[tuple[str, Any]]:
    """(label, formed object) of every test without arguments."""
    for name in modules:
        module = importlib.import_module(sympy_models.TESTS + name)
        for test, function in vars(module).items():
            if test.startswith("test_") and not inspect.signature(function).parameters:
                for k, thing in enumerate(caught(name, test)):
                    yield f"{name}.{test}[{k}]", thing


def caught(module: str, test: str) -> list[Any]:
    def stop(*_: object) -> None:
        raise sympy_models.EnoughError

    signal.signal(signal.SIGALRM, stop)
    signal.alarm(LIMIT)
    try:
        return sympy_models.caught(module, test, EACH)
    finally:
        signal.alarm(0)


def compared(label: str, thing: Any) -> dict[str, Any]:
    row: dict[str, Any] = {"model": label, "kind": type(thing).__name__}
    _, _, specified = sympy_models.states_and_inputs(thing)
    t = dynamicsymbols._t
    inputs = {f: Rational(k + 1, 7) + sin((k + 2) * t) for k, f in enumerate(specified)}
    try:
        model, row["first value, s"] = timed(lambda: compiled(thing, inputs))
        assert model.capsule  # the whole of it is in the cache
        jit._compiled.clear()
        _, row["again, s"] = timed(lambda: compiled(thing, inputs))
        row["sizes"] = [len(model.coordinates), len(model.speeds), len(model.constraint_names)]
        row["difference"] = difference(model, thing, inputs)
    except mechc.MechcError as error:
        row["refused"] = str(error)
    except AssertionError as error:
        row["not compared"] = str(error)
    shown = [f"{value:.2g}" if isinstance(value, float) else str(value) for value in row.values()]
    print("  ".join(shown), flush=True)
    return row


def compiled(thing: Any, inputs: Any) -> Any:
    model = mechc.compile(thing, inputs=inputs, outputs=("multipliers",))
    values = np.ones(len(model.parameters))
    model.rhs(0.0, np.zeros(len(model.coordinates) + len(model.speeds)), values)
    return model


def timed(run: Any) -> tuple[Any, float]:
    started = time.perf_counter()
    made = run()
    return made, time.perf_counter() - started


def difference(model: Any, thing: Any, inputs: Any) -> float:
    """Largest difference at two states, relative to the largest rate or multiplier."""
    reference, rng, largest = sympy_models.Reference(thing, inputs), np.random.default_rng(3), 0.0
    for _ in range(2):
        t, y, values = sympy_models.random_state(model, reference, rng)
        mine = {p: values[p] for p in model.parameters}
        rates, multipliers = reference.rates(t, y, values)
        pairs = [(model.rhs(t, y, mine), rates)]
        if len(multipliers):
            pairs.append((model.multipliers(y, mine, t), -multipliers))
        for one, other in pairs:
            scale = max(1.0, np.abs(other).max())
            largest = max(largest, float(np.abs(one - other).max()) / scale)
    return largest


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MECHC_CACHE_DIR"] = folder  # so that the first compilation is one
        main(sys.argv[1:])
