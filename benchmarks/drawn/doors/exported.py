"""Exported C, compiled and called."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sm
from sympy.physics.mechanics import dynamicsymbols

import mechc

from ...timing.cases import Array
from ..judge import Case, Difference, Fault, Told
from . import rates

STRICT = ("-std=c99", "-O0", "-Wall", "-Wextra", "-Werror", "-pedantic", "-shared", "-fPIC")
STEPS = 50
ROOM = 200_000  # doubles for a model


class Library:
    """The functions of an exported file."""

    def __init__(self, folder: Path, name: str) -> None:
        library = folder / f"{name}.so"
        compiler = os.environ.get("CC") or shutil.which("gcc") or "cc"
        command = [compiler, *STRICT, "-o", str(library), f"{name}.c", "-lm"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
        self._library, self._name = ctypes.CDLL(str(library)), name
        self.model = np.zeros(ROOM)

    def drive(self, header: str, case: Case) -> None:
        """Give inputs from now on: the case's law and the derivatives that constraints ask for."""
        sizes = re.search(r"double p\[(\d+)\], k\[(\d+)\];\s*double inputs\[(\d+)\];", header)
        assert sizes is not None
        by_name = {str(x.func.__name__): x for x in case.names["q"]}
        q = [by_name[name] for name in case.model.coordinates]
        ((_, law),) = case.names["in_sympy"].items()
        t, orders = dynamicsymbols._t, range(int(sizes[3]))
        laws = [sm.lambdify([t, *q], law.diff(t, k), "math") for k in orders]

        def given(_: int, t: float, q: Any, __: int, inputs: Any) -> None:
            for k, law in enumerate(laws):
                inputs[k] = law(t, *q[: len(by_name)])

        doubles, pointer = ctypes.POINTER(ctypes.c_double), ctypes.c_void_p
        self._driving = ctypes.CFUNCTYPE(
            None, pointer, ctypes.c_double, doubles, pointer, doubles
        )(given)  # fmt: skip
        place = sum(map(int, sizes.groups()))
        self.model.view(np.uintp)[place] = ctypes.cast(self._driving, pointer).value

    def call(self, name: str, *arguments: Any) -> int:
        passed = [
            ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else ctypes.c_double(a)
            for a in arguments
        ]
        return int(getattr(self._library, f"{self._name}_{name}")(*passed))


def as_c(case: Case) -> Iterator[Told]:
    """Rates beside SymPy's, and steps of Kutta's method beside the same in Python."""
    model = case.scene.compiled(case.names, open_inputs=True)
    with tempfile.TemporaryDirectory() as folder:
        mechc.export_c(model, folder, name="drawn")
        try:
            made = Library(Path(folder), "drawn")
        except subprocess.CalledProcessError as error:
            yield Fault("exported C", error.stderr[:1500])
            return
        for run in case.whole[:3]:
            known = {**model.defaults, **run.params}
            values = np.array([known[n] for n in model.parameters] or [0.0])
            if made.call("set", made.model, values, 0.0, run.y0.copy()):
                yield Fault("exported C", f"does not take the start; {run.numbers}")
                continue
            if model.inputs:
                made.drive(Path(folder, "drawn.h").read_text("utf-8"), case)
                made.call("begin", made.model, 0.0, run.y0.copy())
            _, expected, limit = rates.at(case, run)
            t, found = 0.0, np.zeros(len(run.y0))
            if not case.reference.closes:
                expected = case.reference.exact(t, case.to_reference(run.y0), run.params)[
                    case.order
                ]
            made.call("rates", made.model, t, run.y0.copy(), found)
            yield rates.worst("exported C: rates", found, expected, limit, case, str(run.numbers))
            if not case.reference.closes:
                yield _steps(case, run, made)


def _steps(case: Case, run: Any, made: Library) -> Difference:
    of, h = case.reference.rates(run.params), float(case.times[-1]) / 1000

    def f(t: float, y: Array) -> Array:
        return of(t, case.to_reference(y))[case.order]

    y, beside = run.y0.copy(), run.y0.copy()
    for k in range(STEPS):
        t = k * h
        made.call("step", made.model, t, h, y)
        a = f(t, beside)
        b = f(t + h / 2, beside + h / 2 * a)
        c = f(t + h / 2, beside + h / 2 * b)
        d = f(t + h, beside + h * c)
        beside = beside + h / 6 * (a + 2 * b + 2 * c + d)
    size = float(np.abs(y - beside).max())
    limit = 1e-11 * run.growth * (1 + float(np.abs(beside).max()))
    return Difference("exported C: steps", size, limit, str(run.numbers))
