"""Sensitivities of open scenes: every method, inputs, states, outputs, and what is refused."""

import numpy as np
import pytest
from mechc_codegen.library.chains.pendulum import pendulum
from sympy import Symbol, cos
from sympy.physics.mechanics import KanesMethod, dynamicsymbols

import mechc
from tests.support.differences import apart, extrapolated
from tests.support.pendulums import bob_on_a_rod

METHODS = {"gauss8": 1e-9, "dop853": 1e-9, "dopri5": 1e-8, "radau5": 1e-8}
GIVEN = {"m": 1.3, "l": 0.8, "g": 9.81, "c": 0.4}
START = {"q": 0.7, "u": -0.5}
T = 2.0


@pytest.fixture(scope="module")
def swing():
    """A damped pendulum with a torque that is given with a run."""
    t = dynamicsymbols._t
    q, u, torque = dynamicsymbols("q u F")
    m, l, g, c = (Symbol(name) for name in "mlgc")
    r, e, _, bob = bob_on_a_rod(q, u, m, l, g)
    method = KanesMethod(r, [q], [u], [q.diff(t) - u])
    method.kanes_equations([bob], [(bob.point, -m * g * r.y), (e, (torque - c * u) * r.z)])
    own = {"push": torque * u, "pull": m * l * u**2 + m * g * cos(q) + u.diff(t)}
    return mechc.compile(
        method, name="swing", defaults=GIVEN, outputs=("energy", "points", "sensitivities", own)
    )


def end(model, name, start=START, torque=0.3, of=None):
    """The end of a tight run as a function of the change of one name."""

    def run(change):
        y0, params, inputs = dict(start), dict(GIVEN), {"F": torque}
        for given in (y0, params, inputs):
            if name in given:
                given[name] += change
        sol = model.simulate(T, y0, params, inputs=inputs, rtol=1e-13)
        if of is None:
            return sol.y[-1]
        return np.atleast_1d(sol.model.output(of, sol.y[-1], sol.params, T))

    return run


def test_several_names_are_columns_side_by_side(swing):
    sol = swing.simulate(T, START, GIVEN, inputs={"F": 0.3}, sensitivities=["l", "y0", "c"])
    for output, shape in (("energy", ()), ("points", (len(swing.point_names), 3))):
        found = sol.sensitivity_of(output, ["c", "y0", Symbol("l")])
        assert found.shape == (len(sol.t), *shape, 4)
        np.testing.assert_array_equal(found[..., 0], sol.sensitivity_of(output, "c"))
        np.testing.assert_array_equal(found[..., 1:3], sol.sensitivity_of(output, "y0"))
        np.testing.assert_array_equal(found[..., 3], sol.sensitivity_of(output, "l"))
    with pytest.raises(mechc.UnknownNameError, match="'m'"):
        sol.sensitivity_of("energy", ("c", "m"))


@pytest.mark.parametrize("method", METHODS)
def test_every_method_differentiates_its_own_steps(swing, method):
    names = ("l", "c", "F", "q", "u")
    sol = swing.simulate(
        T, START, GIVEN, inputs={"F": 0.3}, method=method, rtol=1e-9, sensitivities=names
    )
    for name in names:
        wanted = extrapolated(end(swing, name), 0.01)
        assert apart(sol.sensitivity[name][-1], wanted) < METHODS[method], name
    assert sol.sensitivity.notes == ()


def test_the_motion_is_the_same_to_the_last_bit(swing):
    plain = swing.simulate(T, START, inputs={"F": 0.3})
    sol = swing.simulate(T, START, inputs={"F": 0.3}, sensitivities=["l", "q"])
    np.testing.assert_array_equal(plain.t, sol.t)
    np.testing.assert_array_equal(plain.y, sol.y)


def test_between_the_steps_and_at_t_eval(swing):
    times = np.linspace(0, T, 23)
    by = ["l", "y0"]
    sol = swing.simulate(T, START, inputs={"F": 0.3}, rtol=1e-10, sensitivities=by, t_eval=times)
    tight = swing.simulate(T, START, inputs={"F": 0.3}, rtol=1e-13, max_step=0.01, sensitivities=by)
    for name, there in tight.sensitivity(times).items():
        assert apart(sol.sensitivity[name], there) < 1e-8
    assert sol.sensitivity["y0"].shape == (23, 2, 2)
    np.testing.assert_array_equal(sol.sensitivity["y0"][0], np.eye(2))
    shaped = sol.sensitivity(times[:6].reshape(2, 3))
    assert shaped["l"].shape == (2, 3, 2)
    assert shaped["y0"].shape == (2, 3, 2, 2)


def test_over_a_jump_of_a_signal(swing):
    steps = mechc.Signal([0.0, 0.7, 1.1, 3.0], [0.3, -0.8, 0.5, 0.5], "previous")
    found = {}
    for method in ("gauss8", "dop853", "radau5"):
        sol = swing.simulate(
            T, START, inputs={"F": steps}, method=method, rtol=1e-11, sensitivities=["c"]
        )
        found[method] = sol.sensitivity["c"][-1]

    def run(change):
        params = {"c": GIVEN["c"] + change}
        return swing.simulate(T, START, params, inputs={"F": steps}, rtol=1e-13).y[-1]

    wanted = extrapolated(run, 0.01)
    assert apart(found["gauss8"], wanted) < 1e-10
    assert apart(found["dop853"], wanted) < 1e-10
    assert apart(found["radau5"], wanted) < 1e-9


@pytest.mark.parametrize("output", ["kinetic_energy", "pull", "push"])
@pytest.mark.parametrize("name", ["l", "m", "F"])
def test_outputs_follow(swing, output, name):
    sol = swing.simulate(T, START, inputs={"F": 0.3}, rtol=1e-11, sensitivities=[name])
    wanted = extrapolated(end(swing, name, of=output), 0.01)
    found = sol.sensitivity_of(output, name)
    assert found.shape == sol.t.shape
    assert abs(found[-1] - wanted[0]) < 1e-8 * max(1.0, abs(wanted[0]))


def test_energy_coordinates_and_points(swing):
    sol = swing.simulate(T, START, inputs={"F": 0.3}, sensitivities=["l", "q"])
    parts = [sol.sensitivity_of(f"{kind}_energy", "l") for kind in ("kinetic", "potential")]
    np.testing.assert_allclose(sol.sensitivity_of("energy", "l"), sum(parts), rtol=1e-13)
    np.testing.assert_array_equal(sol.sensitivity_of("q", "l"), sol.sensitivity["l"][:, 0])
    l, q, by_l = GIVEN["l"], sol["q"], sol.sensitivity["l"][:, 0]
    moved = np.stack([np.cos(q) - l * np.sin(q) * by_l, np.sin(q) + l * np.cos(q) * by_l], -1)
    found = sol.sensitivity_of("points", "l")
    tip = swing.point_names
    np.testing.assert_allclose(found[:, tip.index("P"), :2], moved, rtol=1e-9, atol=1e-12)
    times = np.array([0.3, 1.2])
    np.testing.assert_allclose(
        sol.sensitivity_of("q", "q", times), sol.sensitivity(times)["q"][:, 0], rtol=1e-14
    )


def test_a_run_that_was_continued(swing):
    whole = swing.simulate(T, START, inputs={"F": 0.3}, rtol=1e-11, sensitivities=["c", "q"])
    backward = swing.simulate((T, 0.0), whole.y[-1], inputs={"F": 0.3}, rtol=1e-11,
                              sensitivities=["y0"])  # fmt: skip
    forth = swing.simulate(T, START, inputs={"F": 0.3}, rtol=1e-11, sensitivities=["y0"])
    product = backward.sensitivity["y0"][-1] @ forth.sensitivity["y0"][-1]
    np.testing.assert_allclose(product, np.eye(2), atol=1e-8)


def test_what_is_refused_is_named(swing):
    held = {"F": 0.3}
    with pytest.raises(mechc.UnknownNameError, match="mass"):
        swing.simulate(T, START, inputs=held, sensitivities=["mass"])
    with pytest.raises(mechc.MechcError, match="by F needs a number or a signal"):
        swing.simulate(T, START, inputs={"F": lambda t: t}, sensitivities=["F"])
    with pytest.raises(mechc.MechcError, match="u is not given"):
        swing.simulate(T, {"q": 0.5}, inputs=held, sensitivities=["u"])
    plain = swing.simulate(T, START, inputs=held)
    with pytest.raises(mechc.MechcError, match="this run has no derivatives"):
        _ = plain.sensitivity
    sol = swing.simulate(T, START, inputs=held, sensitivities=["l"])
    with pytest.raises(mechc.UnknownNameError, match="'c'"):
        sol.sensitivity["c"]
    with pytest.raises(mechc.UnknownNameError, match="momentum"):
        sol.sensitivity_of("momentum", "l")
    with pytest.raises(mechc.ValueOutOfBoundsError):
        sol.sensitivity(2 * T)


def test_a_terminal_event_ends_them(swing):
    still = mechc.Event(lambda t, y: y[1], terminal=True)
    sol = swing.simulate(T, START, inputs={"F": 0.3}, events=still, sensitivities=["l"])
    whole = swing.simulate(T, START, inputs={"F": 0.3}, sensitivities=["l"])
    assert sol.t[-1] < T
    there = whole.sensitivity(sol.t[-1])["l"]
    np.testing.assert_allclose(sol.sensitivity["l"][-1], there, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("output", ["point_accelerations", "pulls"])
def test_outputs_of_the_accelerations_follow(output):
    """They reach the accelerations by way of what they have in common."""
    two = pendulum(2)
    twice = two.u[0].diff(dynamicsymbols._t) ** 2 * cos(two.q[1])
    pulls = {"pulls": [twice, 3 * twice + two.q[0]]}
    model = mechc.compile(two, outputs=("accelerations", "sensitivities", pulls))
    start, name = {"theta_0": 0.4, "theta_1": -0.9, "omega_0": 1.0}, "l_0"

    def after(change):
        params = {name: 0.8 + change}
        y = model.simulate(1.0, start, params, rtol=1e-13).y[-1]
        return np.ravel(model.output(output, y, params))

    sol = model.simulate(1.0, start, {name: 0.8}, rtol=1e-11, sensitivities=[name])
    found = sol.sensitivity_of(output, name)[-1]
    assert apart(np.ravel(found), extrapolated(after, 0.004)) < 1e-7
