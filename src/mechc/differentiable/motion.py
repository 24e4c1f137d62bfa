"""A motion as a function of its times, start and parameters, with its derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError
from mechc.questions.motion import Arguments, MotionFunction
from mechc.questions.unknowns import PARAMETER, Unknown, kinds_of
from mechc.questions.unknowns import START as BEGIN
from mechc.sensitivities.columns import START, columns_of, held_by
from mechc.simulation.settings import TOGETHER, without_series
from mechc.system.names import by_name, name_of, names_of
from mechc.system.parameters import Array, doubles, one_double
from mechc.system.units import SECONDS


def jvp(
    model: Any, t: Any, y0: Any, params: Any, along: Mapping[Any, Any], t0: float,
    policy: Mapping[str, Any],
) -> tuple[Array, Array]:  # fmt: skip
    """See :meth:`mechc.Model.jvp`."""
    tangents = by_name(along, "along", "{'l_3': 1.0}")
    times = _checked_times(t, t0)
    sol = _simulate(model, times, y0, params, list(tangents), t0, policy)
    moved = np.zeros_like(sol.y)
    for name, tangent in tangents.items():
        columns = sol.sensitivity[name]
        rate, shape = doubles(tangent, f"the tangent of {name}"), columns.shape[2:]
        if rate.shape != shape:
            raise ValueOutOfBoundsError(f"the tangent of {name} has the shape {shape}")
        moved += columns @ rate if rate.ndim else columns * rate
    return _as_asked(t, sol.y), _as_asked(t, moved)


def vjp(
    model: Any, t: Any, y0: Any, params: Any, by: Sequence[Any], t0: float,
    policy: Mapping[str, Any],
) -> tuple[Array, Callable[[Any], dict[str, Any]]]:  # fmt: skip
    """See :meth:`mechc.Model.vjp`."""
    names, times = names_of(by), _checked_times(t, t0)
    forwards = len(times) > 1
    sol = _simulate(model, times, y0, params, names if forwards else (), t0, policy)
    columns_of(sol.system, names, sol.params, held_by(sol.system, params))  # refuses unknown names
    y = _as_asked(t, sol.y)

    def pull(cotangent: Any) -> dict[str, Any]:
        """Name -> the gradient of sum(cotangent * y): a number; (nq + nu,) by ``"y0"``."""
        weights = doubles(cotangent, "a cotangent")
        if weights.shape != y.shape:
            raise ValueOutOfBoundsError(
                f"a cotangent has the shape of the states, {y.shape}, not {weights.shape}"
            )
        rows = weights.reshape(sol.y.shape)
        if not forwards:
            gradient = sol.gradient(end=rows[0], by=names)  # backwards over the steps
            if gradient.notes:
                raise MechcError(f"the motion has no derivative {'; '.join(gradient.notes)}")
            return dict(gradient)
        found = {name: np.tensordot(rows, sol.sensitivity[name], 2) for name in names}
        return {name: each if each.ndim else float(each) for name, each in found.items()}

    return y, pull


def _checked_times(t: Any, t0: float) -> Array:
    times = np.atleast_1d(doubles(t, "the times", of=SECONDS))
    if times.ndim != 1 or not len(times) or not np.isfinite(times).all():
        raise ValueOutOfBoundsError("the times are a number, or finite numbers in a row, in s")
    start = one_double(t0, "t0", SECONDS)
    if not (np.diff(times) > 0).all() or not times[0] >= start:
        raise ValueOutOfBoundsError(
            f"the times must rise, from the start at t0 = {start:g} s on; t0 can be given"
        )
    return times


def _as_asked(t: Any, rows: Array) -> Array:
    """The end state for a single time."""
    return rows if np.ndim(t) else np.asarray(rows[0])


def policy_of(model: Any, policy: Mapping[str, Any]) -> dict[str, Any]:
    """Settings by which a motion is the same with its derivatives and without."""
    return {**policy, "method": without_series(model.system, policy.get("method", "auto"))}


def _simulate(
    model: Any, times: Array, y0: Any, params: Any, names: Sequence[str], t0: float,
    policy: Mapping[str, Any],
) -> Any:  # fmt: skip
    """The motion at the times, with its derivatives where some are named.

    Raises :class:`MechcError` if it does not reach its end, or a derivative does not exist, with
    the reason.
    """
    sol = model.simulate(
        (t0, float(times[-1])), y0, params, t_eval=times, sensitivities=names,
        **policy_of(model, policy),
    )  # fmt: skip
    if not sol.status.ok:
        raise MechcError(f"the motion does not reach its end: {sol.status}")
    if names and sol.sensitivity.notes:
        raise MechcError(f"the motion has no derivative {'; '.join(sol.sensitivity.notes)}")
    return sol


# -- one vector of all arguments, for the tools that differentiate functions of arrays ------------


@dataclass(frozen=True)
class Motion:
    """States at times as a function of one vector x: the start's numbers, then parameters.

    Attributes
    ----------
    function
        The motion as a function of x.
    whole
        Whether x begins with a whole state.
    t0
        When motions begin, s.
    """

    function: MotionFunction
    whole: bool
    t0: float

    @property
    def model(self) -> Any:
        """The :class:`mechc.Model`, driven by its inputs where it has some."""
        return self.function.model

    @property
    def policy(self) -> Mapping[str, Any]:
        """Keywords of ``simulate``."""
        return self.function.policy

    @property
    def width(self) -> int:
        """The number of elements of a state."""
        return len(self.model.coordinates) + len(self.model.speeds)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the elements of x, in their order; ``"y0"`` stands for a whole state."""
        names = tuple(one.name for one in self.function.unknowns)
        return (START, *names[self.width :]) if self.whole else names

    def states(self, t: Array, x: Array) -> Array:
        """States (..., nt, nq + nu) at times (..., nt) for x (..., k); several are a batch.

        Members of a batch that fail are NaN.
        """
        leading, times, rows = _members(t, x)
        if not leading:
            return np.asarray(self._one(t, x).y)
        if self._calls_python:
            found = np.stack([self._one(*each).y for each in zip(times, rows, strict=True)])
        else:
            found = self._batch(times, rows)
        return found.reshape(*leading, *found.shape[1:])

    def slopes(self, t: Array, x: Array) -> Array:
        """Derivatives (..., nt, nq + nu, k) of the states by x; several are a batch.

        Those of members of a batch that fail, and those that do not exist, are NaN.
        """
        leading, times, rows = _members(t, x)
        if not leading:
            return self._slope(t, x)
        if self._calls_python:
            found = np.stack([self._slope(*each) for each in zip(times, rows, strict=True)])
        else:
            found = self._batch(times, rows, self.names)
        return found.reshape(*leading, *found.shape[1:])

    def pull_back(self, t: Array, x: Array, cotangent: Array) -> Array:
        """Gradients (..., k) by x of the sum of cotangents (..., nt, nq + nu) times states; of one
        motion's end by the adjoint, several are a batch."""
        if x.ndim == 1 and t.ndim == 1:
            given = self.function.arguments(x)
            at = self.model, t, given.start, given.params
            _, pull = vjp(*at, self.names, self.t0, self.policy)
            found = pull(cotangent)
            parts = [np.atleast_1d(found[name]) for name in self.names]
            return np.concatenate(parts or [np.zeros(0)])
        return np.asarray(np.einsum("...ti,...tik->...k", cotangent, self.slopes(t, x)))

    def rates(self, t: Array, x: Array, y: Array) -> Array:
        """Derivatives (..., nt, nq + nu) of the states y by the times."""
        values = self.model.system.parameter_set.resolve(self.function.arguments(x).params)
        values = values if values.ndim == 1 else values[..., None, :]
        return np.asarray(self.model.rhs(np.broadcast_to(t, y.shape[:-1]), y, values))

    def _one(self, t: Array, x: Array, names: Sequence[str] = ()) -> Any:
        given, times = self.function.arguments(x), _checked_times(t, self.t0)
        return _simulate(self.model, times, given.start, given.params, names, self.t0, self.policy)

    def _slope(self, t: Array, x: Array) -> Array:
        sol = self._one(t, x, self.names)
        columns = [sol.sensitivity[name] for name in self.names]
        return np.concatenate([c if c.ndim == 3 else c[..., None] for c in columns], axis=-1)

    @property
    def _calls_python(self) -> bool:
        """Whether there are inputs that are functions of Python, which a batch does not take."""
        driven = self.model.system.driven
        return bool(driven and driven.calls_python)

    def _batch(self, t: Array, x: Array, names: Sequence[str] = ()) -> Array:
        """States (n, nt, nq + nu), or their derivatives by the names, at times (n, nt) of members.

        One batch until the last time of all; a member that fails only after its own last time is
        run again until there.
        """
        for each in np.unique(t, axis=0):
            _checked_times(each, self.t0)
        times = np.unique(t)
        together = str(self.policy.get("method")).endswith(TOGETHER)
        batch = self.function.batch(
            x, (self.t0, float(times[-1])), t_eval=times, sensitivities=names,
            lockstep=together,  # each is the motion of simulate
            **policy_of(self.model, self.policy),
        )  # fmt: skip
        found = np.array(batch["sensitivity" if names else "y_eval"])
        found = found[np.arange(len(t))[:, None], np.searchsorted(times, t)]
        for member in np.flatnonzero(~batch.ok):
            shorter = t[member, -1] < times[-1]
            found[member] = self._alone(t[member], x[member], names) if shorter else np.nan
        return found

    def _alone(self, t: Array, x: Array, names: Sequence[str]) -> Any:
        try:
            return self._slope(t, x) if names else self._one(t, x).y
        except MechcError:
            return np.nan


def _members(t: Array, x: Array) -> tuple[tuple[int, ...], Array, Array]:
    """The leading shape of times (..., nt) and vectors (..., k), and both with one axis for it."""
    leading = np.broadcast_shapes(t.shape[:-1], x.shape[:-1])
    times, rows = (np.broadcast_to(each, (*leading, each.shape[-1])) for each in (t, x))
    return leading, times.reshape(-1, t.shape[-1]), rows.reshape(-1, x.shape[-1])


def function_of(
    model: Any, t0: float, inputs: Mapping[str, Any] | None, policy: Mapping[str, Any],
    convert: Callable[[Any], Any], library: Any, differentiable: Callable[[Motion], Any],
) -> Callable[..., Any]:  # fmt: skip
    """A function ``f(t, y0, params) -> states`` of a library's arrays.

    ``convert``: makes such an array of doubles, ``library`` joins them, ``differentiable`` gives
    the states of a motion as a function of t (nt,) and x (k,).
    """
    driven = model if inputs is None else model.with_inputs(inputs)
    motion_of(driven, None, (), t0, policy)

    @cache
    def states(start: tuple[Any, ...] | None, parameters: tuple[Any, ...]) -> Any:
        return differentiable(motion_of(driven, start, parameters, t0, policy))

    def f(t: Any, y0: Any, params: Mapping[Any, Any] | None = None) -> Any:
        given = params or {}
        start = tuple(y0) if isinstance(y0, Mapping) else None
        first = [convert(y0[name]) for name in start] if start is not None else [*convert(y0)]
        numbers = [*first, *(convert(given[name]) for name in given)]
        x = library.stack(numbers) if numbers else library.zeros(0, dtype=library.float64)
        times = convert(t)
        y = states(start, tuple(given))(library.atleast_1d(times), x)
        return y if times.ndim else y[0]

    return f


def motion_of(
    model: Any, start: Any, parameters: Any, t0: float, policy: Mapping[str, Any]
) -> Motion:
    """The motion as a function of what is named; ``start`` is None for a whole state.

    Raises :class:`UnavailableOutputError` if the model cannot be compiled with sensitivities;
    :class:`UnknownNameError` for a parameter, coordinate or speed that the model does not have.
    """
    model.system.differentiable()
    kinds, states = kinds_of(model.system), (*model.coordinates, *model.speeds)
    begun = states if start is None else tuple(name_of(key) for key in start)
    named = tuple(name_of(key) for key in parameters)
    for names, kind, told in (
        (named, PARAMETER, "parameter"),
        (begun, BEGIN, "coordinate or speed"),
    ):
        known = [name for name in kinds if kinds[name] == kind]
        for name in names:
            if name not in known:
                raise UnknownNameError(told, name, known)
    free = tuple(
        Unknown(name, kind, -np.inf, np.inf, np.nan)
        for names, kind in ((begun, BEGIN), (named, PARAMETER)) for name in names
    )  # fmt: skip
    still: Any = np.zeros(len(states)) if start is None else {}
    function = MotionFunction(model, free, Arguments({}, still, {}, {}), policy)
    return Motion(function, start is None, t0)
