"""Initial configurations that close the loops, with speeds that keep them closed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from mechc.assembly.closure_solver import Loop, even_points, wrap
from mechc.assembly.initial_values import filled_start
from mechc.assembly.speeds import only_branch, with_speeds
from mechc.errors import AssemblyError, UnknownNameError, ValueOutOfBoundsError
from mechc.system.parameters import Array, Parameters, brief, by_name

if TYPE_CHECKING:
    from mechc.model import Model

STARTS_PER_UNKNOWN = 24
Values = Mapping[str, float] | None


def assemble(
    model: Model,
    coordinates: Mapping[str, float] | None = None,
    speeds: Mapping[str, float] | None = None,
    guess: Mapping[str, float] | None = None,
    params: Parameters = None,
    t: float = 0.0,
) -> Array:
    """One state that closes the loops to rounding.

    Parameters
    ----------
    coordinates
        Values to keep (rad, m); the other coordinates are solved for, as angles in (-pi, pi].
        When None, those of the mechanism's own start (``model.start``), with its speeds too
        as far as ``speeds`` leaves them a freedom.
    speeds
        Values to keep (rad/s, m/s); the others are made consistent, the least ones where the
        constraints leave a choice.
    guess
        Some coordinates near which the configuration is wanted; of several assemblies the
        nearest is taken, in the turn of the guess.  Without it the mechanism's preferred one is
        taken: the elbow-up configuration of a planar loop.  At a change point also some speeds,
        near which those of one branch are wanted.
    params
        As in every output of the model.
    t
        The time in s, where constraints depend on it.

    Returns
    -------
    y0 : (nq + nu,)

    Raises
    ------
    AssemblyError
        If the loops cannot close (by how many metres they miss), if the coordinates given leave
        a choice and there is no guess, if the speeds contradict each other, or if the
        configuration is a change point and the speeds lead along more than one branch.
    """
    coordinates, speeds, guess = _named(model, coordinates, speeds, guess)
    if coordinates is None:
        coordinates, speeds, guess = filled_start(model, {}, speeds or {}, guess)
    pace = {name: value for name, value in guess.items() if name in model.speeds}
    pace = _checked(model, pace, model.speeds, "speed")
    beside = {name: value for name, value in guess.items() if name not in pace}
    given = _checked(model, speeds or {}, model.speeds, "speed")
    near = _checked(model, beside, model.coordinates, "coordinate")
    if near and set(near) & set(coordinates):
        both = sorted(set(near) & set(coordinates))[0]
        raise AssemblyError(f"{both} is both given and guessed; leave it out of one of them")
    found = _configurations(model, coordinates, params, near, t)
    chosen = _nearest(model, found, near) if near else found[0]
    values = model._parameters.resolve(params)
    states = with_speeds(model, chosen[None], coordinates, given, values, t)
    return only_branch(model, states, given, pace)


def assemblies(
    model: Model,
    coordinates: Mapping[str, float],
    speeds: Mapping[str, float] | None = None,
    params: Parameters = None,
    t: float = 0.0,
) -> Array:
    """Every state that closes the loops with the coordinates given: (n, nq + nu).

    The mechanism's preferred assembly comes first; at a change point there is one state for
    every branch on which the speeds lead.  Parameters and errors as in :func:`assemble`.
    """
    _named(model, coordinates, speeds, None)
    found = _configurations(model, coordinates, params, {}, t)
    given = _checked(model, speeds or {}, model.speeds, "speed")
    return with_speeds(model, found, coordinates, given, model._parameters.resolve(params), t)


def _named(
    model: Model, coordinates: Values, speeds: Values, guess: Values
) -> tuple[Values, Values, Mapping[str, float]]:
    """What is given by name, or not at all."""
    q, u = (
        f"{{{names[0]!r}: 0.5}}" if names else "{}" for names in (model.coordinates, model.speeds)
    )
    return (
        None if coordinates is None else by_name(coordinates, "coordinates", q),
        None if speeds is None else by_name(speeds, "speeds", u),
        {} if guess is None else by_name(guess, "guesses", q),
    )


def _checked(
    model: Model, values: Mapping[str, float], known: tuple[str, ...], kind: str
) -> dict[str, float]:
    checked = {}
    for name, value in by_name(values, f"{kind}s", "{NAME: 0.5}").items():
        if name not in known:
            raise UnknownNameError(kind, name, known)
        try:
            checked[name] = float(value)
        except (TypeError, ValueError, OverflowError):
            raise ValueOutOfBoundsError(f"{name} must be a number, not {brief(value)}") from None
        if not np.isfinite(checked[name]):
            raise ValueOutOfBoundsError(f"{name} = {checked[name]} is not a finite number")
    return checked


def _configurations(
    model: Model,
    coordinates: Mapping[str, float],
    params: Parameters,
    near: Mapping[str, float],
    t: float,
) -> Array:
    """All configurations found, preferred first: (n, nq)."""
    given = _checked(model, coordinates, model.coordinates, "coordinate")
    values = model._parameters.resolve(params)
    if values.ndim != 1:
        raise ValueOutOfBoundsError("assembly takes one set of parameters at a time")
    kept = [model.state_index(name) for name in given]
    free = model._unknown(kept)
    fixed = model._first.copy()
    fixed[kept] = list(given.values())
    loop = Loop(model, values, fixed, free, t)
    if not free or not loop.rows:
        return _without_search(model, loop, near)
    _refuse_choice(model, loop, near)
    return _preferred_first(model, values, loop.solve(_starts(model, loop, near)))


def _without_search(model: Model, loop: Loop, near: Mapping[str, float]) -> Array:
    """Nothing to solve for, or nothing to close."""
    q = loop.fixed.copy()
    for name, value in near.items():
        q[model.state_index(name)] = value
    if loop.rows:
        gap = float(np.abs(loop.gap(np.zeros((1, 0)))).max())
        if gap > 1e-8 * loop.length:
            raise AssemblyError(
                f"the coordinates given leave the loop open by {gap:.6g} m; give fewer of them "
                "and let the others be solved for"
            )
    return q[None]


def _refuse_choice(model: Model, loop: Loop, near: Mapping[str, float]) -> None:
    excess = len(loop.free) - loop.rows
    if excess > 0 and not near:
        names = ", ".join(model.coordinates[i] for i in loop.free)
        raise AssemblyError(
            f"{loop.rows} constraints do not determine {names}: give {excess} more of them, or "
            "a guess"
        )


def _starts(model: Model, loop: Loop, near: Mapping[str, float]) -> Array:
    """Points spread evenly over the free coordinates, and the guess."""
    size = len(loop.free)
    count = STARTS_PER_UNKNOWN * size * size
    spread = even_points(count, size) * np.where(loop.angular, np.pi, loop.length)
    if not near:
        return spread
    guess = np.array([near.get(model.coordinates[i], np.nan) for i in loop.free])
    near_guess = np.where(np.isnan(guess), spread, guess)
    return near_guess if size > loop.rows else np.vstack([near_guess, spread])


def _preferred_first(model: Model, values: Array, found: Array) -> Array:
    order = np.lexsort(found.T[::-1])
    if "preference" in model._scene.outputs:
        states = np.hstack([found, np.zeros((len(found), len(model.speeds)))])
        preference = model._evaluate("preference", states, values, 0.0)
        order = np.lexsort((*found.T[::-1], -preference))
    return found[order]


def _nearest(model: Model, found: Array, near: Mapping[str, float]) -> Array:
    """The configuration nearest to the guess, its angles in the guess's turn."""
    index = [model.state_index(name) for name in near]
    target = np.array(list(near.values()))
    angular = np.array([model.units[name] == "rad" for name in near])
    away = found[:, index] - target
    away = np.where(angular, wrap(away), away)
    chosen = int(np.argmin(np.linalg.norm(away, axis=1)))
    q = found[chosen].copy()
    turns = np.round((target - q[index]) / (2 * np.pi))
    q[index] += np.where(angular, turns * 2 * np.pi, 0.0)
    return np.asarray(q)
