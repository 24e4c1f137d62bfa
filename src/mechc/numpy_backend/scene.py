"""A scene without C, for machines without a compiler: ``backend="numpy"``.

It does what :class:`mechc.native._driver.Scene` does for compiled code: outputs, projection,
integration.  It does not pass change points: see :mod:`mechc.numpy_backend.integrator`.
"""

from __future__ import annotations

import json
from typing import Any, NoReturn

import numpy as np

from mechc.errors import MechcError
from mechc.numpy_backend.equations import ArrayEquations, accelerations
from mechc.numpy_backend.jacobian import jacobian
from mechc.numpy_backend.projection import Manifold
from mechc.system.kinds import Kind
from mechc.system.parameters import Array

BLOCK = 1024  # states at a time: what is computed on the way stays in the processor's cache


class NumpyScene:
    """A scene, by a listing of :mod:`mechc_codegen.emit.numpy`.

    Its methods have the arguments and results of those of :class:`mechc.native._driver.Scene`.
    """

    instruction_set = "numpy"
    lanes = 1
    methods = ("dop853",)

    def __init__(self, listing: Any) -> None:
        self.equations = ArrayEquations(listing)
        self.metadata: str = listing.metadata
        self.coordinates, self.speeds = listing.coordinates, listing.speeds
        self.rows, self.holonomic = listing.rows, listing.holonomic
        self.parameters, self.width = listing.parameters, listing.coordinates + listing.speeds
        size = {
            "rates": self.width, "mass_matrix": self.speeds**2, "forcing": self.speeds,
            "constraint_jacobian": self.rows * self.speeds, "multipliers": self.rows,
            "state_jacobian": self.width**2, "parameter_jacobian": self.width * self.parameters,
            "own_state_jacobian": len(listing.names) * self.width,
            "own_parameter_jacobian": len(listing.names) * self.parameters,
        }  # fmt: skip
        written = {
            listing.names.get(name, name): listing.written[name][1] for name in listing.outputs
        }
        kinds = [each["kind"] for each in json.loads(listing.metadata)["coordinates"]]
        self._angles = np.flatnonzero([kind == Kind.ANGLE for kind in kinds])
        self._labels = {name: label for label, name in listing.names.items()}
        self.outputs = written | {name: size[name] for name in listing.solved}

    @property
    def evaluator(self) -> NumpyScene:
        """What evaluates its outputs."""
        return self

    def wait(self, batches: bool = True) -> None:
        """Nothing is compiled."""

    def _refuse(self, *_: Any) -> NoReturn:
        raise MechcError(
            "a model with backend='numpy' has no compiled code, which this needs (capsules, C "
            "functions, batches, workers): install a C compiler and compile without backend"
        )

    capsule = property(_refuse)
    of_members = property(_refuse)
    bound = bound_along = _refuse

    def complete(self, given: Any, values: Array) -> None:
        """Fill the parameters that are not given with their defaults, in place."""
        self.equations.functions.complete(given, values[None])

    def complete_rows(self, given: Any, rows: Array) -> None:
        """Values for every row."""
        self.equations.functions.complete(given, rows)

    def evaluate(self, name: str, t: Array, y: Array, p: Array, inputs: Any = None) -> Array:
        """Output ``name`` of states (n, nq + nu), t and p once or once a state: (n, length)."""
        equations = self.equations.with_inputs(inputs)
        out = np.empty((len(y), self.outputs[name]))
        for first in range(0, len(y), BLOCK):
            own = slice(first, first + BLOCK)
            times, values = (x[own] if len(x) > 1 else x for x in (t, p))
            out[own] = self._evaluate(
                equations, self._labels.get(name, name), times, y[own], values
            )
        return out

    def _evaluate(
        self, equations: ArrayEquations, name: str, t: Array, y: Array, p: Array
    ) -> Array:
        k = equations.constants(p)
        state = (t, y[:, : self.coordinates], y[:, self.coordinates :], p, k)
        listing = equations.listing
        if name in listing.outputs and name not in listing.of_motion:
            return equations.written(name, *state)
        place = equations.place(t, state[1], p, k)
        if name in ("mass_matrix", "constraint_jacobian"):
            found = place.mass if name == "mass_matrix" else place.jacobian
            return found.reshape(len(y), -1)
        forcing, gamma = equations.terms(*state, place)
        if name == "forcing":
            return forcing
        motion = accelerations(place, forcing, gamma)
        if name == "multipliers":
            return motion[1]
        if name == "rates":
            return np.hstack([equations.coordinate_rates(*state), motion[0]])
        if name in listing.outputs:
            return equations.written(name, *state, motion)
        return jacobian(name, equations, state, place, motion)

    def project(
        self, t: float, y: Array, p: Array, inputs: Any = None
    ) -> tuple[int, Array, float, float]:
        """The nearest state on the constraints: status, state, gap and velocity residual before."""
        if len(y) != self.width:
            raise ValueError(f"a state has {self.width} components")
        return self._manifold(t, y, p, inputs).project(t, np.array(y, dtype=np.float64))

    def _manifold(self, t: float, y: Array, p: Array, inputs: Any) -> Manifold:
        manifold = Manifold(self.equations.with_inputs(inputs), p)
        return manifold.measured_at(t, np.asarray(y)[: self.coordinates], self._angles)

    def start(
        self, t0: float, t1: float, y0: Array, p: Array, rtol: float, atol: Array | None,
        scale: Array, first_step: float, max_step: float, max_steps: int, method: int,
        dense: bool, on_change_point: int = 0, may_stiffen: bool = False,
        max_bytes: float = np.inf, limits: Any = None, inputs: Any = None,
    ) -> Any:  # fmt: skip
        """Begin a run of the explicit pair of order 8(5,3), whatever the method.

        ``limits`` are those of sensitivities, which only compiled code has.
        """
        from mechc.numpy_backend.integrator import NumpyRun, RunLimits

        chosen = RunLimits(t1, rtol, atol, max_step, max_steps, dense, max_bytes)
        manifold = self._manifold(t0, y0, p, inputs)
        return NumpyRun(manifold, t0, y0, scale, first_step, chosen)
