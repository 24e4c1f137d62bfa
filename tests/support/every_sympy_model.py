"""SymPy's own models, compiled and compared with SymPy's own numbers.

    python -m tests.support.every_sympy_model [module ...]

Every object whose equations are formed in SymPy's tests of ``sympy.physics.mechanics`` is compiled
as soon as it is formed and compared at two random states on its constraints.  Columns: sizes,
largest relative difference of the rates and of the constraint forces, seconds until the first
value, and again from the cache.  Takes hours; exits with 1 where a number differs.
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.compilation import build, parts
from tests.support import sympy_models
from tests.support.compilers.compilation import MadeOnRequest

MODULES = (
    *("test_kane", "test_kane2", "test_kane3", "test_kane4", "test_kane5", "test_lagrange"),
    *("test_lagrange2", "test_linearize", "test_models", "test_jointsmethod"),
    *("test_system_class", "test_actuator"),
)
LIMIT = 300  # seconds for one test of SymPy's, which may simplify for long
EACH = 6  # objects of one test
PYTEST = ("-c", os.devnull, "-s", "-p", "no:terminal", "-p", "no:cacheprovider")


def main(modules: list[str]) -> int:
    warnings.simplefilter("ignore")
    rows: list[dict[str, Any]] = []
    for name in modules or MODULES:
        file = importlib.import_module(sympy_models.TESTS + name).__file__
        pytest.main([*PYTEST, str(file)], plugins=[Compare(rows)])
    good = [row for row in rows if row.get("difference", 1.0) < 1e-12]
    refused = [row for row in rows if "refused" in row]
    print(f"{len(rows)} objects: {len(good)} equal to 1e-12, {len(refused)} refused")
    return 1 if any(row.get("difference", 0.0) >= 1e-12 for row in rows) else 0


class Compare:
    """A plug-in of pytest: compares whatever a test forms; what it asserts is not our matter."""

    def __init__(self, rows: list[dict[str, Any]]) -> None:
        self.rows = rows

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: Any) -> Iterator[None]:
        label, before = item.nodeid.removesuffix("()"), len(self.rows)

        def compare(thing: Any) -> None:
            k = len(self.rows) - before
            signal.alarm(0)
            self.rows.append(compared(f"{label}[{k}]", thing))
            if k + 1 == EACH:
                raise sympy_models.EnoughError
            signal.alarm(LIMIT)

        signal.signal(signal.SIGALRM, too_long)
        signal.alarm(LIMIT)
        try:
            with sympy_models.catching(compare):
                return (yield)
        except (sympy_models.EnoughError, AssertionError):
            return None
        finally:
            signal.alarm(0)


def too_long(*_: object) -> None:
    raise sympy_models.EnoughError


def compared(label: str, thing: Any) -> dict[str, Any]:
    row: dict[str, Any] = {"model": label, "kind": type(thing).__name__}
    inputs = sympy_models.stand_ins(thing)
    try:
        model, row["first value, s"] = timed(lambda: compiled(thing, inputs))
        build._compiled.clear()
        model, row["again, s"] = timed(lambda: compiled(thing, inputs))
        row["sizes"] = [len(model.coordinates), len(model.speeds), len(model.constraint_names)]
        found = sympy_models.pairs(model, thing, inputs, states=2, seed=3)
        row["difference"] = max(map(sympy_models.difference, found))
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


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MECHC_CACHE_DIR"] = folder  # so that the first compilation is one
        parts.Pending = MadeOnRequest  # type: ignore[assignment, misc]
        sys.exit(main(sys.argv[1:]))
