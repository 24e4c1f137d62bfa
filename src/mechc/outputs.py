"""Outputs of a model at a state: its equations, energies, points, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from mechc.errors import MechcError, ValueOutOfBoundsError, brief
from mechc.system.description import Description
from mechc.system.names import name_of, names_of
from mechc.system.parameters import Array, Parameters, doubles, is_table, one_double
from mechc.system.quantities import output_of
from mechc.system.system import System, Time
from mechc.system.units import SECONDS

if TYPE_CHECKING:
    from mechc.system.c_interface import CFunction


class Momenta(NamedTuple):
    """Linear momenta (kg m/s) and angular momenta about the origin (kg m^2/s).

    Both of shape (..., bodies, 3), in the inertial frame.
    """

    linear: Array
    angular: Array


class Reactions(NamedTuple):
    """Forces (N) and torques (N m) of every joint, by its parent on its child.

    Both of shape (..., joints, 3), in the inertial frame; a torque is about the child's point of
    the joint.
    """

    force: Array
    torque: Array


ONE_SET = "a C function has one set of parameters"
REACTIONS = ("reaction_forces", "reaction_torques")


def _single(p: Array, what: str) -> Array:
    """Parameters (np,), not several sets of them."""
    if p.ndim != 1:
        raise ValueOutOfBoundsError(f"{what}, not an array {p.shape[:-1]} of them")
    return p


class Outputs(Description):
    """Outputs of a system for parameters by name and states of any shape: checked, then evaluated.

    These are of a state alone, which does not tell whether contacts last (``mechc.Stop``,
    ``mechc.DryFriction``): accelerations, multipliers and reactions are those of the motion without
    contacts.  :meth:`mechc.Solution.output` has them along a motion, with its contacts.

    Every output takes states of shape (..., nq + nu), parameters as a mapping of some names to
    values or an array (..., np) of all, and a time; it is vectorised over the leading axes, which
    broadcast against each other, and returns a fresh array.

    Raises (all outputs)
    --------------------
    UnknownNameError
        For a parameter that does not exist; the nearest names are offered.
    ValueOutOfBoundsError
        For a parameter outside its bounds or not finite.
    """

    def __init__(self, system: System) -> None:
        super().__init__(system.data)
        self.system = system

    def _evaluate(self, name: str, y: Array, params: Parameters, t: Time) -> Array:
        system, states, p = self._for_outputs((name,), y, params)
        found = system.evaluate(name, states, p, t)
        if name in REACTIONS:
            self._judge_reactions(system, {name: found}, p, t, stacklevel=7)
        return found

    def _judge_reactions(
        self, system: System, values: Mapping[str, Array], p: Array, t: Time, stacklevel: int
    ) -> None:
        """Warn of reactions that are not determined; a model does."""

    def _for_outputs(
        self, names: Sequence[str], y: Array, params: Parameters
    ) -> tuple[System, Array, Array]:
        """The system that has these outputs; states and all of its parameters, as arrays for it.

        It may have parameters that the equations do not contain.
        """
        system = self.system.with_output(*names)
        return system, self._checked_states(y), system.parameter_set.resolve(params)

    def _checked_states(self, y: Array) -> Array:
        """States (..., nq + nu) as doubles, row after row in memory."""
        states = doubles(y, "a state", copied=False)
        width = len(self.coordinates) + len(self.speeds)
        if states.ndim == 0 or states.shape[-1] != width:
            raise ValueError(
                f"a state of {self.name} has {width} components (coordinates, then speeds) along "
                f"its last axis; the array given has the shape {states.shape}"
            )
        return states

    def _one_set(self, params: Parameters, what: str) -> Array:
        """All parameters (np,), where only one set is allowed."""
        values = self.system.parameter_set.resolve(params)
        return values if values.ndim == 1 else _single(values, what)

    def _for_closing(self, params: Parameters) -> Array:
        """All parameters (..., np); only those that closing the loops needs have to be given."""
        return self.system.parameter_set.resolve_partly(params, self.system.data["closing"])

    def _one_set_for_closing(self, params: Parameters, what: str) -> Array:
        """Parameters (np,) for closing the loops, where only one set is allowed."""
        return _single(self._for_closing(params), what)

    def with_inputs(self, inputs: Mapping[str, Any]) -> Self:
        """This model with its inputs bound, for all outputs and runs.

        Parameters
        ----------
        inputs
            Name or symbol -> a number, also with a unit, ``"2 kN"``, which fits that of the input
            where ``mechc.compile(..., units=)`` gave it one; an expression as text,
            ``"3*sin(4*t)"``, of time,
            coordinates, speeds and parameters, which is compiled; a :class:`mechc.Signal`, samples
            ``(times, values)``, an interpolant of SciPy, a function ``f(t)`` or ``f(t, q, u)`` of
            floats and arrays (nq,), (nu,), one ``f(x, t)`` of the state, or a tuple of functions of
            t: value, rate, second rate.  A tuple of inputs -> a function that gives all values.
            :attr:`inputs` names those that need a value; what contains one without is not computed.

        Raises
        ------
        UnknownNameError, ValueOutOfBoundsError
            For inputs that do not exist or have a wrong value.
        ExpressionError, UnavailableOutputError, CompilerError
            For a text that is not of the grammar, or cannot be compiled here.

        Notes
        -----
        Compiled code calls a function some thousand times a run, at about a microsecond each;
        ``sol.status.warnings`` reports number and time.  Its smoothness is not known, so
        ``method="auto"`` takes the pair of order 8, whose error follows the tolerance across
        kinks too.
        """
        from mechc.inputs.accept import accepted_inputs
        from mechc.inputs.driven_scene import with_inputs

        model, others = self._with_laws(inputs)
        driven = object.__new__(type(self))
        driven.__dict__.update(model.__dict__)
        given = accepted_inputs(others, model.system)
        driven.system = with_inputs(model.system, given)
        return model if driven.system is model.system else driven

    def _with_laws(self, inputs: Any) -> tuple[Self, Any]:
        """The model with the inputs that are expressions compiled into it, and the other inputs."""
        from mechc.inputs.accept import laws_apart

        laws, others = laws_apart(inputs)
        return (type(self)(self.system.with_laws(laws)) if laws else self), others

    def _driven_over(
        self, span: tuple[float, float], inputs: Mapping[str, Any], sensitivities: Sequence[Any]
    ) -> Self:
        """A model with the inputs of one run, which record the values of its controllers."""
        from mechc.inputs.sampled import with_held

        given, sampled = with_held(inputs, span) if isinstance(inputs, Mapping) else (inputs, False)
        if sampled and len(sensitivities):
            raise MechcError(
                "how a controller depends on the state is not known, so a run with mechc.Sampled "
                "has no sensitivities: give its law as an expression, mechc.compile(..., inputs=)"
            )
        return self.with_inputs(given)

    def _breaking_at_samples(self, names: Sequence[str]) -> Self:
        """A model whose steps end at the samples of signals that derivatives are taken by."""
        from mechc.inputs.samples import signals_among

        signals = signals_among(self.system, names)
        return self.with_inputs(signals) if signals else self

    def rhs(
        self,
        t: Time,
        y: Array,
        params: Parameters = None,
        out: Array | None = None,
        *,
        inputs: Mapping[str, Any] | None = None,
    ) -> Array:
        """State rates y' at the state without projection, shape (..., nq + nu).

        On the constraints these are the accelerations of the mechanism; off them, those of
        J u' = gamma.  Without the forces of contacts: ``sol.output("rates")`` has them.  Written
        into ``out`` if it is given, by compiled code without a copy if it and y are tables of
        states (n, nq + nu) and t and the parameters are the same for all.  ``out`` may share
        memory with y.  ``inputs`` as in :meth:`with_inputs`.
        """
        if inputs is not None:
            return self.with_inputs(inputs).rhs(t, y, params, out)
        if out is None:
            return self._evaluate("rates", y, params, t)
        if not isinstance(out, np.ndarray) or isinstance(out, np.ma.MaskedArray):
            raise TypeError(f"out is an array for the rates, not {brief(out)}")
        values = self.system.parameter_set.resolve(params)
        scene = self.system.scene
        tables = is_table(y, scene.width) and is_table(out, scene.width)
        same = values.ndim == 1 and np.ndim(t) == 0
        apart = tables and not np.may_share_memory(y, out)
        if apart and same and len(y) == len(out):
            time = np.array([one_double(t, "the time", SECONDS)])
            scene.evaluate_into("rates", time, y, values[None], out)
        else:
            rates = self.system.rates(self._checked_states(y), values, t)
            try:
                out[...] = rates
            except ValueError as error:  # of another shape, or read-only
                raise ValueOutOfBoundsError(f"out cannot hold the rates: {error}") from None
        return out

    def ode(self, params: Parameters = None) -> Callable[[float, Array], Array]:
        """The plain right-hand side ``f(t, y)`` for SciPy's integrators.

        Without projection: an integrator that uses it drifts from closure and, near a change
        point, takes a wrong branch at any tolerance.  :meth:`simulate` does neither.
        """
        from mechc.system.c_interface import right_hand_side

        values = self.system.parameter_set.resolve(params)
        return right_hand_side(
            self.system, values,
            lambda t, y: self.system.rates(self._checked_states(y), values, t),
        )  # fmt: skip

    def mass_matrix(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """M of M u' + J^T lambda = F, the open tree's, shape (..., nu, nu)."""
        return self._evaluate("mass_matrix", y, params, t)

    def forcing(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """F of M u' + J^T lambda = F, shape (..., nu)."""
        return self._evaluate("forcing", y, params, t)

    def constraints(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """Configuration constraints, zero where the loops close, shape (..., holonomic rows)."""
        return self._evaluate("constraints", y, params, t)

    def velocity_constraints(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """J u + b, zero where the speeds keep every constraint, shape (..., nc)."""
        return self._evaluate("velocity_constraints", y, params, t)

    def constraint_jacobian(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """J over the speeds, configuration constraints first, shape (..., nc, nu)."""
        return self._evaluate("constraint_jacobian", y, params, t)

    def multipliers(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """lambda of M u' + J^T lambda = F, shape (..., nc); grows like 1/distance at a crossing.

        Without the forces of contacts: ``sol.output("multipliers")`` has them.
        """
        return self._evaluate("multipliers", y, params, t)

    def kinetic_energy(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """T in J, shape (...)."""
        return self._evaluate("kinetic_energy", y, params, t)

    def potential_energy(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """V in J of the loads that have a potential, shape (...)."""
        return self._evaluate("potential_energy", y, params, t)

    def energy(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """T + V in J, shape (...)."""
        return self._evaluate("energy", y, params, t)

    def momenta(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Momenta:
        """Linear and angular momenta of every body, each of shape (..., bodies, 3)."""
        names = ("linear_momenta", "angular_momenta")
        system, states, p = self._for_outputs(names, y, params)
        return Momenta(*(system.evaluate(name, states, p, t) for name in names))

    def reactions(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Reactions:
        """Force and torque, (..., joints, 3) each, that each joint's parent exerts on its child.

        In the order of :attr:`joint_names`, cuts included.  Loads are not reactions: springs,
        friction and motors that are given as loads on the two bodies are not included, so the
        reaction along a free direction is zero, except that of a drive by a constraint on the
        joint's speeds.

        By the Newton-Euler equations from the outermost bodies inwards, with the accelerations and
        multipliers of M u' + J^T lambda = F.  Where constraints are redundant many reactions
        balance the same motion: these are those of the multipliers of least norm, and an
        :class:`UndeterminedReactionWarning` names those of their components that are not zero.
        Near a crossing they grow like 1/distance.  A state knows of no contacts:
        ``sol.output("reaction_forces")`` and ``sol.output("reaction_torques")`` do.
        """
        system, states, p = self._for_outputs(REACTIONS, y, params)
        found = {name: system.evaluate(name, states, p, t) for name in REACTIONS}
        self._judge_reactions(system, found, p, t, stacklevel=4)
        return Reactions(*found.values())

    def points(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """Positions of the named points in m, shape (..., points, 3)."""
        return self._evaluate("points", y, params, t)

    def point_velocities(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """Velocities of the named points in m/s, shape (..., points, 3)."""
        return self._evaluate("point_velocities", y, params, t)

    def point_accelerations(self, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """Accelerations of the named points in m/s^2, shape (..., points, 3).

        Without the forces of contacts: ``sol.output("point_accelerations")`` has them.
        """
        return self._evaluate("point_accelerations", y, params, t)

    def state_jacobian(
        self, y: Array, params: Parameters = None, t: Time = 0.0, *, of: str | None = None
    ) -> Array:
        """Derivative of :meth:`rhs` by the state, shape (..., nq + nu, nq + nu).

        Of the rates of :meth:`rhs`, which off the constraints follow J u' = gamma; along the
        constraints it is that of the mechanism.  Exact: M du' + J^T dlambda
        = -d(M u' + J^T lambda - F), solved by compiled code.  ``of``: instead of a user-defined
        output, shape (..., nq + nu).

        Raises
        ------
        UnavailableOutputError
            If it was not compiled and cannot be: the description is not at hand.
        UnknownNameError
            If there is no such user-defined output.
        """
        return self._jacobian("state", y, params, t, of)

    def parameter_jacobian(
        self, y: Array, params: Parameters = None, t: Time = 0.0, *, of: str | None = None
    ) -> Array:
        """Derivative of :meth:`rhs` by the parameters at a fixed state, (..., nq + nu, np).

        Each parameter separately: defaults that follow others stay constant.  ``of``: instead of a
        user-defined output, shape (..., np).  Raises as :meth:`state_jacobian` does.
        """
        return self._jacobian("parameter", y, params, t, of)

    def input_jacobian(
        self, y: Array, params: Parameters = None, t: Time = 0.0, *, of: str | None = None
    ) -> Array:
        """Derivative of :meth:`rhs` by the inputs that are given with a run, (..., nq + nu, n).

        Columns in the order of :attr:`input_values`.
        ``of``: instead of a user-defined output, shape (..., n).
        """
        return self._jacobian("input", y, params, t, of)

    def _jacobian(self, by: str, y: Array, params: Parameters, t: Time, of: str | None) -> Array:
        system, states, p = self._for_outputs((f"{by}_jacobian",), y, params)
        return system.jacobian(by, states, p, t, name_of(of))

    @property
    def input_values(self) -> tuple[str, ...]:
        """Every input with its rates that the equations contain, as ``("F", "r", "r'", "r''")``."""
        return self.system.input_values

    @property
    def knows_energy(self) -> bool:
        """Whether kinetic and potential energy are among the outputs."""
        return self.system.knows_energy

    def output(self, name: str, y: Array, params: Parameters = None, t: Time = 0.0) -> Array:
        """Any output by name, user-defined ones included, or a number of it: ``"points[C,x]"``.

        Of a state alone, without contacts; along a motion: :meth:`mechc.Solution.output`.
        """
        return output_of(
            self.system, name_of(name), lambda whole: self._evaluate(whole, y, params, t)
        )

    # -- for C --------------------------------------------------------------------------------

    def c_function(self, output: str = "rates", params: Parameters = None) -> CFunction:
        """An output as a C function; by default the state rates of :meth:`rhs`.

        Waits until the model is compiled completely.

        Parameters
        ----------
        output
            ``"rates"``, or what :meth:`output` takes.
        params
            One value of each parameter, by name or all in an array; they are copied.

        Raises
        ------
        UnknownNameError, UnavailableOutputError
            If the model has no such output.
        """
        from mechc.system.c_interface import c_function

        name = name_of(output)
        system = self.system.with_output(name)
        return c_function(system, name, _single(system.parameter_set.resolve(params), ONE_SET))

    def integrand(
        self,
        output: str,
        along: str | Sequence[str],
        y: Array,
        params: Parameters = None,
        *,
        t: float = 0.0,
        component: int = 0,
    ) -> Any:
        """A number of an output as a function of coordinates, for ``scipy.integrate.quad``.

        The state is y (nq + nu,) except the components in ``along``; loops are not closed.

        Parameters
        ----------
        along
            A coordinate, a speed or ``"t"``; several for ``nquad`` or the ``args`` of ``quad``.
        component
            Which number of the output, flattened.

        Returns
        -------
        scipy.LowLevelCallable
            Of the signature ``double (int, double *, void *)``.

        Raises
        ------
        UnknownNameError, UnavailableOutputError
            If the model has no such output, coordinate or speed.
        ValueOutOfBoundsError
            If the output has no such component.
        """
        from mechc.system.c_interface import integrand

        name, names = name_of(output), names_of(along)
        system = self.system.with_output(name)
        p = _single(system.parameter_set.resolve(params), ONE_SET)
        state = self._checked_states(doubles(y, "a state"))
        if state.ndim != 1 or not names:
            raise ValueError(f"one state of {self.name} and at least one name are needed")
        return integrand(
            system, name, names, state, p, one_double(t, "the time", SECONDS), component
        )
