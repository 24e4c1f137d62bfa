"""Units in words as exponents."""

import pytest
from mechc_codegen.export.units import exponents


@pytest.mark.parametrize(
    ("unit", "found"),
    [
        ("m", {"m": 1}),
        ("kg m^2", {"kg": 1, "m": 2}),
        ("N m s/rad", {"kg": 1, "m": 2, "s": -1, "rad": -1}),
        ("m/s^2", {"m": 1, "s": -2}),
        ("1/s", {"s": -1}),
        ("1", {}),
        ("N/(m s)", {"kg": 1, "s": -3}),
        ("N*m", {"kg": 1, "m": 2, "s": -2}),
        ("N/m/s", {"kg": 1, "s": -3}),
        ("W s/J", {}),
        ("parsec", None),
        ("m^x", None),
        ("<m>", None),
    ],
)
def test_exponents_of_base_units(unit, found):
    assert exponents(unit) == found
