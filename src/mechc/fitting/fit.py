"""Parameters, starts and constant inputs from recorded motions, by least squares."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechc.assembly.initial_values import checked_numbers, closed_freedoms, filled_start
from mechc.errors import (
    MechcError,
    RunInterrupt,
    UnknownNameError,
    ValueOutOfBoundsError,
)
from mechc.fitting.losses import loss_of
from mechc.fitting.measured import Measured, checked_measured, known_columns
from mechc.fitting.problem import Problem
from mechc.fitting.recordings import Recording, column_names, read_recordings
from mechc.fitting.result import FitResult
from mechc.fitting.search import Found, Settings, beginnings, refine
from mechc.fitting.statistics import statistics_of
from mechc.questions.motion import Arguments, MotionFunction, params_by_name
from mechc.questions.unknowns import START, Unknown, kinds_of, named_free, read_unknown
from mechc.simulation.settings import checked_count, checked_positive
from mechc.system.names import by_name, names_of
from mechc.system.parameters import Array, doubles, one_double
from mechc.system.system import System
from mechc.system.units import SECONDS

Report = Callable[[float, str], None]


def fit(
    model: Any, measurements: Any, free: Any, measured: Any, *, params: Any, y0: Any,
    guess: Any, inputs: Any, t0: float | None, shared: Any, confidence: float, settings: Settings,
    policy: dict[str, Any], progress: Report | None,
) -> FitResult:  # fmt: skip
    """See :meth:`mechc.Model.fit`."""
    if not checked_positive("confidence", confidence) < 1:
        raise ValueOutOfBoundsError(f"confidence = {confidence} must lie between 0 and 1")
    settings = _checked_settings(settings)
    problem = _problem(
        model, measurements, free, measured, params, y0, guess, inputs, t0, shared, policy
    )
    report = progress or (lambda _, __: None)
    report(0.0, "choosing starts")
    points = beginnings(problem, settings)
    ends: list[Found] = []
    interrupted = False
    try:
        for number, point in enumerate(points):
            ends.append(refine(problem, point, settings))
            if ends[-1].interrupt is not None:
                raise ends[-1].interrupt
            report((number + 1) / len(points), f"cost {min(e.cost for e in ends):.6g}")
    except KeyboardInterrupt:
        if not ends:
            raise
        interrupted = True
    ends.sort(key=lambda end: end.cost)
    result = _result(problem, ends, settings, confidence)
    if interrupted:
        raise RunInterrupt("interrupted; error.fit has the best values tried", fit=result) from None
    return result


def _checked_settings(settings: Settings) -> Settings:
    most = settings.max_evaluations
    checked = replace(
        settings,
        starts=checked_count("starts", settings.starts),
        refined=checked_count("refined", settings.refined),
        f_scale=checked_positive("f_scale", settings.f_scale),
        tol=checked_positive("tol", settings.tol),
        max_evaluations=None if most is None else checked_count("max_evaluations", most),
    )
    loss_of(checked.loss, checked.f_scale)
    return checked


def _problem(
    model: Any, measurements: Any, free: Any, measured: Any, params: Any, y0: Any,
    guess: Any, inputs: Any, t0: float | None, shared: Any, policy: dict[str, Any],
) -> Problem:  # fmt: skip
    """Checked arguments, before anything is computed."""
    if measured is None:
        measured = known_columns(model.system, column_names(measurements))
    system, wanted = checked_measured(model.system, measured)
    model = type(model).of_system(system)
    recordings = read_recordings(measurements, wanted)
    count = len(recordings)
    values, near = params_by_name(system, params), by_name({} if guess is None else guess, "guess")
    near = checked_numbers(system, near, system.coordinates, "coordinate")
    starts = [_checked_start(system, one) for one in _each(y0, count, "y0")]
    driven = [by_name({} if one is None else one, "inputs")
              for one in _each(inputs, count, "inputs")]  # fmt: skip
    states = {name for name in named_free(free, kinds_of(system, system.inputs))
              if name in (*system.coordinates, *system.speeds)}  # fmt: skip
    given = [
        Arguments(values, start, inputs, near)
        if start is not None or t0 is not None
        else Arguments(values, *_start_of_data(system, wanted, one, near, states, inputs))
        for start, inputs, one in zip(starts, driven, recordings, strict=True)
    ]
    unknowns = _unknowns(system, free, shared, given, wanted, recordings)
    motions = tuple(
        MotionFunction(model, unknowns, each, policy, place) for place, each in enumerate(given)
    )
    begin = [float(one.t[0]) if t0 is None else one_double(t0, "t0", SECONDS) for one in recordings]
    problem = Problem(model, unknowns, wanted, recordings, motions, begin)
    for k, one in enumerate(wanted):
        if not any(recording.valid[:, k].any() for recording in recordings):
            raise ValueOutOfBoundsError(f"{one.name} was measured nowhere: all samples are NaN")
    if problem.count < len(unknowns):
        raise ValueOutOfBoundsError(
            f"{problem.count} samples do not determine {len(unknowns)} free values: give more of "
            "the recording, or free fewer"
        )
    begun = [one.name for one in unknowns if one.kind == START]
    if begun and any(isinstance(each, np.ndarray) for each in starts):
        raise MechcError(
            f"y0 is a whole state and {begun[0]} is free: give y0 as a mapping of coordinates and "
            "speeds, which is assembled"
        )
    for place, (recording, first) in enumerate(zip(recordings, begin, strict=True)):
        if not first <= recording.t[0]:
            raise ValueOutOfBoundsError(
                f"t0 = {first:g} s: the motion begins after the first sample of recording "
                f"{place}, at {recording.t[0]:g} s"
            )
    return problem


def _unknowns(
    system: System, free: Any, shared: Any, given: Sequence[Arguments],
    measured: Sequence[Measured], recordings: Sequence[Recording],
) -> tuple[Unknown, ...]:  # fmt: skip
    """The free numbers; a start is one for each recording by itself, if it is not shared."""
    kinds, found = kinds_of(system, system.inputs), []
    bounds, together = named_free(free, kinds), {*names_of(shared)}
    if not bounds:
        raise ValueOutOfBoundsError("nothing is free: give free={'m_1': (0.1, 5.0)}")
    for name in together - {*bounds}:
        raise UnknownNameError("free start", name, bounds)
    for name, ends in bounds.items():
        alone = kinds[name] != START or name in together or len(recordings) == 1
        for member in (None,) if alone else range(len(recordings)):
            place = member or 0
            known = given[place].values_of(kinds[name])
            seen = None
            if kinds[name] == START:
                seen = _first_sample(name, measured, recordings[place])
            one = read_unknown(system, name, kinds[name], ends, known, default=seen, member=member)
            found.append(one)
    return tuple(found)


def _start_of_data(
    system: System, measured: Sequence[Measured], recording: Recording, near: Mapping[str, float],
    free: Collection[str], inputs: Mapping[str, Any],
) -> tuple[dict[str, Any] | None, Mapping[str, Any], Mapping[str, float]]:  # fmt: skip
    """The start of a recording that is not given, its inputs, and a guess for the assembly.

    It has the first samples of what was measured of coordinates and speeds and is not free, as many
    as the loops leave open, and is filled up from the model's own; measured coordinates that follow
    are a guess.  None, the model's own start, where none of them was measured.
    """
    first = dict(zip((one.name for one in measured), recording.values[0].tolist(), strict=True))
    seen = {n: x for n, x in first.items() if np.isfinite(x) and n not in free}
    q, u = ({n: seen[n] for n in names if n in seen}
            for names in (system.coordinates, system.speeds))  # fmt: skip
    if not q and not u:
        return None, inputs, near
    placed, moved = ({n: 0.0 for n in names if n in free}
                     for names in (system.coordinates, system.speeds))  # fmt: skip
    open_speeds = len(system.speeds) - len(system.constraint_names)
    rest = dict([*placed.items(), *q.items()][: closed_freedoms(system, {**placed, **q})])
    speeds = dict([*moved.items(), *u.items()][:open_speeds])
    rest, speeds, guess = filled_start(system, rest, speeds, near)
    start = {n: x for n, x in {**rest, **speeds}.items() if n not in free}
    return start, inputs, {**guess, **{n: x for n, x in q.items() if n not in rest}, **near}


def _first_sample(name: str, measured: Sequence[Measured], recording: Recording) -> float | None:
    """The first sample of a coordinate or speed; None where it was not measured."""
    for k, one in enumerate(measured):
        samples = recording.values[:, k]
        if one.name == name and np.isfinite(samples).any():
            return float(samples[np.isfinite(samples)][0])
    return None


def _each(given: Any, count: int, what: str) -> Sequence[Any]:
    """One for all recordings, or a list with one each."""
    if not isinstance(given, list) or (what == "y0" and given and np.ndim(given[0]) == 0
                                       and not isinstance(given[0], Mapping)):  # fmt: skip
        return [given] * count
    if len(given) != count:
        raise ValueOutOfBoundsError(f"{what} has {len(given)} entries for {count} recordings")
    return given


def _checked_start(system: System, given: Any) -> Any:
    if given is None:
        return None
    if isinstance(given, Mapping):
        states = (*system.coordinates, *system.speeds)
        return checked_numbers(system, by_name(given, "y0"), states, "coordinate or speed")
    return doubles(given, "y0")


def _result(
    problem: Problem, ends: Sequence[Found], settings: Settings, confidence: float
) -> FitResult:
    best = ends[0]
    noise_known = not np.isnan([one.sigma for one in problem.measured]).any()
    names = tuple(one.label for one in problem.unknowns)
    statistics = statistics_of(
        problem.jacobian(best.x), problem.residuals(best.x),
        loss_of(settings.loss, settings.f_scale),
        absolute=noise_known, sizes=_sizes(problem, best.x), active=best.active, labels=names,
        rounding=problem.motions[0].policy["rtol"],
    )  # fmt: skip
    return FitResult(
        problem, names, best.x, best.cost, best.converged, best.message, statistics, confidence,
        noise_known, best.active, tuple((end.x, end.cost) for end in ends), problem.runs,
    )  # fmt: skip


def _sizes(problem: Problem, x: Array) -> Array:
    """Units of changes (k,): a value itself, 1 rad, the model's length."""
    system = problem.model.system
    scale = system.scale(system.parameter_set.resolve(problem.motions[0].arguments(x).params))
    sizes = np.ones(len(x))
    for k, (one, value) in enumerate(zip(problem.unknowns, x.tolist(), strict=True)):
        if one.kind == START:
            sizes[k] = scale[system.state_index(one.name)]
        elif value:
            sizes[k] = abs(value)
    return sizes
