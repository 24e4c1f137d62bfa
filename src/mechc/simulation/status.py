"""The status of a simulation: a code, its cause in words, and advice."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from mechc.native import _codes as codes


@dataclass(frozen=True)
class ChangePoint:
    """A crossing of a configuration where the configuration curve crosses itself.

    Attributes
    ----------
    t
        Time in s.
    q
        The coordinates there, in state order.
    gap
        The closure error that remains in the critical configuration, m: of the size of the
        lengths' rounding.
    """

    t: float
    q: tuple[float, ...]
    gap: float = 0.0


@dataclass(frozen=True, init=False)
class Status:
    """The outcome of a simulation.

    Attributes
    ----------
    code
        One of ``CODES``: ``"finished"``, ``"stopped by an event"``, or a failure.
    t
        Time reached, s.
    cause, advice
        Why it ended there, and what to do; empty for ``"finished"``.
    warnings
        Facts to know about a run that reached its end.
    """

    code: str
    t: float
    cause: str = ""
    advice: str = ""
    warnings: tuple[str, ...] = ()

    def __init__(
        self,
        code: str,
        t: float,
        cause: str = "",
        advice: str = "",
        warnings: tuple[str, ...] = (),
    ) -> None:
        # Every run makes one, and the constructor of a frozen dataclass takes four times as long.
        own = vars(self)
        own["code"], own["t"] = code, t
        own["cause"], own["advice"], own["warnings"] = cause, advice, warnings

    @property
    def ok(self) -> bool:
        """Whether the end time, or a terminal event, was reached."""
        return self.code in ("finished", "stopped by an event")

    @property
    def headline(self) -> str:
        """The outcome without its cause, advice and warnings."""
        how = "reached" if self.ok else "got to"
        return f"{self.code}: {how} t = {self.t:g} s"

    def __repr__(self) -> str:
        count = len(self.warnings)
        more = f", {count} warning{'s' * (count > 1)}" if count else ""
        return f"<mechc.Status {self.headline}{more}>"

    def __str__(self) -> str:
        if self.ok:
            head = self.headline
        else:
            head = f"{self.code} at t = {self.t:.9g} s: {self.cause}. {self.advice}"
        return ". ".join([head.rstrip(". "), *self.warnings]) + ("." if self.warnings else "")


# Near critical configurations, where another method may do.
AT_CROSSINGS = (
    codes.UNDECIDED,
    codes.NO_STEP_FITS,
    codes.BRANCH_IN_DOUBT,
    codes.BEND_TOO_SHARP,
)

# Where the equations jump.
SLIDING = (
    "Dry friction along a line, mu N sign(v), is mechc.DryFriction('v', mu, N) among the events: "
    "it slides and sticks. Else write the law smoothly, as tanh(v/v_s) for sign(v) with a small "
    "v_s, in a plane v_x/sqrt(v_x**2 + v_y**2 + v_s**2) for v_x/|v|, or end the run there by an "
    "event and continue from sol.y[-1] with the other law"
)
CODES = {
    codes.FINISHED: ("finished", "", ""),
    codes.NOT_CLOSED: (
        "not closed",
        "however short a step was, the loops could not be closed at its end: the links come to the "
        "end of their reach, or loops that close in this place only are held apart by rounding",
        "Look at sol.y[-1] and model.constraints(sol.y[-1]); loosen rtol, or start from "
        "model.assemble(...), which closes the loops to rounding",
    ),
    codes.STEP_TOO_SMALL: (
        "step too small",
        "the step size fell below the spacing of doubles: the solution is singular here, or "
        "the tolerance is beyond what doubles give",
        "Loosen rtol, or look at sol.stats['least_singular']: near zero the constraints are "
        "nearly dependent",
    ),
    codes.NOT_FINITE: (
        "not finite",
        "the equations gave infinity or NaN",
        "Look at the last state and the parameters: an expression may be outside its domain",
    ),
    codes.SINGULAR_MASS: (
        "singular mass matrix",
        "the mass matrix is not positive definite in the direction of {coordinate}",
        "Give every body that moves with it a positive mass or inertia",
    ),
    codes.TOO_MANY_STEPS: (
        "too many steps",
        "max_steps attempted steps were used up",
        "Raise max_steps, loosen rtol, or continue from sol.y[-1]",
    ),
    codes.MEMORY_LIMIT: (
        "memory limit",
        "the trajectory needs more memory than max_bytes allows",
        "Or raise max_bytes, pass dense=False, or continue from sol.y[-1] in shorter runs",
    ),
    codes.CHATTERS: (
        "chatters",
        "the equations jump here, and both sides lead back to the jump: steps go to and fro across "
        "it, and no motion leads off it",
        SLIDING,
    ),
    codes.END_OF_REACH: (
        "end of reach",
        "with these lengths the loops cannot follow the prescribed motion beyond {coordinate}: "
        "links are in line there, and speeds and forces grow without bound",
        "End the run before it, or change lengths; model.sweep_positions follows a driven "
        "coordinate to its end, model.limits has the ranges of one",
    ),
    codes.DISCONTINUITY: ("discontinuity", "the equations jump", "Write the law smoothly"),
    codes.NO_MEMORY: (
        "no memory",
        "the trajectory did not fit into memory",
        "Pass dense=False and t_eval",
    ),
    codes.UNDECIDED: (
        "undecided",
        "the lengths, as given, miss a change point by {gap:.1e} m, of the size of rounding: "
        "doubles cannot follow the links past it",
        "Give lengths that meet the change point as typed, or miss it by 1e-12 of their size",
    ),
    codes.NO_STEP_FITS: (
        "no step fits",
        "a change point comes next, and no step could be placed across it, or the run ends at it: "
        "rounding near it is more than a step may err by",
        "End the run a millisecond before or after it, loosen rtol, or take method='dop853'; the "
        "motion until there is good",
    ),
    codes.BRANCH_IN_DOUBT: (
        "branch in doubt",
        "several rows of the constraints are nearly dependent together, and however short a step "
        "was, it did not show which of them reversed",
        "Loosen rtol, or take another method; the motion until there is good",
    ),
    codes.BEND_TOO_SHARP: (
        "bend too sharp",
        "the links pass a change point that they miss by {gap:.1e} m: the motion bends there so "
        "sharply that rounding is more than a step may err by",
        "Loosen rtol, or take method='dop853'; the motion until there is good",
    ),
    codes.AT_CHANGE_POINT: (
        "at a change point",
        "the start is a change point, where several branches of the motion cross, and the "
        "speeds determine none",
        "Take speeds along one branch, as model.assemblies(..., speeds=...) gives them, or start a "
        "little away from it",
    ),
    codes.STOPPED_AT_CHANGE_POINT: (
        "stopped at a change point",
        "a change point is next, and on_change_point is 'stop'",
        "sol.change_points has its time and configuration; continue through it with "
        "on_change_point='continue'",
    ),
    codes.NEARLY_DEPENDENT: (
        "undecided",
        "the constraints become nearly dependent here: a change point, or a near miss of one, is "
        "near, and a motion in contact or with friction does not pass these",
        "End the run before it; sol.stats['least_singular'] measures how near it is",
    ),
    codes.STOPPED_BY_EVENT: ("stopped by an event", "", ""),
    codes.EVENT_FAILED: (
        "event failed",
        "an event function raised an error or gave NaN",
        "Correct the function: it is called at states between the steps too, not only at events",
    ),
    codes.RESETS_ACCUMULATE: (
        "resets accumulate",
        "the times between the resets of an event became too short to be told apart (Zeno)",
        "A contact that lasts is a mechc.Stop; with another event, end the run before it, with "
        "terminal=n or a terminal event on the speed",
    ),
    codes.CONTACT_INCONSISTENT: (
        "contact inconsistent",
        "no forces at the contacts satisfy Coulomb's law and keep the gaps from closing, whichever "
        "slide, stick or open (Painleve's paradox): rigid bodies with this friction have no motion "
        "from here on",
        "Lower the friction, or give the contact a stiffness of its own, as a load",
    ),
    codes.CONTACT_UNDECIDED: (
        "contact undecided",
        "the laws of contact allow several motions from here on, or the contacts change without "
        "end at this instant: friction and rigid bodies do not decide which (Painleve)",
        "Lower the friction, start a little beside it, or give the contact a stiffness of its own",
    ),
    codes.CONTACTS_TOO_MANY: (
        "too many contacts",
        "so many contacts touch at once that their modes cannot all be tried",
        "Describe bodies by fewer points of contact",
    ),
    codes.INPUT_FAILED: (
        "input failed",
        "the function of an input raised an error or returned no finite number",
        "Correct the function: it is called at states between the steps too",
    ),
    codes.NOT_RUN: (
        "not run",
        "the batch was stopped before this member began",
        "Call again; with out=..., finished chunks are not repeated",
    ),
    codes.NOT_ASSEMBLED: (
        "not assembled",
        "no configuration was found that closes the loops with this start and these lengths",
        "The variable 'miss' of the batch is the least gap met, of all constraints together",
    ),
    codes.OPEN_AT_START: (
        "open at the start",
        "the start is not finite, its loops are open or closed with a joint turned by half, its "
        "speeds open one, or parts that touch at a stop overlap",
        "Use mechc.Assembly(...), which closes the loops of each member",
    ),
    codes.INTERRUPTED: (
        "interrupted",
        "the run was interrupted",
        "What was computed until then is kept",
    ),
}


def status_of(
    code: int,
    t: float,
    coordinate: str = "",
    gap: float = 0.0,
    warnings: tuple[str, ...] = (),
) -> Status:
    """The status for a code of the compiled integrator."""
    name, cause, advice = CODES[code]
    if not cause:
        return _status_at_end(name, t, warnings)
    return Status(name, t, cause.format(coordinate=coordinate, gap=gap), advice, warnings)


@lru_cache(maxsize=64)
def _status_at_end(name: str, t: float, warnings: tuple[str, ...]) -> Status:
    return Status(name, t, warnings=warnings)
