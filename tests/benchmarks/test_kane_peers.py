"""What a user of sympy.physics.mechanics would use: notebooks, PyDy and Pinocchio as peers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp


def shortened(problem, t_end):
    """A four-bar problem that ends earlier, at a time whose state is known."""
    from _scene import reference

    exact = np.array(reference(problem.name)["states"][str(t_end)], float)
    return replace(problem, t_end=t_end, exact=exact)


def described(module, mechanism, start):
    """A problem with the defaults of its mechanism, which mechc need not compile."""
    n = len(mechanism.q)
    problem = module("_problem").Problem(
        name=mechanism.name, title=mechanism.title, mechanism=lambda: mechanism,
        start=np.array(start, float), t_end=0.5, quantities=(), exact=np.zeros(2 * n),
        observe=lambda y: y,
    )  # fmt: skip
    problem.__dict__["values"] = {p.symbol.name: float(p.default) for p in mechanism.parameters}
    return problem


def judged(module, cases, problem):
    timing = module("_timing")
    return timing.measure(cases, problem.error, timing.Effort(longest=np.inf, rounds=0))


def errors(cases, tool, method):
    """By tolerance, the loosest first."""
    found = [case for case in cases if (case.tool, case.method) == (tool, method)]
    return [case.error for case in sorted(found, key=lambda case: -case.tol)]


@pytest.mark.parametrize("solver", ["LU", "CRAMER"])
def test_a_notebooks_equations_are_those_of_the_model(module, solver):
    """Inverted without cse and solved with cse, along the motion, in the problem's own order."""
    problem, notebook = module("problems").problem("four_bar_regular"), module("peers.notebook")
    equations = module("_textbook").textbook(problem, solver)
    for end in (0.4, 1.3, 2.9):
        y = problem.model.simulate(end, problem.start, problem.params).y[-1]
        expected = problem.model.rhs(0.0, y, problem.params)
        for form in (notebook.inverting, notebook.solving):
            np.testing.assert_allclose(form(equations)(0.0, y), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("solver", ["LU", "CRAMER"])
def test_the_dependent_speeds_can_be_solved_for_at_the_start(module, solver):
    """With the links of a slider-crank in line; the crank's acceleration is that of its inertia.

    Crank 2 kg, 0.5 m about its pivot, rod 4 kg, 1 m: in line the rod's end does not move, so it
    turns with half the crank's rate and its inertia counts a quarter.
    """
    from mechc_codegen.library.planar.slider_crank import slider_crank

    problem = described(module, slider_crank(), [0.0, 0.0, 1.5, 0.0, 0.0, 0.0])
    equations = module("_textbook").textbook(problem, solver)
    rates = module("peers.notebook").inverting(equations)(0.0, problem.start)
    inertia = 2 * 0.5**2 / 3 + 4 * 1.0**2 / 3 / 4
    np.testing.assert_allclose(rates[3:], [10 / inertia, -5 / inertia, 0.0], atol=1e-12)


def test_pivots_are_the_largest_of_what_is_left(module):
    pivots = module("_textbook").pivots
    assert pivots(np.array([[0.0, 0.0, -1.0], [0.5, 2.0, 0.0]])) == ([1, 0], [1, 2])
    with pytest.raises(module("peers").NotExpressibleError, match="repeat others"):
        pivots(np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]]))


def test_repeated_constraints_are_not_given_to_kanes_method(module):
    from mechc_codegen.library.planar.slider_crank import slider_crank

    once = slider_crank()
    again = [replace(c, name=f"{c.name}, again") for c in once.configuration_constraints]
    twice = replace(once, configuration_constraints=(*once.configuration_constraints, *again[:1]))
    problem = described(module, twice, [0.1, -0.05, 1.49, 0.0, 0.0, 0.0])
    refused = module("peers").NotExpressibleError
    with pytest.raises(refused, match="repeat others"):
        module("_textbook").textbook(problem)


def test_a_notebooks_error_falls_with_the_tolerance(module):
    """Both tools on the smooth four-bar, the first also at the notebook's own tolerance."""
    problem = shortened(module("problems").problem("four_bar_regular"), 2.0)
    built = module("peers.notebook").build(problem, [1e-5, 1e-8, 1e-12])
    cases = judged(module, built.cases, problem)
    assert 1e-6 in [case.tol for case in cases if case.tool == "SymPy notebook"]
    for tool, method in (
        ("SymPy notebook", "RK45"),
        ("SymPy notebook, mended", "RK45"),
        ("SymPy notebook, mended", "DOP853"),
    ):
        loosest, *_, tightest = errors(cases, tool, method)
        assert tightest < 1e-2 * loosest, (tool, method)
        assert tightest < 1e-4, (tool, method)
    assert all(seconds > 0 for of in built.setup.values() for seconds in of.values())


def test_a_notebook_is_shown_to_leave_the_motion_at_a_change_point(module):
    """Its own tolerance, 2.5 s, two crossings: it finishes, and is called wrong."""
    problem = shortened(module("problems").problem("four_bar_change_point"), 2.5)
    built = module("peers.notebook").build(problem, [1e-6])
    own, *_ = judged(module, built.cases, problem)
    assert (own.tool, own.tol) == ("SymPy notebook", 1e-6)
    assert (own.status, own.label) == ("finished", "wrong")


def test_a_notebook_that_does_not_suit_the_problem_says_why(module):
    """RK45 on a stiff problem; too many operations to write out."""
    notebook, problem = module("peers.notebook"), module("problems").problem("four_bar_regular")
    stiff = replace(problem, stiff=True, t_end=1e-3)
    refused, *mended = judged(module, notebook.build(stiff, [1e-3]).cases, stiff)
    assert (refused.label, refused.tool) == ("flagged", "SymPy notebook")
    assert "the problem is stiff" in refused.status
    assert {case.method for case in mended} == {"LSODA", "Radau"}


def test_operations_are_counted_as_they_are_written_out(module):
    """What is shared counts each time it is printed."""
    import sympy

    x, y = sympy.symbols("x y")
    shared = sympy.sin(x + y)  # two operations
    count = module("_textbook").operations
    assert count(sympy.Matrix([shared, shared * x])) == 2 + 3


def test_pydy_is_not_given_time_by_itself(module):
    from mechc_codegen.library.planar.car_axis import car_axis

    problem = described(module, car_axis(), [0.0, 0.5, 1.0, 0.5, -0.5, 0.0, -0.5, 0.0])
    refused = module("peers").NotExpressibleError
    equations = module("_textbook").textbook(problem, "CRAMER")
    with pytest.raises(refused, match="time by itself"):
        module("peers.pydy_cython")._refuse_time(equations)


def test_pydys_error_falls_with_the_tolerance(module):
    """By both integrators, on the smooth four-bar; what it generates is compiled."""
    pytest.importorskip("pydy")
    problem = shortened(module("problems").problem("four_bar_regular"), 2.0)
    built = module("peers.pydy_cython").build(problem, [1e-5, 1e-9])
    cases = judged(module, built.cases, problem)
    for method in ("LSODA", "DOP853"):
        loose, tight = errors(cases, "PyDy", method)
        assert tight < 1e-2 * loose, method
        assert tight < 1e-5, method
    assert all(seconds > 0 for seconds in built.setup["PyDy"].values())


def mechanisms():
    """Mechanisms that Pinocchio has models of, each with a start that closes its loops."""
    from mechc_codegen.library.chains.pendulum import pendulum
    from mechc_codegen.library.chains.windows import windows
    from mechc_codegen.library.planar.andrews import andrews
    from mechc_codegen.library.planar.slider_crank import slider_crank
    from mechc_codegen.library.spatial.flyball_governor import flyball_governor
    from mechc_codegen.library.spatial.heavy_top import heavy_top

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
def test_a_model_of_pinocchio_moves_as_kanes_equations_say(module, name):
    """In mechc's coordinates at the end of a motion that starts with speeds or gains them."""
    pytest.importorskip("pinocchio")
    mechanism, start, t_end = mechanisms()[name]
    problem = described(module, mechanism, start)
    tree, pinocchio = module("_pinocchio_models").tree_of(problem), module("peers.pinocchio_tree")
    kane = module("peers.notebook").solving(module("_textbook").textbook(problem, "CRAMER"))

    def final(rates, y):
        solved = solve_ivp(rates, (0, t_end), y, method="DOP853", rtol=1e-10, atol=1e-10)
        return solved.y[:, -1]

    rates = (pinocchio.closed if tree.loops else pinocchio.opened)(tree)
    found, expected = tree.back(final(rates, tree.into(problem.start))), final(kane, problem.start)
    assert np.abs(expected - problem.start).max() > 0.1
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_pinocchios_error_falls_with_the_tolerance_and_it_too_leaves_the_motion(module):
    """On the smooth four-bar and through change points."""
    pytest.importorskip("pinocchio")
    build = module("peers.pinocchio_tree").build
    smooth = shortened(module("problems").problem("four_bar_regular"), 2.0)
    cases = judged(module, build(smooth, [1e-5, 1e-8]).cases, smooth)
    for method in ("RK45", "DOP853"):
        loose, tight = errors(cases, "Pinocchio", method)
        assert tight < min(1e-2 * loose, 1e-4), method
    crossing = shortened(module("problems").problem("four_bar_change_point"), 2.5)
    (case,) = [c for c in build(crossing, [1e-6]).cases if c.method == "RK45"]
    assert judged(module, [case], crossing)[0].label == "wrong"


def test_pinocchio_is_not_given_wheels_that_roll(module):
    from mechc_codegen.library.spatial.bicycle import bicycle

    rolling = replace(
        module("problems").problem("four_bar_regular"), name="bicycle", mechanism=bicycle
    )
    with pytest.raises(module("peers").NotExpressibleError, match="roll"):
        module("_pinocchio_models").tree_of(rolling)
