"""Dry friction where bodies are always in contact, with sticking."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mechc.system.parameters import Array


@dataclass(frozen=True)
class DryFriction:
    """Coulomb's friction at a speed of sliding, with true sticking.

    While it slides, a force mu N opposes the slip: u' gets -mu N sign(slip) W^T, with the rows W of
    the slip over the speeds, through mass matrix and constraints.  While it sticks, slip = 0 is a
    constraint, and its force is what that needs; it slides again where the force comes to
    ``static`` N.  Given among the events of a run; ``sol.events`` has the times at which it
    changes between the two.

    Attributes
    ----------
    slip
        The speed of sliding, linear in the speeds: an expression of SymPy or a text, ``"u_0"``,
        ``"omega_1 - omega_2"``; or a joint of SymPy with one speed.  In rad/s the force is a
        torque.
    mu
        The coefficient while it slides: a number, or an expression of time, state and parameters,
        as one of the slip.
    normal
        N, the force that presses, likewise; 1 makes ``mu`` the force itself.
    static
        The coefficient at which it begins to slide; None: ``mu``.
    """

    slip: Any
    mu: Any
    normal: Any = 1.0
    static: Any = None


class FrictionLaw:
    """The law as a function of t and y that is never zero, for it is no event by itself.

    Attributes
    ----------
    expressions
        The slip and the coefficients, or forces, of sliding and of sticking, over plain symbols.
    """

    def __init__(self, slip: Any, sliding: Any, sticking: Any) -> None:
        self.expressions = (slip, sliding, sticking)
        self.__name__ = "dry friction"

    def __call__(self, t: float, y: Array) -> float:
        return 1.0
