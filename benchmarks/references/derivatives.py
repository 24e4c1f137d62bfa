"""Errors of derivatives of motions against those of ``data/sensitivities.json``.

    mechc bench derivatives [--only FAMILY ...]

Of every family, method and tolerance: the largest relative error of the derivatives of the end,
over rtol; the condition, by how much errors of the states grow on their way into the derivatives;
and whether the error is within 100 rtol times the condition.  The status is 1 where one is not.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from mechc_codegen.library.spatial.bicycle import values

import mechc

from ..problems.bicycle import COORDINATES, NAMES, SPEEDS
from ..problems.data import reference
from ..problems.problem import Array
from ..stability.stiff import two_masses

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
    condition: float

    @property
    def fine(self) -> bool:
        return self.error <= ALLOWED * self.rtol * self.condition


def pendulum() -> tuple[Any, Sequence[str]]:
    return mechc.load("pendulum", outputs=OUTPUTS), METHODS


def four_bar() -> tuple[Any, Sequence[str]]:
    return mechc.load("four_bar", outputs=("energy", "multipliers", "sensitivities")), METHODS


def stiff_masses() -> tuple[Any, Sequence[str]]:
    return mechc.compile(two_masses(), outputs=OUTPUTS), ("radau5",)


def bicycle() -> tuple[Any, Sequence[str]]:
    return mechc.load("bicycle", outputs=OUTPUTS), METHODS


# What is given besides what the data have.
ALSO: dict[str, Mapping[str, float]] = {"bicycle": {**COORDINATES, **SPEEDS, **values()}}
# The order of the data's states where it is not the model's.
ORDER: dict[str, Sequence[str]] = {"bicycle": NAMES}
MODELS: dict[str, Callable[[], tuple[Any, Sequence[str]]]] = {
    "pendulum": pendulum,
    "four_bar_regular": four_bar,
    "four_bar_change_point": four_bar,
    "stiff_masses": stiff_masses,
    "bicycle": bicycle,
}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="mechc bench derivatives", description=__doc__,
        formatter_class=argparse.RawTextHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--only", nargs="*", choices=list(MODELS), default=list(MODELS))
    chosen = parser.parse_args(arguments)
    print(f"{'family':22} {'method':7} {'rtol':>6} {'error/rtol':>10} {'condition':>9}")
    fine = True
    for name in chosen.only:
        for row in rows(name):
            fine &= row.fine
            told = "" if row.fine else "  too large"
            print(f"{row.family:22} {row.method:7} {row.rtol:6.0e} {row.error / row.rtol:10.3g} "
                  f"{row.condition:9.3g}{told}", flush=True)  # fmt: skip
    return 0 if fine else 1


def rows(name: str) -> Iterator[Row]:
    """The errors of one family."""
    model, methods = MODELS[name]()
    data = reference("sensitivities")[name]
    names = [*model.coordinates, *model.speeds]
    given = {**ALSO.get(name, {}), **{key: float(value) for key, value in data["given"].items()}}
    y0 = {key: value for key, value in given.items() if key in names}
    params = {key: value for key, value in given.items() if key not in names}
    order = [list(ORDER.get(name, names)).index(each) for each in names]
    exact = {key: np.array(each, float)[order] for key, each in data["by"].items()}
    condition = _condition(model, data["t"], y0, params, list(exact))
    for method in methods:
        for rtol in RTOLS:
            sol = model.simulate(
                data["t"], y0, params, rtol=rtol, method=method, sensitivities=list(exact)
            )
            yield Row(name, method, rtol, error(sol.sensitivity, exact), condition)


def error(found: Mapping[str, Array], exact: Mapping[str, Array]) -> float:
    """The largest error of a column's end over the column's size."""
    return max(float(np.abs(found[n][-1] - x).max() / np.abs(x).max()) for n, x in exact.items())


def _condition(
    model: Any, t: float, y0: Mapping[str, float], params: Mapping[str, float], by: Sequence[str]
) -> float:
    """How much the derivatives change, relative to their size, with the start relative to its
    size, one component after the other; at least 1."""

    def ends(start: Mapping[str, float]) -> dict[str, Array]:
        sol = model.simulate(t, start, params, rtol=1e-12, sensitivities=by)
        return {name: sol.sensitivity[name][-1] for name in by}

    plain, most = ends(y0), 1.0
    for name, value in y0.items():
        push = PUSH * max(abs(value), 1.0)
        beside = ends({**y0, name: value + push})
        for key, column in plain.items():
            change = np.abs(beside[key] - column).max() / np.abs(column).max()
            most = max(most, float(change) / PUSH)
    return most
