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
    refuse_choice(system, free, near)
    reach = np.where(loop.angular, np.pi, loop.length)
    return _preferred_first(system, values, loop.solve(starts(system, free, near, reach)))


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


def refuse_choice(system: System, free: list[int], near: Values) -> None:
    """Raise :class:`AssemblyError` if constraints leave a choice that no guess makes."""
    excess = len(free) - system.scene.holonomic
    if excess > 0 and not near:
        names = ", ".join(system.coordinates[i] for i in free)
        raise AssemblyError(
            f"{system.scene.holonomic} constraints do not determine {names}: give {excess} more "
            "of them, or a guess"
        )


def starts(system: System, free: list[int], near: Values, reach: Array) -> Array:
    """Points (n, free) spread evenly over -reach ... reach, those near the guess first."""
    size = len(free)
    spread = even_points(STARTS_PER_UNKNOWN * size * size, size) * reach
    if not near:
        return spread
    guess = np.array([near.get(system.coordinates[i], np.nan) for i in free])
    near_guess = np.where(np.isnan(guess), spread, guess)
    return near_guess if size > system.scene.holonomic else np.vstack([near_guess, spread])


def _preferred_first(system: System, values: Array, found: Array) -> Array:
    return found[np.lexsort((*found.T[::-1], -preference(system, found, values)))]


def preference(system: System, q: Array, values: Array) -> Array:
    """How much the mechanism prefers each configuration (..., nq): zeros where all are equal."""
    if "preference" not in system.scene.outputs:
        return np.zeros(q.shape[:-1])
    still = np.zeros((*q.shape[:-1], len(system.speeds)))
    return system.evaluate("preference", np.concatenate([q, still], axis=-1), values, 0.0)


def _nearest(system: System, found: Array, near: Values) -> Array:
    """The configuration nearest to the guess, its angles within half a turn of it."""
    chosen = np.argmin(distance(system, found, near))
    return in_turn(system, found[chosen], near)


def distance(system: System, q: Array, near: Values) -> Array:
    """Of configurations (n, nq) from the guess, (n,)."""
    index, target, angular = _guessed(system, near)
    away = q[:, index] - target
    return np.asarray(np.linalg.norm(np.where(angular, wrap(away), away), axis=1))


def in_turn(system: System, q: Array, near: Values) -> Array:
    """Configurations (..., nq), their angles within half a turn of the guess."""
    index, target, angular = _guessed(system, near)
    turns = np.where(angular, np.round((target - q[..., index]) / (2 * np.pi)), 0.0)
    q = q.copy()
    q[..., index] += 2 * np.pi * turns
    return q


def _guessed(system: System, near: Values) -> tuple[list[int], Array, Array]:
    """Where the guessed coordinates stand, their values, and which of them are angles."""
    index = [system.state_index(name) for name in near]
    return index, np.array(list(near.values())), system.angular[index]
