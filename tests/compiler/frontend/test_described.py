"""Inputs of mechanisms are found, and a mechanism takes the options that messages advise."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import pytest
from mechc_codegen.description.mechanism import Constraint, Mechanism
from mechc_codegen.description.solid import Solid
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.description.terms import printed_name
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from mechc_codegen.frontend.described import with_settings
from mechc_codegen.frontend.sympy_joints import from_joints
from mechc_codegen.library.catalogue import SHIPPED, shipped_mechanism
from sympy import Function, Symbol, sin, symbols
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, dynamicsymbols

F, T, h = dynamicsymbols("F T h")
m, k = symbols("m k")
t = dynamicsymbols._t
GROUND, CART, POLE = (RigidBody(name, mass=m) for name in ("ground", "cart", "pole"))
SLIDE = PrismaticJoint("slide", GROUND, CART, joint_axis=GROUND.x)
PIN = PinJoint("pin", CART, POLE, child_point=POLE.y, joint_axis=CART.z)
LOADS = [
    (CART.masscenter, (F - k * SLIDE.coordinates[0] - SLIDE.speeds[0]) * GROUND.x),
    (POLE.frame, T * GROUND.z),
    (CART.frame, -T * GROUND.z),
]


def cart(**more: Any) -> Mechanism:
    return from_joints("cart", [SLIDE, PIN], **{"loads": LOADS, **more})


def compiled(thing: Any, **settings: Any) -> CompileRequest:
    return CompileRequest(thing, CompileOptions(ConversionSettings(**settings)))


def test_functions_of_time_in_loads_are_inputs() -> None:
    assert cart().inputs == {F: None, T: None}
    assert cart(loads=LOADS[:1]).inputs == {F: None}
    assert cart(loads=()).inputs == {}


def test_those_in_constraints_gravity_points_and_other_inputs_too() -> None:
    held = Constraint("held", SLIDE.coordinates[0] - h, "m")
    assert cart(loads=(), configuration_constraints=(held,)).inputs == {h: None}
    assert cart(loads=(), gravity=-h * GROUND.y).inputs == {h: None}
    assert cart(inputs={T: sin(h)}).inputs == {F: None, T: sin(h), h: None}


@pytest.mark.parametrize("given", [[F], F, ["F", T], {"F": None}], ids=str)
def test_they_are_given_as_a_list_by_symbol_or_by_name(given: Any) -> None:
    assert cart(inputs=given).inputs == {F: None, T: None}


def test_an_expression_brings_its_parameters() -> None:
    made = cart(inputs={"T": Symbol("a") * sin(t)}, parameters={"a": 2.0})
    assert made.inputs[T] == Symbol("a") * sin(t)
    assert float({p.symbol.name: p.default for p in made.parameters}["a"]) == 2.0


def test_one_that_is_not_there_or_of_another_argument_is_told() -> None:
    with pytest.raises(
        MechanismError, match=r"no specified function of time 'X' here; known: F, T"
    ):
        cart(inputs={"X": 1})
    bump = Function("bump")(SLIDE.coordinates[0])
    with pytest.raises(MechanismError, match="give it as an expression or as samples"):
        cart(loads=[(CART.masscenter, bump * GROUND.y + T * GROUND.x)])


def test_a_mechanism_written_by_hand_is_told_how_to_declare_them() -> None:
    made = cart()
    parts = {f.name: getattr(made, f.name) for f in fields(made)}
    with pytest.raises(MechanismError, match=r"declare it, inputs=\[F\] if it is given with a run"):
        Mechanism(**{**parts, "inputs": {}})
    with pytest.raises(MechanismError, match=r"declare it, parameters=\(\.\.\., mechc.Parameter\("):
        Mechanism(**{**parts, "parameters": ()})
    assert Mechanism(**{**parts, "inputs": [F, T]}).inputs == {F: None, T: None}


def test_name_defaults_inputs_and_parameters_are_taken() -> None:
    a = Symbol("a")
    request = compiled(
        cart(parameters={"m": 1.0}), name="mine", inputs={F: a * sin(t)},
        defaults={"k": 3.0, a: 2 * k}, parameters=("e",),
    )  # fmt: skip
    assert request.numbers == {m: 1.0, k: 3.0}
    made, _ = request.description()
    assert (made.name, made.title, request.title) == ("mine", "mine", "mine")
    assert made.inputs == {F: a * sin(t), T: None}
    default = {p.symbol.name: p.default for p in made.parameters}
    assert default["a"] == 2 * k
    assert {"a", "e"} <= default.keys()


def test_they_decide_the_digest_as_those_in_the_description_do() -> None:
    bound = compiled(cart(), inputs={"F": sin(t)}).digest
    assert bound == compiled(cart(inputs={F: sin(t)})).digest
    assert bound != compiled(cart()).digest
    least = cart(parameters={k: 3.0})
    assert compiled(least, defaults={"k": 2.0}).digest == compiled(least).digest


@pytest.mark.parametrize("name", SHIPPED)
def test_all_of_a_library_mechanism_is_in_its_digest(name: str) -> None:
    """Else it is derived again in each process, though it is in the cache."""
    made = shipped_mechanism(name)
    digest = compiled(made).digest
    assert digest is not None
    assert digest == compiled(shipped_mechanism(name)).digest


def test_triangles_of_a_picture_decide_the_digest() -> None:
    def drawn(triangles: bytes) -> Mechanism:
        part = Solid("mesh", "part", CART.masscenter, CART.frame, (1, 1, 1), triangles=triangles)
        made = cart()
        return replace(made, drawing=replace(made.drawing, solids=(part,)))

    one, other = (compiled(drawn(x)).digest for x in (bytes(36), bytes(72)))
    assert None not in (one, other)
    assert one != other


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"defaults": {"nope": 1.0}}, "defaults: there is no parameter 'nope' here"),
        ({"defaults": {"k": "f()"}}, r"defaults: k: 'f\(\)' is not an expression"),
        ({"inputs": {"nope": 1.0}}, "inputs: there is no specified function of time 'nope' here"),
        ({"inputs": {F: abs}}, "a Python function is not compiled"),
        ({"states": {"nope": F}}, "states: there is no function of time 'nope' here"),
        ({"states": {T: "F"}}, "states: T.* 'F' is not an expression"),
        ({"reactions": ["F"]}, "reactions is an option for SymPy objects"),
        ({"states": {T: F - T}, "defaults": {T: k}}, "the state T starts from a number"),
        ({"units": {"nope": "N/m"}}, "units: there is no symbol 'nope' here"),
        ({"units": {"k": "N/mm"}}, "units: k in 'N/mm': all values are in SI units"),
        ({"units": {"F": "kN"}}, "units: F in 'kN'"),
    ],
)
def test_others_are_told(settings: Any, message: str) -> None:
    with pytest.raises(MechanismError, match=message):
        compiled(cart(), **settings)


@pytest.mark.parametrize("key", [T, "T"], ids=str)
def test_states_are_given_in_the_description_or_when_it_is_compiled(key: Any) -> None:
    """An input with a rate is a state; what its rate contains is found, as in a description."""
    rate = (h - T) / Symbol("tau")
    made = cart(states={T: rate}, parameters={"tau": 0.1})
    later = with_settings(
        cart(), ConversionSettings(states={key: rate}, defaults={"tau": 0.1, key: 0.5})
    )
    assert [(x.symbol, x.rate) for x in later.states] == [(T, rate)]
    assert later.states[0].start == 0.5
    assert later.inputs == made.inputs == {F: None, h: None}
    assert {p.symbol.name for p in later.parameters} == {p.symbol.name for p in made.parameters}
    again = with_settings(made, ConversionSettings(states={T: -T}, units={T: "N m"}))
    assert [(x.rate, x.quantity.unit) for x in again.states] == [(-T, "N m")]


def test_units_are_given_in_the_description_or_when_it_is_compiled() -> None:
    units = {"k": "N/m", F: "N", "q_slide": "m", "m": "kg"}
    told = {
        printed: quantity for printed, quantity in _units(cart(units=units)).items() if quantity
    }
    assert told == {"k": "N/m", "F": "N", "q_slide": "m", "m": "kg", "u_slide": "m/s",
                    "q_pin": "rad", "u_pin": "rad/s"}  # fmt: skip
    later = with_settings(cart(), ConversionSettings(units=units))
    assert {k: x for k, x in _units(later).items() if x} == told
    assert next(p for p in later.parameters if p.symbol == m).quantity.kind == "mass"


def _units(made: Mechanism) -> dict[str, str]:
    kinds = made.coordinates, made.speeds, made.parameters
    found = {printed_name(x.symbol): x.quantity.unit for kind in kinds for x in kind}
    return found | {printed_name(f): unit for f, unit in made.input_units.items()}
