"""A mass on a spring, behind every door of mechc: each gives the states at TIMES of a motion.

The damper c follows m and k by default.  F is an input.  A door gets what belongs to a motion as
`simulate` gets it, and exports as they say; what it does not take it has to refuse.
"""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import particle
from mechc.compilation import toolchain

t = dynamicsymbols._t
q, u, F = dynamicsymbols("q u F")
m, k, c, far = sm.symbols("m k c far")
M, K, C, FAR = 2.0, 30.0, 0.6, 0.3  # kg, N/m, N s/m, m
Y0 = np.array([-0.2, 0.5])
T_END = 2.0  # s
TIMES = np.linspace(0.05, T_END, 40)
RTOL = 1e-10
GIVEN = {"defaults": {m: M, k: K, c: k * m / 100}, "parameters": {far: FAR}}


@dataclass(frozen=True)
class Motion:
    """What belongs to a motion of the mass.

    ``force``: an expression that is compiled in place of the input F.
    """

    inputs: Mapping[str, Any] = field(default_factory=lambda: {"F": 2.0})
    events: Sequence[Any] = ()
    params: Mapping[str, float] = field(default_factory=dict)
    force: Any = None

    @property
    def number(self) -> float | None:
        """The input where it is a number."""
        given = self.inputs.get("F")
        return given if isinstance(given, float) else None

    def policy(self) -> dict[str, Any]:
        """The arguments of `simulate` besides span, start and parameters."""
        given = {"events": self.events} if self.events else {}
        return {"rtol": RTOL, **given, **({"inputs": self.inputs} if self.inputs else {})}


def described() -> Any:
    return particle([q], [u], [F - k * q - c * u])


@cache
def model(force: Any = None) -> mechc.Model:
    inputs = {} if force is None else {"inputs": {F: force}}
    return mechc.compile(described(), name="mass", outputs=("energy",), **GIVEN, **inputs)


def exported(motion: Motion) -> dict[str, Any]:
    """The arguments of an export: the motion without what is given to exported code, numbers."""
    inputs = motion.inputs if motion.number is None else {}
    asked = {F: motion.force} if motion.force is not None else inputs
    events = {"events": motion.events} if motion.events else {}
    return {**GIVEN, **events, **({"inputs": asked} if asked else {}), "name": "mass"}


# -- doors: motion, a folder -> states (nt, 2) at TIMES ----------------------------------------


def simulate(motion: Motion, folder: Path) -> np.ndarray:
    return solution(motion)(TIMES)


def solution(motion: Motion, t_end: float = T_END) -> mechc.Solution:
    sol = model(motion.force).simulate(t_end, Y0, motion.params, **motion.policy())
    assert sol.status.ok, sol.status
    return sol


def at_times(motion: Motion, folder: Path) -> np.ndarray:
    return _at_times(motion)


def _at_times(motion: Motion, method: str = "auto") -> np.ndarray:
    sol = model(motion.force).simulate(
        T_END, Y0, motion.params, t_eval=TIMES, method=method, **motion.policy()
    )
    assert sol.status.ok, sol.status
    return sol.y[np.searchsorted(sol.t, TIMES)]


def continue_to(motion: Motion, folder: Path) -> np.ndarray:
    sol = solution(motion, 0.77).continue_to(T_END)
    assert sol.status.ok, sol.status
    return sol(TIMES)


def stepper(motion: Motion, folder: Path) -> np.ndarray:
    made = model(motion.force).stepper(Y0, motion.params, **motion.policy())
    return np.array([made.step(time - made.t) for time in TIMES])


def batch(motion: Motion, folder: Path) -> np.ndarray:
    return _member(motion)


def streamed(motion: Motion, folder: Path) -> np.ndarray:
    pytest.importorskip("zarr")
    return _member(motion, out=folder / "streamed", lockstep=False)


def _member(motion: Motion, **given: Any) -> np.ndarray:
    members = np.tile(Y0, (3, 1))
    found = model(motion.force).simulate_batch(
        T_END, members, motion.params, t_eval=TIMES, progress=False, **given, **motion.policy()
    )
    assert found.ok.all(), found["status"]
    states = np.asarray(found.y_eval)
    assert (states == states[0]).all()
    np.testing.assert_array_equal(states[1], _at_times(motion, found.method))
    return states[1]


def opened(motion: Motion, folder: Path) -> np.ndarray:
    file = solution(motion).save(folder / "mass.nc")
    again = mechc.open(file, model=model(motion.force))
    assert again.status.ok, again.status
    return again(TIMES)


def unit(motion: Motion, folder: Path) -> np.ndarray:
    """Co-simulation by fmpy."""
    fmpy = pytest.importorskip("fmpy")
    file = mechc.export_fmu(
        described(), folder / "mass.fmu", y0=Y0, params=motion.params, rtol=RTOL,
        derivatives=False, **exported(motion),
    )  # fmt: skip
    record = fmpy.simulate_fmu(
        str(file), fmi_type="CoSimulation", stop_time=T_END, output_interval=TIMES[0],
        output=["q", "u"], relative_tolerance=RTOL, record_events=False,
        start_values=_start(motion),
    )  # fmt: skip
    states = np.column_stack([record["q"], record["u"]])
    return states[[np.abs(record["time"] - time).argmin() for time in TIMES]]


def _start(motion: Motion) -> dict[str, float]:
    return {} if motion.number is None else {"F": motion.number}


ROW = ctypes.POINTER(ctypes.c_double)
DRIVE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_double, ROW, ROW, ROW)


def plain_c(motion: Motion, folder: Path) -> np.ndarray:
    """Kutta's steps of 1 ms; the input is a number of the model, or a function of the program."""
    from tests.compiler.export.test_standalone import Exported, _constants

    given = motion.inputs.get("F")
    drives = isinstance(given, FunctionType)
    shown = Motion({}, motion.events, motion.params, motion.force) if drives else motion
    mechc.export_c(described(), folder, y0=Y0, params=motion.params, **exported(shown))
    values = {"m": M, "k": K, "c": np.nan, "far": FAR} | dict(motion.params)  # NaN: follows
    order = list(model(motion.force).parameters)
    made = Exported(folder, "mass", 2, [values[name] for name in order], Y0)
    place = len(order) + _constants(folder / "mass.h", "k")
    if drives:
        arity = given.__code__.co_argcount

        def drive(_: Any, time: float, x: Any, v: Any, inputs: Any) -> None:
            inputs[0] = given(time) if arity == 1 else given(time, [x[0]], [v[0]])

        kept = DRIVE(drive)
        made.model.view(np.uint64)[place + 1] = ctypes.cast(kept, ctypes.c_void_p).value
    elif motion.force is None:
        made.model[place] = motion.number
    states, y, h, per = [], Y0, 1e-3, round(TIMES[0] / 1e-3)
    for n in range(len(TIMES) * per):
        status, y = made.step(h, y, n * h)
        assert status == 0
        if (n + 1) % per == 0:
            states.append(y)
    return np.array(states)


def page(motion: Motion, folder: Path) -> np.ndarray:
    """The module of the page that simulates, run by Node."""
    node = shutil.which("node")
    if node is None or toolchain.packaged_compiler() is None:
        pytest.skip("node or the package ziglang is not installed")
    mechc.export_wasm(described(), folder, y0=Y0, params=motion.params, **exported(motion))
    shutil.copy(folder / "mass.js", folder / "mass.mjs")
    script = f"""
import {{ create }} from "./mass.mjs";
const m = await create(), states = [];
m.give({json.dumps(_start(motion))});
m.start({{}}, {{ tolerance: {RTOL} }});
for (const time of {TIMES.tolist()}) {{ m.advance(time); states.push(Array.from(m.y)); }}
console.log(JSON.stringify(states));
"""
    (folder / "run.mjs").write_text(script, "utf-8")
    done = subprocess.run([node, folder / "run.mjs"], capture_output=True, text=True, check=True)
    return np.array(json.loads(done.stdout))


DOORS = {
    "simulate": simulate, "t_eval": at_times, "continue_to": continue_to, "stepper": stepper,
    "batch": batch, "streamed": streamed, "opened": opened, "unit": unit, "plain C": plain_c,
    "page": page,
}  # fmt: skip
# The steps of simulate: to the last bit.  A batch has those of its own method, as _member asks.
EXACT = ("t_eval", "streamed", "opened")
SLOW = ("unit", "page")
