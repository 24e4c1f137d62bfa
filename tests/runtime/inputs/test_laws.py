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


@pytest.mark.parametrize("describe", [_cart, _joined])
def test_another_number_compiles_nothing(describe) -> None:
    model = mechc.compile(describe(), defaults=VALUES, parameters=[C])
    laws = ("3*sin(4*t) - c*v", "5*sin(2.5*t) - c*v")
    slow, fast = (model.simulate(2.0, START, inputs={"F": law, "G": 1.0}) for law in laws)
    assert slow.model.system.reference.key == fast.model.system.reference.key
    numbers = [fast.model.defaults[f"F.{i}"] for i in (1, 2)]
    assert sorted(numbers) == [2.5, 5.0]
    function = {"F": lambda t, q, u: 5 * np.sin(2.5 * t) - 0.5 * u[0], "G": 1.0}
    np.testing.assert_allclose(
        fast.y[-1], model.simulate(2.0, START, inputs=function).y[-1], atol=1e-10
    )


def test_an_array_of_parameters_needs_no_numbers_of_laws() -> None:
    model = mechc.compile(_joined(), defaults=VALUES, parameters=[C])
    given, law = np.array([4.0, 0.25]), {"F": LAW, "G": 1.0}
    assert model.parameters == ("M", "c")
    by_name = model.simulate(2.0, START, {"M": 4.0, "c": 0.25}, inputs=law)
    assert (model.simulate(2.0, START, given, inputs=law).y[-1] == by_name.y[-1]).all()
    batch = model.simulate_batch(2.0, START, np.stack([given, given]), inputs=law, progress=False)
    np.testing.assert_allclose(batch.y[1], by_name.y[-1], atol=1e-10)
    with pytest.raises(MechcError, match=r"all 4 of them"):
        model.simulate(2.0, START, [1.0, 2.0, 3.0], inputs=law)
    with pytest.raises(MechcError, match=r"F.1 = -3 \(declared non-negative\) must be .* >= 0"):
        model.simulate(2.0, START, {"F.1": -3.0}, inputs=law)


def test_a_narrow_pulse_of_a_law_is_seen() -> None:
    """A bump of 1 ms: its impulse is sqrt(pi) milliseconds times 400 N."""
    model = mechc.compile(particle([X], [V], [F], M), defaults={"M": 2.0})
    sol = model.simulate(20.0, np.zeros(2), inputs={"F": "400*exp(-((t - 7.3)/0.001)^2)"})
    assert sol.y[-1, 1] == pytest.approx(0.4 * np.sqrt(np.pi) / 2.0, rel=1e-6)


@pytest.mark.slow
def test_derivatives_by_the_numbers_of_a_law() -> None:
    model = mechc.compile(_joined(), defaults=VALUES, parameters=[C])
    inputs = {"F": "3*sin(4*t) - c*v", "G": 1.0}
    driven = model.with_inputs(inputs)
    name = next(n for n in ("F.1", "F.2") if driven.defaults[n] == 3.0)
    sol = model.simulate(2.0, START, inputs=inputs, sensitivities=[name], rtol=1e-11)
    up, down = (
        model.simulate(2.0, START, {name: 3.0 + h}, inputs=inputs, rtol=1e-11).y[-1]
        for h in (1e-3, -1e-3)
    )
    np.testing.assert_allclose(sol.sensitivity[name][-1], (up - down) / 2e-3, rtol=1e-6)
