"""A compiled scene as people use it: its outputs, assembly and simulation."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np

from mechc.analysis import constraint_rank as _redundancy
from mechc.analysis import equilibria as _statics
from mechc.analysis import inverse_dynamics as _inverse
from mechc.analysis import jacobians as _jacobians
from mechc.analysis import linearize as _linearize
from mechc.assembly import positions as _assemble
from mechc.errors import MechcError, UnavailableOutputError, UnknownNameError
from mechc.inputs.bind import InputSlot
from mechc.inputs.driven_scene import DrivenScene
from mechc.native._driver import Scene
from mechc.results import model_report as _model_report
from mechc.results import summary as _report
from mechc.simulation import simulate as _simulate
from mechc.system import c_interface as _c_interface
from mechc.system.parameters import (
    Array,
    Parameters,
    ParameterSet,
    Quantity,
    brief,
    doubles,
    is_table,
)

if TYPE_CHECKING:
    from mechc.batch.simulate import Assembly, Batch


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


class Model:
    """A compiled mechanism.

    States are ``y = [q, u]``: coordinates, then speeds, in the order of ``coordinates`` and
    ``speeds``.  The last of the coordinates are what ``states`` names: activations, controllers,
    with rates of their own and no speed.

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

    def __init__(
        self,
        capsule: object,
        *,
        instruction_set: str | None = None,
        build: Mapping[str, Any] | None = None,
        scene: Any = None,
        whole: Callable[[], dict[str, Any]] | None = None,
    ) -> None:
        self._whole = whole  # operations with nothing fixed and all outputs, counted when asked
        self._asked_for = instruction_set
        compiled: Any = Scene(capsule, instruction_set) if scene is None else scene
        self._data: dict[str, Any] = json.loads(compiled.metadata)
        self._use(compiled)
        self._parameters = ParameterSet(self._quantities("parameters"), self._scene)
        self._no_time = np.zeros(1)
        self.build = MappingProxyType(dict(build or {}))
        self.name: str = self._data["name"]
        self.title: str = self._data["title"]
        self.coordinates = tuple(q.name for q in self._quantities("coordinates"))
        self.speeds = tuple(u.name for u in self._quantities("speeds"))
        self.parameters = self._parameters.names
        units = [q.unit for k in ("coordinates", "speeds") for q in self._quantities(k)]
        self._angular = np.array([unit.startswith("rad") for unit in units])
        self._pure = np.array([unit.startswith(("rad", "1")) for unit in units])
        starts = self._data.get("states", [])
        self._first = np.zeros(len(self.coordinates))  # what they are where nothing is said
        self._first[len(self.coordinates) - len(starts) :] = starts
        self.states = self.coordinates[len(self.coordinates) - len(starts) :]
        self._pure[len(self.coordinates) - len(starts) : len(self.coordinates)] = True
        self._all_pure = bool(self._pure.all())
        self._ones = np.ones(len(units))
        self._state_index = {n: i for i, n in enumerate((*self.coordinates, *self.speeds))}

    def _use(self, scene: Any) -> None:
        """Take a compiled scene, with room for inputs where it has any."""
        slots = [InputSlot.from_metadata(data) for data in self._data.get("inputs", ())]
        free = self._data.get("free_of_inputs", ())
        self._driven = DrivenScene(scene, slots, free) if slots else None
        self._scene: Any = scene if self._driven is None else self._driven
        self.inputs = tuple(slot.name for slot in slots)

    # -- what it is -------------------------------------------------------------------------

    def _quantities(self, kind: str) -> tuple[Quantity, ...]:
        return tuple(Quantity.from_metadata(data) for data in self._data[kind])

    @cached_property
    def quantities(self) -> Mapping[str, Quantity]:
        """Every coordinate, speed and parameter by name."""
        kinds = ("coordinates", "speeds", "parameters")
        return MappingProxyType({q.name: q for kind in kinds for q in self._quantities(kind)})

    @property
    def defaults(self) -> Mapping[str, float]:
        """Default value of every parameter that has one, SI units."""
        values = zip(self.parameters, self._parameters.defaults.tolist(), strict=True)
        return {name: value for name, value in values if value == value}

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of every coordinate, speed and parameter."""
        return {name: q.unit for name, q in self.quantities.items()}

    @property
    def descriptions(self) -> Mapping[str, str]:
        """One line on every coordinate, speed and parameter."""
        return {name: q.description for name, q in self.quantities.items()}

    @property
    def bounds(self) -> Mapping[str, tuple[float, float]]:
        """(lower, upper) of every coordinate, speed and parameter."""
        return {name: (q.lower, q.upper) for name, q in self.quantities.items()}

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the points, in the order of :meth:`points`."""
        return tuple(self._data["points"])

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of the bodies, in the order of :meth:`momenta`."""
        return tuple(self._data["bodies"])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of :meth:`reactions`; empty without these."""
        return tuple(self._data["joints"])

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """Names of the constraint rows: configuration constraints first."""
        return tuple(c["name"] for c in self._data["constraints"])

    @property
    def skeleton(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """What is drawn: (label, names of the points of a polyline)."""
        return tuple((label, tuple(points)) for label, points in self._data["links"])

    @property
    def ground(self) -> tuple[str, ...]:
        """Names of the points drawn as pivots on the ground."""
        return tuple(self._data["ground"])

    @property
    def traced(self) -> tuple[str, ...]:
        """Names of the points whose path is drawn."""
        return tuple(self._data["traced"])

    @property
    def view(self) -> tuple[str, str] | None:
        """The axes of pictures, to the right and up, such as ("x", "-y"); None for the widest."""
        right_up = self._data.get("view")
        return (str(right_up[0]), str(right_up[1])) if right_up else None

    @property
    def start(self) -> Mapping[str, float]:
        """Coordinates and speeds that ``mechc run`` starts from, SI units."""
        return dict(self._data["start"])

    @property
    def options(self) -> Mapping[str, Any]:
        """The options this variant of a shipped mechanism was compiled with."""
        return dict(self.build.get("options", {}))

    @property
    def capsule(self) -> object:
        """The compiled model for C: a pointer to the ``mechc_model`` of ``model.h``.

        Its name is that of the interface's version; :func:`mechc.get_include` has the header.
        """
        return self._scene.capsule

    c_function = _c_interface.c_function
    integrand = _c_interface.integrand

    @property
    def backend(self) -> str:
        """``"c"``, or ``"numpy"`` where there is no compiled code."""
        return str(self.build.get("backend", "c"))

    @property
    def instruction_set(self) -> str:
        """The compilation in use, chosen for this processor."""
        return str(self._scene.instruction_set)

    redundant_constraints = _redundancy.redundant_constraints
    report = _model_report.model_report

    def _unknown(self, given: Iterable[int]) -> list[int]:
        """The coordinates that closing the loops may move: neither given nor states."""
        movable = len(self.coordinates) - len(self.states)
        return sorted(set(range(movable)) - set(given))

    # -- inputs -----------------------------------------------------------------------------

    def with_inputs(self, inputs: Mapping[str, Any]) -> Model:
        """This model driven by inputs, for everything that it can be asked.

        Parameters
        ----------
        inputs
            Name -> a number, a :class:`mechc.Signal`, a function ``f(t)`` or ``f(t, q, u)`` of
            floats and arrays (nq,), (nu,), or a tuple of functions of t: value, rate, second rate.
            :attr:`inputs` names those that were left open when compiling.

        Raises
        ------
        UnknownNameError, ValueOutOfBoundsError, MissingInputError
            For inputs that do not exist, that cannot be what they are given for, or that are
            left out.

        Notes
        -----
        A function is called back from compiled code: a microsecond or so each time, some thousand
        times a run; ``sol.status.warnings`` say how often and how long.  How smooth it is is not
        known, so ``method="auto"`` takes the pair of order 8, whose error follows the tolerance
        over kinks too.
        """
        if self._driven is None:
            for name in inputs:
                raise UnknownNameError("input", name, self.inputs)
            return self
        driven = object.__new__(Model)
        driven.__dict__.update(self.__dict__)
        driven._scene = driven._driven = self._driven.with_inputs(inputs)
        return driven

    # -- outputs ----------------------------------------------------------------------------

    def rhs(
        self,
        t: float | Array,
        y: Array,
        params: Parameters = None,
        out: Array | None = None,
        *,
        inputs: Mapping[str, Any] | None = None,
    ) -> Array:
        """State rates y' at the state as it is, shape (..., nq + nu).

        Where closure holds these are the accelerations of the mechanism; off it, those that
        J u' = gamma asks for.  Into ``out`` if that is given, by compiled code without a copy
        where it and y are tables of states (n, nq + nu) and t and the parameters are the same for
        all.  An ``out`` that shares memory with y holds what one apart would.  ``inputs`` as in
        :meth:`with_inputs`.
        """
        if inputs is not None:
            return self.with_inputs(inputs).rhs(t, y, params, out)
        if out is None:
            return self._evaluate("rates", y, params, t)
        if not isinstance(out, np.ndarray):
            raise TypeError(f"out is an array for the rates, not {brief(out)}")
        values = self._parameters.resolve(params)
        into = getattr(self._scene, "evaluate_into", None)
        tables = is_table(y, self._scene.width) and is_table(out, self._scene.width)
        same = values.ndim == 1 and np.ndim(t) == 0
        apart = tables and not np.may_share_memory(y, out)
        if into is not None and apart and same and len(y) == len(out):
            into("rates", doubles([t], "the time"), y, values[None], out)
        else:
            out[...] = self._evaluate("rates", y, values, t)
        return out

    def ode(self, params: Parameters = None) -> Callable[[float, Array], Array]:
        """The plain right-hand side ``f(t, y)`` for SciPy's integrators.

        Unprojected: an integrator that uses it drifts off closure and, near a change point,
        takes a wrong branch at any tolerance.  Fine for smooth scenes; :meth:`simulate` is
        right for all.
        """
        values = self._parameters.resolve(params)
        return lambda t, y: self._evaluate("rates", y, values, t)

    def mass_matrix(self, y: Array, params: Parameters = None, t: float | Array = 0.0) -> Array:
        """M of M u' + J^T lambda = F, the open tree's, shape (..., nu, nu)."""
        return self._evaluate("mass_matrix", y, params, t)

    def forcing(self, y: Array, params: Parameters = None, t: float | Array = 0.0) -> Array:
        """F of M u' + J^T lambda = F, shape (..., nu)."""
        return self._evaluate("forcing", y, params, t)

    def constraints(self, y: Array, params: Parameters = None, t: float | Array = 0.0) -> Array:
        """Configuration constraints, zero where the loops close, shape (..., holonomic rows)."""
        return self._evaluate("constraints", y, params, t)

    def velocity_constraints(
        self, y: Array, params: Parameters = None, t: float | Array = 0.0
    ) -> Array:
        """J u + b, zero where the speeds keep every constraint, shape (..., nc)."""
        return self._evaluate("velocity_constraints", y, params, t)

    def constraint_jacobian(
        self, y: Array, params: Parameters = None, t: float | Array = 0.0
    ) -> Array:
        """J over the speeds, configuration constraints first, shape (..., nc, nu)."""
        return self._evaluate("constraint_jacobian", y, params, t)

    def multipliers(self, y: Array, params: Parameters = None, t: float | Array = 0.0) -> Array:
        """lambda of M u' + J^T lambda = F, shape (..., nc); grows like 1/distance at a crossing."""
        return self._evaluate("multipliers", y, params, t)

    def kinetic_energy(self, y: Array, params: Parameters = None, t: float | Array = 0.0) -> Array:
        """T in J, shape (...)."""
        return self._evaluate("kinetic_energy", y, params, t)

    def potential_energy(
        self, y: Array, params: Parameters = None, t: float | Array = 0.0
    ) -> Array:
        """V in J of the loads that have a potential, shape (...)."""
        return self._evaluate("potential_energy", y, params, t)

    def energy(self, y: Array, params: Parameters = None, t: float | Array = 0.0) -> Array:
        """T + V in J, shape (...)."""
        values = self._parameters.resolve(params)
        return self.kinetic_energy(y, values, t) + self.potential_energy(y, values, t)

    def momenta(self, y: Array, params: Parameters = None, t: float | Array = 0.0) -> Momenta:
        """Linear and angular momenta of every body, each of shape (..., bodies, 3)."""
        values = self._parameters.resolve(params)
        return Momenta(
            self._evaluate("linear_momenta", y, values, t),
            self._evaluate("angular_momenta", y, values, t),
        )

    def reactions(self, y: Array, params: Parameters = None, t: float | Array = 0.0) -> Reactions:
        """What each joint's parent exerts on its child, force and torque of (..., joints, 3) each.

        In the order of :attr:`joint_names`, cut joints among them; compiled where
        ``outputs=("reactions", ...)`` asks for them.  Everything that passes through the joint
        and is no load: springs, friction and motors that are given as loads on the two bodies
        are not in it, so along a free direction nothing is left of it, except what drives that
        direction by a constraint on the joint's own speeds.

        By Newton and Euler from the outermost bodies inwards, with the accelerations and
        multipliers of M u' + J^T lambda = F.  Where constraints are redundant many reactions
        balance the same motion: these are those of the multipliers of least norm.  Near a
        crossing they grow like 1/distance.
        """
        values = self._parameters.resolve(params)
        return Reactions(
            self._evaluate("reaction_forces", y, values, t),
            self._evaluate("reaction_torques", y, values, t),
        )

    def points(self, y: Array, params: Parameters = None, t: float | Array = 0.0) -> Array:
        """Positions of the named points in m, shape (..., points, 3)."""
        return self._evaluate("points", y, params, t)

    def point_velocities(
        self, y: Array, params: Parameters = None, t: float | Array = 0.0
    ) -> Array:
        """Velocities of the named points in m/s, shape (..., points, 3)."""
        return self._evaluate("point_velocities", y, params, t)

    def point_accelerations(
        self, y: Array, params: Parameters = None, t: float | Array = 0.0
    ) -> Array:
        """Accelerations of the named points in m/s^2, shape (..., points, 3)."""
        return self._evaluate("point_accelerations", y, params, t)

    state_jacobian = _jacobians.state_jacobian
    parameter_jacobian = _jacobians.parameter_jacobian
    input_jacobian = _jacobians.input_jacobian
    input_values = property(_jacobians.input_values)

    def _evaluate(self, name: str, y: Array, params: Parameters, t: float | Array) -> Array:
        values = self._parameters.resolve(params)
        states = doubles(y, "a state")
        if states.ndim == 0 or states.shape[-1] != self._scene.width:
            raise ValueError(
                f"a state of {self.name} has {self._scene.width} components (coordinates, then "
                f"speeds) along its last axis; the array given has the shape {states.shape}"
            )
        shape = self._data["shapes"].get(name)
        if states.ndim == 1 and values.ndim == 1 and np.ndim(t) == 0:
            times = doubles([t], "the time")
            one: Array = self._rows(name, times, states[None], values[None], shape)[0]
            return one
        return self._evaluate_many(name, states, values, doubles(t, "the time"), shape)

    def _evaluate_many(
        self, name: str, states: Array, values: Array, t: Array, shape: list[int] | None
    ) -> Array:
        """Broadcast leading axes; what is the same for all states is passed once."""
        leading = np.broadcast_shapes(states.shape[:-1], values.shape[:-1], t.shape)
        rows = np.ascontiguousarray(np.broadcast_to(states, (*leading, states.shape[-1])))
        times = t.reshape(1) if t.ndim == 0 else np.broadcast_to(t, leading).reshape(-1)
        if values.ndim > 1:
            values = np.broadcast_to(values, (*leading, values.shape[-1]))
        out = self._rows(
            name,
            np.ascontiguousarray(times),
            rows.reshape(-1, states.shape[-1]),
            np.ascontiguousarray(values.reshape(math.prod(values.shape[:-1]), values.shape[-1])),
            shape,
        )
        return out.reshape(*leading, *out.shape[1:])

    def _rows(
        self, name: str, t: Array, states: Array, values: Array, shape: list[int] | None
    ) -> Array:
        if name not in self._scene.outputs:
            absent = ("constraints", "velocity_constraints", "constraint_jacobian", "multipliers")
            if name in absent:
                tail = (0, len(self.speeds)) if name == "constraint_jacobian" else (0,)
                return np.zeros((len(states), *tail))
            self._refuse_output(name)
        out: Array = self._scene.evaluate(name, t, states, values)
        return out if shape is None else out.reshape(len(states), *shape)

    def _refuse_output(self, name: str) -> NoReturn:
        why = self._data["unavailable"].get(name)
        if why is None:
            raise UnknownNameError("output", name, self._scene.outputs)
        raise UnavailableOutputError(f"{self.name} has no {name.replace('_', ' ')}: {why}")

    @property
    def knows_energy(self) -> bool:
        """Whether kinetic and potential energy are among the outputs."""
        names: set[str] = set(self._scene.outputs)
        return {"kinetic_energy", "potential_energy"} <= names

    def output(
        self, name: str, y: Array, params: Parameters = None, t: float | Array = 0.0
    ) -> Array:
        """Any output by name, the user's own ones among them."""
        return self._evaluate(name, y, params, t)

    # -- assembly and simulation ------------------------------------------------------------

    def state_index(self, name: str) -> int:
        """Where a coordinate or speed stands in y."""
        if name not in self._state_index:
            raise UnknownNameError("coordinate or speed", name, self._state_index)
        return self._state_index[name]

    assemble = _assemble.assemble
    assemblies = _assemble.assemblies
    equilibria = _statics.equilibria
    inverse_dynamics = _inverse.inverse_dynamics
    limits = _statics.limits
    linearize = _linearize.linearize
    simulate = _simulate.simulate

    def simulate_batch(
        self,
        t_span: float | tuple[float, float],
        y0: Array | Assembly,
        params: Parameters = None,
        **policy: Any,
    ) -> Batch:
        """Simulate many starts or parameter sets, as :mod:`mechc.batch.simulate` says."""
        if self._driven is not None:
            raise MechcError(
                f"a batch takes no inputs that are given with a run, and {self.name} has "
                f"{', '.join(self.inputs)}: compile it with expressions for them, whose parameters "
                "a batch may vary (mechc.compile(..., inputs={...})), or simulate one by one"
            )
        from mechc.batch.simulate import simulate_batch

        return simulate_batch(self, t_span, y0, params, **policy)

    def __reduce__(self) -> tuple[Any, ...]:
        """A shipped model, or a variant of one, is loaded again on the other side."""
        if self.build.get("custom"):
            raise TypeError(
                f"a model compiled from one's own mechanism cannot be pickled: compile "
                f"{self.name!r} again on the other side"
            )
        from mechc.load import reload

        backend = self.build.get("backend", "c")
        return reload, (self.name, self.options, self._asked_for, backend)

    def __repr__(self) -> str:
        return (
            f"<mechc.Model {self.name}: {len(self.coordinates)} coordinates, "
            f"{len(self.speeds)} speeds, {len(self.constraint_names)} constraints, "
            f"{self.instruction_set}>"
        )

    def _repr_html_(self) -> str:
        return _report.model_html(self)
