"""A compiled scene with the values of its inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechc.errors import InputError, MechcError, UnknownNameError
from mechc.inputs.bind import GivenInputs, InputSlot, missing
from mechc.inputs.sampled import Control, with_held
from mechc.inputs.stored import inputs_as_json, inputs_from_json
from mechc.system.parameters import Array
from mechc.system.system import System

PROJECTION = "constraints", "velocity_constraints", "constraint_jacobian", "mass_matrix"


class DrivenScene:
    """A scene that has inputs: calls that need their values get them, or an error names them.

    All other calls are passed on.
    """

    def __init__(
        self,
        scene: Any,
        slots: Sequence[InputSlot],
        free: Sequence[str],
        given: Mapping[str, Any] | None = None,
    ) -> None:
        self._scene, self._slots, self._free = scene, tuple(slots), frozenset(free)
        self.outputs = scene.outputs
        self.given = dict(given or {})
        sizes = scene.coordinates, scene.speeds
        values = GivenInputs(slots, self.given, sizes)
        self._values = values if values.complete else None
        self._whole: Any = self._values.native_inputs() if self._values else None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._scene, name)

    def with_inputs(self, given: Mapping[str, Any]) -> DrivenScene:
        """A copy of the scene with further inputs."""
        return DrivenScene(self._scene, self._slots, tuple(self._free), {**self.given, **given})

    @property
    def inputs_as_json(self) -> dict[str, Any]:
        """The inputs as JSON data, but for functions of Python."""
        return inputs_as_json(self.given)

    def missing_inputs(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """The inputs in a dict of :attr:`inputs_as_json` that this scene was not given."""
        return {n: x for n, x in inputs_from_json(data).items() if n not in self.given}

    def given_to(self, names: Sequence[str], t: float) -> Any:
        """The inputs for C functions of these outputs; None where no such output contains any."""
        if self._free.issuperset({*names} & {*self._scene.outputs}):
            return None
        values = self._given_inputs()
        values.check_times((t,))
        return self._whole

    def evaluate(
        self, name: str, t: Array, y: Array, p: Array, forces: Array | None = None
    ) -> Array:
        """Evaluate an output as :class:`mechc.native._driver.Scene` does."""
        out = np.empty((len(y), self._scene.outputs[name]))
        self.evaluate_into(name, t, y, p, out, forces)
        return out

    def evaluate_into(
        self, name: str, t: Array, y: Array, p: Array, out: Array, forces: Array | None = None
    ) -> None:
        """Evaluate an output into an array as :class:`mechc.native._driver.Scene` does."""
        if name in self._free:
            self._scene.evaluate_into(name, t, y, p, out, forces=forces)
            return
        values = self._given_inputs()
        if values.caller.takes_state and name.endswith("state_jacobian"):
            raise MechcError(
                f"how {', '.join(values.function_names)} depend on the state is not known, "
                "so there is no derivative by it: compile with expressions for them"
            )
        values.check_times(t)
        self._scene.evaluate_into(name, t, y, p, out, self._whole, forces)
        if values.caller.failure is not None:
            self.raise_failure()

    def project(self, t: float, y: Array, p: Array) -> tuple[int, Array, float, float]:
        """Project a state as :class:`mechc.native._driver.Scene` does."""
        found: tuple[int, Array, float, float] = self._scene.project(
            t, y, p, self.given_to(PROJECTION, t)
        )
        self.raise_failure()
        return found

    def restart(self, t: float) -> None:
        """Begin a run at this time, from which on controllers are called."""
        values = self._given_inputs()
        values.caller.reset()
        for control in values.controls:
            control.restart()
            control.skip(t)

    def repeat(self) -> None:
        """Let later runs repeat the values that controllers gave, and call none."""
        for control in self._given_inputs().controls:
            control.repeat()

    @property
    def feeds_back(self) -> bool:
        """Whether a controller reads the state."""
        return self._values is not None and any(c.takes_state for c in self._values.controls)

    def with_controllers_from(self, t: float) -> DrivenScene:
        """A copy of the scene with controllers of an endless run that begins at this time."""
        sampled = {control.names: control.sampled for control in self._given_inputs().controls}
        return self.with_inputs(with_held(sampled, (t, np.inf))[0]) if sampled else self

    def controlled_until(self, t0: float, t: float) -> DrivenScene:
        """A copy of the scene whose controllers go on until t in the run that began at t0."""
        controls = self._given_inputs().controls
        more = [c.longer(t0, t) for c in controls if c.signals[0].until <= t or c.repeats]
        return self.with_inputs({k: s for each in more for k, s in each.items()}) if more else self

    @property
    def due(self) -> Any:
        """Calls, at a time and a state, controllers whose instant has come; None without any."""
        controls = self._given_inputs().controls
        return (lambda t, y: self._call(controls, t, y)) if controls else None

    def _call(self, controls: Sequence[Control], t: float, y: Array) -> None:
        """Call the controllers whose instant has come; one that fails leaves NaN: the run ends."""
        count = self._scene.coordinates
        for control in controls:
            try:
                control.reach(t, y[:count].copy(), y[count:].copy())
            except BaseException as error:
                self._given_inputs().caller.failure = ", ".join(control.names), t, error

    # -- for a stepper ------------------------------------------------------------------------

    @property
    def without_inputs(self) -> Any:
        """The compiled scene, whose functions take the inputs as an argument."""
        return self._scene

    @property
    def numbers(self) -> dict[str, Array]:
        """The place (1, 1), which runs read, of each input that is a number."""
        return self._given_inputs().numbers

    @property
    def has_only_numbers(self) -> bool:
        """Whether every input is a number."""
        return len(self.numbers) == len(self._slots)

    def native_inputs(self) -> Any:
        """The values for compiled code, separate from those of other runs."""
        return self._given_inputs().native_inputs()

    def breaks(self, t0: float, t1: float, rtol: float) -> list[float]:
        """The kinks of the signals, see :meth:`GivenInputs.breaks`."""
        return self._given_inputs().breaks(t0, t1, rtol)

    def places(self, names: Sequence[str]) -> Array:
        """The places of numbers among the signals, see :meth:`GivenInputs.places`."""
        return self._given_inputs().places(names)

    def values(self, names: Sequence[str], t: Array, y: Array) -> list[Array]:
        """The values (n,) of inputs at times (n,) and states (n, nq + nu), by Python alone."""
        return [self._given_inputs().value(name, t, y) for name in names]

    def of_time(self, names: Sequence[str]) -> list[str]:
        """The inputs among these names that constraints, mass matrix or kinematics contain."""
        return [slot.name for slot in self._slots if slot.of_time and slot.name in names]

    def is_free(self, output: str) -> bool:
        """Whether an output contains no input."""
        return output in self._free

    def check_times(self, times: Sequence[float], additions: int = 0) -> None:
        """Check that signals have values at these times, see :meth:`GivenInputs.check_times`."""
        self._given_inputs().check_times(times, additions)

    def reset(self) -> None:
        """Forget calls and failures of functions."""
        self._given_inputs().caller.reset()

    def for_c(self, output: str) -> Any:
        """The inputs that an output as a C function keeps; None where it contains none."""
        return None if output in self._free else self._given_inputs().for_c()

    # -- Python functions ----------------------------------------------------------------------

    @property
    def calls_python(self) -> bool:
        """Whether there are functions of Python, whose smoothness is not known."""
        return bool(self.functions)

    @property
    def has_failed(self) -> bool:
        """Whether a function failed since this was last raised."""
        return self._values is not None and self._values.caller.failure is not None

    @property
    def was_interrupted(self) -> bool:
        """Whether Ctrl-C interrupted a function; this is then reset."""
        if self._values is None or not self.has_failed:
            return False
        caller = self._values.caller
        if not isinstance(caller.failure[2], KeyboardInterrupt):
            return False
        caller.failure = None
        return True

    def failure_in_words(self) -> str:
        """A message that says which function failed, when and how."""
        assert self._values is not None
        name, t, error = self._values.caller.failure
        why = "returned no finite number" if error is None else f"{type(error).__name__}: {error}"
        return f"the input {name} failed at t = {t:.9g} s: {why}"

    def raise_failure(self, solution: object = None) -> None:
        """Raise :class:`InputError` if a function failed; ``solution``: the motion until then."""
        if not self.has_failed:
            return
        assert self._values is not None
        told, error = self.failure_in_words(), self._values.caller.failure[2]
        self._values.caller.failure = None
        if error is not None and not isinstance(error, Exception):
            raise error
        kept = "; error.solution is the motion until then" if solution is not None else ""
        raise InputError(f"{told}{kept}", solution) from error

    def notes(self, method: str) -> tuple[str, ...]:
        """The cost of Python functions in the last run, and what its method may miss of them."""
        return () if self._values is None else self._values.notes(method)

    @property
    def functions(self) -> tuple[str, ...]:
        """The inputs that are functions of Python."""
        return () if self._values is None else tuple(self._values.function_names)

    def _given_inputs(self) -> GivenInputs:
        if self._values is None:
            raise missing(self._slots, self.given)
        return self._values


def scene_with_inputs(scene: Any, data: Mapping[str, Any]) -> Any:
    """The scene with the inputs that its metadata name."""
    slots = [InputSlot.from_metadata(slot) for slot in data["inputs"]]
    return DrivenScene(scene, slots, data.get("free_of_inputs", ()))


def with_inputs(system: System, inputs: Mapping[str, Any]) -> System:
    """The system driven by inputs: see :meth:`mechc.Model.with_inputs`."""
    if system.driven is None:
        for name in inputs:
            raise UnknownNameError("input", name, system.inputs)
        return system
    return system.replaced_scene(system.driven.with_inputs(inputs))
