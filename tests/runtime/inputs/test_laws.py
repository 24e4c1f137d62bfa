"""Inputs that are texts: read by the grammar of typed expressions, and compiled."""

from __future__ import annotations

import numpy as np
import pytest
from sympy import Symbol, sin, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    PrismaticJoint,
    RigidBody,
    dynamicsymbols,
)

import mechc
from benchmarks.problems.particle import particle
from mechc.errors import MechcError, MissingInputError, UnavailableOutputError, UnknownNameError
from mechc.inputs.accept import laws_apart

T = dynamicsymbols._t
X, V, F, G = dynamicsymbols("x v F G")
M, C = symbols("M c")
VALUES = {"M": 2.0, "c": 0.5}
START = np.array([0.1, 0.2])
LAW, LAW_OF_SYMPY = "3*sin(4*t) - c*v", 3 * sin(4 * T) - C * V


def _cart() -> KanesMethod:
    """A cart with a force F and a push G."""
    return particle([X], [V], [F + G - 9 * X], M)


def _joined() -> mechc.Mechanism:
    """The same cart, of a joint."""
    ground, cart = RigidBody("ground"), RigidBody("cart", mass=M)
    slide = PrismaticJoint("s", ground, cart, coordinates=X, speeds=V, joint_axis=ground.x)
    loads = [(cart.masscenter, (F + G - 9 * X) * ground.x)]
    return mechc.from_joints("cart", [slide], loads=loads, parameters={"M": 2.0})


@pytest.fixture(scope="module")
def end() -> np.ndarray:
    """The state to which the law of SymPy leads."""
    model = mechc.compile(_cart(), defaults=VALUES, inputs={F: LAW_OF_SYMPY, G: 1})
    return model.simulate(2.0, START).y[-1]


def test_a_text_is_compiled_as_the_expression_of_sympy_is(end: np.ndarray) -> None:
    model = mechc.compile(_cart(), defaults=VALUES, parameters=[C], inputs={"F": LAW, "G": "1"})
    assert model.inputs == ()
    assert (model.simulate(2.0, START).y[-1] == end).all()


@pytest.mark.parametrize("describe", [_cart, _joined])
def test_a_text_given_with_a_run_is_compiled_and_the_rest_stays(describe, end) -> None:
    model = mechc.compile(describe(), defaults=VALUES, parameters=[C])
    sol = model.simulate(2.0, START, inputs={F: LAW, "G": 1.0})
    np.testing.assert_allclose(sol.y[-1], end, atol=1e-10)
    assert (model.inputs, sol.model.inputs) == (("F", "G"), ("G",))
    assert sol.method == "gauss8", "a function of Python has another"
    assert sol.check().ok


def test_a_saved_run_asks_for_the_text_that_it_was_given(tmp_path) -> None:
    model = mechc.compile(_cart(), defaults=VALUES, parameters=[C], inputs={G: 1})
    file = model.simulate(2.0, START, inputs={"F": LAW}).save(tmp_path / "run.nc")
    with pytest.raises(MissingInputError, match="functions of Python or texts"):
        mechc.open(file, model)
    assert mechc.open(file, model.with_inputs({"F": LAW})).check().ok


def test_members_and_steppers_take_texts_too(end: np.ndarray) -> None:
    model = mechc.compile(_cart(), defaults=VALUES, parameters=[C])
    batch = model.simulate_batch(2.0, START, inputs={"F": LAW, "G": [1.0, 2.0]}, progress=False)
    np.testing.assert_allclose(batch.y[0], end, atol=1e-10)
    assert batch.model.inputs == ("G",)
    stepper = model.stepper(START, inputs={"F": LAW, "G": 1.0})
    np.testing.assert_allclose(stepper.step(2.0), end, atol=1e-8)


@pytest.mark.parametrize(("text", "told"), [
    ("__import__('os').abort()", "cannot read"),
    ("F + 1", "'F' is not known here"),
    ("wind*t", "'wind' is not known here"),
])  # fmt: skip
def test_texts_beyond_the_grammar_are_refused(text: str, told: str) -> None:
    with pytest.raises(MechcError, match=told):
        mechc.compile(_cart(), inputs={"F": text})
    model = mechc.compile(_cart(), defaults=VALUES, parameters=[C])
    with pytest.raises(MechcError, match=told):
        model.with_inputs({"F": text})


def test_names_and_a_description_are_needed() -> None:
    model = mechc.compile(_cart(), defaults=VALUES, parameters=[C])
    with pytest.raises(UnknownNameError, match="no input is called 'H'"):
        model.with_inputs({"H": LAW})
    bare = mechc.Model(model.system.replaced_scene(model.system.scene))
    bare.system.origin = None
    with pytest.raises(UnavailableOutputError, match="not its description"):
        bare.with_inputs({"F": "sin(t)"})


def test_a_symbol_that_is_printed_as_another_is_not_named_by_a_text() -> None:
    kane = particle([X], [V], [F - (Symbol("k") + Symbol("k", positive=True)) * X], M)
    with pytest.raises(MechcError, match="'k' is not known here"):
        mechc.compile(kane, inputs={"F": "k*t"})


def test_an_input_of_a_run_is_drawn(end: np.ndarray) -> None:
    model = mechc.compile(_cart(), defaults=VALUES, parameters=[C])
    sol = model.simulate(2.0, START, inputs={"F": lambda t: np.sin(3 * t), "G": 1.0})
    line = sol.plot("x", "F").axes[1].lines[0]
    np.testing.assert_allclose(line.get_ydata(), np.sin(3 * line.get_xdata()))


def test_numbers_as_texts_are_no_laws() -> None:
    numbers = {"F": "3", "G": "-2.5e-3", "H": "3 N", "I": 4.0}
    assert laws_apart(numbers) == ({}, numbers)
    assert laws_apart({F: "3*t", "G": "3"}) == ({"F": "3*t"}, {"G": "3"})
