"""Units that would need a conversion are refused: nothing converts them."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mechc_codegen.convert.convert import convert
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.read import read
from sympy import Symbol

from tests.support import scenes
from tests.support.sympy_objects import slider


@pytest.mark.parametrize(
    ("unit", "instead"),
    [("deg", "rad"), ("°", "rad"), ("mm", "m"), ("cm^2", "m"), ("rad/min", "s"), ("rpm", "rad/s")],
)
def test_a_unit_that_is_not_the_sis_is_refused_with_the_one_to_use(unit: str, instead: str) -> None:
    with pytest.raises(MechanismError, match=f"Give its values in {instead} instead of"):
        convert(read(slider()), ConversionSettings(units={"x": unit}))


@pytest.mark.parametrize("unit", ["m", "kg m^2", "N s/m", "rad", "1", "of a beard"])
def test_others_are_words_for_people(unit: str) -> None:
    made = convert(read(slider()), ConversionSettings(units={"x": unit}))
    assert made.coordinates[0].quantity.unit == unit


@pytest.mark.parametrize("unit", ["mm", "deg", "kN/mm"])
def test_a_mechanism_in_other_units_is_refused_too(unit: str) -> None:
    described = scenes.bead_with(Symbol("f"))
    (parameter,) = described.parameters
    other = replace(parameter, quantity=parameter.quantity.with_unit(unit))
    with pytest.raises(MechanismError, match=f"f in '{unit}': all values are in SI units"):
        replace(described, parameters=(other,))
