"""Events with resets, as functions of Python and as texts, against closed forms and conservation
laws."""

import pickle

import numpy as np
import pytest
from sympy import symbols

import mechc
from mechc.errors import EventError, ValueOutOfBoundsError
from mechc.simulation.events.resets import onto_constraints
from tests.support.impacts import G, impacts
from tests.support.pendulums import pushed_mass


@pytest.fixture(scope="module")
def pendulum():
    return mechc.load("pendulum")


def bounce_by_python(restitution, **given):
    return mechc.Event(
        lambda t, y: y[0], direction=-1, reset=lambda t, q, u: (q, -restitution * u), **given
    )


def bounce_by_text(restitution, **given):
    return mechc.Event("q_0", direction=-1, reset={"u_0": f"-{restitution}*u_0"}, **given)


@pytest.fixture(params=[bounce_by_python, bounce_by_text], ids=["Python", "text"])
def bouncing(request):
    """An event of a ball, by its restitution."""
    return request.param


def is_by_tape(sol):
    return not sol._run_events.bound.calls_python


@pytest.mark.parametrize("method", ["gauss8", "dop853"])
def test_a_hundred_bounces_come_at_the_times_of_the_closed_form(ball, bouncing, method):
    sol = ball.simulate(
        20.0, [1.0, 0.0], events=[bouncing(0.9, terminal=100)], rtol=1e-12, method=method
    )
    assert is_by_tape(sol) == (bouncing is bounce_by_text)
    assert sol.status.code == "stopped by an event"
    exact = impacts(0.9, 100)
    np.testing.assert_allclose(sol.events[0].t, exact, rtol=0, atol=1e-12)
    speeds = np.sqrt(2 * G) * 0.9 ** np.arange(100)
    np.testing.assert_allclose(sol.events[0].y[:, 1], -speeds, atol=1e-11)
    assert sol.y[-1, 1] == pytest.approx(0.9 * speeds[-1], rel=1e-9)
    assert len(sol.segments) == 101


@pytest.mark.parametrize("unit", [1e-12, 1e-6, 1e6])
@pytest.mark.parametrize("law", ["reset", "stop"])
def test_bounces_are_found_whatever_the_unit_of_time(unit, law):
    """g in m per square unit: times in units are those of g in m/s^2."""
    falling = mechc.compile(pushed_mass(-symbols("m") * symbols("g")), defaults={"m": 1, "k": 0})
    floor = {
        "reset": mechc.Event("q", direction=-1, reset={"u": "-0.8*u"}),
        "stop": mechc.Stop("q", 0.8),
    }[law]
    sol = falling.simulate(3.0 * unit, [1.0, 0.0], {"g": G / unit**2}, events=floor)
    assert sol.status.code == "finished"
    np.testing.assert_allclose(sol.events[0].t, unit * impacts(0.8, 6), rtol=1e-13)


def test_many_pieces_keep_within_the_memory_allowed(ball, bouncing):
    sol = ball.simulate(50.0, [1.0, 0.0], events=[bouncing(1.0)], max_bytes=1e4)
    assert sol.status.code == "memory limit"
    assert 2 < len(sol.segments) < 20


def test_pieces_of_one_step_keep_within_the_memory_allowed(ball):
    """Each has room for its first and its last state, however little is left."""
    often = mechc.Event("sin(5000*t)", reset={"u_0": "u_0"})
    sol = ball.simulate(1.0, [10.0, 0.0], events=[often], max_bytes=1e5)
    assert sol.status.code == "memory limit"
    assert 20 < len(sol.segments) < 300
    assert len(sol.t) < 2.1 * len(sol.segments)


def test_both_sides_of_each_jump(ball, bouncing):
    sol = ball.simulate(2.0, [1.0, 0.0], events=[bouncing(0.8)])
    times = sol.events[0].t
    assert len(sol.segments) == len(times) + 1 == 4
    for t, before, after in zip(times, sol.segments, sol.segments[1:], strict=False):
        assert before.t1 == after.t0 == t
        assert after.y1[0] >= -1e-12
        np.testing.assert_allclose(after.y0[1], -0.8 * before.y1[1])
        np.testing.assert_array_equal(sol(t), after.y0)
        np.testing.assert_array_equal(sol([t, t]), [before.y1, after.y0])
        for side, state in ((-1e-7, before.y1), (1e-7, after.y0)):
            near = np.array([state[0] + side * state[1], state[1] - G * side])
            np.testing.assert_allclose(sol(t + side), near, atol=1e-12)
    twice = sol.t[1:][np.diff(sol.t) == 0]
    np.testing.assert_array_equal(twice, times)
    np.testing.assert_allclose(sol(sol.t), sol.y, atol=1e-13)
    assert (sol.y[:, 0] > -1e-12).all()
    at = ball.simulate(2.0, [1.0, 0.0], events=[bouncing(0.8)], t_eval=np.linspace(0, 2, 50))
    np.testing.assert_allclose(at.y, sol(at.t), atol=1e-9)


def test_ever_shorter_flights_end_in_a_status(ball, bouncing):
    for restitution in (0.9, 0.5, 0.1):
        sol = ball.simulate(20.0, [1.0, 0.0], events=[bouncing(restitution)])
        last = np.sqrt(2 / G) * (1 + restitution) / (1 - restitution)
        assert sol.status.code == "resets accumulate"
        assert "Zeno" in str(sol.status)
        assert sol.status.t == pytest.approx(last, abs=1e-6)
        np.testing.assert_allclose(sol.y[-1], 0.0, atol=1e-6)
        assert (sol.y[:, 0] > -1e-9).all()
    plastic = ball.simulate(20.0, [1.0, 0.0], events=[bouncing(0.0)])
    assert plastic.status.code == "resets accumulate"
    assert plastic.status.t == pytest.approx(np.sqrt(2 / G))


def stops_of_a_pendulum(way, bottom, e):
    """At 0.4 rad to one side of the bottom and 0.6 rad to the other; by text as parts of 2 m."""
    if way == "text":
        reset = {"omega_0": f"-{e}*omega_0"}
        below, above = f"theta_0 - {bottom!r} < -0.2*l_0", f"theta_0 - {bottom!r} > 0.3*l_0"
        return [mechc.Event(below, reset=reset), mechc.Event(above, reset=reset)]
    hit = lambda t, q, u: (q, -e * u)  # noqa: E731
    return [
        mechc.Event(lambda t, y: y[0] - bottom + 0.4, direction=-1, reset=hit),
        mechc.Event(lambda t, y: y[0] - bottom - 0.6, direction=1, reset=hit),
    ]


@pytest.mark.parametrize("way", ["Python", "text"])
def test_a_pendulum_between_two_stops_loses_what_the_restitution_takes(pendulum, way):
    """Its energy is constant between the impacts and falls by 1 - e^2 of the kinetic energy."""
    e, (low, high), params = 0.8, (-0.4, 0.6), {"l_0": 2.0}
    bottom = float(pendulum.equilibria()[0].y[0])
    stops = stops_of_a_pendulum(way, bottom, e)
    sol = pendulum.simulate(6.0, [bottom, 6.0], params, events=[*stops, "omega_0"], rtol=1e-11)
    assert len(sol.events[2].t) > 0
    assert sol.status.ok
    assert len(sol.events[0].t) > 2
    assert len(sol.events[1].t) > 2
    angle = sol(np.linspace(0.0, 6.0, 3000))[:, 0] - bottom
    assert angle.min() > low - 1e-9
    assert angle.max() < high + 1e-9
    for part, after in zip(sol.segments, sol.segments[1:], strict=False):
        energies = [pendulum.energy(y, params) for y in (part.y0, part.y1, after.y0)]
        kinetic = pendulum.kinetic_energy(part.y1, params)
        assert energies[1] == pytest.approx(energies[0], abs=1e-9)
        assert energies[2] - energies[1] == pytest.approx(-(1 - e**2) * kinetic, abs=1e-9)
    assert (np.diff(sol.energy) < 1e-9).all()


def cradle_by_python(e):
    """Neighbours exchange speeds: masses are equal."""

    def reset(k):
        def collide(t, q, u):
            mean, half = 0.5 * (u[k] + u[k + 1]), 0.5 * e * (u[k] - u[k + 1])
            u[k], u[k + 1] = mean - half, mean + half
            return q, u

        return collide

    return [
        mechc.Event(lambda t, y, k=k: y[k + 1] - y[k], direction=-1, reset=reset(k))
        for k in range(4)
    ]


def cradle_by_text(e):
    mean, half = "(u_{0} + u_{1})/2", f"{e}*(u_{{0}} - u_{{1}})/2"
    return [
        mechc.Event(
            f"q_{k + 1} - q_{k}", direction=-1,
            reset={f"u_{k}": f"{mean} - {half}".format(k, k + 1),
                   f"u_{k + 1}": f"{mean} + {half}".format(k, k + 1)},
        )
        for k in range(4)
    ]  # fmt: skip


def test_neighbours_of_a_cradle_meet_alike_by_python_and_by_text(five_springs):
    """Several resets at one instant, with losses."""
    start = np.array([-0.1, *np.zeros(9)])
    one, other = (
        five_springs.simulate(1.0, start, events=cradle(0.97), rtol=1e-11)
        for cradle in (cradle_by_text, cradle_by_python)
    )
    assert max(len(piece.causes) for piece in one.record.pieces) > 1
    for a, b in zip(one.events, other.events, strict=True):
        np.testing.assert_allclose(a.t, b.t, rtol=0, atol=1e-12)
    np.testing.assert_allclose(one.y[-1], other.y[-1], rtol=0, atol=1e-10)


def test_newtons_cradle_passes_the_motion_on(five_springs):
    """Equal springs, so that all meet in the middle: the ball at one end swings, then the other."""
    start = np.zeros(10)
    start[0] = -0.1
    sol = five_springs.simulate(10.0, start, events=cradle_by_python(1.0), rtol=1e-11)
    assert sol.status.ok
    period = np.pi  # of a spring of 4 N/m and 1 kg
    meetings = period / 4 + period / 2 * np.arange(6)
    for k, record in enumerate(sol.events):
        met = record.t[np.abs(record.y[:, 6 + k] - record.y[:, 5 + k]) > 1e-6]
        np.testing.assert_allclose(met, meetings, atol=1e-9)
    for n, t in enumerate(meetings[:-1] + period / 4):
        q = np.zeros(5)
        q[-1 if n % 2 == 0 else 0] = 0.1 if n % 2 == 0 else -0.1
        np.testing.assert_allclose(sol(t)[:5], q, atol=1e-8)
    kinetic = 0.5 * (sol.y[:, 5:] ** 2).sum(axis=1) + 2.0 * (sol.y[:, :5] ** 2).sum(axis=1)
    np.testing.assert_allclose(kinetic, 0.5 * 4 * 0.01, rtol=1e-9)


@pytest.mark.parametrize("cradle", [cradle_by_python, cradle_by_text])
def test_a_cradle_with_losses_never_gains_energy(five_springs, cradle):
    start = np.zeros(10)
    start[0] = -0.1
    sol = five_springs.simulate(3.0, start, events=cradle(0.7), max_steps=3000)
    energy = 0.5 * (sol.y[:, 5:] ** 2).sum(axis=1) + 2.0 * (sol.y[:, :5] ** 2).sum(axis=1)
    assert energy[-1] < 0.9 * energy[0]
    assert (np.diff(energy) < 1e-9).all()
    gaps = np.diff(sol.y[:, :5], axis=1)
    assert gaps.min() > -1e-8


@pytest.mark.parametrize("way", ["Python", "text"])
@pytest.mark.parametrize(("wall", "grazes"), [(0.1, True), (0.1 + 1e-12, True), (0.11, False),
                                              (0.09, False)])  # fmt: skip
def test_grazing_is_told(five_springs, wall, grazes, way):
    """An oscillator of amplitude 0.1 and a wall there."""
    hit = mechc.Event(lambda t, y: wall - y[0], direction=-1, reset=lambda t, q, u: (q, -0.9 * u))
    if way == "text":
        hit = mechc.Event(f"{wall!r} - q_0", direction=-1, reset={"u_0": "-0.9*u_0"})
    start = np.zeros(10)
    start[5] = 0.2
    sol = five_springs.simulate(3.0, start, events=[hit])
    assert ("grazing" in str(sol.status)) == grazes


def test_a_switch_goes_on_through_its_zero(ball):
    """A force that is turned off is a switch: the speed is changed, not turned back."""
    faster = mechc.Event(lambda t, y: y[0] - 0.5, reset=lambda t, q, u: (q, 2 * u))
    sol = ball.simulate(1.0, [1.0, 0.0], events=[faster])
    assert sol.status.ok
    assert sol.events[0].t == pytest.approx([np.sqrt(1 / G)])
    assert len(sol.segments) == 2


def test_speeds_are_put_onto_the_constraints_by_the_impulse_of_least_energy(model):
    """The change of the speeds is orthogonal, in the mass metric, to all speeds allowed."""
    y = model.assemble({"theta_0": 1.2}, speeds={"omega_0": 3.0})
    system, values = model.system, model.system.parameter_set.resolve(None)
    given = y.copy()
    given[3:] += [0.5, -2.0, 1.0]
    found = onto_constraints(system, 0.0, given, values)
    np.testing.assert_allclose(model.velocity_constraints(found), 0.0, atol=1e-13)
    np.testing.assert_allclose(found[:3], y[:3], atol=1e-14)
    allowed = model.assemble({"theta_0": 1.2}, speeds={"omega_0": 1.0})[3:]
    impulse = model.mass_matrix(y) @ (found[3:] - given[3:])
    assert allowed @ impulse == pytest.approx(0.0, abs=1e-12)
    lost = np.array([0.0, 0.0, 0.0, *(found[3:] - given[3:])])
    total = model.kinetic_energy(found) + model.kinetic_energy(np.append(y[:3], lost[3:]))
    assert model.kinetic_energy(np.append(y[:3], given[3:])) == pytest.approx(total)


@pytest.mark.parametrize(
    "stop",
    [
        mechc.Event(
            lambda t, y: y[0] - 3.0, direction=1,
            reset=lambda t, q, u: (q, [-0.5 * u[0], u[1], u[2]]),
        ),
        mechc.Event("theta_0 > 3", reset={"omega_0": "-0.5*omega_0"}),
    ],
    ids=["Python", "text"],
)  # fmt: skip
def test_a_linkage_hits_a_stop_and_stays_closed(model, regular, stop):
    params, start = regular
    sol = model.simulate(6.0, start, params, events=[stop])
    assert sol.status.ok
    assert len(sol.segments) > 2
    assert sol.closure.max() < 1e-12
    assert sol.velocity_closure.max() < 1e-11
    assert sol.q[:, 0].max() < 3.0 + 1e-9
    assert (np.diff(sol.energy) < 1e-7).all()
    before, after = sol.segments[0].y1, sol.segments[1].y0
    asked = np.append(before[:3], [-0.5 * before[3], *before[4:]])
    p = model.system.parameter_set.resolve(params)
    np.testing.assert_allclose(after, onto_constraints(model.system, 0.0, asked, p), atol=1e-9)


def test_saved_pickled_and_continued(ball, bouncing, tmp_path):
    first = ball.simulate(1.0, [1.0, 0.0], events=[bouncing(0.8)])
    whole = ball.simulate(3.0, [1.0, 0.0], events=[bouncing(0.8)])
    on = first.continue_to(2.0).continue_to(3.0)
    np.testing.assert_allclose(on.events[0].t, whole.events[0].t, atol=1e-9)
    times = np.linspace(0, 3, 400)
    np.testing.assert_allclose(on(times), whole(times), atol=1e-8)
    assert len(on.segments) == len(whole.segments)
    again = mechc.open(whole.save(tmp_path / "ball.nc"), model=ball)
    for other in (again, pickle.loads(pickle.dumps(whole))):
        np.testing.assert_allclose(other(times), whole(times), atol=1e-8)
        np.testing.assert_array_equal(other.t, whole.t)
        np.testing.assert_allclose(other.y, whole.y, atol=1e-8)
        np.testing.assert_allclose(
            [part.y0 for part in other.segments], [part.y0 for part in whole.segments]
        )


def test_backwards_speeds_grow_at_each_impact(ball):
    """From the last flight back to the start."""
    whole = ball.simulate(3.0, [1.0, 0.0], events=bounce_by_text(0.8))
    at = whole.events[0].t[1] + 0.1
    back = mechc.Event("q_0", direction=-1, reset={"u_0": "-u_0/0.8"})
    sol = ball.simulate((at, 0.0), whole(at), events=back, rtol=1e-12)
    np.testing.assert_allclose(sol.y[-1], [1.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(sol.events[0].t, whole.events[0].t[1::-1], atol=1e-9)


def test_a_run_whose_resets_accumulated_is_saved_and_opened(ball, bouncing, tmp_path):
    sol = ball.simulate(20.0, [1.0, 0.0], events=[bouncing(0.5)])
    again = mechc.open(sol.save(tmp_path / "rest.nc"), model=ball)
    assert again.status == sol.status
    assert again.span == sol.span
    np.testing.assert_allclose(again.y, sol.y, atol=1e-12)


def test_pictures_show_jumps(ball, bouncing):
    sol = ball.simulate(1.0, [1.0, 0.0], events=[bouncing(0.8)])
    from mechc.results.sampling import sample

    run = sample(sol, 50, jumps=True)
    (at,) = np.flatnonzero(np.diff(run.t) == 0)
    assert run.t[at] == sol.events[0].t[0]
    np.testing.assert_array_equal(run.y[[at, at + 1]], [sol.segments[0].y1, sol.segments[1].y0])
    assert sol.plot() is not None
    assert "html" in sol.animate()._repr_html_()


def test_what_is_wrong_is_told(ball):
    with pytest.raises(ValueOutOfBoundsError, match="reset"):
        ball.simulate(1.0, [1.0, 0.0], events=[mechc.Event(lambda t, y: y[0], reset=3.0)])
    for wrong in (lambda t, q, u: q, lambda t, q, u: (q, u * np.nan), lambda t, q, u: 1 / 0):
        with pytest.raises(EventError, match="reset") as caught:
            ball.simulate(1.0, [1.0, 0.0], events=[mechc.Event(lambda t, y: y[0], reset=wrong)])
        assert caught.value.solution.span[1] == pytest.approx(np.sqrt(2 / G))
    with pytest.raises(EventError, match="NaN"):
        ball.simulate(1.0, [1.0, 0.0], events=mechc.Event("sqrt(q_0 - 0.5)", reset={"u_0": "-u_0"}))
    with pytest.raises(EventError, match="reset"):
        ball.simulate(
            1.0, [1.0, 0.0], events=mechc.Event("q_0 - 0.5", reset={"u_0": "log(q_0 - 1)"})
        )


# -- all that goes on after a reset that changes a parameter --------------------------------------


@pytest.fixture(scope="module")
def cart():
    defaults = {"m": 2.0, "k": 30.0}
    model = mechc.compile(pushed_mass(), name="cart", defaults=defaults, outputs=("energy",))
    return model.with_inputs({"F": 0.0})


HARDER = mechc.Event("q < 0", reset={"k": "4*k"})
RATE = np.sqrt(15.0)
TURNED = 0.5 * np.pi / RATE
START, LATER = [0.1, 0.0], 0.7  # s, before the cart passes 0 the second time


def harder(t, k=30.0):
    """The cart after it has passed 0, from where its spring is four times as hard."""
    rate = np.sqrt(k / 2.0)
    angle = 2.0 * rate * (t - 0.5 * np.pi / rate)
    return np.array([-0.05 * np.sin(angle), -0.1 * rate * np.cos(angle)])


def motion(cart, _):
    return cart.simulate(LATER, START, events=HARDER)


def continued(cart, _):
    return cart.simulate(0.45, START, events=HARDER).continue_to(LATER)


def opened(cart, folder):
    return mechc.open(motion(cart, folder).save(folder / "cart.nc"))


def pickled(cart, folder):
    return pickle.loads(pickle.dumps(motion(cart, folder)))


def member(cart, _):
    return cart.simulate_batch(LATER, START, {"k": [20.0, 30.0]}, events=HARDER)[1]


def member_continued(cart, _):
    found = cart.simulate_batch(0.45, START, {"k": [20.0, 30.0]}, events=HARDER)
    return found[1].continue_to(LATER)


def joined(cart, _):
    """Of a motion before it and this one."""
    before = cart.simulate((-0.1, 0.0), START, {"k": 7.0})
    return before.followed_by(cart.simulate(LATER, START, events=HARDER))


@pytest.mark.parametrize(
    "door", [motion, continued, opened, pickled, member, member_continued, joined],
    ids=lambda door: door.__name__,
)  # fmt: skip
def test_what_goes_on_has_the_parameters_that_a_reset_left(cart, door, tmp_path):
    sol = door(cart, tmp_path)
    k = cart.parameters.index("k")
    assert sol.params_at(0.1)[k] == 30.0
    assert sol.params_at(LATER)[k] == sol.segments[-1].params[k] == 120.0
    q, u = harder(LATER)
    np.testing.assert_allclose(sol(LATER), [q, u], atol=1e-9)
    np.testing.assert_allclose(sol.output("rates", LATER), [u, -60.0 * q], atol=1e-7)
    np.testing.assert_allclose(sol.output("energy", LATER), u**2 + 60.0 * q**2, atol=1e-8)


def test_derivatives_through_a_reset_that_changes_parameters_are_refused(cart):
    sol = cart.simulate(LATER, START, events=HARDER)
    for ask in (
        lambda: cart.simulate(LATER, START, events=HARDER, sensitivities=["k"]),
        lambda: sol.gradient("q", by=["k"]),
    ):
        with pytest.raises(mechc.MechcError, match="whose resets change parameters"):
            ask()


def test_a_run_with_checkpoints_has_no_resets(cart):
    with pytest.raises(ValueOutOfBoundsError, match="takes neither events="):
        cart.simulate(LATER, START, events=HARDER, checkpoints=1e6)


def test_a_unit_for_other_programs_has_no_resets_of_parameters(cart, tmp_path):
    with pytest.raises(mechc.MechcError, match="k"):
        mechc.export_fmu(
            pushed_mass(), tmp_path / "cart.fmu", params={"k": 30.0, "m": 2.0}, events=HARDER
        )
