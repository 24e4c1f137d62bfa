"""A mechanism of joints with a motor: given with a run, or an expression when it is compiled."""

from __future__ import annotations

import numpy as np
import pytest
from sympy import Symbol, exp
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, dynamicsymbols

import mechc
from mechc.errors import MechcError, MissingInputError

F, M, C, TIME = dynamicsymbols("F"), Symbol("M"), Symbol("c"), dynamicsymbols._t
GROUND, CART = RigidBody("ground"), RigidBody("cart", mass=M)
SLIDE = PrismaticJoint("slide", GROUND, CART, joint_axis=GROUND.x)


@pytest.fixture(scope="module")
def driven() -> mechc.Mechanism:
    loads = [(CART.masscenter, (F - C * SLIDE.speeds[0]) * GROUND.x)]
    return mechc.from_joints("cart", [SLIDE], loads=loads, parameters={"M": 2.0, "c": 0.5})


def test_a_motor_gets_its_value_with_a_run(driven: mechc.Mechanism) -> None:
    model = mechc.compile(driven)
    assert model.inputs == ("F",)
    with pytest.raises(MissingInputError, match="F"):
        model.simulate(1.0, {"q_slide": 0.0})
    sol = model.simulate(4.0, {"q_slide": 0.0}, inputs={"F": 3.0}, rtol=1e-10)
    np.testing.assert_allclose(sol["u_slide"], 6.0 * (1 - np.exp(-sol.t / 4.0)), atol=1e-8)


def test_name_defaults_and_inputs_of_compile_are_those_of_the_model(
    driven: mechc.Mechanism,
) -> None:
    law = Symbol("F_0") * exp(-TIME)
    model = mechc.compile(
        driven, name="rocket", inputs={F: law}, defaults={M: 1.0, "F_0": 3.0, "c": 0.0}
    )
    assert (model.name, model.title, model.inputs) == ("rocket", "rocket", ())
    sol = model.simulate(4.0, {"q_slide": 0.0}, rtol=1e-10)
    np.testing.assert_allclose(sol["u_slide"], 3.0 * (1 - np.exp(-sol.t)), atol=1e-8)


UNITS = {"F": "N", "c": "N s/m", "M": "kg"}


@pytest.mark.parametrize("given", ["3 N", "0.003 kN", (["0 ms", "4 s"], ["3 N", "3000 mN"])])
def test_inputs_and_parameters_have_units(driven: mechc.Mechanism, given: object) -> None:
    """Those that are given when it is compiled, and any where none is."""
    for units in (UNITS, None):
        model = mechc.compile(driven, units=units)
        start, params = {"q_slide": "0 mm"}, {"M": "2000 g", "c": "5e-4 N/(mm/s)"}
        sol = model.simulate("4 s", start, params, inputs={"F": given}, rtol=1e-10)
        np.testing.assert_allclose(sol["u_slide"], 6.0 * (1 - np.exp(-sol.t / 4.0)), atol=1e-8)
        stepper = model.stepper(start, params, inputs={"F": "0 N"})
        (_, speed) = stepper.step("500 ms", {"F": "3000 mN"})
        assert speed == pytest.approx(6.0 * (1 - np.exp(-0.125)))


def test_units_of_something_else_are_refused(driven: mechc.Mechanism) -> None:
    model = mechc.compile(driven, units=UNITS)

    def refused(words: str, value: object) -> None:
        with pytest.raises(MechcError, match=words):
            model.simulate(1.0, {"q_slide": 0.0}, inputs={"F": value})
        with pytest.raises(MechcError, match=words):
            model.simulate_batch(1.0, [0.0, 0.0], inputs={"F": value}, progress=False)

    refused("the input F: 'mm' in '3 mm' is not one of its units; use N, or another", "3 mm")
    refused("the input F: 'kg' in '3 kg'", (["0 s", "1 s"], ["3 N", "3 kg"]))
    refused("time.* of a signal: 'N' in '0 N' .* use s or ms", (["0 N", "1 s"], ["3 N", "3 N"]))
    with pytest.raises(MechcError, match="F: 'm' in '1 m' is not one of its units; use N"):
        model.stepper([0.0, 0.0], inputs={"F": 0.0}).step(0.1, {"F": "1 m"})
    with pytest.raises(MechcError, match=r"fix: c: 'kg' in '1 kg' .* use N s/m"):
        mechc.compile(driven, units=UNITS, fix={"c": "1 kg"})
    with pytest.raises(MechcError, match=r"defaults: c: 'kg' in '1 kg' .* use N s/m"):
        mechc.compile(driven, units=UNITS, defaults={"c": "1 kg"})


def test_a_unit_that_is_a_name_of_the_model_is_refused_where_none_is_known(
    driven: mechc.Mechanism,
) -> None:
    with pytest.raises(MechcError, match="F: c in '2 c' is a unit and a name of the model"):
        mechc.compile(driven).simulate(1.0, {"q_slide": 0.0}, inputs={"F": "2 c"})


def test_values_in_the_description_have_units() -> None:
    length = Symbol("l")
    arm = RigidBody("arm", mass=M)
    pin = PinJoint("pin", GROUND, arm, child_point=length * arm.y, joint_axis=GROUND.z)
    units = {length: "m", "M": "kg"}
    given = {M: "500 g", length: "30 mm"}
    made = mechc.from_joints("arm", [pin], parameters=given, units=units, start={"q_pin": "30 deg"})
    model = mechc.compile(made, fix={"M": "400 g"})
    assert (model.defaults, model.start) == ({"l": 0.03}, {"q_pin": np.radians(30)})
    assert model.data["fixed"] == {"M": 0.4}
    with pytest.raises(MechcError, match="M: 'm' in '1 m' is not one of its units; use kg or g"):
        mechc.from_joints("arm", [pin], parameters={M: "1 m"}, units=units)
    with pytest.raises(MechcError, match=r"start: q_pin: 'mm' in '1 mm' .* use rad or deg"):
        mechc.from_joints("arm", [pin], start={"q_pin": "1 mm"})


def test_a_motor_with_a_lag_is_a_state_when_it_is_compiled(driven: mechc.Mechanism) -> None:
    """F' = (3 - F)/tau from 1 N drives M v' = F - c v, whose solution is written out."""
    tau, given = Symbol("tau"), {"tau": "500 ms", "F": "1 N", "M": 2.0, "c": 0.5}
    model = mechc.compile(driven, states={F: (3 - F) / tau}, units=UNITS, defaults=given)
    assert (model.states, model.inputs, model.units["F"]) == (("F",), (), "N")
    sol = model.simulate(4.0, {"q_slide": 0.0}, rtol=1e-11)
    np.testing.assert_allclose(sol["F"], 3 - 2 * np.exp(-2 * sol.t), atol=1e-9)
    speed = 6 + 2 / 3.5 * np.exp(-2 * sol.t) - (6 + 2 / 3.5) * np.exp(-sol.t / 4)
    np.testing.assert_allclose(sol["u_slide"], speed, atol=1e-9)


def test_a_table_of_the_motion_has_the_inputs(driven: mechc.Mechanism) -> None:
    pytest.importorskip("pandas")
    model = mechc.compile(driven)
    sol = model.simulate(1.0, {"q_slide": 0.0}, inputs={"F": ([0.0, 1.0], [1.0, 3.0])})
    table = sol.to_dataframe()
    np.testing.assert_allclose(table["F"], 1.0 + 2.0 * sol.t, rtol=1e-14)
    assert not table["F"].isna().any()
