"""A compiled scene: its data, its parameters, its functions of checked arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NoReturn, TypeAlias

import numpy as np

from mechc.errors import UnavailableOutputError, UnknownNameError
from mechc.native._steps import Sizes
from mechc.system.attitudes import Attitudes
from mechc.system.description import Description
from mechc.system.kinds import ANGULAR, DIMENSIONLESS
from mechc.system.parameters import Array, ParameterSet, doubles
from mechc.system.picture import Picture
from mechc.system.reference import ModelReference

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
        operations_of_all: Callable[[], dict[str, Any]] | None = None,
    ) -> None:
        super().__init__(data)
        self._set_scene(scene)
        self.reference = reference
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

    @cached_property
    def knows_energy(self) -> bool:
        """Whether kinetic and potential energy are among the outputs."""
        return {"kinetic_energy", "potential_energy"} <= set(self.scene.outputs)

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
        known = {n: x for n, x in self.reference.defaults.items() if n in self.parameters}
        return ParameterSet(quantities, self.scene, known)

    def with_defaults(self, defaults: Mapping[str, float]) -> System:
        """A copy of the system with other defaults."""
        other = self.replaced_scene(self.scene)
        other.reference = replace(self.reference, defaults=dict(defaults))
        other.parameter_set = other._parameter_set()
        return other

    def with_start(self, start: Mapping[str, float]) -> System:
        """A copy of the system with these coordinates and speeds as its start."""
        other = self.replaced_scene(self.scene)
        other.data = {**self.data, "start": dict(start)}
        return other

    def wait(self, *, batches: bool = True) -> None:
        """Return when what runs, or also batches, need is in the cache for other processes."""
        self.scene.wait(batches)

    @property
    def picture(self) -> Picture:
        """The drawing, by the compiled points, or by the description where these do not suffice."""
        if Picture not in self.cache:
            self.cache[Picture] = self._picture()
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

    def _picture(self) -> Picture:
        own = Picture(
            self.point_names, self.skeleton, self.ground, self.traced, self.view, self.points
        )
        if self.drawn is None or (own.is_complete and not self.draws_more):
            return own
        found = self.drawn(self)
        return found if found.skeleton else own

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
        known = self.gap_unit == "m" and self.parameter_set.has_lengths
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

    # -- outputs ----------------------------------------------------------------------------

    def rates(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """y' at the state without projection, (..., nq + nu)."""
        return self.evaluate("rates", y, p, t)

    def mass_matrix(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """M of M u' + J^T lambda = F, (..., nu, nu)."""
        return self.evaluate("mass_matrix", y, p, t)

    def forcing(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """F of M u' + J^T lambda = F, (..., nu)."""
        return self.evaluate("forcing", y, p, t)

    def constraints(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """Configuration constraints, (..., holonomic rows)."""
        return self.evaluate("constraints", y, p, t)

    def velocity_constraints(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """J u + b, (..., nc)."""
        return self.evaluate("velocity_constraints", y, p, t)

    def constraint_jacobian(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """J over the speeds, (..., nc, nu)."""
        return self.evaluate("constraint_jacobian", y, p, t)

    def kinetic_energy(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """T in J, (...)."""
        return self.evaluate("kinetic_energy", y, p, t)

    def potential_energy(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """V in J of the loads that have a potential, (...)."""
        return self.evaluate("potential_energy", y, p, t)

    def energy(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """T + V in J, (...)."""
        return self.kinetic_energy(y, p, t) + self.potential_energy(y, p, t)

    def points(self, y: Array, p: Array, t: Time = 0.0) -> Array:
        """Positions of the named points in m, (..., points, 3)."""
        return self.evaluate("points", y, p, t)

    def evaluate(self, name: str, y: Array, p: Array, t: Time = 0.0) -> Array:
        """Evaluate any output by name, into a new array.

        Raises
        ------
        UnknownNameError, UnavailableOutputError
            If there is no such output, or it was not requested when compiling.
        """
        if name in self.array_outputs:
            return self._array_output(name, y, p, t)
        if y.ndim == 1 and p.ndim == 1 and np.ndim(t) == 0:
            times = doubles([t], "the time")
            one: Array = self._rows(name, times, y[None], p[None])[0]
            return one
        return self._evaluate_many(name, y, p, doubles(t, "the time"))

    def _array_output(self, name: str, y: Array, p: Array, t: Time) -> Array:
        """The elements of a user-defined output that has several, (..., *shape)."""
        parts = [self.evaluate(element, y, p, t) for element in self.array_elements(name)]
        leading = parts[0].shape
        return np.stack(parts, axis=-1).reshape(*leading, *self.array_outputs[name])

    def _evaluate_many(self, name: str, y: Array, p: Array, t: Array) -> Array:
        """Broadcast leading axes; values that are equal for all states are passed once."""
        leading = np.broadcast_shapes(y.shape[:-1], p.shape[:-1], t.shape)
        rows = np.ascontiguousarray(np.broadcast_to(y, (*leading, y.shape[-1])))
        times = t.reshape(1) if t.ndim == 0 else np.broadcast_to(t, leading).reshape(-1)
        if p.ndim > 1:
            p = np.broadcast_to(p, (*leading, p.shape[-1]))
        out = self._rows(
            name,
            np.ascontiguousarray(times),
            rows.reshape(-1, y.shape[-1]),
            np.ascontiguousarray(p.reshape(math.prod(p.shape[:-1]), p.shape[-1])),
        )
        return out.reshape(*leading, *out.shape[1:])

    def _rows(self, name: str, t: Array, y: Array, p: Array) -> Array:
        if name not in self.scene.outputs:
            if name in ABSENT:
                tail = (0, len(self.speeds)) if name == "constraint_jacobian" else (0,)
                return np.zeros((len(y), *tail))
            self.refuse_output(name)
        out: Array = self.scene.evaluate(name, t, y, p)
        shape = self._shapes.get(name)
        return out if shape is None else out.reshape(len(y), *shape)

    def refuse_output(self, name: str) -> NoReturn:
        """Raise the error for an output that does not exist."""
        why = self.data["unavailable"].get(name)
        if why is None:
            raise UnknownNameError("output", name, self.scene.outputs)
        raise UnavailableOutputError(f"{self.name} has no {name.replace('_', ' ')}: {why}")
