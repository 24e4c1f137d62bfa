"""A mechanism as a whole."""

from math import inf

import pytest
from mechc_codegen.description.mechanism import Parameter
from mechc_codegen.description.quantity import Quantity
from mechc_codegen.library.catalogue import shipped_mechanism
from sympy import Symbol


def test_a_mechanism_shows_itself_in_a_line():
    assert repr(shipped_mechanism("four_bar")) == (
        "<mechc.Mechanism four_bar: 3 coordinates, 3 speeds, 3 bodies, 4 joints, 2 constraints, "
        "11 parameters>"
    )
    single = repr(shipped_mechanism("pendulum"))
    assert "1 coordinate, 1 speed, 1 body, 0 joints, 0 constraints" in single


@pytest.mark.parametrize(("assumption", "bounds"), [
    ({}, (-inf, inf)), ({"positive": True}, (0.0, inf)), ({"negative": True}, (-inf, 0.0)),
    ({"nonnegative": True}, (0.0, inf)), ({"real": True}, (-inf, inf)),
])  # fmt: skip
def test_a_parameter_has_the_sign_that_its_symbol_is_declared_with(assumption, bounds) -> None:
    """SymPy has simplified with it: Abs(k*x) is k*Abs(x)."""
    quantity = Parameter(Symbol("k", **assumption), None, Quantity("N/m", "")).quantity
    assert (quantity.lower, quantity.upper) == bounds
    narrower = Quantity("N/m", "stiffness", lower=1.0, upper=2.0)
    if "negative" not in assumption:
        assert Parameter(Symbol("k", **assumption), None, narrower).quantity == narrower
