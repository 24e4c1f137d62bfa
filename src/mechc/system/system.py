"""A compiled scene: its data, its parameters, its functions of checked arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NoReturn, TypeAlias

import numpy as np

from mechc.errors import (
    CacheError,
    CompilerError,
    MechcError,
    UnavailableOutputError,
    UnknownNameError,
    ValueOutOfBoundsError,
)
from mechc.native._driver import PARTS
from mechc.native._steps import Sizes
from mechc.progress import Notice
from mechc.system.attitudes import Attitudes
from mechc.system.description import Description
from mechc.system.names import name_of
from mechc.system.parameters import Array, ParameterSet, doubles, one_double
from mechc.system.picture import Picture
from mechc.system.quantity import ANGULAR, DIMENSIONLESS, ENERGIES, SUMS, Kind, NamedQuantity
from mechc.system.reference import ModelReference, Origin
from mechc.system.units import SECONDS, in_si

Time: TypeAlias = "float | Array"
ABSENT = ("constraints", "velocity_constraints", "constraint_jacobian", "multipliers")


class System(Description):
    """A mechanism whose equations are compiled.

    Everything here takes arrays that were checked before: states y (..., nq + nu) of doubles, row
    after row in memory, all parameters p (..., np) and times t; leading axes broadcast against
    each other.  Arguments of users are resolved and checked by :class:`mechc.Model`.

    Attributes
    ----------
    scene
        The compiled functions: a :class:`mechc.native._driver.Scene`, or one with its methods.
    driven
        The scene if it has inputs that are given with a run, else None.
    parameter_set
        Defaults, bounds and order of the parameters.
    reference
        How another process finds the same scene.
    kept
        What functions of a system keep for their next call, by a key of their own.
    build
        Facts of its build: options, seconds of each stage, key in the cache.
    operations_of_all
        Counts the operations with nothing fixed and all default outputs, where that is known.
    origin
        What it was compiled from, where that is known.
    given_defaults
        The default values given, some with units, also of parameters of further outputs alone.
    law_numbers
        Parameters that are the numbers of inputs given as texts.
    drawn
        Makes the picture of this system from its description, where that is known.
    angular, dimensionless : (nq + nu,)
        Which components of a state are angles (or their rates), and which contain no length.
    """

    def __init__(
        self,
        data: Mapping[str, Any],
        scene: Any,
        reference: ModelReference,
        build: Mapping[str, Any] | None = None,
        operations_of_all: Callable[[], dict[str, Any] | None] | None = None,
    ) -> None:
        super().__init__(data)
        self._set_scene(scene)
        self.reference = reference
        self._wider: dict[frozenset[str], System] = {}  # shared by copies
        self.build = MappingProxyType(dict(build or {}))
        self.operations_of_all = operations_of_all
        self.parameter_set = self._parameter_set()
        kinds = [self.quantities[name].kind for name in (*self.coordinates, *self.speeds)]
        self.angular = np.array([kind in ANGULAR for kind in kinds])
        self.angles = tuple(np.flatnonzero(self.angular[: len(self.coordinates)]).tolist())
        self.dimensionless = np.array([kind in DIMENSIONLESS for kind in kinds])
        first = len(self.coordinates) - len(self.states)
        self.dimensionless[first : len(self.coordinates)] = True
        self.default_coordinates = np.zeros(len(self.coordinates))
        self.default_coordinates[first:] = data.get("states", ())
        self.attitudes = Attitudes.of(data, self.coordinates)
        self._no_lengths = np.ones(len(kinds)) if self.dimensionless.all() else None
        self._shapes: Mapping[str, list[int]] = data["shapes"]

    def default_configurations(self, count: int, given: Iterable[str]) -> Array:
        """Coordinates (count, nq) where none but those named are given."""
        q = np.tile(self.default_coordinates, (count, 1))
        return self.attitudes.fill_quaternions(q, [self.state_index(name) for name in given])

    @property
    def instruction_set(self) -> str:
        """The instruction set in use, chosen for this processor."""
        return str(self.scene.instruction_set)

    @property
    def defaults(self) -> Mapping[str, float]:
        """Default value of every parameter that has one, SI units."""
        values = zip(self.parameters, self.parameter_set.defaults.tolist(), strict=True)
        return {name: value for name, value in values if value == value}

    def quantity_of(self, name: str) -> NamedQuantity:
        """A coordinate, speed, parameter or input; of any other name nothing is known."""
        if name in self.quantities:
            return self.quantities[name]
        inputs: dict[str, Any] = {slot["name"]: slot for slot in self.data.get("inputs", ())}
        slot, told = inputs.get(name, {}), f"the input {name}" if name in inputs else name
        free = (-math.inf, math.inf, False)
        kind = Kind(slot.get("kind", Kind.OTHER))
        return NamedQuantity(told, slot.get("unit", ""), "", *free, kind)

    @cached_property
    def knows_energy(self) -> bool:
        """Whether kinetic and potential energy are among the outputs."""
        return {*ENERGIES} <= {*self.scene.outputs}

    @property
    def headline(self) -> str:
        """The name and the sizes of the mechanism, in one line."""
        return (
            f"{self.name}: {len(self.coordinates)} coordinates, {len(self.speeds)} speeds, "
            f"{len(self.constraint_names)} constraints, {self.instruction_set}"
        )

    def __repr__(self) -> str:
        return f"<mechc.System {self.headline}>"

    def replaced_scene(self, scene: Any) -> System:
        """A copy of the system with other compiled functions."""
        other = object.__new__(System)
        other.__dict__.update(self.__dict__)
        other._set_scene(scene)
        return other

    cache: dict[Any, Any]
    origin: Origin | None = None
    given_defaults: Mapping[str, Any] = MappingProxyType({})
    law_numbers: frozenset[str] = frozenset()
    drawn: Callable[..., Picture] | None = None
    draws_more = False  # than the compiled points

    def drawn_by(self, drawn: Callable[..., Picture], *, more: bool = False) -> System:
        """A copy of the system with a picture made at first use; ``more``: always by ``drawn``."""
        other = self.replaced_scene(self.scene)
        other.drawn, other.draws_more = drawn, more
        return other

    def _set_scene(self, scene: Any) -> None:
        self.scene = scene
        self.driven = scene if self.inputs else None
        self.cache = {}

    def _parameter_set(self) -> ParameterSet:
        quantities = [self.quantities[name] for name in self.parameters]
        return ParameterSet(quantities, self.scene, self.reference.defaults, self.law_numbers)

    def with_defaults(self, defaults: Mapping[str, Any]) -> System:
        """A copy of the system with other defaults, some with units; those of parameters that it
        does not have are kept for further outputs.

        Raises :class:`ValueOutOfBoundsError` for a value that is not in a unit of its parameter.
        """
        other = self.replaced_scene(self.scene)
        own = {
            name: one_double(in_si(value, self.quantities[name]), f"the default of {name}")
            for name, value in defaults.items()
            if name in self.parameters
        }
        other.reference, other.given_defaults = replace(self.reference, defaults=own), defaults
        other.parameter_set = other._parameter_set()
        return other

    def with_law_numbers(self, numbers: Mapping[str, float]) -> System:
        """A copy of the system with these values of the numbers of its inputs' texts."""
        other = self.replaced_scene(self.scene)
        other.law_numbers = self.law_numbers | {*numbers}
        return other.with_defaults({**self.given_defaults, **numbers})

    def with_start(self, start: Mapping[str, float]) -> System:
        """A copy of the system with these coordinates and speeds as its start."""
        other = self.replaced_scene(self.scene)
        other.data = {**self.data, "start": dict(start)}
        return other

    @property
    def prefers_series(self) -> bool:
        """Whether ``method="auto"`` takes Taylor series for a run by itself."""
        series = self.data.get("taylor") or {}
        return bool(series.get("leads_alone")) and not self.data.get("switches")

    def wait(self, *, batches: bool = True, derivatives: bool = False) -> None:
        """Return when what runs, or also batches, need is in the cache for other processes.

        ``derivatives``: and what derivatives of runs need, where it has any.
        """
        together = PARTS["derivatives"] if derivatives and self.has_derivatives else 0
        if self.data.get("lockstep") and not self.data.get("switches"):
            together |= PARTS["sweeps"] | (PARTS["taylor_lanes"] if self.data.get("taylor") else 0)
        self.scene.wait(batches, self.prefers_series, together)

    @property
    def picture(self) -> Picture:
        """The drawing, by the compiled points, or by the description where these do not suffice."""
        if Picture not in self.cache:
            drawn = self.skeleton, self.ground, self.traced, self.view
            names = self.point_names if "points" in self.scene.outputs else ()
            own = Picture(names, *drawn, self.points)
            if self.drawn is not None and (self.draws_more or not own.is_complete):
                described = self.drawn(self)
                own = described if described.skeleton else own
            self.cache[Picture] = own
        found: Picture = self.cache[Picture]
        return found

    @property
    def picture_in_space(self) -> Picture:
        """The drawing with solids, springs and dampers where these are known; else ``picture``."""
        if "space" not in self.cache:
            found = None if self.drawn is None else self.drawn(self, in_space=True)
            seen = found is not None and bool(found.skeleton or found.solids)
            self.cache["space"] = found if seen else self.picture
        kept: Picture = self.cache["space"]
        return kept

    # -- sizes ------------------------------------------------------------------------------

    @cached_property
    def sizes(self) -> Sizes:
        """The rules for the sizes of the components of a state, for runs."""
        lowest, highest = self.parameter_set.limits
        lengths = self.parameter_set.length_places.astype(np.intc)
        return Sizes(self.dimensionless.astype(np.uint8), lengths, lowest, highest)

    @property
    def closure_units(self) -> tuple[str, ...]:
        """Units of the configuration constraints (nh,), "" where unknown."""
        rows = self.data["constraints"][: self.scene.holonomic]
        return tuple(str(row["unit"]) for row in rows)

    @cached_property
    def rate_units(self) -> tuple[str, ...]:
        """Units of the rows of J u + b (nc,), "per second" of rows whose unit is unknown."""
        moving = [str(row["unit"]) for row in self.data["constraints"][self.scene.holonomic :]]
        rates = [f"{unit}/s" if unit else "" for unit in self.closure_units]
        return tuple(unit or "per second" for unit in (*rates, *moving))

    @cached_property
    def sized_by_lengths(self) -> bool:
        """Whether parameters tell the size of all configuration rows, or there are none."""
        known = self.gap_unit == "m" and len(self.parameter_set.length_places) > 0
        return known or not self.scene.holonomic

    def length(self, p: Array) -> float:
        """The scale of lengths, m: the largest parameter that is a length, 1 if there is none."""
        return self.parameter_set.length(p)

    def scale(self, p: Array) -> Array:
        """Size of each component (nq + nu,): 1 for angles and numbers, else the length."""
        if self._no_lengths is not None:
            return self._no_lengths
        return np.where(self.dimensionless, 1.0, self.length(p))

    def unknowns(self, given: Sequence[int]) -> list[int]:
        """The coordinates that closing the loops may move: neither given nor states."""
        movable = len(self.coordinates) - len(self.states)
        return sorted(set(range(movable)) - set(given))

    # -- outputs that were not requested at first ------------------------------------------------

    def including(self, *outputs: str) -> System:
        """This system, or the same with further outputs, which is compiled at the first request.

        This one does not change, nor does any digit of what it computes: other outputs share other
        subexpressions, so the two may differ in rounding.

        Parameters
        ----------
        outputs
            Names as ``mechc.compile(..., outputs=)`` takes them.

        Raises
        ------
        UnavailableOutputError
            If the description is not at hand, or does not determine them; the message says which.
        CompilerError
            If there is no C compiler.
        """
        missing = frozenset(outputs).intersection(self.data["left_out"].values())
        if not missing:
            return self
        if (System, missing) not in self.cache:
            self.cache[System, missing] = self._like(self._compiled_with(missing))
        found: System = self.cache[System, missing]
        return found

    def with_laws(self, laws: Mapping[str, str]) -> System:
        """This system with inputs by expressions, as texts by name; compiled at the first request.

        Raises
        ------
        UnknownNameError
            For an input that there is not.
        UnavailableOutputError
            If the description is not at hand.
        ExpressionError, CompilerError
            If a text is not of the grammar of expressions, or there is no C compiler.
        """
        for name in laws:
            if name not in self.inputs:
                raise UnknownNameError("input", name, self.inputs)
        key = System, tuple(sorted(laws.items()))
        if key not in self.cache:
            told = ", ".join(f"{name} = {law}" for name, law in laws.items())
            if self.origin is None or self.origin.with_laws is None:
                raise UnavailableOutputError(
                    f"{told} cannot be compiled here: this process has the compiled model "
                    f"{self.name}, but not its description"
                )
            with Notice(f"compiling {self.name} with {told} ..."):
                self.cache[key] = self._like(self.origin.with_laws(laws))
        found: System = self.cache[key]
        return found

    def with_output(self, *names: str) -> System:
        """This system, or the same with these outputs; see :meth:`including`."""
        return self.including(*self._requests_of(names))

    def differentiable(self, *names: str) -> System:
        """This system, or the same with derivatives of motions, and of these outputs along them;
        see :meth:`including`."""
        more = self._requests_of(names)
        found = self.including("sensitivities", *more)
        found.scene.evaluator.at_once(PARTS["derivatives"])  # an error comes before the motion
        return found

    @property
    def has_derivatives(self) -> bool:
        """Whether it was compiled with derivatives of motions."""
        return "sensitivities" not in self.data["left_out"].values()

    def _requests_of(self, names: Iterable[str]) -> list[str]:
        """Names by which a request has these outputs, where it has not."""
        parts = [part for name in names for part in SUMS.get(name, (name,))]
        left_out = self.data["left_out"]
        return [left_out[part] for part in parts if part in left_out]

    def _compiled_with(self, missing: frozenset[str]) -> System:
        """The mechanism compiled with further outputs, as all copies of this system need it."""
        if missing not in self._wider:
            what = " and ".join(sorted(each.replace("_", " ") for each in missing))
            if self.origin is None:
                raise UnavailableOutputError(
                    f"{self.name} has no {what} yet, and they cannot be compiled here: this "
                    "process has the compiled model, but not its description. Compile the "
                    "description in this process (mechc.open(path, model) takes the model)"
                )
            told = f"compiled {what} of {self.name}"
            with Notice(f"compiling {what} of {self.name} ...", told):
                try:
                    found = self.origin.with_outputs(missing)
                except (CompilerError, CacheError):
                    raise
                except MechcError as error:
                    raise UnavailableOutputError(f"{self.name} has no {what}: {error}") from error
            self._wider[missing] = found
        return self._wider[missing]

    def _like(self, found: System) -> System:
        """Another system of the same mechanism, with the defaults, start, picture and inputs of
        this one."""
        every = {} if self.driven is None else self.driven.given
        given = {name: value for name, value in every.items() if name in found.inputs}
        scene = found.scene.with_inputs(given) if given else found.scene
        other = found.replaced_scene(scene).with_start(self.start)
        other.law_numbers = self.law_numbers | found.law_numbers
        other = other.with_defaults({**found.given_defaults, **self.given_defaults})
        other.title, other.drawn, other.draws_more = self.title, self.drawn, self.draws_more
        return other

    def values_of(self, other: System, p: Array) -> Array:
        """All parameters (..., np) from those of another system of the same mechanism."""
        if self.parameters == other.parameters:
            return p
        return self.parameter_set.resolve(
            dict(zip(other.parameters, np.moveaxis(p, -1, 0), strict=True))
        )

    @cached_property
    def derivative_rows(self) -> dict[str, tuple[list[int], tuple[int, ...]]]:
        """Output -> its rows in the Jacobians of the outputs, and its shape."""
        own, shapes = list(self.data["own"]), self.data["shapes"]
        found: dict[str, tuple[list[int], tuple[int, ...]]]
        found, first = {name: ([k], ()) for k, name in enumerate(own)}, len(own)
        for name, size in self.data.get("differentiated", ()):
            found[name] = list(range(first, first + size)), tuple(shapes.get(name, ()))
            first += size
        for name, shape in self.array_outputs.items():
            found[name] = [own.index(each) for each in self.array_elements(name)], tuple(shape)
        return found

    def jacobian(self, by: str, y: Array, p: Array, t: Time = 0.0, of: str | None = None) -> Array:
        """Derivatives ``by`` ``"state"``, ``"parameter"`` or ``"input"``: (..., nq + nu, n).

        ``of``: of a user-defined output instead of the right-hand side, (..., n).

        Raises :class:`UnavailableOutputError` as :meth:`including`; :class:`UnknownNameError` if
        there is no such user-defined output.
        """
        name, own = f"{by}_jacobian", self.data["own"]
        if of is None:
            return self.evaluate(name, y, p, t)
        if of not in own:
            raise UnknownNameError("user-defined output", of, own)
        whole = self.evaluate(f"own_{name}", y, p, t)
        return np.ascontiguousarray(whole[..., own.index(of), :])

    @property
    def input_values(self) -> tuple[str, ...]:
        """Every input with its rates that the equations contain, as ``("F", "r", "r'", "r''")``."""
        slots = self.data.get("inputs", ())
        return tuple(slot["name"] + "'" * order for slot in slots for order in slot["orders"])

    # -- outputs ----------------------------------------------------------------------------

    def rates(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """y' at the state without projection, (..., nq + nu)."""
        return self.evaluate("rates", y, p, t)

    def mass_matrix(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """M of M u' + J^T lambda = F, (..., nu, nu)."""
        return self.evaluate("mass_matrix", y, p, t)

    def constraints(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """Configuration constraints, (..., holonomic rows)."""
        return self.evaluate("constraints", y, p, t)

    def velocity_constraints(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """J u + b, (..., nc)."""
        return self.evaluate("velocity_constraints", y, p, t)

    def constraint_jacobian(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """J over the speeds, (..., nc, nu)."""
        return self.evaluate("constraint_jacobian", y, p, t)

    def constraint_gradient(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """Derivative of the configuration constraints by the coordinates, (..., rows, nq)."""
        if "constraint_gradient" in self.scene.outputs:
            return self.evaluate("constraint_gradient", y, p, t)
        rows = self.constraint_jacobian(y, p, t)[..., : self.scene.holonomic, :]
        return rows if self.scene.holonomic else np.zeros((*rows.shape[:-1], len(self.coordinates)))

    def kinetic_energy(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """T in J, (...)."""
        return self.evaluate("kinetic_energy", y, p, t)

    def potential_energy(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """V in J of the loads that have a potential, (...)."""
        return self.evaluate("potential_energy", y, p, t)

    def energy(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """T + V in J, (...)."""
        return self.evaluate("energy", y, p, t)

    def points(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """Positions of the named points in m, (..., points, 3)."""
        return self.evaluate("points", y, p, t)

    def evaluate(
        self, name: str, y: Array, p: Array, t: Time = 0.0, forces: Array | None = None
    ) -> Array:
        """Evaluate any output by name, into a new array.

        ``forces`` (..., nu): generalized forces besides those of the description, of contacts,
        with which accelerations and multipliers are solved.

        One that was not requested is compiled now.

        Raises :class:`UnknownNameError`, :class:`UnavailableOutputError` if there is no such
        output, or the description does not determine it or is not at hand.
        """
        if name in SUMS:
            first, *rest = (self.evaluate(part, y, p, t, forces) for part in SUMS[name])
            return sum(rest, first)
        if name_of(name) in self.array_outputs:
            elements = self.array_elements(name)
            parts = [self.evaluate(element, y, p, t, forces) for element in elements]
            shape = (*parts[0].shape, *self.array_outputs[name])
            return np.stack(parts, axis=-1).reshape(shape)
        if y.ndim == 1 and p.ndim == 1 and np.ndim(t) == 0:
            times = np.array([one_double(t, "the time", SECONDS)])
            row = None if forces is None else forces.reshape(1, -1)
            one: Array = self._rows(name, times, y[None], p[None], row)[0]
            return one
        return self._evaluate_many(
            name, y, p, doubles(t, "the time", of=SECONDS, copied=False), forces
        )

    def _evaluate_many(
        self, name: str, y: Array, p: Array, t: Array, forces: Array | None
    ) -> Array:
        """Broadcast leading axes; values that are equal for all states are passed once."""
        shapes = y.shape[:-1], p.shape[:-1], t.shape
        try:
            leading = np.broadcast_shapes(*shapes)
        except ValueError:
            raise ValueOutOfBoundsError(
                "the leading shapes of states, parameters and times do not fit: "
                f"{', '.join(map(str, shapes))}"
            ) from None
        times = t.reshape(1) if t.ndim == 0 else np.broadcast_to(t, leading).reshape(-1)
        if p.ndim > 1:
            p = np.broadcast_to(p, (*leading, p.shape[-1]))
        out = self._rows(
            name,
            np.ascontiguousarray(times),
            _rows_of(y, leading),
            np.ascontiguousarray(p.reshape(math.prod(p.shape[:-1]), p.shape[-1])),
            None if forces is None else _rows_of(forces, leading),
        )
        return out.reshape(*leading, *out.shape[1:])

    def _rows(self, name: str, t: Array, y: Array, p: Array, forces: Array | None = None) -> Array:
        if name not in self.scene.outputs:
            if name in ABSENT:
                tail = (0, len(self.speeds)) if name == "constraint_jacobian" else (0,)
                return np.zeros((len(y), *tail))
            wider = self.with_output(name)
            if wider is self:
                self.refuse_output(name)
            return wider._rows(name, t, y, wider.values_of(self, p), forces)
        out: Array = self.scene.evaluate(name, t, y, p, forces=forces)
        shape = self._shapes.get(name)
        return out if shape is None else out.reshape(len(y), *shape)

    def refuse_output(self, name: str) -> NoReturn:
        """Raise the error for an output that does not exist."""
        why = self.data["unavailable"].get(name)
        if why is None:
            raise UnknownNameError("output", name, self.scene.outputs)
        raise UnavailableOutputError(f"{self.name} has no {name.replace('_', ' ')}: {why}")


def _rows_of(values: Array, leading: tuple[int, ...]) -> Array:
    """Values (..., n) for each of the leading axes, as rows."""
    every = np.broadcast_to(values, (*leading, values.shape[-1]))
    return np.ascontiguousarray(every).reshape(-1, values.shape[-1])
