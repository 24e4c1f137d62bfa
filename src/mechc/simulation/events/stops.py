"""Stops: parts of a mechanism that hit each other, and may stay in contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.simulation.events.friction import FrictionLaw
from mechc.system.parameters import Array
from mechc.system.system import System

NEWTON, POISSON = "newton", "poisson"


@dataclass(frozen=True)
class Stop:
    """A gap that stays open: where it closes, an impact turns its rate back, or contact lasts.

    The impulse acts through the mass matrix and the constraints.  Stops that touch at that instant
    get their impulses together.  By Newton's law each rate is afterwards at least ``-e`` times the
    one before, and where it is more there is no impulse (Moreau 1988; a linear complementarity
    problem).  By Poisson's law expansion follows compression, which ends with gaps at rest, and has
    at least ``e`` times its impulses, with friction of its own (Glocker & Pfeiffer 1995).

    Energy never grows: of stops with different e that touch at once the least counts where it
    would.  Newton's law with friction gives energy at some oblique impacts (Kane & Levinson 1985):
    all restitutions are then as much smaller as keeps it from that, and the status warns.
    Poisson's does not.

    Where flights become too short to be told apart, and with e = 0, the contact lasts: the gap is
    held by a force that presses, until that comes to 0.

    Attributes
    ----------
    gap
        Positive where the parts are apart: an expression of time, coordinates and parameters, of
        SymPy or as text, ``"theta_0 + 0.2"``.
    restitution
        e, 0 to 1: a number, or an expression of parameters.
    terminal
        As of :class:`mechc.Event`.
    friction
        Coulomb's coefficient while it slides, and at impacts: a number, or an expression of time,
        state and parameters.  In the plane: there is one direction of sliding.
    slip
        The speed of sliding at the contact, linear in the speeds, with ``friction``: as
        ``"u_x + r*omega"``.
    static
        The coefficient at which what sticks begins to slide; None: ``friction``.
    law
        ``"newton"`` or ``"poisson"``: the law of restitution, one for all stops of a run.
    """

    gap: Any
    restitution: Any = 0.0
    terminal: bool | int = False
    friction: Any = 0.0
    slip: Any = None
    static: Any = None
    law: str = NEWTON


class StopReset:
    """The impact of one stop by itself, as a function of t, q, u and parameters.

    ``gap`` and ``kept``, the restitution, are a :class:`ValueExpression` each; ``friction``: its
    law, without a slip where there is none.  One impact by itself without friction is the same by
    either ``law`` of restitution.
    """

    takes_parameters = True

    def __init__(
        self, gap: Any, kept: Any, system: System, p: Array, friction: FrictionLaw, law: str
    ) -> None:  # fmt: skip
        self.friction, self.law = friction, law
        self.gap, self.kept, self.system, self.p = gap, kept, system, p
        self.restitution = kept.expression
        self.__name__ = "of a stop"

    def __call__(self, t: float, q: Array, u: Array, p: Array | None = None) -> tuple[Array, Array]:
        """The state after the impact; ``p``: other parameters than those of the run."""
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
