"""Speeds that keep assembled loops closed; at a change point, those along its branches."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from mechc.assembly import tangent_branches as branches
from mechc.assembly.closure_solver import in_words
from mechc.errors import AssemblyError
from mechc.system.parameters import Array
from mechc.system.system import System

DEAD = 1e-7  # relative singular value of a dead point, found to half the digits as it is


def with_speeds(
    system: System,
    q: Array,
    coordinates: Iterable[str],
    given: Mapping[str, float],
    values: Array,
    t: float,
) -> Array:
    """States (n, nq + nu) on the configurations q (n, nq), at a change point one for every branch.

    ``coordinates`` are those that the user gave and that stay as they are, ``given`` the speeds.
    """
    states = np.hstack([q, np.zeros((len(q), len(system.speeds)))])
    kept = [system.state_index(name) for name in coordinates]
    return np.vstack([_speeds_at(system, y, kept, given, values, t) for y in states])


def _speeds_at(
    system: System, y: Array, fixed: list[int], given: Mapping[str, float], values: Array, t: float
) -> Array:
    at = branches.find(system, y, values, t)
    if at is None or (at.q[fixed] != y[fixed]).any():
        _consistent_speeds(system, y, given, values, t)
        return y[None]
    kept = {system.speeds.index(name): value for name, value in given.items()}
    speeds = branches.speeds_on_branches(system, at, kept, values, t)
    if speeds is None or not len(speeds):
        _refuse_speeds(system, y, given, at, values, t, leave_a_choice=speeds is None)
    assert speeds is not None
    return np.hstack([np.tile(at.q, (len(speeds), 1)), speeds])


def _refuse_speeds(
    system: System, y: Array, given: Mapping[str, float], at: branches.SingularConfiguration,
    values: Array, t: float, *, leave_a_choice: bool,
) -> None:  # fmt: skip
    """At a change point: speeds that follow no branch, or do not determine one."""
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
    """The one state, or of several branches the one whose speeds are nearest to a guess."""
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


def _consistent_speeds(
    system: System, y: Array, given: Mapping[str, float], values: Array, t: float
) -> None:
    """Fill the speeds of one state in place."""
    u = y[len(system.coordinates) :]
    kept = [system.speeds.index(name) for name in given]
    free = [i for i in range(len(u)) if i not in kept]
    u[kept] = list(given.values())
    jacobian = system.constraint_jacobian(y, values, t)
    if not len(jacobian):
        return
    residual = system.velocity_constraints(y, values, t)
    if free:
        u[free] -= np.linalg.lstsq(jacobian[:, free], residual, rcond=DEAD)[0]
        residual = system.velocity_constraints(y, values, t)
    size = np.abs(jacobian).max() * max(1.0, float(np.abs(u).max()))
    if np.abs(residual).max() > 1e-9 * size:
        row = int(np.abs(residual).argmax())
        names = ", ".join(f"{name} = {value:g}" for name, value in given.items()) or "rest"
        raise AssemblyError(
            f"no speeds with {names} keep the constraint {system.constraint_names[row]!r}: it "
            f"opens at {abs(residual[row]):.6g} per second. Give other speeds, or fewer"
        )
