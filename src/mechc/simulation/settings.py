"""Settings of a run, checked before anything is computed."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.native._arrays import NOT_IN_ORDER, OUTSIDE, times_along
from mechc.native._codes import CHANGE_POINT_POLICIES, LOCKSTEP, METHODS
from mechc.system.names import checked_word
from mechc.system.parameters import Array, doubles
from mechc.system.quantity import NamedQuantity
from mechc.system.system import System
from mechc.system.units import SECONDS, has_unit, in_si

SEQUENCES = (tuple, list, np.ndarray)
SHORTEST = sys.float_info.min  # s, a span but 0
TIGHTEST = sys.float_info.epsilon  # a smaller rtol is refused
LOOSEST = 0.1  # a larger rtol is refused
MOST_STEPS = 10_000_000  # attempted, by default
LARGEST_TRAJECTORY = 2.0**30  # bytes of states and dense output, by default
# Of the code that takes several runs in the lanes, the name of the method that users know.
IN_LOCKSTEP = {code: name for name, code in reversed(LOCKSTEP.items())}
METHODS_OF_USERS = tuple(name for name in METHODS if IN_LOCKSTEP.get(name, name) == name)
# In lanes: sums of a Taylor series that leads, and the least rtol at which the explicit pair does.
MOST_SUMS, LEAST_OF_PAIR, LEAST_OF_PAIR_FIRST_ORDER = 32, 1e-7, 1e-12
LEAST_OF_PAIR_ALONE = 1e-5  # the same of a run by itself, where q' is not u
TOGETHER = " in lockstep"  # after the name of a method whose steps are others there
BEGINNING = "auto from "  # before the name of the method that "auto" is to begin with
SCIPYS = {"RK45": "dopri5", "DOP853": "dop853", "Radau": "radau5"}  # its names of the same methods


class Policy(NamedTuple):
    """Settings of a simulation; see :func:`mechc.simulation.simulate.simulate`."""

    rtol: float
    atol: Array | None
    method: str
    first_step: float
    max_step: float
    max_steps: int
    dense: bool
    on_change_point: str
    stiff_switch: bool
    max_bytes: float = LARGEST_TRAJECTORY
    limits: tuple[Array, Array] | None = None  # times (n + 1,), the longest steps between them (n,)
    checkpoints: float | None = None  # bytes for them, in place of the trajectory
    lockstep: bool = False  # the steps are those of several runs in the lanes

    def as_dict(self) -> dict[str, Any]:
        """The settings that decide the motion, by name; the limits follow from them."""
        told = self._asdict()
        del told["limits"], told["checkpoints"]
        return told

    def arguments(self) -> dict[str, Any]:
        """The arguments of :func:`checked_policy` that give the same policy."""
        told = self.as_dict()
        auto = told.pop("stiff_switch") and not self._is_as_member
        begun = "auto" if self.lockstep else BEGINNING + self.method
        told["method"] = begun if auto else self.method_of_users
        told["first_step"] = self.first_step or None
        return told

    @property
    def when_stiff(self) -> str:
        """The method that takes over where stability limits the steps; empty: none.

        From the explicit pair in lockstep it does so beside critical configurations too.
        """
        if not self.stiff_switch:
            return ""
        return "gauss8" if self.lockstep else "radau5"

    @property
    def takes_lanes(self) -> bool:
        """Whether members run side by side.

        Without lockstep those do whose numbers are the same in the lanes.  A series that "auto"
        begins alone is left to collocation in long runs, which it is not there.
        """
        leaves = self.method == "taylor" and self.stiff_switch and not self.lockstep
        return self.method in IN_LOCKSTEP and not leaves

    @property
    def method_of_users(self) -> str:
        """The name by which a user gets the same steps."""
        name = IN_LOCKSTEP.get(self.method, self.method)
        return name + TOGETHER if name != self.method or self._is_as_member else name

    @property
    def _is_as_member(self) -> bool:
        """Whether its code is the same alone, where it does not go over to another method."""
        same = IN_LOCKSTEP.get(self.method) == self.method
        return self.lockstep and self.stiff_switch and same


def checked_policy(
    system: System, *, rtol: float, method: str, atol: Any = None, first_step: float | None = None,
    max_step: float = math.inf, max_steps: int = MOST_STEPS, dense: bool = True,
    on_change_point: str = "continue", max_bytes: float = LARGEST_TRAJECTORY,
    checkpoints: float | None = None, lockstep: bool | None = None, several: bool = False,
    calls_python: bool = False,
) -> Policy:  # fmt: skip
    """The policy of a run or a batch; the last one of a system is kept.

    ``calls_python``: whether inputs besides those of the system are functions of Python.
    ``lockstep=None``: as the method's name says, and with ``several`` runs where the method has
    it, and the scene.

    Raises
    ------
    UnknownNameError, ValueOutOfBoundsError
        For an unknown method or policy, wrong numbers, methods without lockstep, and names that
        say another than ``lockstep``.
    """
    asked = (rtol, method, first_step, max_step, max_steps, dense, on_change_point, max_bytes,
             checkpoints, lockstep, several, calls_python)  # fmt: skip
    known = system.cache.get("policy")
    if known is not None and atol is None and _are_equal(known[0], asked):
        kept: Policy = known[1]
        return kept
    tolerance = _checked_rtol(rtol)
    begun = isinstance(method, str) and method.startswith(BEGINNING)
    given = method.removeprefix(BEGINNING) if begun else method
    several = several or (given == "auto" and _leads_alone(system, tolerance))
    name, together = _alone_or_together(given, lockstep, several and not begun)
    code, together = _in_lockstep(system, name, together, tolerance, calls_python)
    if name == "auto" and code == "gauss8" and system.prefers_series:
        code = "taylor"
    as_member = together and name == code and name != given  # as a member whose method is "auto"
    policy = Policy(
        tolerance,
        None if atol is None else _checked_atol(system, atol),
        code,
        0.0 if first_step is None else checked_positive("first_step", first_step, of=SECONDS),
        checked_positive("max_step", max_step, infinite=True, of=SECONDS),
        checked_count("max_steps", max_steps),
        dense,
        checked_change_point(on_change_point),
        name == "auto" or as_member or begun,
        checked_positive("max_bytes", max_bytes, infinite=True),
        checkpoints=None if checkpoints is None else checked_positive("checkpoints", checkpoints),
        lockstep=together,
    )
    if atol is None:
        system.cache["policy"] = asked, policy
    return policy


def without_series(system: System, method: Any) -> Any:
    """The method of runs that have derivatives, or whose length is not known: ``"auto"`` begins
    them by collocation where it would take a series for one by itself."""
    series = isinstance(method, str) and method == "auto" and system.prefers_series
    return f"{BEGINNING}gauss8" if series else method


def _are_equal(kept: tuple[Any, ...], asked: tuple[Any, ...]) -> bool:
    try:
        return kept == asked
    except ValueError:  # an array is none of these
        return False


def refuse_beside_checkpoints(events: Sequence[Any], sensitivities: Sequence[Any]) -> None:
    """
    Raises
    ------
    ValueOutOfBoundsError
        Where there are any.
    """
    if len(events) or len(sensitivities):
        raise ValueOutOfBoundsError(
            "a run with checkpoints takes neither events= nor sensitivities=: its gradient, "
            "sol.gradient(...), needs neither"
        )


def holds_derivatives(output: str) -> bool:
    """Whether an output holds derivatives of the motion, which those in contact do not have."""
    return output.endswith(("state_jacobian", "parameter_jacobian", "input_jacobian"))


def refuse_derivatives_in_contact(outputs: Iterable[str]) -> None:
    """
    Raises
    ------
    MechcError
        Where an output holds derivatives of the motion.
    """
    for name in filter(holds_derivatives, outputs):
        raise MechcError(
            f"{name} is that of the motion without contacts: derivatives of a motion in which "
            "contacts last are not known"
        )


def checked_change_point(policy: str) -> str:
    """``"continue"``, ``"stop"`` or ``"raise"``."""
    return checked_word("policy at change points", policy, CHANGE_POINT_POLICIES)


def _alone_or_together(
    method: str, lockstep: bool | None, several: bool
) -> tuple[str, bool | None]:
    """The name of a method by itself, and whether in lockstep; None: where there is such code."""
    if lockstep is not None:
        checked_truth("lockstep", lockstep)
    if not isinstance(method, str) or not method.endswith(TOGETHER):
        return method, lockstep if lockstep is not None or several else False
    name = method.removesuffix(TOGETHER)
    if name == "auto":
        raise ValueOutOfBoundsError(f"method={method!r} is none: take 'auto' and lockstep=True")
    if lockstep is not None and not lockstep:
        raise ValueOutOfBoundsError(
            f"method={method!r} has lockstep=True: omit lockstep=False, or take {name!r} with it"
        )
    return name, True


def _in_lockstep(
    system: System, method: str, lockstep: bool | None, rtol: float, calls_python: bool
) -> tuple[str, bool]:
    """The code of the method, and whether it is that of several runs in the lanes."""
    chosen = _chosen_method(system, method, calls_python)
    auto = method == "auto"
    if lockstep and not auto and chosen not in LOCKSTEP:
        others = ", ".join(repr(name) for name in METHODS_OF_USERS if name in LOCKSTEP)
        raise ValueOutOfBoundsError(f"method={method!r} has no lockstep: take one of {others}")
    fits = system.data.get("lockstep") and not system.data.get("switches")
    if lockstep is False or not fits or chosen not in LOCKSTEP or (auto and chosen != "gauss8"):
        return chosen, False
    return LOCKSTEP[_fastest_in_lanes(system, rtol) if auto else chosen], True


def _fastest_in_lanes(system: System, rtol: float) -> str:
    """The method whose runs take the least time at the same error (``mechc bench default``).

    Series of few sums lead at all tolerances.  Explicit steps of order 8 grow so much shorter with
    the tolerance that collocation of order 16 takes less work from some tolerance on: one that is
    tighter where the speeds are no derivatives of the coordinates, since its iteration contracts
    more slowly there.
    """
    series = system.data.get("taylor")
    if series and series["sums"] <= MOST_SUMS:
        return "taylor"
    least = LEAST_OF_PAIR if system.data["identity_kinematics"] else LEAST_OF_PAIR_FIRST_ORDER
    return "dop853" if rtol >= least else "gauss8"


def _leads_alone(system: System, rtol: float) -> bool:
    """Whether the explicit pair leads in a run by itself too, with the steps of a member.

    Where the speeds are no derivatives of the coordinates the iteration of collocation contracts
    slowly, and its steps are no longer for tolerances looser than it has use for.
    """
    if system.data["identity_kinematics"] or system.prefers_series or rtol < LEAST_OF_PAIR_ALONE:
        return False
    return _fastest_in_lanes(system, rtol) == "dop853"


def _chosen_method(system: System, method: str, calls_python: bool) -> str:
    if isinstance(method, str) and method == "auto":
        smooth = system.data.get("smooth", True) or system.data.get("switches", 0) > 0
        called = calls_python or (system.driven and system.driven.calls_python)
        return "gauss8" if smooth and not called else "dop853"
    method = SCIPYS.get(method, method) if isinstance(method, str) else method
    if not isinstance(method, str) or method not in METHODS_OF_USERS:
        raise UnknownNameError("method", method, ("auto", *METHODS_OF_USERS, *SCIPYS))
    if method == "taylor" and not system.data.get("taylor"):
        raise ValueOutOfBoundsError(
            "method='taylor' needs a small scene without constraints, tables and inputs, whose "
            "equations have +, -, *, /, powers, sqrt, sin, cos, tan, exp and log alone: take "
            "method='auto'"
        )
    return method


def checked_span_and_times(
    t_span: Any, t_eval: Array | None
) -> tuple[tuple[float, float], Array | None]:
    """(t0, t1) and the times to report at; a span of more than two times is those too."""
    if type(t_span) is float and t_eval is None and SHORTEST <= abs(t_span) < math.inf:
        return (0.0, t_span), None  # nearly always, and fast
    if t_eval is None and isinstance(t_span, SEQUENCES) and _has_several(t_span):
        t_span, t_eval = (t_span[0], t_span[-1]), t_span
    span = checked_span(t_span)
    return span, None if t_eval is None else checked_times(t_eval, span)


def _has_several(t_span: Any) -> bool:
    return getattr(t_span, "ndim", 1) == 1 and len(t_span) > 2


def checked_span(t_span: float | tuple[float, float]) -> tuple[float, float]:
    """(t0, t1), finite, in s; a number alone is t1."""
    t_span = in_si(t_span, replace(SECONDS, name="t_span"))
    try:
        first, last = t_span if isinstance(t_span, SEQUENCES) else (0.0, t_span)
        t0, t1 = float(first), float(last)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(
            f"t_span must be (t0, t1) or t1, in seconds, not {brief(t_span)}"
        ) from None
    if not (math.isfinite(t0) and math.isfinite(t1)):
        raise ValueOutOfBoundsError(f"t_span = ({t0}, {t1}) must be finite")
    return _with_length(t0, t1)


def _with_length(t0: float, t1: float) -> tuple[float, float]:
    """A span whose fractions are numbers: steps of one that is shorter have no length."""
    if 0.0 < abs(t1 - t0) < SHORTEST:
        raise ValueOutOfBoundsError(
            f"t_span = ({t0}, {t1}) must be 0 or at least {SHORTEST:g} s long"
        )
    return t0, t1


def checked_times(t_eval: Array, span: tuple[float, float]) -> Array:
    """Times within the span, in its direction; ends that are off by rounding become the ends."""
    given = doubles(t_eval, "t_eval", of=SECONDS, copied=False)  # times_along copies
    slack = 8 * math.ulp(max(abs(span[0]), abs(span[1])))
    found, times = times_along(given, *span, slack) if given.ndim == 1 else (OUTSIDE, given)
    if found == OUTSIDE:
        low, high = sorted(span)
        raise ValueOutOfBoundsError(
            f"t_eval must be a sequence of times within the span {low:g} ... {high:g} s"
        )
    if found == NOT_IN_ORDER:
        raise ValueOutOfBoundsError("t_eval must go strictly in the direction of t_span")
    checked: Array = times
    return checked


def _checked_atol(system: System, atol: float | Array) -> Array:
    names, width = (*system.coordinates, *system.speeds), system.scene.width
    every = [atol] * width if has_unit(atol) else atol
    if isinstance(every, (list, tuple)) and len(every) == width:
        own = (replace(system.quantities[name], name=f"atol of {name}") for name in names)
        every = [in_si(each, quantity) for each, quantity in zip(every, own, strict=True)]
    given = doubles(every, "atol")
    if given.shape not in ((), (1,), (width,)):
        raise ValueOutOfBoundsError(
            f"atol is one number, or one for each of the {width} components of a state "
            f"({', '.join(names)}), not of shape {given.shape}"
        )
    values = np.broadcast_to(given, (width,))
    if not (np.isfinite(values) & (values > 0)).all():
        raise ValueOutOfBoundsError("atol must be positive and finite in every component")
    return np.ascontiguousarray(values)


def checked_positive(
    name: str, value: Any, *, infinite: bool = False, of: NamedQuantity | None = None
) -> float:
    """A positive number, finite or not; ``of``: what it is, where it has a unit."""
    if type(value) is float and 0.0 < value < math.inf:
        return value  # nearly always, and fast
    value = value if of is None else in_si(value, replace(of, name=name))
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueOutOfBoundsError(f"{name} must be a number, not {brief(value)}") from None
    if not number > 0 or (not infinite and not math.isfinite(number)):
        raise ValueOutOfBoundsError(f"{name} = {value} must be positive and finite")
    return number


def checked_truth(name: str, value: Any) -> bool:
    """True or False; raises ``TypeError`` for anything else."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} is True or False, not {brief(value)}")
    return bool(value)


def _checked_rtol(rtol: float) -> float:
    value = checked_positive("rtol", rtol)
    if value < TIGHTEST:
        raise ValueOutOfBoundsError(
            f"rtol = {rtol:g} is less than the spacing of doubles, {TIGHTEST:.2g}: no state holds "
            "so many digits; the tightest that changes a motion is about 1e-15"
        )
    if value > LOOSEST:
        raise ValueOutOfBoundsError(f"rtol = {rtol:g} is too large; {LOOSEST:g} at most")
    return value


def checked_count(name: str, value: float) -> int:
    """A whole number above 0; infinity is the largest, and fractions are left out."""
    if type(value) is int and 0 < value < 2**62:
        return value
    found = int(min(checked_positive(name, value, infinite=True), 2.0**62))
    if not found:
        raise ValueOutOfBoundsError(f"{name} = {value} must be at least 1")
    return found
