"""Arguments of model.optimise: what is refused, in words."""

import numpy as np
import pytest
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems import optimal as problems
from mechc.optimal.question import _conditions


@pytest.fixture(scope="module")
def cart():
    return problems.double_integrator().model


@pytest.mark.parametrize(
    ("error", "words", "arguments", "options"),
    [
        ("ValueOutOfBoundsError", "nothing is to be least", (1.0, [0, 0], {"F": None}), {}),
        ("UnknownNameError", "no input is called 'G'", (1.0, [0, 0], {"G": None}), {}),
        ("ExpressionError", "'xx' is not known here", (1.0, [0, 0], {"F": None}),
         {"final": "xx", "end": {}}),
        ("UnknownNameError", "parameter, coordinate or speed", (1.0, {"x": 0}, {"F": None}),
         {"final": "x", "free": {"k": None}}),
        ("ValueOutOfBoundsError", "lower bound 2 must be below 1", (1.0, [0, 0], {"F": (2, 1)}),
         {"final": "x"}),
        ("ValueOutOfBoundsError", "do not rise", ((3.0, 1.0), [0, 0], {"F": None}), {"final": "x"}),
        ("ValueOutOfBoundsError", "two bounds", ((1, 2, 3), [0, 0], {"F": None}), {"final": "x"}),
        ("ValueOutOfBoundsError", "y0 as a mapping", (1.0, [0, 0], {"F": None}),
         {"final": "x", "free": {"x": (0, 1)}}),
        ("ValueOutOfBoundsError", "(lower, upper)", (1.0, [0, 0], {"F": None}),
         {"final": "x", "end": {"x*v": (1, 2, 3)}}),
        ("ValueOutOfBoundsError", "value at the start", (1.0, [0, 0], {"F": None}),
         {"final": "x[1]"}),
        ("UnknownNameError", "no solver is called 'snopt'", (1.0, [0, 0], {"F": None}),
         {"final": "x", "solver": "snopt"}),
        ("ValueOutOfBoundsError", "intervals", (1.0, [0, 0], {"F": None}),
         {"final": "x", "intervals": 0}),
        ("ValueOutOfBoundsError", "x is a finite number", (1.0, [0, 0], {"F": None}),
         {"final": "x", "end": {"x": float("inf")}}),
        ("ValueOutOfBoundsError", "2*x is a finite number", (1.0, [0, 0], {"F": None}),
         {"final": "x", "end": {"2*x": float("inf")}}),
        ("MissingInputError", "F", (1.0, [0, 0]), {"final": "x", "solver": "slsqp"}),
    ],
)  # fmt: skip
def test_refused(cart, error, words, arguments, options):
    family = mechc.MechcError if error == "ExpressionError" else getattr(mechc, error)
    with pytest.raises(family) as caught:
        cart.optimise(*arguments, **options)
    assert words in str(caught.value)


def test_a_drive_in_time_keeps_the_duration(cart):
    with pytest.raises(mechc.MechcError, match="time in the equations drives"):
        cart.optimise((1.0, 2.0), [0.0, 0.0], final="x", inputs={"F": "sin(3*t)"})
    pushed = mechc.Signal([0.0, 1.5], [0.0, 1.0], "linear")
    with pytest.raises(mechc.MechcError, match="F drives the motion"):
        cart.optimise((1.0, 2.0), [0.0, 0.0], final="x", inputs={"F": pushed})


def test_events_in_time_keep_the_duration(cart):
    moving = mechc.Stop("5 - x + t", restitution=0.5)
    kick = mechc.Event("x - 1", reset={"v": "v + t"})
    late = mechc.Event(lambda t, y: t - 0.8, reset=lambda t, q, u: (q, u))
    for event in (mechc.Event("t - 0.8", reset={"v": "v + 1"}), moving, kick, late):
        with pytest.raises(mechc.MechcError, match="time in event 0 drives"):
            cart.optimise((1.0, 2.0), [0.0, 0.0], {"F": (-1, 1)}, final="x", events=[event])


def test_a_pulse_that_begins_late_keeps_the_duration(cart):
    pulse = mechc.Signal([0.0, 1.5, 1.51, 9.0], [0.0, 1.0, 0.0, 0.0], "previous")
    with pytest.raises(mechc.MechcError, match="F drives the motion"):
        cart.optimise((1.0, 2.0), [0.0, 0.0], final="x", inputs={"F": pulse})


def test_a_model_with_its_own_duration():
    duration, speed = dynamicsymbols("duration speed")
    system = mechc.from_equations([duration], [speed], None, [0])
    model = mechc.compile(system, outputs=("sensitivities",))
    with pytest.raises(mechc.ValueOutOfBoundsError, match="duration is that of the motion"):
        model.optimise((0.5, 3.0), [0.0, 1.0], final="duration")


def test_models_without_derivatives_have_no_rows_of_them():
    assert mechc.load("pendulum").system.derivative_rows == {}


def test_parameters_that_a_whole_state_of_loops_does_not_follow():
    bar = mechc.load("four_bar", outputs=("sensitivities",))
    y0 = bar.assemble({"theta_0": 1.2}, params={"l_3": 3.5})
    with pytest.raises(mechc.MechcError, match="y0 as a mapping"):
        bar.optimise(1.0, y0, params={"l_3": 3.5}, free={"l_1": (1.5, 2.5)}, final="theta_1")


def test_quaternions_of_length_one():
    body = mechc.load("rigid_body", outputs=("energy", "sensitivities"))
    with pytest.raises(mechc.MechcError, match="FreeJoint"):
        body.optimise(1.0, body.assemble(), final=body.speeds[0])


def test_conditions_take_units_and_expressions():
    system = mechc.load("pendulum").system
    angle, speed = system.coordinates[0], system.speeds[0]
    found = _conditions(
        system, {angle: "90deg", speed: (-1.0, None), f"{angle}*{speed}": (None, 2.0)}, "end"
    )
    assert found.components[0] == pytest.approx((np.pi / 2, np.pi / 2))
    assert found.components[1] == (-1.0, np.inf)
    assert found.others == [(f"{angle}*{speed}", -np.inf, 2.0)]
