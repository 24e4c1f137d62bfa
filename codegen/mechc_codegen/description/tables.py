"""Lookup tables as functions of SymPy: piecewise polynomials of one or two arguments.

A table is data; each of its derivatives is a function of its own, which the data define.  So
derivatives of all orders are exact, and zero beyond the degree.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from sympy import Expr, Float, Function, S

Orders = tuple[int, ...]


@dataclass(frozen=True)
class TableData:
    """The data of a lookup table: piecewise polynomials of one or two arguments.

    Attributes
    ----------
    starts
        Of each argument, the values at which pieces begin; the first goes on downwards.
    degree
        Of the polynomials, in each argument.
    coefficients
        The factors of the powers of the arguments from the piece's start; the last argument's
        powers change fastest, then the other's, then pieces of the last argument, of the first.
    periods
        Of each argument; None where it is not periodic.
    evaluate
        (orders, arguments) -> numbers, for decisions that need values.
    """

    starts: tuple[tuple[float, ...], ...]
    degree: int
    coefficients: tuple[float, ...]
    periods: tuple[float | None, ...]
    evaluate: Callable[..., Any] = field(compare=False, repr=False)

    @property
    def digest(self) -> str:
        """A hash of the data, used in the names of functions."""
        parts = (self.starts, self.degree, self.coefficients, self.periods)
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


class Lookup(Function):  # type: ignore[misc]
    """A derivative of a table; subclasses have ``table`` and ``orders``."""

    is_real = True
    table: TableData
    orders: Orders

    @classmethod
    def eval(cls, *arguments: Expr) -> Expr | None:
        if not all(x.is_number for x in arguments):
            return None
        return Float(float(cls.table.evaluate(cls.orders, *map(float, arguments))))

    def fdiff(self, argindex: int = 1) -> Expr:
        further = tuple(n + (k == argindex - 1) for k, n in enumerate(self.orders))
        if max(further) > self.table.degree:
            return S.Zero
        return lookup(self.table, further)(*self.args)


_known: dict[tuple[str, Orders], type[Lookup]] = {}


def lookup(table: TableData, orders: Orders) -> type[Lookup]:
    """The SymPy function for a derivative of a table; equal data give the same class."""
    key = (table.digest, orders)
    if key not in _known:
        name = f"table_{key[0]}_{'_'.join(map(str, orders))}"
        members = {
            "table": table, "orders": orders, "nargs": len(orders),
            "_imp_": staticmethod(lambda *x: table.evaluate(orders, *x)),
        }  # fmt: skip
        _known[key] = type(name, (Lookup,), members)
    return _known[key]
