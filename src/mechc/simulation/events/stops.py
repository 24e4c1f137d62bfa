"""Stops: parts of a mechanism that hit each other, with Newton's law of restitution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.errors import MechcError, ValueOutOfBoundsError
from mechc.system.parameters import Array
from mechc.system.system import System


@dataclass(frozen=True)
class Stop:
    """A gap that stays open: where it closes, an impact without friction turns its rate back.

    The impulse acts through the mass matrix and the constraints.  Stops that touch at that instant
    get their impulses together: each rate is afterwards at least ``-e`` times the one before, and
    where it is more there is no impulse (Moreau 1988; a linear complementarity problem).  Energy
    never grows: of stops with different e that touch at once the least counts where it would.

    Attributes
    ----------
    gap
        Positive where the parts are apart: an expression of time, coordinates and parameters, of
        SymPy or as text, ``"theta_0 + 0.2"``.
    restitution
        e, 0 to 1: a number, or an expression of parameters.
    terminal
        As of :class:`mechc.Event`.
    """

    gap: Any
    restitution: Any = 0.0
    terminal: bool | int = False


def refuse_stops(system: System, span: tuple[float, float], compiled: bool) -> None:
    """Refuse stops where their impacts cannot be computed.

    Raises
    ------
    ValueOutOfBoundsError, MechcError
        Backwards in time; without compiled code, or beside events that are functions of Python.
    """
    if span[1] < span[0]:
        raise ValueOutOfBoundsError(
            "backwards in time there are no stops: the motion before an impact does not follow "
            "from the one after it"
        )
    if not compiled:
        raise MechcError(
            f"{system.name}: stops run in compiled code. They need a C compiler, all other events "
            "as expressions, and a start that is no change point"
        )


class StopReset:
    """The impact of one stop by itself, as a function of t, q, u and parameters.

    ``gap`` and ``kept``, the restitution, are a :class:`ValueExpression` each.
    """

    takes_parameters = True

    def __init__(self, gap: Any, kept: Any, system: System, p: Array) -> None:
        self.gap, self.kept, self.system, self.p = gap, kept, system, p
        self.restitution = kept.expression
        self.__name__ = "of a stop"

    def __call__(self, t: float, q: Array, u: Array, p: Array | None = None) -> tuple[Array, Array]:
        """``p``: other parameters than those of the run."""
        values = self.p if p is None else p
        y, system, split = np.concatenate([q, u]), self.system, len(q)
        by_time, by_state, _ = self.gap.slopes(t, y, values)
        rates = system.rates(y, values, t)
        rate = by_time + by_state[:split] @ rates[:split]
        moved = y + np.hstack([np.zeros((len(u), split)), np.eye(len(u))])
        along = (system.rates(moved, values, t) - rates)[:, :split] @ by_state[:split]
        root = np.linalg.cholesky(system.mass_matrix(y, values, t))
        free = np.linalg.solve(root, along)
        rows = np.linalg.solve(root, system.constraint_jacobian(y, values, t).T)
        free -= rows @ np.linalg.lstsq(rows, free, rcond=None)[0]
        e = self.kept.at(t, y, values)
        return q, u - np.linalg.solve(root.T, free) * (1.0 + e) * rate / (free @ free)
