"""Equations of motion that are given, not derived from bodies and loads."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from sympy import Expr

ENERGIES = ("kinetic_energy", "potential_energy")


@dataclass(frozen=True)
class GivenEquations:
    """The terms of M u' + J^T lambda = F.

    Attributes
    ----------
    mass_matrix
        Rows of M, which is symmetric; free of accelerations, as all of these.
    forcing
        F.
    energies
        T and V, where they are known.
    """

    mass_matrix: tuple[tuple[Expr, ...], ...]
    forcing: tuple[Expr, ...]
    energies: tuple[Expr, Expr] | None = None

    def terms(self) -> Iterable[tuple[str, Expr]]:
        """Every expression, with its name."""
        for i, row in enumerate(self.mass_matrix):
            for j, entry in enumerate(row):
                yield f"mass_matrix[{i}, {j}]", entry
        for i, entry in enumerate(self.forcing):
            yield f"forcing[{i}]", entry
        yield from zip(ENERGIES, self.energies or (), strict=False)
