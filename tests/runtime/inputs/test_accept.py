"""A mechanism of joints with a motor: given with a run, or an expression when it is compiled."""

from __future__ import annotations

import numpy as np
import pytest
from sympy import Symbol, exp
from sympy.physics.mechanics import PrismaticJoint, RigidBody, dynamicsymbols

import mechc
from mechc.errors import MissingInputError

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
