"""Contact that lasts and dry friction, against closed forms and a scheme of time steps."""

import numpy as np
import pytest
import sympy
from mpmath import asin, ellipf, ellipk, mpf, pi, sin, sqrt, workdps

import mechc
from mechc.errors import EventError, InputError, MechcError, ValueOutOfBoundsError
from tests.support.impacts import TIP_GAP, TIP_SLIP, G, block, impacts, rod


@pytest.fixture(scope="module", name="block")
def block_on_a_slope():
    return block()


@pytest.fixture(scope="module", name="rod")
def rod_on_a_floor():
    return rod()


def at_the_tip(theta, slip, omega):
    """A rod whose tip is on the floor and moves along it."""
    s, c = np.sin(theta), np.cos(theta)
    return np.array([0.0, s, theta, slip - s * omega, c * omega, omega])


def words(sol):
    return [part.contacts for part in sol.segments if part.contacts]


# -- contact that lasts ----------------------------------------------------------------------------


def test_a_ball_bounces_ever_less_and_then_rests(ball):
    sol = ball.simulate(20.0, [1.0, 0.0], events=mechc.Stop("q_0", 0.9), rtol=1e-12)
    assert sol.status.ok
    np.testing.assert_allclose(sol.events[0].t[:100], impacts(0.9, 100), rtol=0, atol=1e-12)
    rest = sol.segments[-1]
    assert rest.contacts == ("held",)
    assert rest.t0 == pytest.approx(np.sqrt(2 / G) * 19.0, abs=1e-9)
    assert np.abs(sol(np.linspace(rest.t0, 20.0, 50))).max() < 1e-15
    assert sol.energy_drift < 1e-12
    assert sol.work[-1] == pytest.approx(-G, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("height", [1.0, 1e4])
@pytest.mark.parametrize("friction", [{}, {"friction": 0.3, "slip": "v_x"}])
def test_far_from_the_origin_a_ball_rests_no_earlier(block, height, friction):
    """There a gap is a difference of large numbers: what is rounding of it is no impact."""
    stop, e, upright = mechc.Stop(f"y - {height}", 0.5, **friction), 0.5, {"a": 0.0}
    sol = block.simulate(2.0, [0, height + 1, 0, 0], upright, events=stop, rtol=1e-12)
    assert not sol.status.warnings
    assert words(sol)[-1][0] in ("held", "sticks")
    shortest = np.sqrt(256 * np.finfo(float).eps * height / G)  # s, of flights told from none
    assert sol.segments[-1].t0 == pytest.approx(np.sqrt(2 / G) * 3.0, abs=2 * shortest / (1 - e))
    count = len(sol.events[0].t)
    assert count >= (22 if height == 1.0 else 16)
    np.testing.assert_allclose(sol.events[0].t, impacts(e, count), atol=2 * shortest)


def between_stops(low, high, e, omega):
    """Times of the impacts of a pendulum of 1 m that leaves its lower stop upwards, and of its
    rest, in elliptic integrals; angles from the vertical."""
    w, t, hits = sqrt(mpf(G)), mpf(0), ([], [])
    ends = [sin(x / 2) ** 2 for x in (low, high)]

    def way(number, k2):
        """From the lower stop to the upper one, or to where it turns."""
        top = asin(sqrt(ends[1] / k2)) if number else pi / 2
        return (ellipf(top, k2) - ellipf(asin(sqrt(ends[0] / k2)), k2)) / w

    while omega > mpf(10) ** -12:
        k2 = ends[0] + (omega / (2 * w)) ** 2
        reaches = ends[1] < k2
        t += way(reaches, k2)
        if reaches:
            hits[1].append(t)
            k2 = ends[1] + e**2 * (k2 - ends[1])
        t += way(reaches, k2)
        hits[0].append(t)
        omega = e * 2 * w * sqrt(k2 - ends[0])
    return hits, t


@pytest.mark.slow
def test_a_pendulum_between_two_stops_comes_to_rest():
    stops = [mechc.Stop("theta_0 - 0.2", 0.8), mechc.Stop("0.6 - theta_0", 0.8)]
    model = mechc.load("pendulum")
    sol = model.simulate(8.0, [0.2, 5.0], events=stops, rtol=1e-12)
    with workdps(25):
        hits, rest = between_stops(mpf(0.2), mpf(0.6), mpf(0.8), mpf(5))
    assert sol.status.ok
    assert not sol.status.warnings
    assert len(sol.events[1].t) == len(hits[1]) == 3
    np.testing.assert_allclose(sol.events[1].t, np.array(hits[1], float), rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        sol.events[0].t[:30], np.array(hits[0][:30], float), rtol=0, atol=1e-12
    )
    assert sol.segments[-1].contacts == ("held", "open")
    assert sol.segments[-1].t0 == pytest.approx(float(rest), abs=1e-6)
    assert np.diff(sol.energy).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("friction", [{}, {"friction": 0.3, "slip": "u_1"}])
@pytest.mark.parametrize("e", [0.0, 0.8])
def test_a_grazing_impact_is_one_or_none_and_flagged(five_springs, e, friction):
    """An oscillator of amplitude 1 + d and a wall at 1 m."""
    stop = mechc.Stop("q_0 + 1", e, **friction)
    for d in (1e-4, 1e-8, 1e-10, 1e-13, 0.0, -1e-13, -1e-10, -1e-8, -1e-4):
        sol = five_springs.simulate(4.0, [1.0 + d, *np.zeros(9)], events=stop, rtol=1e-9)
        assert sol.status.ok
        assert ("grazing" in str(sol.status)) == (abs(d) < 1e-6)
        if abs(d) > 1e-12:  # beyond the rounding of the place, not of its time
            assert len(sol.events[0].t) == (d > 0)


def test_a_plastic_impact_and_a_start_on_the_floor_rest_at_once(ball):
    for height, impacts_there in ((1.0, 1), (0.0, 0)):
        sol = ball.simulate(2.0, [height, 0.0], events=mechc.Stop("q_0"))
        assert sol.status.ok
        assert len(sol.events[0].t) == impacts_there
        assert words(sol) == [("open",)] * impacts_there + [("held",)]
        assert abs(sol.y[-1]).max() < 1e-15


def test_a_block_slides_where_a_reset_has_made_the_slope_steeper(block):
    """It sticks until then, and the angle is a parameter; the force is that of the new one."""
    stop = mechc.Stop("y", friction=0.5, slip="v_x")
    steeper = mechc.Event("t - 1", reset={"a": "2*a"})
    sol = block.simulate(2.0, np.zeros(4), events=[stop, steeper], rtol=1e-12)
    assert words(sol) == [("sticks", ""), ("slides -", "")]
    along = G * (np.sin(0.6) - 0.5 * np.cos(0.6))
    np.testing.assert_allclose(sol([1.0, 1.5, 2.0])[:, 0], -along * np.array([0, 0.125, 0.5]),
                               atol=1e-12)  # fmt: skip
    assert sol.params_at(1.5)[list(block.parameters).index("a")] == 0.6


def test_a_reset_takes_the_table_away(ball):
    """A ball that lay on it falls to where the table is then; into the ball it cannot go."""
    stop = mechc.Stop("q_0 - h", "e")
    lower = mechc.Event("t - 1", reset={"h": "h - 1"})
    sol = ball.simulate(3.0, [0.0, 0.0], events=[stop, lower], rtol=1e-12)
    count = len(sol.events[0].t)
    assert count > 20
    np.testing.assert_allclose(sol.events[0].t, 1.0 + impacts(0.5, count), atol=1e-9)
    assert sol.y[-1, 0] == pytest.approx(-1.0, abs=1e-14)
    higher = mechc.Event("t - 1", reset={"h": "h + 1"})
    with pytest.raises(EventError, match="so the parts overlap"):
        ball.simulate(3.0, [0.0, 0.0], events=[stop, higher])


def test_a_mass_leaves_a_table_that_vibrates_where_its_acceleration_is_that_of_gravity(ball):
    """A sin(w t) from rest on it; then a flight that is a parabola, and contact again."""
    A, w = 0.2, 10.0
    sol = ball.simulate(2.0, [0.0, 2.0], events=mechc.Stop(f"q_0 - {A}*sin({w}*t)"), rtol=1e-12)
    assert sol.status.ok
    assert not sol.status.warnings
    lifts = [part for part in sol.segments if part.contacts == ("open",)]
    first = np.arcsin(G / (A * w**2)) / w
    for k, part in enumerate(lifts):  # all alike: every landing is plastic
        periods = round((part.t0 - first) / (2 * np.pi / w))
        assert periods >= k
        assert part.t0 == pytest.approx(first + periods * 2 * np.pi / w, abs=1e-11)
        since = part.t1 - part.t0
        flight = A * np.sin(w * part.t0) + A * w * np.cos(w * part.t0) * since - G / 2 * since**2
        if part is not lifts[-1]:
            assert flight == pytest.approx(A * np.sin(w * part.t1), abs=1e-10)
    assert len(lifts) >= 3
    held = [part for part in sol.segments if part.contacts == ("held",)]
    for part in held:
        t = np.linspace(part.t0, part.t1, 9)[:-1]
        np.testing.assert_allclose(sol(t)[:, 0], A * np.sin(w * t), atol=1e-12)


def test_what_has_rested_on_a_table_bounces_again(ball):
    stop = mechc.Stop("q_0 - 1 - sin(10*t)/5", 0.3)
    sol = ball.simulate(0.6, [1.0, 2.0], events=stop, rtol=1e-11)
    assert [word[0] for word in words(sol)][:3] == ["held", "open", "open"]
    flight, after = sol.segments[1:3]
    table = 2.0 * np.cos(10 * flight.t1)
    assert flight.t1 - flight.t0 > 0.2
    assert after.y0[1] - table == pytest.approx(-0.3 * (flight.y1[1] - table), rel=1e-12)


def test_a_wall_that_begins_to_move_after_the_start_takes_a_mass_along(five_springs):
    """At the start neither gap, rate nor acceleration tell that it will press."""
    sol = five_springs.simulate(1.0, np.zeros(10), events=mechc.Stop("q_0 - t**3", 0.5))
    np.testing.assert_allclose(sol.y[-1][[0, 5]], [1.0, 3.0], atol=1e-12)


def test_several_contacts_last_and_open_one_by_one(five_springs):
    """Masses on springs with rests at 0, on walls that move away: each lifts off by itself."""
    stops = [mechc.Stop(f"q_{k} + {k + 1}/10 - cos(t)", 0.0) for k in range(2)]
    y0 = np.zeros(10)
    y0[:2] = [0.9, 0.8]
    sol = five_springs.simulate(1.5, y0, events=stops, rtol=1e-11)
    assert words(sol)[0] == ("held", "held")
    # q = cos t - c is held while q'' + 4 q = 3 cos t - 4 c presses: it is pulled back until then
    lifts = [np.arccos(4 * (k + 1) / 10 / 3) for k in range(2)]
    opened = [next(p.t0 for p in sol.segments if p.contacts[k] == "open") for k in range(2)]
    np.testing.assert_allclose(opened, lifts, atol=1e-10)


def test_a_linkage_is_held_by_a_stop_and_leaves_it(model, regular):
    """Its loop stays closed, and it leaves where its free acceleration turns away."""
    params, start = regular
    sol = model.simulate(3.0, start, params, events=mechc.Stop("3 - theta_0"), rtol=1e-11)
    assert sol.status.ok
    held = [part for part in sol.segments if part.contacts == ("held",)]
    assert held
    for part in held:
        t = np.linspace(part.t0, part.t1, 20)[:-1]
        np.testing.assert_allclose(sol(t)[:, 0], 3.0, atol=1e-14)
        if part.t1 < 3.0:
            assert abs(model.rates(part.y1, params)[3]) < 1e-8
    assert sol.closure.max() < 1e-12
    assert sol.velocity_closure.max() < 1e-11


# -- friction --------------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [0.0, 1e-10, 1e-6])
def test_near_a_change_point_friction_takes_no_branch(model, gap):
    """Beside a gap of 1e-10 m a step over it once came out on the wrong side, without a word."""
    params = {"l_3": 4.0 + gap}
    start = model.assemble({"theta_0": 1.5}, params=params)
    drag = mechc.DryFriction("omega_0", mu=1e-11, normal="1")
    sol = model.simulate(1.5, start, params, events=drag, rtol=1e-5)
    free = model.simulate(1.5, start, params, rtol=1e-9)
    assert sol.status.code == "undecided"
    assert 0.7 < sol.status.t < 0.8
    np.testing.assert_allclose(sol.y[-1], free(sol.t[-1]), atol=1e-4)


def test_near_misses_wide_enough_are_followed_with_friction(model):
    params = {"l_3": 4.0 + 1e-3}
    start = model.assemble({"theta_0": 1.5}, params=params)
    drag = mechc.DryFriction("omega_0", mu=1e-11, normal="1")
    sol = model.simulate(1.5, start, params, events=drag, rtol=1e-9)
    assert sol.status.ok
    free = model.simulate(1.5, start, params, rtol=1e-11)
    np.testing.assert_allclose(sol.y[-1], free.y[-1], atol=1e-7)


@pytest.mark.parametrize("mu", [0.5, 0.2])
def test_a_block_slides_up_a_slope_and_sticks_or_slides_back(block, mu):
    up, down = (G * (np.sin(0.3) + sign * mu * np.cos(0.3)) for sign in (1, -1))
    for law in (
        [mechc.Stop("y", friction=mu, slip="v_x")],
        [mechc.Stop("y"), mechc.DryFriction("v_x", mu, "m*g*cos(a)")],
    ):
        sol = block.simulate(3.0, [0.0, 0.0, 2.0, 0.0], events=law, rtol=1e-11)
        turn = sol.segments[0].t1
        assert turn == pytest.approx(2.0 / up, abs=1e-12)
        back = max(down, 0.0)  # 0: it sticks
        x = 2.0 / up - back * (3.0 - turn) ** 2 / 2
        assert sol.y[-1, 0] == pytest.approx(x, abs=1e-11)
        assert sol.y[-1, 2] == pytest.approx(-back * (3.0 - turn), abs=1e-11)
        assert words(sol)[-1][-1] == ("slides -" if back else "sticks")
        assert sol.work[-1] == pytest.approx(sol.energy[-1] - sol.energy[0], rel=1e-10)


def test_a_thrown_block_loses_mu_times_the_normal_impulse_at_every_bounce(block):
    """While it slides; on level ground, until it bounces upright."""
    e, mu, h, v = 0.7, 0.1, 1.0, 3.0
    stop = mechc.Stop("y", e, friction=mu, slip="v_x")
    sol = block.simulate(10.0, [0.0, h, v, 0.0], {"a": 0.0}, events=stop, rtol=1e-11)
    down = np.sqrt(2 * G * h)
    for k, part in enumerate(sol.segments[1:8]):
        expected = v - mu * (1 + e) * down * (1 - e ** (k + 1)) / (1 - e)
        assert part.y0[2] == pytest.approx(max(expected, 0.0), abs=1e-10)
    assert (np.diff(sol.energy) < 1e-12).all()
    assert words(sol)[-1] == ("sticks",)


def test_stick_and_slip_on_a_belt(five_springs):
    """A mass on a spring of 4 N/m and a belt of 0.2 m/s, which holds up to 1.5 N and slides at 1 N:
    arcs of ellipses, each 2 (pi - arctan(w d / v)) / w long."""
    belt = mechc.DryFriction("u_0 - 1/5", 1.0, static=1.5)
    y0 = np.zeros(10)
    sol = five_springs.simulate(12.0, y0, events=belt, rtol=1e-12)
    sticks = [part for part in sol.segments if part.contacts == ("sticks",)]
    slips = [part for part in sol.segments if part.contacts == ("slides -",)][1:-1]
    w, d, v = 2.0, 0.125, 0.2  # from 1.5 to 1 N is 0.125 m
    for part in slips:
        assert part.y0[0] == pytest.approx(0.375, abs=1e-11)
        assert part.y1[0] == pytest.approx(0.125, abs=1e-11)
        assert part.t1 - part.t0 == pytest.approx(2 * (np.pi - np.arctan(w * d / v)) / w, abs=1e-11)
    assert len(slips) >= 2
    for part in sticks[1:-1]:
        assert part.t1 - part.t0 == pytest.approx(2 * d / v, abs=1e-11)
    assert len(sol.events[0].t) == len(sol.segments) - 1


@pytest.mark.parametrize("slip", ["u_0", "u_0 - 1/5", "u_2 - 2*u_1"])
def test_steps_that_a_bound_excludes_hold_no_end_of_sliding(five_springs, slip):
    """A force that time changes by nothing is not known to be constant: its steps are sampled."""
    bounded, sampled = (
        mechc.DryFriction(slip, 0.1, normal=normal) for normal in (1.0, "1 + 1e-300*t")
    )
    found = 0
    for seed in range(4):
        y0 = np.random.default_rng(seed).uniform(-1.0, 1.0, 10)
        one, other = (five_springs.simulate(12.0, y0, events=law) for law in (bounded, sampled))
        found += len(one.events[0].t)
        assert np.array_equal(one.t, other.t)
        assert np.array_equal(one.y, other.y)
        assert np.array_equal(one.events[0].t, other.events[0].t)
    assert found > 6


def test_a_mass_at_rest_slides_once_its_friction_has_faded(five_springs):
    """0.3 m from its spring's rest and held by up to 2 - t, it starts at 0.8 s, slides at a quarter
    of that and takes along the one that sticks to it; nothing moves before, so that speeds are
    rounding and no faster one is known."""
    ground = mechc.DryFriction("u_0", 0.25, normal="2 - t", static=1.0)
    other = mechc.DryFriction("u_1 - u_0", 0.5)
    sol = five_springs.simulate(1.0, np.eye(10)[0] * 0.3, events=[ground, other], rtol=1e-12)
    assert words(sol) == [("sticks", "sticks"), ("slides -", "sticks")]
    assert sol.events[0].t == pytest.approx([0.8], abs=1e-12)
    s = sol.t[sol.t > 0.8] - 0.8  # 2 x'' + 8 (x - 0.3) = -1.2 + 0.25 (1.2 - s)
    moved = (-0.9 - 0.25 * s + 0.9 * np.cos(2 * s) + 0.125 * np.sin(2 * s)) / 8
    np.testing.assert_allclose(
        sol.y[sol.t > 0.8][:, :2] - [0.3, 0.0], moved[:, None] * [1, 1], atol=1e-11
    )


def test_a_mode_that_begins_beyond_its_limit_by_rounding_ends_at_once(five_springs):
    """Held by 1.2 N less 1e-10 that fades, against a spring's 1.2 N."""
    ground = mechc.DryFriction("u_0", 1.0, normal="1.2 - 1e-10 - t")
    sol = five_springs.simulate(0.5, np.eye(10)[0] * 0.3, events=ground, rtol=1e-12)
    t = sol.t  # x'' + 4 (x - 0.3) = -t
    moved = -(t - np.sin(2 * t) / 2) / 4
    np.testing.assert_allclose(sol["q_0"], 0.3 + moved, atol=1e-9)
    assert sol["q_0"][-1] < 0.29


@pytest.mark.parametrize("q_0", [0.0, 0.3])
def test_where_everything_sticks_steps_are_those_of_a_motion(five_springs, q_0):
    """A belt rubs on a mass that two others hold: accelerations cancel, but for their rounding."""
    belt = mechc.DryFriction("u_0 - 1", 1.0, normal="1 + 0.1*sin(4*t)")
    held = [mechc.DryFriction("u_0 - u_1/3", 5.0), mechc.DryFriction("u_1", 5.0), belt]
    sol = five_springs.simulate(2.0, [q_0, *np.zeros(9)], events=held, max_steps=100)
    assert sol.status.ok
    assert words(sol) == [("sticks", "sticks", "slides -")]
    assert abs(sol.y - sol.y[0]).max() < 1e-14


def test_a_force_that_presses_and_becomes_negative_is_an_error(five_springs):
    """It would push what slides; from where it is 0 nothing rubs."""
    fading = mechc.DryFriction("u_0", 0.1, normal="1 - 2*t")
    with pytest.raises(mechc.EventError, match=r"negative from t = 0.5 s") as error:
        five_springs.simulate(1.0, np.eye(10)[0] * 0.3, events=fading)
    assert error.value.solution.t[-1] == pytest.approx(0.5, abs=1e-9)
    none = mechc.DryFriction("u_0", 0.1, normal=sympy.Max(1 - 2 * sympy.Symbol("t"), 0))
    assert five_springs.simulate(1.0, np.eye(10)[0] * 0.3, events=none).status.ok


@pytest.mark.parametrize("friction", [{}, {"friction": 0.3, "slip": "u_1"}])
def test_a_start_at_which_parts_overlap_is_refused(five_springs, friction):
    with pytest.raises(ValueOutOfBoundsError, match=r"event 0: the gap q_0 is -0.001"):
        five_springs.simulate(1.0, np.eye(10)[0] * -1e-3, events=mechc.Stop("q_0", **friction))


@pytest.mark.slow
def test_a_rod_that_lies_on_both_ends_slides_and_sticks(rod):
    """Four forces on three freedoms: they are not unique, the motion is."""
    other = mechc.Stop("y + l*sin(theta)", friction=0.4, slip="v_x - l*sin(theta)*omega")
    stops = [mechc.Stop(TIP_GAP, friction=0.4, slip=TIP_SLIP), other]
    sol = rod.simulate(2.0, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0], events=stops)
    assert words(sol) == [("slides +", "slides +"), ("sticks", "sticks")]
    assert sol.segments[0].t1 == pytest.approx(1 / (0.4 * G), abs=1e-11)
    np.testing.assert_allclose(sol.y[-1], [0.5 / (0.4 * G), 0, 0, 0, 0, 0], atol=1e-11)


def moreau(model, y, mu, t_end, h):
    """A rod's tip in steps of impulses (Moreau 1988): first order in h."""
    q, u = y[:3].copy(), y[3:].copy()
    weight = np.array([1.0, 1.0, 3.0])  # of 1/M
    for _ in range(round(t_end / h)):
        q += 0.5 * h * u
        u = u + h * np.array([0.0, -G, 0.0])
        if q[1] - np.sin(q[2]) <= 0.0:
            rows = np.array([[0.0, 1.0, -np.cos(q[2])], [1.0, 0.0, np.sin(q[2])]])
            w, a = rows @ u, rows @ (weight * rows).T
            if w[0] < 0.0:
                p = np.linalg.solve(a, -w)
                if abs(p[1]) > mu * p[0]:
                    side = mu * np.sign(p[1])
                    p = -w[0] / (a[0, 0] + side * a[0, 1]) * np.array([1.0, side])
                u = u + weight * (p @ rows)
        q += 0.5 * h * u
    return np.concatenate([q, u])


@pytest.mark.slow
def test_a_rod_that_slides_and_sticks_is_that_of_a_scheme_of_time_steps(rod):
    start = at_the_tip(1.2, 3.0, 0.0)
    stop = mechc.Stop(TIP_GAP, friction=0.5, slip=TIP_SLIP)
    sol = rod.simulate(1.1, start, events=stop)
    assert words(sol) == [("slides +",), ("sticks",)]
    errors = [np.abs(moreau(rod, start, 0.5, 1.1, h) - sol.y[-1]).max() for h in (4e-3, 1e-3)]
    assert errors[1] < 0.02
    assert errors[1] < 0.5 * errors[0]


def test_painleves_rod_is_flagged(rod):
    """With m = l = 1 the stiffness of the sliding contact is 1 + 3 cos^2 - 3 mu sin cos: where that
    is negative there is no motion or, where the turning lifts the tip, more than one."""
    stop = mechc.Stop(TIP_GAP, friction=2.0, slip=TIP_SLIP)
    for theta in (0.3, 0.7, 1.0, 1.2, 1.4, 1.5):
        stiffness = 1 + 3 * np.cos(theta) ** 2 - 6 * np.sin(theta) * np.cos(theta)
        still = rod.simulate(0.01, at_the_tip(theta, -3.0, 0.0), events=stop)
        assert (still.status.code == "contact inconsistent") == (stiffness < 0)
        omega = np.sqrt(1.5 * G / np.sin(theta))
        turning = rod.simulate(0.01, at_the_tip(theta, -3.0, omega), events=stop)
        assert (turning.status.code == "contact undecided") == (stiffness < 0)
    assert "Painleve" in str(rod.simulate(0.1, at_the_tip(1.2, -3.0, 0.0), events=stop).status)


@pytest.mark.slow
def test_energy_never_grows(rod):
    rng = np.random.default_rng(11)
    for _ in range(4):
        e, mu = rng.uniform(0.0, 1.0, 2)
        other = mechc.Stop("y + l*sin(theta)", e, friction=mu, slip="v_x - l*sin(theta)*omega")
        stops = [mechc.Stop(TIP_GAP, e, friction=mu, slip=TIP_SLIP), other]
        y0 = np.append([0.0, 1.2, 0.5], rng.normal(size=3))
        sol = rod.simulate(0.8, y0, events=stops)
        assert len(sol.segments) > 1
        assert np.diff(sol.energy).max() < 1e-8


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_a_pin_falls_from_the_middle_of_its_bush_and_rests_below(block, friction):
    """A clearance joint: in the middle the gap has no direction."""
    slip = "(x*v_y - y*v_x)/sqrt(x**2 + y**2)" if friction else None
    bush = mechc.Stop("0.2 - sqrt(x**2 + y**2)", friction=friction, slip=slip)
    sol = block.simulate(1.0, np.zeros(4), {"a": 0.0}, events=bush, rtol=1e-10)
    assert sol.events[0].t == pytest.approx([np.sqrt(0.4 / G)], abs=1e-12)
    assert words(sol)[-1] == (("sticks" if friction else "held"),)
    np.testing.assert_allclose(sol.y[-1], [0.0, -0.2, 0.0, 0.0], atol=1e-9)


def test_a_pin_that_rests_in_its_bush_swings_as_a_pendulum(block):
    """Of the length of the play, with the period 4 K(sin(1/2)) sqrt(c/g)."""
    bush = mechc.Stop("0.2 - sqrt(x**2 + y**2)")
    start = np.array([0.2 * np.sin(1.0), -0.2 * np.cos(1.0), 0.0, 0.0])
    period = float(4 * sqrt(0.2 / G) * ellipk(sin(0.5) ** 2))
    sol = block.simulate(period, start, {"a": 0.0}, events=bush, rtol=1e-11)
    assert words(sol) == [("held",)]
    np.testing.assert_allclose(sol.y[-1], start, atol=1e-10)


# -- with inputs -----------------------------------------------------------------------------------


TIMES = [0.0, 1.0, 2.0, 3.0, 4.0]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["previous", "linear"])
def test_a_mass_that_an_input_presses_on_a_wall_leaves_it_when_the_push_ends(pushed, kind):
    """At a jump of the push, and where it passes 0; it begins to press after the start."""
    values = [-1.0, -2.0, 3.0, -4.0, -4.0] if kind == "previous" else [0.0, -2.0, 2.0, -4.0, -4.0]
    push = {"F": mechc.Signal(np.array(TIMES), np.array(values), kind)}
    sol = pushed.simulate(3.0, [0, 0], inputs=push, events=mechc.Stop("q", 0.5), rtol=1e-12)
    lift = 2.0 if kind == "previous" else 1.5
    flight = next(p for p in sol.segments if p.contacts == ("open",) and p.t0 > 0.1)
    assert flight.t0 == pytest.approx(lift, abs=1e-12)
    assert abs(sol(np.linspace(0, lift, 50))).max() < 1e-9
    assert len(sol.events[0].t) == 0
    if kind == "previous":
        np.testing.assert_allclose(sol.y[-1], [0.75, 1.5], atol=1e-12)
        return
    # (F is 4 (t - 3/2) until 2 s, then 2 - 6 (t - 2)); m = 2 kg
    np.testing.assert_allclose(sol(2.0), [1 / 24, 0.25], atol=1e-11)
    np.testing.assert_allclose(sol.y[-1], [1 / 24 + 0.25 + 0.5 - 0.5, 0.25 + 1.0 - 1.5], atol=1e-11)


def test_a_push_that_jumps_lets_go_and_turns_what_friction_holds(pushed):
    push = {"F": mechc.Signal(np.array(TIMES), np.array([-1.0, -2.0, 3.0, -1.0, -1.0]), "previous")}
    sol = pushed.simulate(4.0, [0, 0], inputs=push, events=mechc.DryFriction("u", 1.5), rtol=1e-12)
    assert [(p.t0, p.contacts[0]) for p in sol.segments] == [
        (0.0, "sticks"), (1.0, "slides -"), (2.0, "slides -"),
        (pytest.approx(2 + 0.25 / 2.25, abs=1e-12), "slides +"), (3.0, "slides +"),
        (pytest.approx(3 + (1 - 0.25 / 2.25) * 0.75 / 1.25, abs=1e-12), "sticks"),
    ]  # fmt: skip
    assert sol.work[-1] == pytest.approx(sol.energy[-1] - sol.energy[0], rel=1e-9)


def test_inputs_are_needed_within_the_run_alone(pushed):
    """Samples that end with it, and a function that fails later; the motion until then is kept."""
    push = {"F": mechc.Signal(np.array([0.0, 0.5]), np.array([-1.0, -2.0]), "linear")}
    sol = pushed.simulate(0.5, [0, 0], inputs=push, events=mechc.Stop("q"))
    assert abs(sol.y[-1]).max() < 1e-15
    fails = {"F": lambda t: -1.0 if t < 1.0 else 1.0 / 0.0}
    with pytest.raises(InputError, match="ZeroDivisionError") as caught:
        pushed.simulate(4.0, [0, 0], inputs=fails, events=mechc.Stop("q"))
    assert 0.0 < caught.value.solution.t[-1] < 1.0
    assert words(caught.value.solution) == [("held",)]


class Pushing:
    """A controller that pushes for a while, and keeps what it was asked."""

    def __init__(self, start, end, force):
        self.start, self.end, self.force, self.asked = start, end, force, []

    def __call__(self, t, q, u):
        self.asked.append((t, q[0], u[0]))
        return self.force if self.start <= t < self.end else 0.0


def test_a_controller_moves_what_friction_holds(pushed, tmp_path):
    """Pushed with 3.2 N, of which friction takes 1.5, from 0.22 to 0.62 s: called once at each
    instant, with the state there; the run is saved with what it applied, and opened again."""
    push, a, b = Pushing(0.2, 0.6, 3.2), 0.85, 0.75
    inputs = {"F": mechc.Sampled(push, period=0.05, delay=0.02)}
    sol = pushed.simulate(
        2.0, [0, 0], inputs=inputs, events=mechc.DryFriction("u", 1.5), rtol=1e-12
    )
    np.testing.assert_allclose(sol.events[0].t, [0.62 + 0.4 * a / b], atol=1e-12)
    t, q, u = np.array(push.asked).T
    np.testing.assert_allclose(t, 0.05 * np.arange(40), atol=1e-15)
    pushed_for, slowed_for = np.clip(t - 0.22, 0.0, 0.4), np.clip(t - 0.62, 0.0, 0.4 * a / b)
    np.testing.assert_allclose(u, a * pushed_for - b * slowed_for, atol=1e-12)
    moved = a / 2 * pushed_for**2 + a * 0.4 * slowed_for - b / 2 * slowed_for**2
    np.testing.assert_allclose(q, moved, atol=1e-12)
    again = mechc.open(sol.save(tmp_path / "run.nc"), model=pushed)
    np.testing.assert_array_equal(again.y, sol.y)
    assert len(push.asked) == 40


def test_a_controller_bounces_what_comes_to_rest(pushed):
    """Thrown onto a stop by a controller that lets go of it later."""
    push = Pushing(0.0, 1.0, -4.0)
    lift = lambda t, q, u: push(t, q, u) + (2.0 if t >= 1.0 else 0.0)  # noqa: E731
    inputs = {"F": mechc.Sampled(lift, period=0.1)}
    sol = pushed.simulate(2.0, [0.1, 0], inputs=inputs, events=mechc.Stop("q", 0.5), rtol=1e-12)
    np.testing.assert_allclose([asked[0] for asked in push.asked], 0.1 * np.arange(20), atol=1e-14)
    assert ("held",) in words(sol)
    assert sol.y[-1, 0] == pytest.approx(0.5, abs=1e-12)  # of 1 m/s^2 from 1 s on
    fails = mechc.Sampled(lambda t: 1 / (t < 0.5) - 2.0, period=0.1)
    with pytest.raises(InputError, match="ZeroDivisionError") as caught:
        pushed.simulate(2.0, [0, 0], inputs={"F": fails}, events=mechc.Stop("q"))
    assert caught.value.solution.t[-1] == pytest.approx(0.5)


# -- beside other things ---------------------------------------------------------------------------


def test_other_events_go_on_in_contact(ball):
    """Functions of Python, a terminal event, and a reset that throws a ball that rests."""
    throw = mechc.Event("t - 1", reset={"u_0": "3"})
    seen = mechc.Event(lambda t, y: t - 1.2)
    sol = ball.simulate(3.0, [0.1, 0.0], events=[mechc.Stop("q_0"), throw, seen], rtol=1e-11)
    assert [part.contacts for part in sol.segments[1:]] == [
        ("held", "", ""), ("open", "", ""), ("held", "", ""),
    ]  # fmt: skip
    assert sol.segments[-1].t0 == pytest.approx(1 + 6 / G, abs=1e-11)
    np.testing.assert_allclose(sol.events[2].t, [1.2], atol=1e-12)
    last = mechc.Event("t - 2", terminal=True)
    ended = ball.simulate(3.0, [0.1, 0.0], events=[mechc.Stop("q_0"), last])
    assert ended.status.code == "stopped by an event"
    assert ended.t[-1] == pytest.approx(2.0, abs=1e-12)


@pytest.mark.slow
def test_a_motion_with_contact_is_continued_saved_and_drawn(block, tmp_path):
    stop = mechc.Stop("y", 0.5, friction=0.5, slip="v_x")
    start = [0.0, 0.1, 2.0, 0.0]
    whole = block.simulate(2.0, start, events=stop)
    sol = block.simulate(1.0, start, events=stop).continue_to(2.0)
    np.testing.assert_allclose(sol.y[-1], whole.y[-1], atol=1e-9)
    assert words(sol)[-1] == ("sticks",)
    pytest.importorskip("xarray")
    sol.save(tmp_path / "sol.nc")
    again = mechc.open(tmp_path / "sol.nc", model=block)
    times = np.linspace(0.0, 2.0, 301)
    np.testing.assert_allclose(again(times), sol(times), atol=1e-9)
    assert [p.contacts for p in again.segments] == [p.contacts for p in sol.segments]
    assert again.plot()


def test_what_contact_does_not_have_yet_is_refused(block):
    stop = mechc.Stop("y", friction=0.5, slip="v_x")
    start = [0.0, 0.0, 2.0, 0.0]
    with pytest.raises(MechcError, match="no derivatives of a motion with friction"):
        block.simulate(1.0, start, events=stop, sensitivities=["a"])


@pytest.mark.parametrize("law", ["newton", "poisson"])
def test_an_oblique_impact_of_a_rod_with_friction(rod, law):
    """The tip sticks to the floor at the end of compression.  Poisson's law in closed form; with
    Newton's energy would grow, and the run says what it did."""
    e, mu = 0.9, 1.0
    stop = mechc.Stop(TIP_GAP, e, friction=mu, slip=TIP_SLIP, law=law)
    start = np.array([0.0, np.sin(0.8) + 0.01, 0.8, 0.3, -1.0, 1.0])
    sol = rod.simulate(0.01, start, {"g": 0.0}, events=stop)
    before, after = sol.segments[0].y1, sol.segments[1].y0
    s, c = np.sin(before[2]), np.cos(before[2])
    energy = [rod.kinetic_energy(y, {"g": 0.0}) for y in (before, after)]
    if law == "newton":
        assert energy[1] == pytest.approx(energy[0], rel=1e-12)
        assert "would have given energy" in str(sol.status)
        batch = rod.simulate_batch(0.01, [start], {"g": 0.0}, events=stop)
        assert batch.lowered_impacts.tolist() == [sol.stats["lowered_impacts"]] == [1]
        assert "would have given energy" in batch.warnings[0]
        return
    assert not sol.status.warnings
    rows = np.array([[0.0, 1.0, -c], [1.0, 0.0, s]])
    by_one_newton = rows / [1.0, 1.0, 1 / 3]  # of a rod of 1 kg and the half length 1 m
    a, rates = by_one_newton @ rows.T, rows @ before[3:]
    pressing = -np.linalg.solve(a, rates)
    again = e * np.array([pressing[0], -a[1, 0] / a[1, 1] * pressing[0]])
    assert abs(pressing[1]) < mu * pressing[0]
    assert abs(again[1]) < mu * again[0]
    wanted = before[3:] + (pressing + again) @ by_one_newton
    np.testing.assert_allclose(after[3:], wanted, atol=1e-9)
    assert energy[1] < 0.9 * energy[0]


@pytest.mark.parametrize("slip", [0.0, 1e-32, -1e-32, 1e-14, -1e-14])
def test_a_slip_that_is_rounding_does_not_slide(block, slip):
    """On a slope that holds it the block stays, whichever way its last digit moves."""
    stop = mechc.Stop("y", 0.5, friction=0.5, slip="v_x")
    sol = block.simulate((1.0, 2.0), [0.3, 0.0, slip, 0.0], events=stop)
    assert words(sol) == [("sticks",)]
    np.testing.assert_allclose(sol.y[-1], [0.3, 0, 0, 0], rtol=0, atol=1e-13)
