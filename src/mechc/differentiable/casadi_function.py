"""Functions of NumPy arrays under CasADi, with their derivatives, and motions as such functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from mechc.errors import install_command, package

Vectors = Sequence[Any]


def library() -> Any:
    """CasADi; raises :class:`MissingPackageError` without it."""
    return package("casadi", f"CasADi is not installed: {install_command('casadi')}")


def numeric_function(
    name: str, sizes: Sequence[int], results: Sequence[int],
    value: Callable[..., Vectors], jacobian: Callable[..., Sequence[Vectors]],
    patterns: Sequence[Sequence[Any]] | None = None,
) -> Any:  # fmt: skip
    """A function of CasADi that calls NumPy.

    Parameters
    ----------
    sizes, results
        Lengths of the vectors that it takes and gives.
    value
        Of the vectors: those that it gives.
    jacobian
        Of the vectors: for each vector that it gives the derivatives by each that it takes, arrays
        or sparse matrices.
    patterns
        Sparse matrices with the places of the derivatives that are not zero, likewise; by default
        all places.
    """
    return _callback()(name, sizes, results, value, jacobian, patterns)


@cache
def _callback() -> Any:
    """The class of such functions, made when CasADi is there."""
    casadi = library()

    class NumericFunction(casadi.Callback):  # type: ignore[misc, name-defined]
        """A function that calls NumPy.  ``shapes``: sparsities of what it takes and gives."""

        def __init__(self, name: str, shapes: Any, call: Any, slope: Any = None) -> None:
            super().__init__()
            self._shapes, self._called, self._slope = shapes, call, slope
            self.construct(name, {})

        def get_n_in(self) -> int:
            return len(self._shapes[0])

        def get_n_out(self) -> int:
            return len(self._shapes[1])

        def get_sparsity_in(self, i: int) -> Any:
            return self._shapes[0][i]

        def get_sparsity_out(self, i: int) -> Any:
            return self._shapes[1][i]

        def eval(self, given: Any) -> list[Any]:
            found = zip(self._called(given), self._shapes[1], strict=True)
            return [self._as_matrix(*one) for one in found]

        @staticmethod
        def _as_matrix(found: Any, sparsity: Any) -> Any:
            if hasattr(found, "tocsc"):
                columns = found.tocsc()
                columns.sort_indices()
                return casadi.DM(sparsity, columns.data)
            return casadi.DM(np.asarray(found, dtype=np.float64).reshape(sparsity.shape))

        def has_jacobian(self) -> bool:
            return self._slope is not None

        def get_jacobian(self, name: str, *_: Any) -> Any:
            self._jacobian = self._slope(name)  # CasADi holds no reference
            return self._jacobian

    def wrap(name: str, sizes: Any, results: Any, value: Any, jacobian: Any, patterns: Any) -> Any:
        takes, gives = ([casadi.Sparsity.dense(n, 1) for n in each] for each in (sizes, results))
        if patterns is None:
            slopes = [casadi.Sparsity.dense(m, n) for m in results for n in sizes]
        else:
            slopes = [_sparsity(casadi, one) for row in patterns for one in row]

        def slope(name: str) -> Any:
            return NumericFunction(
                name, ([*takes, *gives], slopes),
                lambda given: [one for row in jacobian(*_vectors(given[: len(sizes)]))
                               for one in row],
            )  # fmt: skip

        return NumericFunction(name, (takes, gives), lambda given: value(*_vectors(given)), slope)

    return wrap


def _vectors(given: Any) -> list[Any]:
    return [np.array(one, dtype=np.float64).reshape(-1) for one in given]


def _sparsity(casadi: Any, pattern: Any) -> Any:
    columns = pattern.tocsc()
    columns.sort_indices()
    places = columns.indptr.tolist(), columns.indices.tolist()
    return casadi.Sparsity(*columns.shape, *places)
