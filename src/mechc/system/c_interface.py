"""Outputs as C functions: for SciPy's LowLevelCallable, numba, ctypes and C."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from mechc.native._driver import Ode
from mechc.system.parameters import Array
from mechc.system.system import System

_PROTOTYPE = ctypes.CFUNCTYPE(
    None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p
)


class CFunction:
    """An output of a model as a C function, with its parameters bound.

    Called as ``void f(double t, double *y, double *out, void *data)``, with y [q, u] of
    ``states`` numbers and out of ``width`` numbers.  A call takes no lock of Python, and threads
    may share the function and its data.

    Attributes
    ----------
    address, data
        Addresses of the function, and for its last argument.  Both are valid as long as this
        object or its capsule is kept.
    capsule
        The same as a capsule named by the signature, its context the data, for
        ``scipy.LowLevelCallable``.
    stack
        Bytes that a call takes at most of the stack of the thread that makes it: some 300 KiB, a
        few MiB for states of more than 64 components and for trees that are walked link by link.
        Give threads that call it such a stack, and what they need themselves: the operating system
        ends a program whose stack is too small.
    signature
        ``"void (double, double *, double *, void *)"``.
    failure
        None; or name, time and exception of the first input given as a Python function that
        failed: it is NaN from then on.
    """

    signature = "void (double, double *, double *, void *)"

    def __init__(
        self, capsule: object, address: int, data: int, states: int, width: int, stack: int,
        inputs: Any = None,
    ) -> None:  # fmt: skip
        self.capsule, self.stack, self._inputs = capsule, stack, inputs
        self.address, self.data = address, data
        self.states, self.width = states, width

    @property
    def ctypes(self) -> Any:
        """The function for ctypes and, inside compiled code, for numba; arguments are addresses."""
        return _PROTOTYPE(self.address)

    @property
    def failure(self) -> tuple[str, float, BaseException | None] | None:
        if self._inputs is None:
            return None
        found: tuple[str, float, BaseException | None] | None = self._inputs.caller.failure
        return found

    def __repr__(self) -> str:
        return f"<mechc.CFunction {self.signature}: {self.states} -> {self.width}>"


def c_function(system: System, output: str, p: Array) -> CFunction:
    """An output as a C function with the parameters p (np,) and the inputs bound; they are copied.

    Waits until the model is compiled completely.
    """
    inputs = _inputs(system, output)
    bound = system.scene.bound(output, np.ascontiguousarray(p), inputs)
    capsule, address, data, width, stack = bound
    return CFunction(capsule, address, data, system.scene.width, width, stack, inputs)


def integrand(
    system: System, output: str, along: Sequence[str], y: Array, p: Array, t: float, component: int
) -> Any:
    """A number of an output as a function of coordinates: a ``scipy.LowLevelCallable``."""
    from scipy import LowLevelCallable

    inputs = _inputs(system, output)
    width = system.scene.outputs[output]
    if not 0 <= component < width:
        raise ValueOutOfBoundsError(
            f"{output} has components 0 to {width - 1} at one state, not {component}"
        )
    places = np.array([_place(system, name) for name in along], dtype=np.intc)
    return LowLevelCallable(
        system.scene.bound_along(output, np.ascontiguousarray(p), component, places, y, t, inputs)
    )


def _inputs(system: System, output: str) -> Any:
    """The values of inputs that an output of the system keeps; None if it contains none."""
    if output not in system.scene.outputs:
        system.refuse_output(output)
    return None if system.driven is None else system.driven.for_c(output)


def _place(system: System, name: str) -> int:
    """The index of a name in y; -1 is the time, unless a coordinate is called t."""
    names = (*system.coordinates, *system.speeds)
    if name in names:
        return names.index(name)
    if name != "t":
        raise UnknownNameError("coordinate or speed", name, (*names, "t"))
    return -1


def right_hand_side(
    system: System, p: Array, general: Callable[[float, Array], Array]
) -> Callable[[float, Array], Array]:
    """f(t, y) as integrators call it: ``general``, or compiled code that does the same at once."""
    return Ode(system, p, general) if p.ndim == 1 else general
