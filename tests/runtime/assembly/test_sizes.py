"""A four-bar in natural coordinates, lengths in mm as numbers, rows times 1e6 and 1e-6: every door
treats it as any other.  References: intersections of circles."""

import numpy as np
import pytest
import sympy as sm
import sympy.physics.mechanics as me

import mechc
from mechc.errors import AssemblyError
from tests.support.linkages import dyads

pytestmark = pytest.mark.slow  # two scenes of its own
UNIT = 70.0  # mm for each metre of the shape


def described(*factors):
    """Crank theta, coupler's end at (x, y): squares of two distances."""
    shape = dyads.four_bar(0.0).scaled(UNIT)
    theta, x, y, omega, v, w = me.dynamicsymbols("theta x y omega v w")
    t, frame, origin = me.dynamicsymbols._t, me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(frame, 0)
    pin = UNIT * (sm.cos(theta) * frame.x + sm.sin(theta) * frame.y)
    at = {"A": pin, "D": shape.known["D"][0] * frame.x, "B": x * frame.x + y * frame.y}
    closed = []
    for (a, b, length), factor in zip(shape.rods, factors, strict=True):
        rod = at[a] - at[b]
        closed.append(factor * (rod.dot(rod) - length**2))
    end = origin.locatenew("B", at["B"])
    end.set_vel(frame, v * frame.x + w * frame.y)
    crank = origin.locatenew("A", pin)
    crank.set_vel(frame, UNIT * omega * (-sm.sin(theta) * frame.x + sm.cos(theta) * frame.y))
    rates = {theta.diff(t): omega, x.diff(t): v, y.diff(t): w}
    kane = me.KanesMethod(
        frame, q_ind=[theta], u_ind=[omega], kd_eqs=[a - b for a, b in rates.items()],
        q_dependent=[x, y], u_dependent=[v, w], configuration_constraints=closed,
        velocity_constraints=[row.diff(t).xreplace(rates) for row in closed],
    )  # fmt: skip
    masses = [me.Particle("B", end, 1), me.Particle("A", crank, 1)]
    weight = -9810 * frame.y
    kane.kanes_equations(masses, [(end, weight), (crank, weight)])
    return kane


@pytest.fixture(scope="module")
def natural():
    return mechc.compile(described(1e6, 1e-6))


@pytest.fixture(scope="module")
def even():
    """Both rows times 1e-6."""
    return mechc.compile(described(1e-6, 1e-6))


def places(theta):
    """(x, y) in both assemblies, (2, 2)."""
    return dyads.four_bar(theta).scaled(UNIT).assemblies()[:, 0]


def rods(y):
    """By how much of its length each rod is too long (n, 2)."""
    crank = UNIT * np.stack([np.cos(y[:, 0]), np.sin(y[:, 0])], axis=1)
    pivot = UNIT * np.array([3.5, 0.0])
    lengths = [np.linalg.norm(y[:, 1:3] - end, axis=1) for end in (crank, pivot)]
    return np.stack(lengths, axis=1) / (UNIT * np.array([2.0, 3.0])) - 1


@pytest.mark.parametrize("theta", [0.4, 2.0, 5.0])
def test_both_assemblies_and_the_one_near_a_guess_are_found(natural, theta):
    expected = places(theta)
    found = natural.assemblies({"theta": theta}, {"omega": 2.0})
    order = np.argsort(expected[:, 0])
    np.testing.assert_allclose(found[:, 1:3], expected[order], rtol=0, atol=1e-11 * UNIT)
    assert np.abs(rods(found)).max() < 1e-14
    for place in expected:
        guess = {"x": place[0] + 0.2 * UNIT, "y": place[1] - 0.1 * UNIT}
        near = natural.assemble({"theta": theta}, guess=guess)
        np.testing.assert_allclose(near[1:3], place, rtol=0, atol=1e-11 * UNIT)


def test_speeds_are_those_of_the_rods(natural):
    states = natural.assemblies({"theta": 1.0}, {"omega": 2.0})
    by_circles = (places(1.0 + 1e-5) - places(1.0 - 1e-5)) / 1e-5
    expected = by_circles[np.argsort(places(1.0)[:, 0])]
    np.testing.assert_allclose(states[:, 4:6], expected, rtol=1e-7, atol=1e-7 * UNIT)
    with pytest.raises(AssemblyError, match="no speeds with omega = 2, v = 1000 "):
        natural.assemble({"theta": 1.0}, {"omega": 2.0, "v": 1e3})


def test_one_assembly_is_followed(natural):
    turn = np.linspace(0.2, 2 * np.pi, 60)
    sweep = natural.sweep_positions(
        "theta", turn, guess=dict(zip("xy", places(0.2)[0], strict=True))
    )
    expected = [places(theta)[0] for theta in turn]
    np.testing.assert_allclose(sweep.q[:, 1:3], expected, rtol=0, atol=1e-11 * UNIT)
    assert not len(sweep.change_points)


def test_a_crank_turns_round_and_its_coupler_reaches_as_far_as_it_can(natural):
    """The coupler's end moves on a circle about the pivot between the stretched positions."""
    ((low, high),) = natural.limits("theta")
    assert (low, high) == pytest.approx((-np.pi, np.pi))
    ranges = np.array(natural.limits("x")) / UNIT
    reach = [(3.5**2 + r**2 - 3.0**2) / 7.0 for r in (1.0, 3.0)]
    np.testing.assert_allclose([ranges.min(), ranges.max()], reach, atol=1e-7)


def test_equilibria_hang_at_the_least_height(even):
    """The two masses have the least height together where its slope along the crank vanishes."""
    found = even.equilibria()
    stable = [e.y for e in found if e.stable]
    assert np.abs(rods(np.array([e.y for e in found]))).max() < 1e-13
    for theta in np.array([e.y[0] for e in found]):
        slopes = [
            (a[1] - b[1]) / 2e-6 / UNIT + np.cos(theta)
            for a, b in zip(places(theta + 1e-6), places(theta - 1e-6), strict=True)
        ]
        assert np.abs(slopes).min() < 1e-7
    lowest = min(UNIT * np.sin(a) + y for a in np.linspace(0, 6.28, 300) for _, y in places(a))
    heights = [UNIT * np.sin(y[0]) + y[2] for y in stable]
    assert min(heights) == pytest.approx(lowest, abs=1e-3 * UNIT)


def test_a_state_with_ten_digits_starts_a_run_and_a_wrong_one_is_refused(even):
    y0 = even.assemble({"theta": 1.0}, {"omega": 2.0}, guess={"y": 200.0})
    typed = np.array([float(f"{x:.10g}") for x in y0])
    assert even.simulate(0.01, typed).status.code == "finished"
    off = y0 + np.array([0, 1e-3 * UNIT, 0, 0, 0, 0])
    with pytest.raises(AssemblyError, match=r"y0 leaves 'constraint \d' at"):
        even.simulate(0.01, off)
    off = y0 + np.array([0, 0, 0, 0, 0, 1e-3 * UNIT])
    with pytest.raises(AssemblyError, match=r"speeds of y0 open 'constraint \d' at"):
        even.simulate(0.01, off)


def test_what_does_not_close_says_what_was_met(natural):
    with pytest.raises(AssemblyError) as refusal:
        natural.assemble({"x": 9 * UNIT})
    told = str(refusal.value)
    assert "no configuration was found that closes the loops at x = 630" in told
    assert "the least gap met leaves 'constraint" in told
    assert "give a guess" in told
    assert " m." not in told
    with pytest.raises(AssemblyError, match="coordinates given leave 'constraint"):
        natural.assemble({"theta": 1.0, "x": 1.0, "y": 2.0})


def test_a_batch_starts_where_the_loops_close():
    model = mechc.compile(described(1e-6, 1e-6))
    crank = np.linspace(0.1, 6.0, 40)
    batch = model.simulate_batch(0.0, mechc.Assembly({"theta": crank}, guess={"y": 200.0}))
    y0 = np.asarray(batch["y0"])
    assert np.abs(rods(y0)).max() < 1e-13
    again = model.simulate_batch(0.0, np.round(y0, 9))
    np.testing.assert_array_equal(again["status"], batch["status"])


def test_rows_too_uneven_to_be_integrated_are_refused(natural):
    """Their sizes are told: times 1e6 and 1e-6."""
    y0 = natural.assemble({"theta": 1.0}, {"omega": 2.0}, guess={"y": 200.0})
    for refused in (
        lambda: natural.simulate(0.01, y0),
        natural.equilibria,
        lambda: natural.simulate_batch(0.01, y0[None]),
    ):
        with pytest.raises(AssemblyError, match=r"'constraint 1' changes .*e\+1\d times .*similar"):
            refused()
