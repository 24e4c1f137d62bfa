"""Speeds that keep assembled loops closed; at a change point, those along its branches."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

import numpy as np

from mechc.assembly import tangent_branches as branches
from mechc.assembly.closer import closure
from mechc.assembly.sizes import speed_sizes
from mechc.errors import AssemblyError
from mechc.system.parameters import Array
from mechc.system.quantity import Kind, NamedQuantity
from mechc.system.system import System

OPEN = 1e-9  # residuals below it, of the size of J and of the speeds, are rounding
DEAD = 1e-7  # relative singular value of a dead point, found to half the digits as it is


def with_speeds(
    system: System,
    q: Array,
    coordinates: Collection[str],
    given: Mapping[str, float],
    values: Array,
    t: float,
    instead: Callable[[], Array] | None = None,
) -> Array:
    """States (n, nq + nu) on the configurations q (n, nq), at a change point one for every branch.

    ``coordinates`` are those that the user gave and that stay as they are, ``given`` the speeds.
    ``instead``: gives the configurations to take where rows of these are nearly dependent.
    """
    states = np.zeros((len(q), q.shape[1] + len(system.speeds)))
    states[:, : q.shape[1]] = q
    for name, value in given.items():
        states[:, system.state_index(name)] = value
    if not system.scene.rows:
        return states
    kept = consistent(system, states, given, values[None], t)
    if all(kept.keep) and min(kept.conditioning) > branches.NEAR:
        return kept.y
    if instead is not None:
        return with_speeds(system, instead(), coordinates, given, values, t)
    fixed = [system.state_index(name) for name in coordinates]
    return np.vstack([
        _speeds_at(system, states[i], kept, i, fixed, given, values, t) for i in range(len(q))
    ])  # fmt: skip


class KeptSpeeds(NamedTuple):
    """States y (n, nq + nu) with speeds that are as consistent as can be.

    ``row``: the row that opens most, ``residual``: by how much a second, ``keep``: whether that is
    rounding; ``conditioning``: the least singular value of J relative to the largest.
    """

    y: Array
    keep: Any
    row: Any
    residual: Array
    conditioning: Array


def consistent(system: System, y: Array, given: Collection[str], p: Array, t: float) -> KeptSpeeds:
    """The speeds that keep the constraints, with the least change of those that are not given.

    States y (n, nq + nu), parameters p (n or 1, np); the scene has constraints.
    """
    names = "speeds", tuple(given)
    free = system.cache.get(names)
    if free is None:
        places = [i for i, name in enumerate(system.speeds) if name not in given]
        free = system.cache[names] = np.array(places, np.intc)
    units: tuple[Array, ...] = ()  # weights of the rows and units of the speeds, for every row of p
    if not system.sized_by_lengths:
        rows, steps = speed_sizes(system, y[: len(p)], p, t)
        units = 1.0 / rows, steps
    y, left, row, residual, conditioning = closure(system, t).keep_speeds(
        t, y, p, free, DEAD, *units
    )
    if system.driven is not None:
        system.driven.raise_failure()
    return KeptSpeeds(y, left <= OPEN, row, residual, conditioning)


def _speeds_at(
    system: System, y: Array, kept: KeptSpeeds, i: int, fixed: list[int],
    given: Mapping[str, float], values: Array, t: float,
) -> Array:  # fmt: skip
    """States with speeds at one configuration: one, or at a change point one for each branch."""
    near = not kept.conditioning[i] > branches.NEAR
    at = branches.find(system, y, values, t) if near else None
    if at is None or (at.q[fixed] != y[fixed]).any():
        if not kept.keep[i]:
            names = ", ".join(f"{name} = {value:g}" for name, value in given.items()) or "rest"
            raise AssemblyError(
                f"no speeds with {names} keep the constraint "
                f"{system.constraint_names[kept.row[i]]!r}: it opens at {kept.residual[i]:.6g} per "
                "second. Give other speeds, or fewer"
            )
        return kept.y[i : i + 1]
    places = {system.speeds.index(name): value for name, value in given.items()}
    speeds = branches.speeds_on_branches(system, at, places, values, t)
    if speeds is None or not len(speeds):
        _refuse_speeds(system, y, given, at, values, t, leave_a_choice=speeds is None)
    assert speeds is not None
    return np.hstack([np.tile(at.q, (len(speeds), 1)), speeds])


def _refuse_speeds(
    system: System, y: Array, given: Mapping[str, float], at: branches.SingularConfiguration,
    values: Array, t: float, *, leave_a_choice: bool,
) -> None:  # fmt: skip
    """Raise at a change point for speeds that follow no branch, or do not determine one."""
    words = ", ".join(f"{name} = {value:g}" for name, value in given.items())
    if leave_a_choice:
        raise AssemblyError(
            f"{_place(system, y)} is a change point, and with {words} more than one degree of "
            "freedom remains: give more of the speeds"
        )
    lines = [
        _motion(system, row)
        for name, value in given.items()
        if value
        for row in _or_none(branches.speeds_on_branches(
            system, at, {system.speeds.index(name): value}, values, t
        ))
    ][:8]  # fmt: skip
    told = f": {'; or '.join(dict.fromkeys(lines))}" if lines else ""
    raise AssemblyError(
        f"{_place(system, y)} is a change point, and no branch of the motion continues with "
        f"{words}. Give one speed, and a second one near those of a branch as a guess{told}"
    )


def _or_none(rows: Array | None) -> Array:
    return np.zeros((0, 0)) if rows is None else rows


def only_branch(
    system: System, states: Array, given: Mapping[str, float], pace: Mapping[str, float]
) -> Array:
    """The only state, or among those of several branches the one nearest in speed to a guess."""
    if len(states) == 1:
        return np.asarray(states[0])
    if not pace:
        words = ", ".join(f"{name} = {value:g}" for name, value in given.items())
        ways = "; or ".join(_motion(system, y[len(system.coordinates) :]) for y in states)
        raise AssemblyError(
            f"{_place(system, states[0])} is a change point, where {words} is possible on "
            f"{len(states)} branches: {ways}. Give another of these speeds as a guess "
            "(guess={...}), or take one of model.assemblies(...)"
        )
    columns = [system.state_index(name) for name in pace]
    away = np.linalg.norm(states[:, columns] - list(pace.values()), axis=1)
    return np.asarray(states[np.argmin(away)])


def _motion(system: System, u: Array) -> str:
    return ", ".join(f"{n} = {x:.6g}" for n, x in zip(system.speeds, u, strict=True))


def _place(system: System, y: Array) -> str:
    return ", ".join(
        in_words(system.quantities[n], x) for n, x in zip(system.coordinates, y, strict=False)
    )


def in_words(coordinate: NamedQuantity, value: float) -> str:
    """A coordinate with its value, angles in degrees."""
    if coordinate.kind is Kind.ANGLE:
        return f"{coordinate.name} = {math.degrees(value):.6g} deg"
    return f"{coordinate.name} = {value:.6g} {coordinate.unit}".rstrip()
