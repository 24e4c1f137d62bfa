"""Outputs as C functions: for SciPy's LowLevelCallable, numba, ctypes and C."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from mechc.system.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.model import Model

_PROTOTYPE = ctypes.CFUNCTYPE(
    None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p
)


class CFunction:
    """An output of a model as a C function, with its parameters bound.

    Called as ``void f(double t, double *y, double *out, void *data)``, with y [q, u] of
    ``states`` numbers and out of ``width`` numbers.  Such a call takes no lock of Python's, and
    threads may share the function and its data.

    Attributes
    ----------
    address, data
        Of the function, and of what its last argument must be.  Both hold as long as this
        object or its capsule is kept.
    capsule
        The same as a capsule named by the signature, its context the data: what
        ``scipy.LowLevelCallable`` takes.
    signature
        ``"void (double, double *, double *, void *)"``.
    """

    signature = "void (double, double *, double *, void *)"

    def __init__(self, capsule: object, address: int, data: int, states: int, width: int) -> None:
        self.capsule = capsule
        self.address, self.data = address, data
        self.states, self.width = states, width

    @property
    def ctypes(self) -> Any:
        """The function for ctypes and, inside compiled code, for numba; arguments are addresses."""
        return _PROTOTYPE(self.address)

    def __repr__(self) -> str:
        return f"<mechc.CFunction {self.signature}: {self.states} -> {self.width}>"


def c_function(model: Model, output: str = "rates", params: Parameters = None) -> CFunction:
    """An output as a C function; by default the state rates, unprojected as in :meth:`rhs`.

    Waits until all of a model that is being compiled is there.

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
    values = _one_set(model, output, params)
    capsule, address, data, width = model._scene.bound(output, values)
    return CFunction(capsule, address, data, model._scene.width, width)


def integrand(
    model: Model,
    output: str,
    along: str | Sequence[str],
    y: Array,
    params: Parameters = None,
    *,
    t: float = 0.0,
    component: int = 0,
) -> Any:
    """A number of an output as a function of coordinates, for ``scipy.integrate.quad``.

    The state is y (nq + nu,) but for what it runs along; nothing closes loops on the way.

    Parameters
    ----------
    along
        A coordinate, a speed or ``"t"``; several for ``nquad``, or for the ``args`` of ``quad``.
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
    from scipy import LowLevelCallable

    values = _one_set(model, output, params)
    width = model._scene.outputs[output]
    if not 0 <= component < width:
        raise ValueOutOfBoundsError(
            f"{output} has components 0 to {width - 1} at one state, not {component}"
        )
    names = [along] if isinstance(along, str) else list(along)
    places = np.array([_place(model, name) for name in names], dtype=np.intc)
    state = np.array(y, dtype=np.float64)
    if state.shape != (model._scene.width,) or not names:
        raise ValueError(f"a state of {model.name} has {model._scene.width} components")
    return LowLevelCallable(
        model._scene.bound_along(output, values, component, places, state, float(t))
    )


def _one_set(model: Model, output: str, params: Parameters) -> Array:
    if output not in model._scene.outputs:
        model._refuse_output(output)
    values = model._parameters.resolve(params)
    if values.ndim != 1:
        raise ValueOutOfBoundsError(
            f"a C function has one set of parameters, not an array {values.shape[:-1]} of them"
        )
    return np.ascontiguousarray(values)


def _place(model: Model, name: str) -> int:
    """Where it stands in y; -1 is the time, unless a coordinate is called so."""
    names = (*model.coordinates, *model.speeds)
    if name in names:
        return names.index(name)
    if name != "t":
        raise UnknownNameError("coordinate or speed", name, (*names, "t"))
    return -1
