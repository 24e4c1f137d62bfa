"""Initial configurations that close the loops, with speeds that keep them closed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechc.assembly.closure_solver import Loop, even_points, wrap
from mechc.assembly.speeds import only_branch, with_speeds
from mechc.errors import AssemblyError
from mechc.system.parameters import Array
from mechc.system.system import System

STARTS_PER_UNKNOWN = 24
Values = Mapping[str, float]  # name -> number


def assemble(
    system: System,
    coordinates: Values,
    speeds: Values,
    near: Values,
    p: Array,
    t: float = 0.0,
) -> Array:
    """One state (nq + nu,) that closes the loops to rounding; see :meth:`mechc.Model.assemble`.

    ``near``: a guess: coordinates near the configuration wanted, and speeds near those of a branch.
    """
    close_by = {name: value for name, value in near.items() if name not in system.speeds}
    pace = {name: value for name, value in near.items() if name in system.speeds}
    found = _configurations(system, coordinates, p, close_by, t)
    chosen = _nearest(system, found, close_by) if close_by else found[0]
    states = with_speeds(system, chosen[None], coordinates, speeds, p, t)
    return only_branch(system, states, speeds, pace)


def assemblies(
    system: System, coordinates: Values, speeds: Values, p: Array, t: float = 0.0
) -> Array:
    """Every state (n, nq + nu) that closes the loops with the coordinates given."""
    found = _configurations(system, coordinates, p, {}, t)
    return with_speeds(system, found, coordinates, speeds, p, t)


def _configurations(system: System, given: Values, values: Array, near: Values, t: float) -> Array:
    """All configurations found, preferred first: (n, nq)."""
    kept = [system.state_index(name) for name in given]
    free = system.unknowns(kept)
    fixed = system.default_coordinates.copy()
    fixed[kept] = list(given.values())
    loop = Loop(system, values, fixed, free, t)
    if not free or not loop.rows:
        return _without_search(system, loop, near)
    _refuse_choice(system, loop, near)
    return _preferred_first(system, values, loop.solve(_starts(system, loop, near)))


def _without_search(system: System, loop: Loop, near: Values) -> Array:
    """Nothing to solve for, or nothing to close."""
    q = loop.fixed.copy()
    for name, value in near.items():
        q[system.state_index(name)] = value
    if loop.rows:
        gap = float(np.abs(loop.gap(np.zeros((1, 0)))).max())
        if gap > 1e-8 * loop.length:
            raise AssemblyError(
                f"with the coordinates given the loop is open by {gap:.6g} m; give fewer of them "
                "and let the others be solved for"
            )
    return q[None]


def _refuse_choice(system: System, loop: Loop, near: Values) -> None:
    excess = len(loop.free) - loop.rows
    if excess > 0 and not near:
        names = ", ".join(system.coordinates[i] for i in loop.free)
        raise AssemblyError(
            f"{loop.rows} constraints do not determine {names}: give {excess} more of them, or "
            "a guess"
        )


def _starts(system: System, loop: Loop, near: Values) -> Array:
    """Points spread evenly over the free coordinates, and the guess."""
    size = len(loop.free)
    count = STARTS_PER_UNKNOWN * size * size
    spread = even_points(count, size) * np.where(loop.angular, np.pi, loop.length)
    if not near:
        return spread
    guess = np.array([near.get(system.coordinates[i], np.nan) for i in loop.free])
    near_guess = np.where(np.isnan(guess), spread, guess)
    return near_guess if size > loop.rows else np.vstack([near_guess, spread])


def _preferred_first(system: System, values: Array, found: Array) -> Array:
    order = np.lexsort(found.T[::-1])
    if "preference" in system.scene.outputs:
        states = np.hstack([found, np.zeros((len(found), len(system.speeds)))])
        preference = system.evaluate("preference", states, values, 0.0)
        order = np.lexsort((*found.T[::-1], -preference))
    return found[order]


def _nearest(system: System, found: Array, near: Values) -> Array:
    """The configuration nearest to the guess, its angles within half a turn of the guess's."""
    index = [system.state_index(name) for name in near]
    target = np.array(list(near.values()))
    angular = system.angular[index]
    away = found[:, index] - target
    away = np.where(angular, wrap(away), away)
    chosen = int(np.argmin(np.linalg.norm(away, axis=1)))
    q = found[chosen].copy()
    turns = np.round((target - q[index]) / (2 * np.pi))
    q[index] += np.where(angular, turns * 2 * np.pi, 0.0)
    return np.asarray(q)
