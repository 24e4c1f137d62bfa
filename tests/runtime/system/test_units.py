"""Values as people type them."""

import math

import pytest

import mechc
from mechc.errors import MechcError
from mechc.system.kinds import Kind
from mechc.system.parameters import NamedQuantity
from mechc.system.units import read_seconds, read_value, split_assignment


def quantity(unit):
    kind = str(mechc.Quantity(unit, "a number").kind)
    return NamedQuantity("x", unit, "a number", -math.inf, math.inf, False, Kind(kind))


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("85deg", "rad", math.radians(85)),
        ("-85 deg", "rad", math.radians(-85)),
        ("85°", "rad", math.radians(85)),
        ("1.5", "rad", 1.5),
        ("1.5rad", "rad", 1.5),
        ("60rpm", "rad/s", 2 * math.pi),
        ("360deg/s", "rad/s", 2 * math.pi),
        ("3500mm", "m", 3.5),
        ("350cm", "m", 3.5),
        ("3.5", "m", 3.5),
        (" 3.5 m ", "m", 3.5),
        ("1e-3", "m", 1e-3),
        ("1.e3mm", "m", 1.0),
        (".5m", "m", 0.5),
        ("+2", "kg", 2.0),
        ("250g", "kg", 0.25),
        ("2kg m^2", "kg m^2", 2.0),
        ("9.81m/s^2", "m/s^2", 9.81),
    ],
)
def test_numbers_with_and_without_unit_are_read_in_si(text, unit, value):
    assert read_value(text, quantity(unit)) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "unit", "told"),
    [
        ("85degg", "rad", r"x: 'degg' in '85degg' is not one of its units; use rad or deg or °"),
        ("85mm", "rad", "'mm' .* use rad or deg"),
        ("3deg", "m", "'deg' .* use m or cm or mm"),
        ("3 3", "m", "'3' in '3 3'"),
        ("3s", "kg m^2", r"'s' .*; use kg m\^2"),
        ("abc", "m", "'abc' is not a number"),
        ("", "m", "'' is not a number"),
        ("--3", "m", "not a number"),
        ("3,5", "m", "',5'"),
        ("0x10", "m", "'x10'"),
        ("__import__('os')", "m", "not a number"),
        ("1e", "m", "'e'"),
    ],
)
def test_nonsense_is_refused_with_what_would_do(text, unit, told):
    with pytest.raises(MechcError, match=told):
        read_value(text, quantity(unit))


def test_infinity_and_nan_are_read_for_the_bounds_to_refuse():
    assert math.isinf(read_value("-inf", quantity("m")))
    assert math.isnan(read_value("nan", quantity("m")))


def test_durations_are_in_seconds():
    assert read_seconds("20") == read_seconds("20s") == read_seconds("2e1 s") == 20
    assert read_seconds("500ms") == 0.5
    assert read_seconds("2min") == read_seconds("120") == read_seconds("2 min") == 120
    with pytest.raises(MechcError, match=r"'m'.*s or ms or min or h"):
        read_seconds("2m")


def test_assignments_come_in_two():
    assert split_assignment(" l_3 = 3.5 m") == ("l_3", "3.5 m")
    assert split_assignment("a=b=c") == ("a", "b=c")
    for text in ("l_3", "=3", "l_3=", " = ", ""):
        with pytest.raises(MechcError, match="NAME=VALUE"):
            split_assignment(text)


def test_the_runtime_has_the_kinds_of_the_compiler():
    """They come with a scene's metadata as texts."""
    assert {kind.name: str(kind) for kind in Kind} == {k.name: str(k) for k in mechc.Kind}


def test_a_kind_decides_and_no_text_of_a_unit():
    """A coordinate in a unit of its own is an angle where its description says so."""
    quarter = NamedQuantity("x", "grad", "an angle", -math.inf, math.inf, False, Kind.ANGLE)
    assert read_value("90deg", quarter) == pytest.approx(math.pi / 2)
    plain = NamedQuantity("x", "rad", "a number called so", -math.inf, math.inf, False)
    with pytest.raises(MechcError, match="use rad"):
        read_value("90deg", plain)
