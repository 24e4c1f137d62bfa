"""Constraints that follow from the others on every closed configuration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechc.assembly.closer import even_points
from mechc.assembly.positions import closed_states
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
    """See :meth:`mechc.Model.redundant_constraints`."""
    omitted = [name for name, always_holds, _ in system.data.get("cut_rows", ()) if always_holds]
    rows = redundant_rows(system, values, t)
    return (*rows, *(Redundancy(name, (), ()) for name in omitted))


def redundant_rows(system: System, values: Array, t: float = 0.0) -> tuple[Redundancy, ...]:
    """Rows of J that are redundant in all configurations."""
    y = closed_states(system, even_points(STARTS, len(system.coordinates)), values, t)
    every = np.asarray(system.constraint_jacobian(y, values, t))
    singular = np.linalg.svd(every, compute_uv=False)
    rank = (singular > DEPENDENT * singular[:, :1]).sum(axis=1)
    jacobian = np.asarray(every[rank == rank.max(initial=0)][:SAMPLES])  # of the highest rank
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
            sizes = np.abs(shares).max(axis=0, initial=0.0)
            most = float(sizes.max(initial=0.0))
            part = [i for i in range(len(kept)) if sizes[i] > SHARE * max(1.0, most)]
            names = tuple(system.constraint_names[kept[i]] for i in part)
            constant = np.ptp(shares, axis=0).max(initial=0.0) <= SHARE * most
            same = tuple(shares[0, part].tolist()) if constant else ()
            found.append(Redundancy(name, names, same))
    return tuple(found)


def _shares(jacobian: Array, kept: list[int], row: int) -> tuple[Array, Array]:
    """Factors (samples, kept) of the rows kept that make up a row, and the rest (samples,)."""
    shares = np.zeros((len(jacobian), len(kept)))
    left = np.linalg.norm(jacobian[:, row], axis=1)
    for i, sample in enumerate(jacobian):
        if kept:
            shares[i] = np.linalg.lstsq(sample[kept].T, sample[row], rcond=DEPENDENT)[0]
            left[i] = np.linalg.norm(sample[row] - shares[i] @ sample[kept])
    return shares, left
