"""Families of equilibria: in which directions one stays where it is put, and who is of which.

A direction is a null vector of the linear model: it changes no acceleration.  It counts if a
displacement along it, and not only its first order, leads to another equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechc.analysis.linearize import Linearization
from mechc.assembly.closer import wrap
from mechc.assembly.sizes import steps_of
from mechc.system.parameters import Array
from mechc.system.system import System

Settle = Callable[[Array], "Array | None"]  # the equilibrium (nq + nu,) next to a state, if any
BALANCED = 1e-9  # of the largest slope: rounding
PROBE, LONGEST, SHORTEST, MOST = 0.02, 0.5, 1e-3, 200  # steps: of a trial, of a walk; of these
NEAR, FAR, CLOSE = 1e-6, 1e3, 0.3  # distances, in steps: rounding, of that, and near
MOVES, LEADS = 1e-6, 1e-3  # parts of a direction: more than rounding, enough to divide by


def null_directions(system: System, lin: Linearization, values: Array, pull: float) -> Array:
    """Directions (n, nq) along the configuration constraints that change no acceleration, beside
    the largest change and ``pull``; none that changes a quaternion's length.

    In echelon form: each has a coordinate that changes by 1 along it and stays along all others.
    """
    width = sum(name in system.coordinates for name in lin.states)
    nq, steps = len(system.coordinates), steps_of(system, values)
    own = steps[[system.state_index(name) for name in lin.states]]
    moved = lin.to_state[:nq, :width] * own[:width] / steps[:nq, None]
    slope = lin.A[width:, :width] * own[:width] / own[width:, None]
    lengths = system.attitudes.lengths_gradient(lin.y[:nq], range(nq)) @ moved
    most = max(float(np.linalg.norm(slope, 2)), pull)
    rows = np.concatenate([slope / most if most else slope, lengths])
    _, singular, right = np.linalg.svd(rows)
    found, leading = _echelon(right[int((singular > BALANCED).sum()) :] @ moved.T)
    return np.asarray(found * steps[:nq] / steps[leading][:, None])


def _echelon(rows: Array) -> tuple[Array, list[int]]:
    """Rows that span the same, and the place in each of a one where the others have zeros."""
    rows, leading = rows.copy(), list[int]()
    for column in range(rows.shape[1]):
        done = len(leading)
        if done == len(rows):
            break
        best = done + int(np.argmax(np.abs(rows[done:, column])))
        if abs(rows[best, column]) < LEADS:
            continue
        rows[[done, best]] = rows[[best, done]]
        rows[done] /= rows[done, column]
        others = np.arange(len(rows)) != done
        rows[others] -= rows[others, column, None] * rows[done]
        leading.append(column)
    kept = rows[: len(leading)]
    return np.asarray(np.where(np.abs(kept) > MOVES, kept, 0.0)), leading


def kept_directions(
    system: System, y: Array, directions: Array, settle: Settle, values: Array
) -> Array:
    """Those of the directions (n, nq) of an equilibrium along which there are others."""
    nq, steps = len(system.coordinates), steps_of(system, values)
    kept = []
    for direction in directions:
        trial = y.copy()
        trial[:nq] += PROBE * direction / np.abs(direction / steps[:nq]).max()
        there = settle(trial)
        if there is not None and _away(system, there, y, steps).max() > PROBE / 2:
            kept.append(direction)
    return np.array(kept).reshape(-1, nq)


def are_joined(
    system: System, begin: tuple[Array, Array], end: tuple[Array, Array], settle: Settle,
    directions_at: Callable[[Array], Array], values: Array,
) -> bool:  # fmt: skip
    """Whether equilibria lead from one to another: states (nq + nu,) and their directions.

    Walks towards the end; along a curve to the side that is nearer, and on until the end is near,
    or the begin again.
    """
    (start, directions), (goal, at_goal) = begin, end
    nq, steps = len(system.coordinates), steps_of(system, values)
    away = _towards(system, start, goal, steps)[:nq]
    if np.abs(away[~(directions.any(axis=0) | at_goal.any(axis=0))]).max(initial=0.0) > FAR * NEAR:
        return False
    at, length, last, left = start, LONGEST, np.zeros(nq), False
    for _ in range(MOST):
        across = (directions / steps[:nq]).T
        basis = np.linalg.qr(across)[0]
        step = basis @ (basis.T @ away)
        beside = np.abs(away).max() < CLOSE
        if len(directions) == 1 and not beside and last.any():
            forwards = across[:, 0] / np.abs(across).max()
            step = np.copysign(LONGEST, forwards @ last) * forwards
        longest = np.abs(step).max(initial=0.0)
        if longest < NEAR:
            break
        trial = at.copy()
        trial[:nq] += step * min(1.0, length / longest) * steps[:nq]
        there = settle(trial)
        taken = min(longest, length)
        if there is None or _away(system, there, trial, steps).max() > max(taken / 3, NEAR):
            length = taken / 2
            if length < SHORTEST:
                return False
            continue
        at, last, length = there, _towards(system, at, there, steps)[:nq], min(LONGEST, 2 * taken)
        directions, away = directions_at(there), _towards(system, there, goal, steps)[:nq]
        home = _away(system, there, start, steps).max()
        if left and home < taken / 2:
            break
        left |= home > CLOSE
    return bool(np.abs(away).max() < FAR * NEAR)


def _towards(system: System, y: Array, goal: Array, steps: Array) -> Array:
    """From one state to another, in steps; of a quaternion to the nearer of both signs."""
    goal = goal.copy()
    for places in system.attitudes.free_in_length:
        goal[[*places]] *= np.sign(goal[[*places]] @ y[[*places]]) or 1.0
    away = goal - y
    return np.asarray(np.where(system.angular, wrap(away), away) / steps)


def distance(system: System, y: Array, other: Array, values: Array) -> float:
    """Between two states, in steps of the coordinate that is farthest away."""
    return float(_away(system, y, other, steps_of(system, values)).max())


def _away(system: System, y: Array, other: Array, steps: Array) -> Array:
    return np.abs(_towards(system, y, other, steps))
