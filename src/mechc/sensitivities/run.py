"""The sensitivities of a finished run: from the start through every piece of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from mechc.sensitivities.columns import Columns, columns_of, held_by
from mechc.sensitivities.events import AT_ONE_INSTANT, Jump, jump_of, through_reset
from mechc.sensitivities.history import Sensitivity
from mechc.sensitivities.start import OPENS, opening, start_columns, without_closure
from mechc.sensitivities.steps import Piece, differentiable, follow, refuse_contact
from mechc.simulation.record import Record
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array

WEAK = 1e-5  # of the largest singular value: at a crossing the weakest row is weaker
NO_DERIVATIVE = (
    "there a law jumps at a zero that is only touched (grazing), or to which both sides lead back, "
    "or two laws jump at one instant"
)


def sensitivity_of_run(sol: Trajectory, names: Sequence[str], y0: Any, params: Any) -> Sensitivity:
    """Derivatives of the run; ``y0`` and ``params`` as the user gave them.

    Raises :class:`UnavailableOutputError`, :class:`UnknownNameError`, :class:`MechcError` as
    :func:`columns_of` and :func:`start_columns` say.
    """
    refuse_contact(sol)
    sol = differentiable(sol)
    system = sol.system
    columns = columns_of(system, names, sol.params, held_by(system, params))
    t, y = sol.record.ends()
    start, notes = start_columns(system, columns, y0, sol.record, sol.params)
    notes += without_closure(system, columns, start, y[0], sol.params, float(t[0]))
    ended: list[str] = []
    pieces = _pieces(sol, columns, start, ended)
    notes += tuple(ended)
    notes += _past_crossings(sol, columns, pieces)
    return Sensitivity(sol, columns, pieces, notes)


def _pieces(sol: Trajectory, columns: Columns, start: Array, notes: list[str]) -> list[Piece]:
    """The columns over the pieces of the motion."""
    found: list[Piece] = []
    for number, piece in enumerate(sol.record.pieces):
        if found:
            start = _end(sol.record, number - 1, found[-1])
        if piece.jumps:
            start = _after_jump(sol, jump_of(sol.record, number), columns, start, notes)
        found.append(follow(sol.system, piece.steps, sol.params, columns, start))
        lost = np.asarray(np.isnan(found[-1].ends).any(axis=1))
        for column in np.flatnonzero(lost[-1] & ~lost[0]):  # NaN from a jump of a law on
            t = found[-1].t[int(np.argmax(lost[:, column]))]
            names = columns.names_among(np.arange(lost.shape[1]) == column)
            notes += [f"by {n}: none from t = {t:.9g} s on, for {NO_DERIVATIVE}" for n in names]
    return found


def _after_jump(
    sol: Trajectory, jump: Jump, columns: Columns, start: Array, notes: list[str]
) -> Array:
    """Columns after the resets of events; NaN where they do not exist."""
    found, why = np.full(start.shape, np.nan), AT_ONE_INSTANT
    if len(jump.causes) == 1:
        found = through_reset(sol, jump, columns, start)
        why = (
            "the event only touches its zero (grazing), and its time moves infinitely fast; by "
            "what does not move the event there is one"
        )
    ended = np.isfinite(start).all(axis=0) & np.isnan(found).any(axis=0)
    notes += [
        f"by {name}: none from t = {jump.t:.9g} s on, for {why}"
        for name in columns.names_among(np.asarray(ended))
    ]
    return np.ascontiguousarray(found)


def _end(record: Record, number: int, piece: Piece) -> Array:
    """The columns at the end of a piece, which may be within its last step."""
    t, y = (each[-1:] for each in record.pieces[number].states())
    return np.ascontiguousarray(piece.on_tangent_space(t, y, piece.at(t))[0])


# -- where there is no derivative -----------------------------------------------------------------


def _past_crossings(sol: Trajectory, columns: Columns, pieces: Sequence[Piece]) -> tuple[str, ...]:
    """Set columns to NaN from a change point on that exists for exactly these lengths only."""
    notes: list[str] = []
    for t, bad, said in ended_columns(sol, columns):
        notes += said
        for piece in pieces if bad.any() else ():
            forwards = 1.0 if piece.t[-1] >= piece.t[0] else -1.0
            step = int(np.searchsorted(forwards * piece.t, forwards * t, side="right")) - 1
            piece.ends[max(step, 0) + 1 :, :, bad] = np.nan  # from the step that contains t on
    return tuple(notes)


def ended_columns(
    sol: Trajectory, columns: Columns
) -> Iterator[tuple[float, Array, tuple[str, ...]]]:
    """Times at which columns end, flags (k,) of these, and why."""
    alive = np.ones(columns.count, dtype=bool)
    for point in sol.change_points:
        y = np.array(sol(point.t))
        y[: len(point.q)] = point.q
        opened = opening(sol.system, columns, y, sol.params, point.t)
        if opened is None:
            continue
        gaps = np.abs(_weak_rows(sol, y, point.t) @ opened).max(axis=0, initial=0.0)
        bad = alive & (gaps > OPENS * np.abs(opened).max())
        alive &= ~bad
        notes = (
            f"by {name}: none from t = {point.t:.9g} s on, for there is a change point of exactly "
            f"these lengths: with another {name} the motion turns off or back (the gap there "
            f"changes by {gaps[columns.places[name]]:.3g} m per unit). By the start and the "
            "masses, lengths held, there is one"
            for name in columns.names_among(bad)
        )
        yield point.t, bad, tuple(notes)


def _weak_rows(sol: Trajectory, y: Array, t: float) -> Array:
    """The combinations (m, nh) of the configuration constraints that no motion changes at y."""
    system = sol.system
    rows = system.constraint_jacobian(y, sol.params, t)[: system.scene.holonomic]
    left, sizes, _ = np.linalg.svd(rows)
    sizes = np.append(sizes, np.zeros(len(rows) - len(sizes)))
    weak = sizes <= WEAK * sizes[0]
    weak[np.argmin(sizes)] = True
    return np.asarray(left.T[weak])
