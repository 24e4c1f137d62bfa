"""A model under CasADi: rates, constraints, outputs and motions as its functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from mechc.assembly.closed import Retraction
from mechc.differentiable.casadi_function import library, numeric_function
from mechc.differentiable.motion import policy_of
from mechc.errors import MechcError, ValueOutOfBoundsError
from mechc.inputs.samples import places_of_values
from mechc.sensitivities.events import difference
from mechc.system.names import name_of
from mechc.system.parameters import Array, doubles, one_double
from mechc.system.quantities import outputs_in, quantities_of, slopes_of, values_of
from mechc.system.system import System
from mechc.system.units import SECONDS

SECOND = 1.0  # s; the size of times where differences by time are taken


def casadi(
    model: Any, near: Any = None, *, t0: float = 0.0, rtol: float = 1e-9, method: str = "auto"
) -> CasadiModel:
    """Functions of CasADi for a model, with their derivatives, for transcriptions of your own.

    Parameters
    ----------
    model
        A :class:`mechc.Model`; derivatives of its motions are compiled if they are not.
    near : (nq + nu,)
        A state on the loops, needed by ``motion`` of a model that has some: the states that motions
        begin with are moved onto the loops along the normals there, which is smooth, and changes no
        state that is closed.
    t0
        When motions begin, s.
    rtol, method
        As in :meth:`mechc.Model.simulate`.

    Returns
    -------
    CasadiModel
        ``rates(t, y, r, p)``, ``constraints(t, y, r, p)``, ``velocity_constraints(t, y, r, p)``,
        ``output(name)(t, y, r, p)`` and ``motion(h, y, r, p)``, the state after h seconds.  y
        (nq + nu,), r the inputs (``model.inputs``), constant numbers, and p all parameters
        (``model.parameters``).  Derivatives are exact, those by t differences, good for some ten
        digits; there are no second ones.

    Raises
    ------
    MissingPackageError
        Without CasADi.
    UnavailableOutputError
        If the model has no derivatives of motions.
    ValueOutOfBoundsError
        For a state ``near`` of another shape.
    """
    library()
    system = model.system.differentiable()
    if near is not None:
        near = doubles(near, "near")
        if near.shape != (system.scene.width,):
            raise ValueOutOfBoundsError(f"near is a state of {system.scene.width} numbers")
    policy = {"rtol": rtol, "method": method}
    return CasadiModel(type(model).of_system(system), near, one_double(t0, "t0", SECONDS), policy)


class CasadiModel:
    """Functions of CasADi for a model; see :func:`mechc.casadi`."""

    def __init__(self, model: Any, near: Array | None, t0: float, policy: dict[str, Any]) -> None:
        self.model, self._near, self._t0, self._policy = model, near, t0, policy
        self._retraction: Retraction | None = None  # constraints may need the inputs

    @cached_property
    def rates(self) -> Any:
        """``rates(t, y, r, p)``: y' (nq + nu,)."""

        def slopes(system: System, *at: Any) -> list[Array]:
            by_state, by_parameters = (system.jacobian(by, *at) for by in ("state", "parameter"))
            nothing = np.zeros((len(by_state), 0))
            by_inputs = system.jacobian("input", *at) if system.input_values else nothing
            return [by_state, by_inputs, by_parameters]

        return self._function("rates", lambda system, *at: system.rates(*at), slopes)

    @cached_property
    def constraints(self) -> Any:
        """``constraints(t, y, r, p)``: the configuration constraints, zero on closed loops."""

        def slopes(system: System, *at: Any) -> list[Array]:
            gradient = system.constraint_gradient(*at)[: system.scene.holonomic]
            by_state = np.hstack([gradient, np.zeros((len(gradient), len(system.speeds)))])
            return [by_state, *self._by_others(system, "constraints", len(gradient), at)]

        return self._function("constraints", lambda system, *at: system.constraints(*at), slopes)

    @cached_property
    def velocity_constraints(self) -> Any:
        """``velocity_constraints(t, y, r, p)``: J u + b, zero for speeds that keep the loops
        closed."""

        def slopes(system: System, *at: Any) -> list[Array]:
            rows = system.constraint_jacobian(*at)
            by_state = np.hstack([system.evaluate("velocity_gradient", *at), rows])
            return [by_state, *self._by_others(system, "velocity_constraints", len(rows), at)]

        return self._function(
            "velocity_constraints", lambda system, *at: system.velocity_constraints(*at), slopes
        )

    def output(self, name: Any) -> Any:
        """``output("points[2,0]")(t, y, r, p)``: a quantity, or all numbers of an output.

        Raises :class:`UnknownNameError` for one that there is not, or that has no derivatives.
        """
        wider = self.model.system.differentiable(*outputs_in([name]))
        numbers = quantities_of(wider, name, differentiable=True)[1]

        def slopes(system: System, *at: Any) -> list[Array]:
            by = ("state", "input", "parameter")
            return [slopes_of(numbers, each, system, *at) for each in by]

        return self._function(
            str(name_of(name)), lambda system, *at: values_of(numbers, system, *at), slopes, wider
        )

    @cached_property
    def motion(self) -> Any:
        """``motion(h, y, r, p)``: the state (nq + nu,) h seconds after y, with constant inputs.

        A motion that does not reach its end is NaN.
        """
        system = self.model.system
        if system.scene.rows and self._near is None:
            raise MechcError(
                "the states of a search are off the loops: give a closed state near them, "
                "mechc.casadi(model, near=y)"
            )
        nx, ni, np_ = system.scene.width, len(system.inputs), len(system.parameters)
        return numeric_function("motion", [1, nx, ni, np_], [nx], self._end, self._slopes_of_end)

    # -- how they are evaluated -------------------------------------------------------------------

    def _with_numbers(self, r: Array, model: Any = None) -> Any:
        model = model or self.model
        numbers = dict(zip(self.model.inputs, r.tolist(), strict=True))
        return model.with_inputs(numbers) if numbers else model

    def _function(
        self, name: str, value: Callable[..., Array], slopes: Callable[..., list[Array]],
        system: System | None = None,
    ) -> Any:  # fmt: skip
        """A function of t, y, r, p; ``slopes`` gives derivatives by state, all input values,
        parameters."""
        model = type(self.model).of_system(system) if system else self.model
        own = model.system
        each = [(k, place) for k, name in enumerate(own.inputs)
                for place, order in places_of_values(own, name) if order == 0]  # fmt: skip
        given, places = [k for k, _ in each], [place for _, place in each]

        def at(t: Array, y: Array, r: Array, p: Array) -> tuple[Any, ...]:
            return self._with_numbers(r, model).system, y, p, float(t[0])

        def evaluate(*x: Array) -> list[Array]:
            return [value(*at(*x))]

        def jacobian(t: Array, y: Array, r: Array, p: Array) -> list[list[Array]]:
            driven, *rest = at(t, y, r, p)
            by_state, by_values, by_parameters = slopes(driven, *rest)
            by_inputs = np.zeros((len(by_state), len(r)))
            by_inputs[:, given] = by_values[:, places]
            by_time = difference(lambda e: value(driven, y, p, float(t[0]) + e), SECOND)
            return [[by_time[:, None], by_state, by_inputs, by_parameters]]

        sizes = [1, own.scene.width, len(own.inputs), len(own.parameters)]
        still = np.zeros(1), np.array(own.scale(self._some(own))), np.zeros(sizes[2])
        count = len(evaluate(*still, self._some(own))[0])
        return numeric_function(name, sizes, [count], evaluate, jacobian)

    @staticmethod
    def _some(system: System) -> Array:
        """Parameters (np,) at which sizes are asked: the defaults, or 1."""
        return np.array([system.defaults.get(name, 1.0) for name in system.parameters])

    @staticmethod
    def _by_others(system: System, rows: str, count: int, at: Any) -> list[Array]:
        """Derivatives of constraints by inputs and parameters."""
        widths = {"inputs": len(system.input_values), "parameters": len(system.parameters)}
        return [
            system.evaluate(f"{rows}_by_{name}", *at)
            if f"{rows}_by_{name}" in system.scene.outputs
            else np.zeros((count, width))
            for name, width in widths.items()
        ]

    def _run(self, h: Array, y: Array, r: Array, p: Array) -> tuple[Any, Any]:
        model, span = self._with_numbers(r), (self._t0, self._t0 + float(h[0]))
        if self._retraction is None:
            near = y if self._near is None else self._near
            some = self._some(model.system)
            self._retraction = Retraction.at(model.system, near, some, self._t0)
        closed = self._retraction.close(model.system, y, p, self._t0)
        return model.simulate(span, closed.y, p, **policy_of(model, self._policy)), closed

    def _end(self, *x: Array) -> list[Array]:
        try:
            sol, _ = self._run(*x)
        except (MechcError, ValueError):  # CasADi's solvers take NaN for a step too far
            return [np.full(len(x[1]), np.nan)]
        end = sol.record.ends()[1][1]
        return [end if sol.status.ok else np.full_like(end, np.nan)]

    def _slopes_of_end(self, *x: Array) -> list[list[Array]]:
        sol, closed = self._run(*x)
        system = sol.system
        found = sol.differentiate(["y0", *system.inputs, *system.parameters], closed.y, sol.params)
        (t0, t1), (y0, y1) = sol.record.ends()
        start, end = found.at(np.array([t0, t1]), np.array([y0, y1]))
        nx, last = len(y1), len(y1) + len(system.inputs)
        by_state = end[:, :nx] @ closed.by_state
        values = [system.input_values.index(name) for name in system.inputs]
        closing = np.hstack([closed.by_inputs[:, values], closed.by_parameters])
        by_others = end[:, nx:] + end[:, :nx] @ (closing - start[:, nx:])
        rates = system.rates(y1, sol.params, t1)
        return [[rates[:, None], by_state, by_others[:, : last - nx], by_others[:, last - nx :]]]
