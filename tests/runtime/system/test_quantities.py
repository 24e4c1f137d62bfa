"""Quantities that a text names: by numbers, and by the names of what their indices count."""

import numpy as np
import pytest

import mechc
from mechc.optimal.terms import read_terms
from mechc.system.quantities import outputs_in
from tests.support.linkages.jointed import four_bar

OUTPUTS = ("energy", "momenta", "points", "multipliers", "accelerations", "reactions")


@pytest.fixture(scope="module")
def model():
    return mechc.compile(four_bar(), outputs=OUTPUTS)


@pytest.fixture(scope="module")
def motion(model):
    params = {"l_3": 3.5}
    start = model.assemble({"q_0": 1.2}, speeds={"u_0": 1.0}, params=params)
    return model.simulate(0.3, start, params, t_eval=np.linspace(0, 0.3, 7))


COUNTED = {
    "linear_momenta": ("body_names", "xyz"),
    "angular_momenta": ("body_names", "xyz"),
    "points": ("point_names", "xyz"),
    "point_velocities": ("point_names", "xyz"),
    "point_accelerations": ("point_names", "xyz"),
    "reaction_forces": ("joint_names", "xyz"),
    "reaction_torques": ("joint_names", "xyz"),
    "multipliers": ("constraint_names",),
    "velocity_constraints": ("constraint_names",),
    "constraints": ("constraint_names",),
    "constraint_jacobian": ("constraint_names", "speeds"),
    "mass_matrix": ("speeds", "speeds"),
    "forcing": ("speeds",),
}


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("output", COUNTED)
def test_names_in_indices_name_the_number_that_their_place_has(model, motion, output):
    axes = [getattr(model, key, key) for key in COUNTED[output]]
    whole = motion.output(output)
    assert whole.shape[1:] == tuple(map(len, axes))
    for index in np.ndindex(whole.shape[1:]):
        named = ", ".join(names[i] for names, i in zip(axes, index, strict=True))
        mixed = ",".join([named.split(", ")[0], *map(str, index[1:])])
        for typed in (named, mixed, ",".join(map(str, index))):
            expected = whole[(slice(None), *index)]
            text = f"{output}[{typed}]"
            assert np.array_equal(motion[text], expected)
            assert np.array_equal(motion.output(text), expected)
            assert np.array_equal(model.output(text, motion.y, motion.params, motion.t), expected)


def test_rates_are_named_by_coordinates_and_speeds(model, motion):
    for k, name in enumerate((*model.coordinates, *model.speeds)):
        assert np.array_equal(motion[f"rates[{name}]"], motion.output("rates")[:, k])


def test_reductions_ends_of_runs_and_plots_take_names(model, motion):
    pairs = [
        ("mean(reaction_torques[J_0,z])", "mean(reaction_torques[0,2])"),
        ("max(abs(reaction_forces[J_3,y]), away=1ms)", "max(abs(reaction_forces[3,1]), away=1ms)"),
        ("max(multipliers[J_3 along ground_frame.x])", "max(multipliers[0])"),
    ]
    batch = model.simulate_batch(
        0.2, {"q_0": 1.2}, {"l_3": [3.5, 3.4]}, reduce=[one for pair in pairs for one in pair],
        until="points[J_2_rod_1_joint,y] > 100", progress=False,
    )  # fmt: skip
    for named, numbered in pairs:
        assert np.array_equal(batch[named], batch[numbered])
        assert np.isfinite(batch[named]).all()
    motion.plot("reaction_torques[J_0,z]")


@pytest.mark.slow
def test_expressions_and_derivatives_take_names(model, motion):
    texts = ["points[J_2_rod_1_joint, y]**2*q_0[0]", "points[2,1]**2*q_0[0]"]
    _, terms = read_terms(model.system, texts)
    assert len(terms.entries) == 1
    assert terms.expressions[0] == terms.expressions[1]
    assert terms.titles == texts
    named, numbered = (motion.gradient(end=f"points[{point}]", by=["l_1"])["l_1"]
                       for point in ("J_2_rod_1_joint,y", "2,1"))  # fmt: skip
    assert named == numbered != 0


def test_what_is_not_there_is_refused_with_what_is(motion):
    refused = {
        "reaction_torques[J_9,z]": "no joint is called 'J_9'; known are J_0, J_1, J_2, J_3",
        "reaction_torques[J_0,w]": "no axis is called 'w'; known are x, y, z",
        "linear_momenta[rod,x]": "no body is called 'rod'; known are rod_0, rod_1, rod_2",
        "multipliers[J_3]": "known are J_3 along ground_frame.x, J_3 along ground_frame.y",
        "rates[q_9]": "no coordinate or speed is called 'q_9'",
        "reaction_torques[J_0]": "from reaction_torques[0,0] to reaction_torques[3,2]",
        "reaction_torques[4,0]": "has the shape",
        "reaction_torques[]": "has the shape",
        "energy[J_0]": "one number",
        "q_0[J_0]": "one number",
    }
    for text, words in refused.items():
        with pytest.raises(mechc.MechcError, match=r".") as error:
            motion[text]
        assert words in str(error.value)


def test_names_in_indices_are_no_outputs():
    texts = ["max(reaction_torques[energy,z])", "points[multipliers, x] + kinetic_energy"]
    assert outputs_in(texts) == ["max", "reaction_torques", "points", "kinetic_energy"]
