"""Motions under PyTorch: an ``autograd.Function`` over compiled code."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any

import numpy as np

from mechc.differentiable.motion import Motion, function_of
from mechc.errors import MechcError, package


def torch(
    model: Any, *, t0: float = 0.0, inputs: Mapping[str, Any] | None = None, rtol: float = 1e-9,
    method: str = "auto",
) -> Callable[..., Any]:  # fmt: skip
    """A function ``f(t, y0, params) -> states`` of PyTorch's tensors, with their gradients.

    Arguments, result and errors as those of :func:`mechc.jax`; tensors are doubles, on any device.
    Forward and backward derivatives, and ``torch.func.vmap``, which runs a batch.

    Raises
    ------
    MissingPackageError
        Without PyTorch.
    UnavailableOutputError
        If the model has no derivatives of motions.
    MechcError
        When called with tensors of single precision.
    """
    library, policy = _library(), {"rtol": rtol, "method": method}
    convert = partial(_double, library)
    return function_of(
        model, t0, inputs, policy, convert, library,
        lambda motion: partial(_states().apply, motion),
    )  # fmt: skip


def _library() -> Any:
    return package("torch", "PyTorch is not installed: pip install torch")


def _double(library: Any, given: Any) -> Any:
    if not isinstance(given, library.Tensor):
        return library.as_tensor(given, dtype=library.float64)
    if given.dtype != library.float64:
        raise MechcError(f"motions need tensors of float64, not {given.dtype}")
    return given


@cache
def _states() -> Any:
    """The differentiable function, made when PyTorch is there."""
    library, called = _library(), _numpy_function()

    class States(library.autograd.Function):  # type: ignore[misc, name-defined]
        """The states of a motion, as a function of times t (..., nt) and x (..., k)."""

        @staticmethod
        def forward(motion: Motion, t: Any, x: Any) -> Any:
            return _on_tensors(motion.states, t, x)

        @staticmethod
        def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
            ctx.motion, t, x = inputs
            ctx.save_for_backward(t, x, output)
            ctx.save_for_forward(t, x, output)

        @staticmethod
        def backward(ctx: Any, cotangent: Any) -> Any:
            t, x, y = ctx.saved_tensors
            by_t = by_x = None
            if ctx.needs_input_grad[1]:
                by_t = (cotangent * called.apply(ctx.motion.rates, t, x, y)).sum(-1)
            if ctx.needs_input_grad[2]:
                by_x = called.apply(ctx.motion.pull_back, t, x, cotangent)
            return None, by_t, by_x

        @staticmethod
        def jvp(ctx: Any, _: Any, dt: Any, dx: Any) -> Any:
            t, x, y = ctx.saved_tensors
            moved = library.zeros_like(y)
            if dt is not None:
                moved = moved + called.apply(ctx.motion.rates, t, x, y) * dt[..., None]
            if dx is not None:
                slopes = called.apply(ctx.motion.slopes, t, x)
                moved = moved + (slopes * dx[..., None, None, :]).sum(-1)
            return moved

        @staticmethod
        def vmap(info: Any, in_dims: Any, motion: Motion, *given: Any) -> Any:
            return States.apply(motion, *_leading(info, in_dims, given)), 0

    return States


@cache
def _numpy_function() -> Any:
    """A function of NumPy arrays on tensors, without derivatives of its own."""
    library = _library()

    class Called(library.autograd.Function):  # type: ignore[misc, name-defined]
        """A call of a NumPy function, also on the tensors within a vmap."""

        @staticmethod
        def forward(function: Callable[..., Any], *given: Any) -> Any:
            return _on_tensors(function, *given)

        @staticmethod
        def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
            pass

        @staticmethod
        def backward(ctx: Any, *_: Any) -> Any:
            raise MechcError("motions have first derivatives only")

        @staticmethod
        def vmap(info: Any, in_dims: Any, function: Callable[..., Any], *given: Any) -> Any:
            return Called.apply(function, *_leading(info, in_dims, given)), 0

    return Called


def _leading(info: Any, in_dims: Any, given: Any) -> list[Any]:
    """Tensors with the axis of a vmap first."""
    return [
        each.expand(info.batch_size, *each.shape) if dim is None else each.movedim(dim, 0)
        for each, dim in zip(given, in_dims[1:], strict=True)
    ]


def _on_tensors(function: Callable[..., Any], *given: Any) -> Any:
    arrays = [np.ascontiguousarray(each.detach().cpu().numpy()) for each in given]
    values = np.ascontiguousarray(function(*arrays))
    return _library().as_tensor(values, dtype=given[-1].dtype, device=given[-1].device)
