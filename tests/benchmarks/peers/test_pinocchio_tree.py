"""Pinocchio as a peer: its models move as Kane's equations say."""

from dataclasses import replace

import numpy as np
import pytest
from mechc_codegen.library.chains.pendulum import pendulum
from mechc_codegen.library.chains.windows import windows
from mechc_codegen.library.planar.andrews import andrews
from mechc_codegen.library.planar.slider_crank import slider_crank
from mechc_codegen.library.spatial.bicycle import bicycle
from mechc_codegen.library.spatial.flyball_governor import flyball_governor
from mechc_codegen.library.spatial.heavy_top import heavy_top
from scipy.integrate import solve_ivp

from benchmarks import peers, problems
from benchmarks.formulations import textbook
from benchmarks.peers import notebook, pinocchio_tree
from tests.support.benchmarks.problems import described, errors, judged, shortened


def mechanisms():
    """Mechanisms that Pinocchio has models of, each with a start that closes its loops."""
    half = np.pi / 2
    return {
        "pendulum": (pendulum(3), [1.0, 1.2, 0.3, 0.1, 0.2, -0.4], 0.5),
        "heavy top": (heavy_top(), [0.2, 0.3, -0.1, 3.0, 15.0, -4.0], 0.15),
        "governor": (flyball_governor(), [0.3, 0.5, 0.5, 0.6, 6.0, 0.1, 0.2, -0.1], 2e-3),
        "slider-crank": (slider_crank(), [0.0, 0.0, 1.5, 0.0, 0.0, 0.0], 0.5),
        "window": (windows(1), [half, -half, -half, -1.0, 1.0, -1.0], 0.5),
        "Andrews": (
            andrews(),
            [-0.06171389001427645, 0.0, 0.45527981916307037, 0.22266839016588588,
             0.48736497954384256, -0.22266839016588588, 1.2305474445498212, *[0.0] * 7],
            5e-3,
        ),
    }  # fmt: skip


@pytest.mark.parametrize("name", list(mechanisms()))
def test_a_model_of_pinocchio_moves_as_kanes_equations_say(name):
    """In mechc's coordinates at the end of a motion that starts with speeds or gains them."""
    pytest.importorskip("pinocchio")
    mechanism, start, t_end = mechanisms()[name]
    problem = described(mechanism, start)
    tree = pinocchio_tree.tree_of(problem)
    kane = notebook.solving(textbook.textbook(problem, "CRAMER"))

    def final(rates, y):
        solved = solve_ivp(rates, (0, t_end), y, method="DOP853", rtol=1e-10, atol=1e-10)
        return solved.y[:, -1]

    rates = (pinocchio_tree.closed if tree.loops else pinocchio_tree.opened)(tree)
    found, expected = tree.back(final(rates, tree.into(problem.start))), final(kane, problem.start)
    assert np.abs(expected - problem.start).max() > 0.1
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_pinocchios_error_falls_with_the_tolerance_and_it_too_leaves_the_motion():
    """On the smooth four-bar and through change points."""
    pytest.importorskip("pinocchio")
    build = pinocchio_tree.build
    smooth = shortened(problems.problem("four_bar_regular"), 2.0)
    cases = judged(build(smooth, [1e-5, 1e-8]).cases, smooth)
    for method in ("RK45", "DOP853"):
        loose, tight = errors(cases, "Pinocchio", method)
        assert tight < min(1e-2 * loose, 1e-4), method
    crossing = shortened(problems.problem("four_bar_change_point"), 2.5)
    (case,) = [c for c in build(crossing, [1e-6]).cases if c.method == "RK45"]
    assert judged([case], crossing)[0].label == "wrong"


def test_pinocchio_is_not_given_wheels_that_roll():
    rolling = replace(problems.problem("four_bar_regular"), name="bicycle", mechanism=bicycle)
    with pytest.raises(peers.NotExpressibleError, match="roll"):
        pinocchio_tree.tree_of(rolling)
