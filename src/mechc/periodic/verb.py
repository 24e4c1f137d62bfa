"""The verb of a model that finds cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mechc.progress import Notice
from mechc.simulation.settings import checked_count, checked_positive
from mechc.system.names import owned
from mechc.system.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.outputs import Outputs
    from mechc.periodic.cycle import Cycle


def periodic(
    model: Outputs,
    y0: Array | Mapping[Any, float],
    period: Any,
    params: Parameters = None,
    *,
    hold: Sequence[Any] = (),
    advance: Mapping[Any, Any] | None = None,
    t0: float = 0.0,
    inputs: Mapping[str, Any] | None = None,
    events: Sequence[Any] = (),
    rtol: float = 1e-10,
    method: str = "auto",
    tol: float = 1e-7,
    max_iterations: int = 40,
) -> Cycle:
    """The cycle near a guess: a motion that is after a period where it began.

    By shooting, with the exact derivatives of motions through loops, events and resets, and
    Newton's method; every iterate closes the loops.  Where time is in nothing that moves the
    mechanism (tried by a motion that begins later), the period is unknown and ``period`` a
    guess; else it is what drives the motion that gives it.

    Parameters
    ----------
    y0
        A state near the cycle, as in :meth:`simulate`.
    period
        In s: a number, a text with a unit, or, where parameters determine it, an expression of
        these, ``"2*pi/Omega"``.  A whole number of periods of what drives the motion.
    hold
        What stays as in y0: names of coordinates and speeds, ``"energy"``, ``"period"``.  A
        motion that conserves its energy has a cycle for each value of it: without ``hold`` the
        nearest is found.
    advance
        What coordinates grow by in a period, ``{"theta_0": "360deg"}``; None for one that need
        not return: ``{"x": None}`` of what walks.  By default nothing, but the whole turns
        that angles make in the first motion.
    t0
        When the period begins, s.
    inputs, events, rtol, method, params
        As in :meth:`simulate`.
    tol
        The largest return error tolerated, as ``cycle.closure``; it is as a rule much smaller.
    max_iterations
        The most steps of Newton's method.

    Returns
    -------
    Cycle
        ``y0``, ``period``, ``solution``, ``multipliers``, ``stable``; it prints as a table.
        ``follow`` continues it through a parameter, ``basin`` tells which starts lead to it.

    Raises
    ------
    MechcError
        If no cycle is found, with how near the best motion came.
    ValueOutOfBoundsError
        If what drives the motion does not repeat after the period; and what :meth:`simulate`
        raises.
    """
    from mechc.periodic.find import periodic

    run = {"inputs": owned(inputs), "events": owned(events), "rtol": rtol, "method": method}
    with Notice(f"searching a cycle of {model.name} ..."):
        return periodic(
            model, y0, period, params, t0=t0, hold=hold, advance=advance, run=run,
            tol=checked_positive("tol", tol), most=checked_count("max_iterations", max_iterations),
        )  # fmt: skip
