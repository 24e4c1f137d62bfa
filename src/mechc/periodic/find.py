"""Cycles from a guess: what is free and what is held, where to begin, then Newton's method."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechc.compilation.event_tapes import typed_expression
from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError
from mechc.periodic.cycle import Cycle
from mechc.periodic.newton import NoCycleError, search
from mechc.periodic.repeats import (
    TURN,
    UNEVEN,
    is_later_the_same,
    refuse_other_advances,
    refuse_other_events,
    refuse_other_periods,
    sizes_in,
    whole_turns,
)
from mechc.periodic.shooting import Shooting, Trial
from mechc.questions.motion import params_by_name
from mechc.simulation.events.expressions import is_expression, read_events
from mechc.simulation.settings import checked_positive
from mechc.system.names import by_name, checked_word, names_of
from mechc.system.parameters import Array
from mechc.system.system import System
from mechc.system.units import SECONDS, in_si, is_number

RETURNS = 0.6, 1.5  # of the period guessed: within it the nearest return is looked for
SAMPLES = 2000


def periodic(
    model: Any, y0: Any, period: Any, params: Any, *, t0: float, hold: Sequence[Any], advance: Any,
    run: dict[str, Any], tol: float, most: int,
) -> Cycle:  # fmt: skip
    """See :meth:`mechc.Model.periodic`."""
    system, given = model.system, params_by_name(model.system, params)
    if system.attitudes.of_length_one:
        raise MechcError(
            f"{model.name} has a quaternion of length one, of which no cycles are searched for: "
            "describe its attitude by angles, or by a mechc.BallJoint or mechc.FreeJoint"
        )
    names = (*system.coordinates, *system.speeds)
    words = (*names, "energy", "period")
    held = [checked_word("coordinate, speed or word", each, words) for each in names_of(hold)]
    law, grown = _law(system, period, given), _advances(system, advance)
    first = law(system.parameter_set.resolve(given)) if law else _seconds(period)
    checked_positive("the period", first)

    def simulate(start: Any) -> Any:
        return model.simulate((t0, t0 + RETURNS[1] * first), start, given, **run)

    sol = simulate(y0)
    if sol.span[1] < t0 + first:
        raise MechcError(
            f"the guess does not last a period of {first:.6g} s: {sol.status.headline}. Begin "
            "nearer to a cycle"
        )
    trial, nothing = Trial(sol.record.ends()[1][0], first), np.zeros(len(names))
    problem = Shooting(
        model, given, t0, run, law, False, False, nothing, frozenset(), None, sizes_in(sol), first
    )
    autonomous = is_later_the_same(problem, trial, UNEVEN * first)
    free = autonomous and law is None and "period" not in held
    kept = frozenset(names.index(name) for name in held if name in names)
    if autonomous and not kept and any(part.t0 > t0 for part in sol.segments):
        trial = trial._replace(y=_middle(sol, first))
        sol = simulate(trial.y)
    gain, found = _gain(sol, trial, grown, free)
    refuse_other_advances(sol, gain)
    energy = float(sol.model.energy(trial.y, given)) if "energy" in held else None
    problem = replace(
        problem, autonomous=autonomous, free=free, gain=gain, held=kept, energy=energy,
        tempo=found,
    )  # fmt: skip
    trial = trial._replace(period=found)
    refuse_other_periods(problem, trial)
    refuse_other_events(problem, trial)
    try:
        return Cycle(search(problem, trial, tol, most), tol)
    except NoCycleError as error:
        raise MechcError(str(error)) from None


def _seconds(period: Any) -> float:
    return checked_positive("period", period, of=SECONDS)


def _law(system: System, period: Any, given: Any) -> Callable[[Array], float] | None:
    """A period that is an expression of parameters; None of a number."""
    if not is_expression(period) or (isinstance(period, str) and is_number(period)):
        return None
    still = np.zeros(system.scene.width)
    p = system.parameter_set.resolve(given)
    value: Any = read_events(period, system, p, typed_expression)[0].function
    by_time, by_state, _ = value.slopes(0.0, still)
    if by_time or by_state.any():
        raise ValueOutOfBoundsError(f"period = {period} is to be an expression of parameters alone")
    return lambda p: float(value.at(0.0, still, p))


def _advances(system: System, advance: Any) -> dict[int, float]:
    """Coordinate -> what it grows by, NaN where that is free."""
    found = {}
    for name, value in by_name(advance or {}, "advance", "{'theta_0': '360deg'}").items():
        if name not in system.coordinates:
            raise UnknownNameError("coordinate", name, system.coordinates)
        number = np.nan if value is None else in_si(value, system.quantities[name])
        found[system.coordinates.index(name)] = float(number)
    return found


def _middle(sol: Any, period: float) -> Array:
    """A state amid the longest smooth part within a period in which the fewest contacts last."""
    parts = [part for part in sol.segments if part.t0 - sol.span[0] < period]
    lasting = [sum(word not in ("", "open") for word in part.contacts) for part in parts]
    free = [part for part, n in zip(parts, lasting, strict=True) if n == min(lasting)]
    longest = max(free, key=lambda part: part.t1 - part.t0)
    return np.array(sol(0.5 * (longest.t0 + longest.t1)))


def _gain(sol: Any, trial: Trial, advances: Mapping[int, float], free: bool) -> tuple[Array, float]:
    """Growth of components, and the period: where it is free, that of the nearest return."""
    low, high = (share * trial.period for share in (RETURNS if free else (1.0, 1.0)))
    start, end = sol.span
    after = np.linspace(low, min(high, end - start), SAMPLES if free else 1)
    grown = sol(np.minimum(start + after, end)) - trial.y
    gains = np.zeros_like(grown)
    turning = whole_turns(sol)
    gains[:, turning] = TURN * np.round(grown[:, turning] / TURN)
    for i, value in advances.items():
        gains[:, i] = value
    best = int(np.argmin(np.nan_to_num(np.abs(grown - gains) / sizes_in(sol)).max(axis=1)))
    return gains[best], float(after[best])
