"""Errors of derivatives of motions against those of ``data/sensitivities.json``.

    mechc bench derivatives [--only FAMILY ...]

Of every family, method and tolerance: the largest relative error of the derivatives of the end,
over rtol, of columns forwards and of gradients backwards; the condition, by how much errors of the
states grow on their way into the derivatives; and whether both errors are within 100 rtol times the
condition.  The status is 1 where one is not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from mechc_codegen.library.spatial.bicycle import values

import mechc

from ...problems.bicycle import COORDINATES, NAMES, SPEEDS
from ...problems.data import reference
from ...problems.problem import Array
from ...stability.stiff import two_masses
from ...timing.results import command_parser
from . import struck

RTOLS = (1e-6, 1e-8, 1e-10, 1e-12)
METHODS = ("gauss8", "dop853")
ALLOWED = 100.0
PUSH = 1e-5  # of each component's size
OUTPUTS = ("energy", "sensitivities")


class Row(NamedTuple):
    """One line of the table."""

    family: str
    method: str
    rtol: float
    error: float
    backwards: float
    condition: float

    @property
    def fine(self) -> bool:
        return max(self.error, self.backwards) <= ALLOWED * self.rtol * self.condition


def strikes() -> dict[str, Any]:
    """The wall and the torque."""
    wall = mechc.Event(
        lambda t, y: y[0] - struck.WALL, direction=-1,
        reset=lambda t, q, u: (q, -struck.RESTITUTION * u),
    )  # fmt: skip
    torque = mechc.Signal(struck.TIMES, struck.TORQUES, "previous")
    return {"events": wall, "inputs": {"F": torque}}


# What is given besides what the data have.
ALSO: dict[str, Mapping[str, float]] = {"bicycle": {**COORDINATES, **SPEEDS, **values()}}
# The order of the data's states where it is not the model's.
ORDER: dict[str, Sequence[str]] = {"bicycle": NAMES}
FOUR_BAR = partial(mechc.load, "four_bar", outputs=("energy", "multipliers", "sensitivities"))
MODELS: dict[str, Callable[[], Any]] = {
    "pendulum": lambda: mechc.load("pendulum", outputs=OUTPUTS),
    "four_bar_regular": FOUR_BAR,
    "four_bar_change_point": FOUR_BAR,
    "stiff_masses": lambda: mechc.compile(two_masses(), outputs=OUTPUTS),
    "bicycle": lambda: mechc.load("bicycle", outputs=OUTPUTS),
    "andrews": lambda: mechc.load("andrews", outputs=OUTPUTS),
    "struck_pendulum": lambda: mechc.compile(struck.pushed_pendulum(), outputs=OUTPUTS),
}
STIFF = {"stiff_masses": ("radau5",)}  # other methods where METHODS do not suit
# What a run needs besides its start and parameters.
RUNS: dict[str, Callable[[], Mapping[str, Any]]] = {"struck_pendulum": strikes}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("derivatives", __doc__)
    parser.add_argument("--only", nargs="*", choices=list(MODELS), default=list(MODELS))
    chosen = parser.parse_args(arguments)
    print(f"{'family':22} {'method':7} {'rtol':>6} {'error/rtol':>10} {'backwards':>10} "
          f"{'condition':>9}")  # fmt: skip
    fine = True
    for name in chosen.only:
        for row in rows(name):
            fine &= row.fine
            told = "" if row.fine else "  too large"
            errors = f"{row.error / row.rtol:10.3g} {row.backwards / row.rtol:10.3g}"
            print(f"{row.family:22} {row.method:7} {row.rtol:6.0e} {errors} "
                  f"{row.condition:9.3g}{told}", flush=True)  # fmt: skip
    return 0 if fine else 1


class Posed(NamedTuple):
    """A family as a run of its model: ``run(y0, params, ...)``, and the exact derivatives (nx,) of
    its end, in the order of the model's states."""

    model: Any
    run: Callable[..., Any]
    y0: Mapping[str, float]
    params: Mapping[str, float]
    t: float
    methods: Sequence[str]
    exact: Mapping[str, Array]


def posed(name: str) -> Posed:
    """One family."""
    model, methods = MODELS[name](), STIFF.get(name, METHODS)
    data = reference("sensitivities")[name]
    names = [*model.coordinates, *model.speeds]
    given = {**ALSO.get(name, {}), **{key: float(value) for key, value in data["given"].items()}}
    y0 = {key: value for key, value in given.items() if key in names}
    params = {key: value for key, value in given.items() if key in model.parameters}
    run = partial(model.simulate, data["t"], **RUNS.get(name, dict)())
    order = [list(ORDER.get(name, names)).index(each) for each in names]
    exact = {key: np.array(each, float)[order] for key, each in data["by"].items()}
    return Posed(model, run, y0, params, data["t"], methods, exact)


def rows(name: str) -> Iterator[Row]:
    """The errors of one family."""
    _, run, y0, params, _, methods, exact = posed(name)
    condition = _condition(run, y0, params, list(exact))
    for method in methods:
        for rtol in RTOLS:
            sol = run(y0, params, rtol=rtol, method=method, sensitivities=list(exact))
            errors = error(sol.sensitivity, exact), error(backwards(sol, list(exact)), exact)
            yield Row(name, method, rtol, *errors, condition)


def backwards(sol: Any, by: Sequence[str]) -> dict[str, Array]:
    """Derivatives of the end (1, nq + nu), a gradient for each of its components."""
    parts = [sol.gradient(end=unit, by=by) for unit in np.eye(sol.y.shape[1])]
    return {name: np.array([[part[name] for part in parts]]) for name in by}


def error(found: Mapping[str, Array], exact: Mapping[str, Array]) -> float:
    """The largest error of a column's end over the column's size."""
    return max(float(np.abs(found[n][-1] - x).max() / np.abs(x).max()) for n, x in exact.items())


def _condition(
    run: Callable[..., Any], y0: Mapping[str, float], params: Mapping[str, float],
    by: Sequence[str],
) -> float:  # fmt: skip
    """How much the derivatives change, relative to their size, with the start relative to its
    size, one component after the other; at least 1."""

    def ends(start: Mapping[str, float]) -> dict[str, Array]:
        sol = run(start, params, rtol=1e-12, sensitivities=by)
        return {name: sol.sensitivity[name][-1] for name in by}

    plain, most = ends(y0), 1.0
    for name, value in y0.items():
        push = PUSH * max(abs(value), 1.0)
        beside = ends({**y0, name: value + push})
        for key, column in plain.items():
            change = np.abs(beside[key] - column).max() / np.abs(column).max()
            most = max(most, float(change) / PUSH)
    return most
