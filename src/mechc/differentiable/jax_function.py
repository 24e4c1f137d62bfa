"""Motions under JAX: compiled code called back, with its own rule of differentiation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from mechc.differentiable.motion import Motion, function_of
from mechc.errors import MechcError, package


def jax(
    model: Any, *, t0: float = 0.0, inputs: Mapping[str, Any] | None = None, rtol: float = 1e-9,
    method: str = "auto",
) -> Callable[..., Any]:  # fmt: skip
    """A function ``f(t, y0, params) -> states`` of JAX, under jit, grad, jvp and vmap.

    Parameters
    ----------
    model
        A :class:`mechc.Model`; derivatives of its motions are compiled if they are not.
    t0
        When motions begin, s.
    inputs, rtol, method
        As in :meth:`mechc.Model.simulate`.

    Returns
    -------
    f
        ``t``: a time or times (nt,) in s, rising.  ``y0``: a mapping of coordinates and speeds,
        which is assembled, or a state (nq + nu,).  ``params``: a mapping of those that are not at
        their defaults.  Gives the states (nq + nu,) or (nt, nq + nu), differentiable by all three.
        ``vmap`` runs a batch on all cores; members of it that fail are NaN.

    Raises
    ------
    MissingPackageError
        Without JAX.
    UnavailableOutputError
        If the model has no derivatives of motions.
    MechcError
        When called without double precision.
    """
    library = package("jax", "JAX is not installed: pip install jax")

    def convert(given: Any) -> Any:
        if not library.config.jax_enable_x64:
            raise MechcError(
                "motions need double precision: jax.config.update('jax_enable_x64', True) after "
                "importing jax"
            )
        return library.numpy.asarray(given, dtype=library.numpy.float64)

    policy, differentiable = {"rtol": rtol, "method": method}, partial(_differentiable, library)
    return function_of(model, t0, inputs, policy, convert, library.numpy, differentiable)


def _differentiable(library: Any, motion: Motion) -> Callable[[Any, Any], Any]:
    """States of t (nt,) and x (k,), with their derivative along (dt, dx)."""
    call = partial(_call, library, motion)

    def plain(t: Any, x: Any) -> Any:
        return call(motion.states, (), t, x)

    states: Callable[[Any, Any], Any] = library.custom_jvp(plain)

    def rule(primals: Any, tangents: Any) -> Any:
        (t, x), (dt, dx) = primals, tangents
        y = states(t, x)
        slopes = call(motion.slopes, (x.shape[-1],), t, x)
        rates = call(motion.rates, (), t, x, y)
        return y, slopes @ dx + rates * dt[..., None]

    states.defjvp(rule)  # type: ignore[attr-defined]
    return states


def _call(library: Any, motion: Motion, function: Any, tail: tuple[int, ...], *given: Any) -> Any:
    """A function of NumPy arrays, called from a computation of JAX."""
    import numpy as np

    shape = library.ShapeDtypeStruct((*given[0].shape, motion.width, *tail), np.float64)
    return library.pure_callback(
        lambda *arrays: function(*(np.asarray(each) for each in arrays)), shape, *given,
        vmap_method="broadcast_all",
    )  # fmt: skip
