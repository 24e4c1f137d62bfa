"""Gaps of constraints that are rounding, beside the change of the rows by unit steps.

Whatever the unit of a row is, and whatever it is multiplied by.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from mechc.assembly.closer import closure
from mechc.errors import AssemblyError
from mechc.native._closing import measure
from mechc.system.parameters import Array
from mechc.system.system import System

UNEVEN = 1e-7  # ratio of rows that counts as dependent between steps (dynamics/project.h)
ROUNDING = 1e-8  # of the size of a row: a state typed with ten digits is closed


def steps_of(system: System, p: Array, t: float = 0.0) -> Array:
    """A step of each component of a state (nq + nu,): 1 for angles and numbers, else the length."""
    return np.where(system.dimensionless, 1.0, sizes(system, p, t).length)


class Sizes(NamedTuple):
    """The mechanism's length, and what a radian, 1 or that length change each row by (nh,).

    Of members with parameters (n, np): (n,) and (n, nh).
    """

    length: Any
    rows: Array


def sizes(system: System, p: Array, t: float = 0.0) -> Sizes:
    """The sizes with parameters p (np,); those of the last parameters are kept."""
    of_all = sizes_of_members(system, p[None], t)
    return Sizes(float(of_all.length[0]), of_all.rows[0])


def sizes_of_members(system: System, p: Array, t: float) -> Sizes:
    """The sizes with parameters p (n, np); those of the last ones are kept."""
    key = p.tobytes(), len(p), t
    known = system.cache.get("sizes")
    if known is None or known[0] != key:
        known = system.cache["sizes"] = key, _sizes(system, np.ascontiguousarray(p), t)
    found: Sizes = known[1]
    return found


def _sizes(system: System, p: Array, t: float) -> Sizes:
    hints = system.parameter_set.lengths(p)
    if not system.scene.holonomic:
        return Sizes(hints, np.zeros((len(p), 0)))
    found = measure(closure(system, t), t, _free(system), system.default_coordinates, p, hints)
    if system.driven is not None:
        system.driven.raise_failure()
    return Sizes(*found)


def _free(system: System) -> Array:
    """The places of all coordinates that closing may change."""
    known: Array | None = system.cache.get("free")
    if known is None:
        known = system.cache["free"] = np.array(system.unknowns([]), np.intc)
    return known


def checked_gap(system: System, p: Array, t: float) -> float:
    """A gap that is rounding in every row, found fast where lengths are known.

    Raises :class:`AssemblyError` if rows are too uneven, see :func:`refuse_uneven`.
    """
    if system.sized_by_lengths:
        return ROUNDING * system.parameter_set.length(p)
    refuse_uneven(system, p, t)
    return ROUNDING * float(sizes(system, p, t).rows.min())


def allowed_gaps(system: System, p: Array, t: float) -> Array:
    """Gaps (n,) that are rounding in every row, for parameters p (n, np).

    Raises :class:`AssemblyError` if those of a member make rows too uneven, see
    :func:`refuse_uneven`.
    """
    if system.sized_by_lengths:
        return np.asarray(ROUNDING * system.parameter_set.lengths(p))
    rows = sizes_of_members(system, p, t).rows
    _refuse_uneven(system, rows)
    return np.asarray(ROUNDING * rows.min(axis=1))


def refuse_uneven(system: System, p: Array, t: float) -> None:
    """Raise where the integrator would take the smallest row for one that depends on others.

    Raises :class:`AssemblyError`, which names the two rows.
    """
    if not system.sized_by_lengths:
        _refuse_uneven(system, sizes(system, p, t).rows[None])


def _refuse_uneven(system: System, rows: Array) -> None:
    """Raise where the sizes of the rows (n, nh) of a member are too uneven."""
    uneven = rows.min(axis=1) < UNEVEN * rows.max(axis=1)
    if uneven.any():
        first = rows[np.argmax(uneven)]
        least, most = int(np.argmin(first)), int(np.argmax(first))
        names = system.constraint_names
        raise AssemblyError(
            f"{names[most]!r} changes {first[most] / first[least]:.1g} times as much as "
            f"{names[least]!r} in the same motion: rows so uneven cannot be told from dependent "
            "ones. Multiply constraints by factors that make them similar"
        )


def is_open(system: System, gap: Array, p: Array, t: float) -> bool:
    """Whether the rows (nh,) are off by more than rounding."""
    return not (np.abs(gap) <= ROUNDING * sizes(system, p, t).rows).all()


def gap_in_words(system: System, gap: Array, p: Array, t: float) -> str:
    """The gap in words: of loops in m where that is known, else of the row that is worst."""
    if system.gap_unit == "m":
        return f"the loop open by {np.abs(gap).max():.6g} m"
    worst = int(np.argmax(np.abs(gap) / sizes(system, p, t).rows))
    row = system.closure_units[worst]
    return f"{system.constraint_names[worst]!r} at {gap[worst]:.6g} {row}".rstrip()


def speed_sizes(system: System, y: Array, p: Array, t: float) -> tuple[Array, Array]:
    """The change (n, nc) of each row of J u + b by unit steps of the speeds, and the steps (n, nu).

    States y (n, nq + nu), parameters p (n, np).  Configuration constraints have their sizes;
    others, those of their rows at the state.
    """
    found, width = sizes_of_members(system, p, t), len(system.coordinates)
    first = system.scene.holonomic
    steps = np.where(system.dimensionless[width:], 1.0, found.length[:, None])
    if first == system.scene.rows:
        return found.rows, steps
    rows = np.abs(system.constraint_jacobian(y, p, t))[:, first:]
    others = (rows @ steps[:, :, None])[:, :, 0]
    return np.hstack([found.rows, np.where(others > 0.0, others, 1.0)]), steps


def excess_of_rates(system: System, drift: Array, y: Array, p: Array, t: float) -> Array:
    """The ratio of the rows of J u + b (nc,) at a state to rounding; above 1 they are off."""
    (rows,), (steps,) = speed_sizes(system, y[None], p[None], t)
    fastest = max(1.0, float(np.abs(y[len(system.coordinates) :] / steps).max(initial=0.0)))
    return np.asarray(np.abs(drift) / (ROUNDING * fastest * rows))
