"""Every answer of a question has values, parameters, a start, a motion, a table and a file."""

import json

import numpy as np
import pytest

import mechc
from benchmarks.problems import optimal as problems
from tests.support.linkages.synthesis import bounds, coupler_points, four_bar
from tests.support.pendulums import van_der_pol

KNOWN = {
    "l_0": 0.5, "l_1": 1.2, "l_2": 1.1, "l_3": 1.4, "x_C": 0.7, "y_C": 0.6, "x_O": -0.2,
    "y_O": 0.1, "alpha": 0.3,
}  # fmt: skip
CRANK = np.linspace(0.0, 5.6, 9)


def fitted():
    model, t = mechc.load("pendulum", outputs=("energy", "sensitivities")), np.linspace(0, 2, 41)
    data = (t, model.simulate(2.0, {"theta_0": 0.8}, {"l_0": 1.3}, t_eval=t)["theta_0"])
    return model.fit(data, {"l_0": (0.3, 3.0)}, "theta_0", y0={"theta_0": 0.8, "omega_0": 0.0})


def synthesized():
    targets = {"C": coupler_points(KNOWN, CRANK)[0], "theta_0": CRANK}
    return four_bar().synthesize(targets, bounds(2.0), turns=True, samples=256, refined=8)[0]


ANSWERS = {
    "fit": (fitted, "l_0", 2.0),
    "optimise": (lambda: problems.double_integrator().optimise(solver="slsqp", intervals=4),
                 None, 4.0),
    "periodic": (lambda: van_der_pol().periodic({"q": 2.0}, 6.5, {"mu": 0.3}), "period", None),
    "synthesize": (synthesized, "l_1", None),
}  # fmt: skip


@pytest.mark.parametrize("verb", ANSWERS)
def test_what_every_answer_has(verb, tmp_path):
    ask, name, last = ANSWERS[verb]
    answer = ask()
    assert answer.status == "converged"
    assert answer.model.parameters == tuple(answer.model.system.parameters)
    assert answer.y0.shape == (len(answer.model.coordinates) + len(answer.model.speeds),)
    sol = answer.simulate() if verb != "synthesize" else answer.simulate(0.1)
    np.testing.assert_allclose(sol.y[0], answer.y0, atol=1e-12)
    assert last is None or sol.span[1] == pytest.approx(last)
    assert answer.simulate(0.01, rtol=1e-6).span == (0.0, 0.01)
    told = json.loads(answer.save(tmp_path / "answer.json").read_text())
    assert told["mechanism"] == answer.model.name
    assert told["values"] == pytest.approx(answer.values)
    if name:
        assert answer[name] == answer.values[name]
        assert f"<td style='text-align:left'>{name}</td>" in answer._repr_html_()
        assert f"{name} " in str(answer)
    assert answer.plot().axes
