"""Constraints that follow from the others on every closed configuration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechc.assembly.closer import even_points, search_of
from mechc.assembly.positions import reach
from mechc.errors import AssemblyError
from mechc.system.parameters import Array
from mechc.system.system import System

SAMPLES = 8
STARTS = 64
DEPENDENT = 1e-8  # of a row's largest length: what remains after elimination of the rows before it
SHARE = 1e-6  # of the largest share: a smaller one counts as zero


@dataclass(frozen=True)
class Redundancy:
    """A constraint row that the rows before it imply.

    Attributes
    ----------
    name
        The row, as in ``model.constraint_names``.
    follows_from
        Rows that imply it; empty where its Jacobian is always zero.
    shares
        Its coefficients in terms of these rows, if they are the same on every closed
        configuration; else empty.
    """

    name: str
    follows_from: tuple[str, ...]
    shares: tuple[float, ...]

    def __str__(self) -> str:
        if not self.follows_from:
            return f"{self.name}: always holds"
        if not self.shares:
            return f"{self.name}: follows from {', '.join(self.follows_from)}"
        terms = [f"{s:+.6g} of {n}" for s, n in zip(self.shares, self.follows_from, strict=True)]
        return f"{self.name}: is {', '.join(terms)}"


def redundant_constraints(system: System, values: Array, t: float = 0.0) -> tuple[Redundancy, ...]:
    """Rows that are redundant everywhere: see :meth:`mechc.Model.redundant_constraints`."""
    y = _closed_states(system, values, t)
    jacobian = _of_highest_rank(np.asarray(system.constraint_jacobian(y, values, t)))
    size = np.linalg.norm(jacobian, axis=2).max(axis=0, initial=0.0)
    largest = float(size.max(initial=0.0))
    kept: list[int] = []
    found = []
    for row, name in enumerate(system.constraint_names):
        scale = size[row] if size[row] > 1e-13 * largest else largest
        shares, left = _shares(jacobian, kept, row)
        if (left > DEPENDENT * scale).any():
            kept.append(row)
        else:
            found.append(_relation(system, name, kept, shares))
    return tuple(found)


def _closed_states(system: System, values: Array, t: float) -> Array:
    """States (n, nq + nu) at rest on configurations that close the loops."""
    width = len(system.coordinates)
    starts = even_points(STARTS, width)
    if not system.scene.holonomic:
        closed = starts[:SAMPLES] * reach(system, values)
    else:
        fixed = np.zeros((1, width))
        every = search_of(system, range(width), starts=starts)
        search = every.solved(t, fixed, values[None], STARTS, all=True)
        if not search.many[0]:
            raise AssemblyError(
                "no configuration that closes the loops was found: the ends miss each other by at "
                f"least {search.miss[0]:.6g} m with these lengths"
            )
        closed = search.found[0, : search.many[0]]
    return np.hstack([closed, np.zeros((len(closed), len(system.speeds)))])


def _of_highest_rank(jacobian: Array) -> Array:
    """The samples (at most SAMPLES, nc, nu) whose rank is the highest."""
    singular = np.linalg.svd(jacobian, compute_uv=False)
    rank = (singular > DEPENDENT * singular[:, :1]).sum(axis=1)
    return np.asarray(jacobian[rank == rank.max(initial=0)][:SAMPLES])


def _shares(jacobian: Array, kept: list[int], row: int) -> tuple[Array, Array]:
    """Shares (samples, kept) of the rows kept in this one, and the remainder (samples,)."""
    shares = np.zeros((len(jacobian), len(kept)))
    left = np.linalg.norm(jacobian[:, row], axis=1)
    for i, sample in enumerate(jacobian):
        if kept:
            shares[i] = np.linalg.lstsq(sample[kept].T, sample[row], rcond=DEPENDENT)[0]
            left[i] = np.linalg.norm(sample[row] - shares[i] @ sample[kept])
    return shares, left


def _relation(system: System, name: str, kept: list[int], shares: Array) -> Redundancy:
    size = np.abs(shares).max(axis=0, initial=0.0)
    part = [i for i in range(len(kept)) if size[i] > SHARE * max(1.0, size.max(initial=0.0))]
    names = tuple(system.constraint_names[kept[i]] for i in part)
    constant = np.ptp(shares, axis=0).max(initial=0.0) <= SHARE * size.max(initial=0.0)
    return Redundancy(name, names, tuple(shares[0, part].tolist()) if constant else ())
