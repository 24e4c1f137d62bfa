"""A path, the motion on it, and the inputs that make it: see ``model.inverse_dynamics``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechc.analysis.inverse_dynamics import inverse_dynamics
from mechc.assembly.verb import ONE_SET
from mechc.errors import ValueOutOfBoundsError
from mechc.inputs.driven_scene import with_inputs
from mechc.prescribed.follow import Follower
from mechc.prescribed.path import read_path
from mechc.prescribed.result import PrescribedMotion
from mechc.system.names import by_name
from mechc.system.parameters import Array, doubles
from mechc.system.quantities import outputs_in
from mechc.system.units import SECONDS

OF_POINTS = ("points", "point_velocities", "point_accelerations")


def along_path(
    model: Any, given: Mapping[Any, Any], params: Any, names: Sequence[str], t: Any,
    guess: Mapping[Any, float],
) -> PrescribedMotion:  # fmt: skip
    """The motion on a path, and the inputs of these names that make it."""
    times = _checked_times(t)
    wider = OF_POINTS if "points" in outputs_in(by_name(given, "path")) else ()
    wide = model.system.with_output(*wider)
    still = {name: 0.0 for name in names if name in wide.parameters}
    if params is None or isinstance(params, Mapping):
        params = {**still, **by_name(params or {}, "params")}
    p = type(model).of_system(wide)._one_set(params, ONE_SET)
    system = with_inputs(wide, {name: 0.0 for name in names if name in wide.inputs})
    path = read_path(system, given, p)
    follower = Follower(system, path, p)
    start = dict(zip((one.name for one in path.quantities), path.at(times[0])[0], strict=True))
    turned = {model.coordinates[i] for places in system.attitudes.quaternions for i in places}
    kept = {n: float(start[n]) for n in model.coordinates if n in start and n not in turned}
    near = {n: x for n, x in model.start.items() if n in model.coordinates and n not in kept}
    near |= by_name(guess, "guess")
    begin = model.assemble(kept, guess=near or None, params=params, t=times[0])
    first = follower.first(begin[: len(model.coordinates)], times[0])
    q = follower.positions(first, times)
    every = [follower.motion(*each) for each in zip(q, times, strict=True)]
    y, rates = (np.stack(each) for each in zip(*every, strict=True))
    found = inverse_dynamics(wide, y, rates, p, tuple(names), times)
    return PrescribedMotion(wide, path.quantities, p, times, y, rates, names, *found)


def _checked_times(t: Any) -> Array:
    times = np.atleast_1d(doubles(t, "the times", of=SECONDS))
    if times.ndim != 1 or not len(times) or not np.isfinite(times).all():
        raise ValueOutOfBoundsError("the times of a path are finite numbers in a row, in s")
    if not (np.diff(times) > 0.0).all():
        raise ValueOutOfBoundsError("the times of a path rise from each to the next")
    return times
