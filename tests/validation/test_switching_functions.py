"""Laws with corners and jumps, against closed forms: steps end at them, and miss none."""

from dataclasses import replace

import numpy as np
import pytest
from mechc_codegen.description.mechanism import Parameter
from mechc_codegen.library.catalogue import shipped_mechanism
from scipy.integrate import solve_ivp
from sympy import Abs, Heaviside, Max, Symbol, cos, exp, sign, sin, sinh, sqrt, symbols, tanh
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.stability import laws
from tests.support import scenes

pytestmark = pytest.mark.slow

q, u = dynamicsymbols("q u")
t, f = dynamicsymbols._t, Symbol("f")
STIFF = 1e4  # N/m
STEEP = 1e-6  # s


def compiled(load):
    return mechc.compile(scenes.bead_with(load), outputs=())


@pytest.fixture(scope="module")
def wall():
    """On a spring of 4 N/m against a stiff wall at f."""
    return compiled(-4 * q - STIFF * Max(q - f, 0))


def bounced(place, t_end):
    """q and u from q = 0 and u = 2 on, half a swing each side of the wall and within it."""
    rate, depth = np.sqrt(4 + STIFF), place - STIFF * place / (4 + STIFF)
    speed, t = 2 * np.sqrt(1 - place**2), np.arcsin(place) / 2
    within, free = 2 * np.arctan2(speed / rate, depth) / rate, np.pi - np.arccos(place)
    if t_end < t:
        return np.sin(2 * t_end), 2 * np.cos(2 * t_end)
    while t_end >= t + within + free:
        t += within + free
    if t_end < t + within:
        c, s = np.cos(rate * (t_end - t)), np.sin(rate * (t_end - t))
        return place - depth + depth * c + speed / rate * s, speed * c - depth * rate * s
    c, s = np.cos(2 * (t_end - t - within)), np.sin(2 * (t_end - t - within))
    return place * c - speed / 2 * s, -2 * place * s - speed * c


@pytest.mark.parametrize("rtol", [1e-4, 1e-8, 1e-12])
def test_contacts_of_any_depth_are_met(wall, rtol):
    """Down to 1e-9 m and a few microseconds, between any two nodes of a step."""
    for depth in np.logspace(-0.3, -9, 25):
        sol = wall.simulate(10.0, {"q": 0.0, "u": 2.0}, {"f": 1 - depth}, rtol=rtol)
        assert sol.stats["method"] == "gauss8"
        assert np.abs(sol.y[-1] - bounced(1 - depth, 10.0)).max() < 0.1 * rtol + 1e-11, depth


def test_members_of_a_batch_have_the_bits_of_single_runs(wall):
    places = np.array([0.3, 0.9, 0.999])
    batch = wall.simulate_batch(10.0, {"q": 0.0, "u": 2.0}, {"f": places}, rtol=1e-8)
    for place, y in zip(places, batch.y, strict=True):
        one = wall.simulate(10.0, {"q": 0.0, "u": 2.0}, {"f": place}, rtol=1e-8)
        np.testing.assert_array_equal(y, one.y[-1])


@pytest.mark.parametrize("method", ["auto", "gauss8"])
@pytest.mark.parametrize(("rtol", "steps"), [(1e-6, 32), (1e-9, 56), (1e-12, 76)])
def test_friction_that_slides(method, rtol, steps):
    """Each half swing is a cosine about 12.5 mm on one side.  It took 177, 366 and 607 steps."""
    model = compiled(-0.05 * sign(u) - 4 * q)
    half, rest = divmod(12.0, np.pi / 2)
    centre = (-1) ** half * 0.0125
    reach = (-1) ** half * (3.3 - 0.025 * half) - centre
    wanted = centre + reach * np.cos(2 * rest), -2 * reach * np.sin(2 * rest)
    sol = model.simulate(12.0, {"q": 3.3, "u": 0.0}, rtol=rtol, method=method)
    np.testing.assert_allclose(sol.y[-1], wanted, atol=rtol + 1e-12)
    assert sol.stats["steps"] <= steps
    back = model.simulate((12.0, 11.0), sol.y[-1], rtol=rtol, method=method)
    np.testing.assert_allclose(back.y[-1], sol(11.0), atol=rtol + 1e-12)


@pytest.mark.thorough
@pytest.mark.parametrize("family", [laws.hidden_jumps, laws.narrow_features])
def test_jumps_without_a_sign_and_narrow_features(family):
    """The cases of the stress suite at rtol 1e-9: all of them are right."""
    for row in family(quick=True):
        assert row["word"] == "right", row


def beside_nodes():
    """Laws that change within 1e-6 s at f, with the motions from rest that they lead to by 10 s."""
    z, w = (t - f) / STEEP, STEEP
    step, corner = z / sqrt(1 + z**2), sqrt(1 + z**2)

    def stepped(z):
        return w * np.sqrt(1 + z * z), w**2 * (z * np.sqrt(1 + z * z) + np.arcsinh(z)) / 2

    def bent(z):
        root, turned = np.sqrt(1 + z * z), np.arcsinh(z)
        return w**2 * (z * root + turned) / 2, w**3 * (root**3 / 3 + z * turned - root) / 2

    return {"step": (step, stepped), "corner": (w * corner, bent)}


@pytest.mark.parametrize("law", ["step", "corner"])
@pytest.mark.parametrize("lockstep", [True, False])
def test_what_changes_beside_the_nodes_of_a_step_is_seen(law, lockstep):
    """No edge of these laws is known, and no stage of a step lies in its first or last fiftieth."""
    load, integrals = beside_nodes()[law]
    places = np.linspace(2.0, 8.0, 400)
    ends = (
        compiled(load)
        .simulate_batch(
            10.0, np.zeros(2), {"f": places}, method="gauss8", lockstep=lockstep, progress=False
        )
        .y
    )
    (first, moved), (last, reached) = (integrals((x - places) / STEEP) for x in (0.0, 10.0))
    gained = last - first
    assert (np.abs(ends[:, 1] - gained) / np.maximum(1, np.abs(gained))).max() < 5e-8
    assert np.abs(ends[:, 0] - (reached - moved - 10.0 * first)).max() < 5e-6


def test_features_as_wide_as_the_steps_change_nothing():
    """tanh(q) is no feature for steps of its width: they are those of a law without edges."""
    smooth, plain = compiled(-4 * tanh(q)), compiled(-4 * sinh(q) / sqrt(1 + sinh(q) ** 2))
    for rtol in (1e-6, 1e-10):
        one, other = (m.simulate(10.0, [3.0, 0.0], rtol=rtol) for m in (smooth, plain))
        assert one.stats["steps"] == other.stats["steps"]
        assert one.stats["rejected"] == other.stats["rejected"]


def test_an_absolute_value_that_keeps_its_sign_costs_nothing():
    """Drag on one side: u = v tanh(t / v) with v^2 = 10.  The pair of order 8 takes 132 steps."""
    sol = compiled(1 - 0.1 * Abs(u) * u).simulate(10.0, {"q": 0.0, "u": 0.0}, rtol=1e-12)
    assert sol["u"][-1] == pytest.approx(np.sqrt(10) * np.tanh(np.sqrt(10)), abs=1e-11)
    assert sol.stats["steps"] <= 60


def test_hundreds_of_jumps():
    """A force of 1 N that changes its side every pi/40 m has a potential: 9343 steps before."""
    model = compiled(-4 * q + sign(sin(40 * q)))
    sol = model.simulate(10.0, {"q": 1.0, "u": 0.0}, rtol=1e-12)
    x, v = sol.y.T
    energy = v**2 / 2 + 2 * x**2 - np.arccos(np.cos(40 * x)) / 40
    assert np.ptp(energy) < 1e-11
    assert sol.stats["steps"] <= 200
    back = model.simulate((10.0, 0.0), sol.y[-1], rtol=1e-12)
    np.testing.assert_allclose(back.y[-1], [1.0, 0.0], atol=1e-10)


def test_a_linkage_with_coulombs_friction_and_a_motor_that_switches():
    four_bar = shipped_mechanism("four_bar")
    crank, _, rocker = four_bar.speeds
    angle = four_bar.coordinates[2].symbol
    motor = 3 * sign(sin(3 * angle)) - 3 * Abs(rocker.symbol) * rocker.symbol
    torques = (12 - 4 * sign(crank.symbol), motor)
    axis = four_bar.frame.z
    loads = [(four_bar.bodies[i].frame, T * axis) for i, T in zip((0, 2), torques, strict=True)]
    rough = replace(four_bar, name="rough four bar", loads=(*four_bar.loads, *loads))
    model = mechc.compile(rough, outputs=())
    for length in (3.0, 3.5):
        params = {"l_3": length}
        y0 = model.assemble({"theta_0": np.radians(85)}, params=params)
        wanted = model.simulate(6.0, y0, params, rtol=1e-12, method="dop853")
        sol = model.simulate(6.0, y0, params, rtol=1e-6)
        np.testing.assert_allclose(sol.y[-1], wanted.y[-1], atol=2e-6)
        assert sol.stats["steps"] < 0.25 * wanted.stats["steps"]


# -- four laws at once, against SciPy from zero to zero, each piece with one form of every law ---


def rough_bead():
    a, b, c, d, e, g, h, k = own = symbols("a b c d e g h k")
    force = -a * sign(u - b) - c * Max(q - d, 0) - e * Abs(q - g) * u - h * Heaviside(sin(k * t))
    parameters = [Parameter(x, 1.0, scenes.ONE) for x in own]
    bead = scenes._bead(1, (q, 0), (u, 0), lambda r: (force - 4 * q) * r.x, *parameters)
    return mechc.compile(bead, outputs=())


def switched(values, t_end, y):
    """The last state, each piece by SciPy; None where the friction holds the bead."""
    a, b, c, d, e, g, h, k = values
    functions = [
        lambda t, y: y[1] - b, lambda t, y: y[0] - d, lambda t, y: y[0] - g,
        lambda t, y: np.sin(k * t),
    ]  # fmt: skip
    for function in functions:
        function.terminal = True

    def force(form, t, y):
        slides, touches, side, pushed = form
        contact = c * (y[0] - d) * (touches > 0)
        drag = e * side * (y[0] - g) * y[1]
        return -4 * y[0] - a * slides - contact - drag - h * (pushed > 0)

    time = 0.0
    while time < t_end:
        after = [None, y[1], y[1], k * np.cos(k * time)]  # signs where a function is zero
        signs = [x(time, y) for x in functions]
        form = [np.sign(z if abs(s) < 1e-10 else s) if z is not None else np.sign(s)
                for s, z in zip(signs, after, strict=True)]  # fmt: skip
        if abs(signs[0]) < 1e-10:
            ways = {np.sign(force([way, *form[1:]], time, y)) for way in (-1, 1)}
            if len(ways) > 1:
                return None
            form[0] = ways.pop()
        for end, events in ((min(time + 1e-9, t_end), None), (t_end, functions)):
            piece = solve_ivp(
                lambda t, y, form=form: [y[1], force(form, t, y)], (time, end), y, events=events,
                method="DOP853", rtol=1e-13, atol=1e-14, max_step=0.02,
            )  # fmt: skip
            time, y = piece.t[-1], piece.y[:, -1]
            if time >= t_end:
                break
    return y


def test_random_laws_are_followed_from_zero_to_zero():
    model, rng = rough_bead(), np.random.default_rng(7)
    compared = 0
    for _ in range(20):
        places, sizes = rng.uniform(-1, 1, 4), rng.uniform(0, [0.5, 3, 0.3, 5])
        values = np.ravel(np.column_stack([sizes, places]))  # a b c d e g h k
        values[2], values[6], values[7] = 10 ** sizes[1], places[3], 0.5 + sizes[3]
        start = rng.uniform(-1, 1, 2)
        wanted = switched(values, 4.0, start)
        if wanted is None:
            continue
        compared += 1
        for rtol in (1e-5, 1e-8, 1e-11):
            params = dict(zip("abcdeghk", values, strict=True))
            sol = model.simulate(4.0, dict(zip("qu", start, strict=True)), params, rtol=rtol)
            np.testing.assert_allclose(sol.y[-1], wanted, atol=10 * rtol + 1e-10)
    assert compared >= 15


def test_bodies_that_move_alike_meet_no_corner_between_them():
    """What is zero but for the rounding of its terms has no zeros: q_0 - q_1 here, of equal masses
    whose springs differ by a rounding."""
    q, u, a = dynamicsymbols("q:2"), dynamicsymbols("u:2"), Symbol("a")
    one = sin(a) ** 2 + cos(a) ** 2
    forces = [1 - q[0] - Abs(q[0] - q[1]), 1 - one * q[1] - Abs(q[0] - q[1])]
    model = mechc.compile(mechc.from_equations(q, u, None, forces, name="alike"))
    for angle in np.arange(0.1, 3.0, 0.1):
        sol = model.simulate(10.0, np.zeros(4), {"a": angle}, max_steps=1000)
        assert sol.stats["steps"] < 50, angle
        assert abs(sol.y[-1, 0] - (1 - np.cos(10.0))) < 1e-11


def test_a_jump_is_met_where_its_argument_was_far_larger_before():
    """exp(30 (1 - q)) - 1 falls from 1e13 to its zero at q = 1: four against two metres a second
    squared."""
    force = 1 + 3 * sign(exp(30 * (1 - q)) - 1)
    model = mechc.compile(mechc.from_equations([q], [u], None, [force], name="steep"))
    reached = np.sqrt(0.5)
    sol = model.simulate(reached + 0.3, [0.0, 0.0], rtol=1e-9)
    speed = 4 * reached
    assert np.abs(sol.y[-1] - [1 + 0.3 * speed - 0.09, speed - 0.6]).max() < 1e-8
