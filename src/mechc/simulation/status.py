"""How a simulation ended, as a value with prose that ends in advice."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ChangePoint:
    """A passage of a configuration where the configuration curve crosses itself.

    Attributes
    ----------
    t
        Time in s.
    q
        The coordinates there, in state order.
    gap
        By how much the loop misses closing exactly in that critical configuration, m: within
        rounding of the lengths.
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
        One of ``CODES``: ``"finished"``, ``"stopped by an event"``, or what went wrong.
    t
        Time reached, s.
    cause, advice
        Why it ended there, and what to do; empty for ``"finished"``.
    warnings
        What a careful reader should know although the end was reached.
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
        # Every run makes one, and the constructor of a frozen dataclass takes twice as long.
        vars(self).update(code=code, t=t, cause=cause, advice=advice, warnings=warnings)

    @property
    def ok(self) -> bool:
        """Whether the end time, or a terminal event, was reached."""
        return self.code in ("finished", "stopped by an event")

    @property
    def headline(self) -> str:
        """The outcome without its cause, advice and warnings."""
        how = "reached" if self.ok else "got to"
        return f"{self.code}: {how} t = {self.t:g} s"

    def __str__(self) -> str:
        if self.ok:
            head = self.headline
        else:
            head = f"{self.code} at t = {self.t:.9g} s: {self.cause}. {self.advice}"
        return ". ".join([head.rstrip(". "), *self.warnings]) + ("." if self.warnings else "")


CODES = {
    1: ("finished", "", ""),
    2: (
        "not closed",
        "the loops could not be closed any further: the step led to a configuration that the "
        "lengths do not allow",
        "Check the state with model.constraints(y); start from model.assemble(...)",
    ),
    3: (
        "step too small",
        "the step needed fell below the spacing of doubles: the solution is singular here, or "
        "the tolerance is beyond what doubles give",
        "Loosen rtol, or look at sol.stats['least_singular']: near zero the constraints are "
        "nearly dependent",
    ),
    4: (
        "not finite",
        "the equations gave infinity or NaN",
        "Look at the last state and the parameters: a load may have left its domain",
    ),
    5: (
        "singular mass matrix",
        "the mass matrix is not positive definite in the direction of {coordinate}",
        "Give every body that moves with it a positive mass or inertia",
    ),
    6: (
        "too many steps",
        "max_steps attempted steps were used up",
        "Raise max_steps, loosen rtol, or continue from sol.y[-1]",
    ),
    7: ("no memory", "the trajectory did not fit into memory", "Pass dense=False and t_eval"),
    8: (
        "undecided",
        "the links come so nearly in line that doubles cannot tell on which side they pass: the "
        "loop misses the change point by {gap:.1e} m",
        "Which way the motion goes on depends on digits below rounding. Change a length by more "
        "than that, or make it exact",
    ),
    9: (
        "at a change point",
        "the start is a change point, where the configuration has more than one way on, and the "
        "speeds do not choose one",
        "Take speeds along one branch, as model.assemblies(..., speeds=...) gives them, or start a "
        "little beside it",
    ),
    10: (
        "stopped at a change point",
        "a change point comes next, and on_change_point='stop' was asked for",
        "sol.change_points holds its time and configuration; continue past it with "
        "on_change_point='continue'",
    ),
    11: (
        "undecided",
        "the constraints become nearly dependent here: a change point, or a near miss of one, is "
        "close by, and backend='numpy' does not pass these",
        "Install a C compiler and compile without backend; sol.stats['least_singular'] says how "
        "near it came",
    ),
    109: ("stopped by an event", "", ""),
    110: (
        "event failed",
        "an event function raised an error or gave NaN",
        "Mend the function: it is called at states between the steps too, not only at events",
    ),
    113: (
        "input failed",
        "a function that gives an input raised an error or gave no finite number",
        "Mend the function: it is called at states between the steps too",
    ),
    0: (
        "not run",
        "the batch was stopped before its turn",
        "Call again; with out=..., what is done is not repeated",
    ),
    112: (
        "not assembled",
        "the loops cannot close with this start and these lengths",
        "The variable 'miss' of the batch says by how many metres",
    ),
    111: (
        "open at the start",
        "the start is not finite, leaves a loop open, or has speeds that open one",
        "Take mechc.Assembly(...), which closes the loops member by member",
    ),
    108: ("interrupted", "the run was interrupted", "What was computed until then is kept"),
}


UNDECIDED = 8
# The same where the loop closes in line to rounding.
NO_STEP_FITS = (
    "a change point comes next, to the rounding of the lengths, and no step could be placed across "
    "it: rounding near it is more than a step may err by",
    "Loosen rtol, or take method='dop853'; the motion until there is good",
)


def status_of(
    code: int,
    t: float,
    coordinate: str = "",
    gap: float = 0.0,
    warnings: tuple[str, ...] = (),
    *,
    rounding: float = 0.0,
) -> Status:
    """The status for a code of the compiled integrator; a gap up to the rounding given is none."""
    name, cause, advice = CODES[code]
    if code == UNDECIDED and gap <= rounding:
        cause, advice = NO_STEP_FITS
    if not cause:
        return Status(name, t, warnings=warnings)
    return Status(name, t, cause.format(coordinate=coordinate, gap=gap), advice, warnings)
