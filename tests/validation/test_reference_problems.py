"""Problems of the field against answers in closed form or quadruple precision.

The numbers and their sources are in ``benchmarks/data``; the mechanisms are the library's.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import pi

import numpy as np
import pytest
from mechc_codegen.library.planar.andrews import ANGLES

import mechc
from tests.support import DATA, LOCKSTEP, by
from tests.support.marks import slow_among

pytestmark = pytest.mark.usefixtures("flags_of_users")
EVERY_TOLERANCE = (1e-6, 1e-8, 1e-10, 1e-12)
MARGIN = 30.0  # of the tolerance times the condition; most runs stay below 10
FLOOR = 1e-13  # below this an error is rounding
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Problem:
    """How a problem starts, what its reference lists, and how its errors grow.

    ``known`` gives the columns of the reference from a model and a solution.  ``condition`` is
    how many times an error at the start grows until the end, over the reference's own scale.
    """

    mechanism: str
    start: Mapping[str, float]
    known: Callable
    condition: float = 1.0
    params: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, int] = field(default_factory=dict)


def columns(*names):
    """Coordinates and speeds as the reference has them."""
    return lambda model, sol: np.stack([sol[name] for name in names], axis=1)


def place_and_velocity(point, turned=0.0):
    """x, y, x', y' of a point, in axes turned by an angle."""
    back = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])

    def known(model, sol):
        index = model.point_names.index(point)
        place = model.points(sol.y, sol.params)[:, index, :2]
        velocity = model.point_velocities(sol.y, sol.params)[:, index, :2]
        return np.hstack([place @ back.T, velocity @ back.T])

    return known


def spin_and_centre(model, sol):
    return np.hstack([sol.u, model.points(sol.y)[:, model.point_names.index("g")]])


def motion_and_forces(model, sol):
    """States, accelerations, multipliers."""
    accelerations = model.rhs(sol.t, sol.y)[:, len(model.coordinates) :]
    return np.hstack([sol.y, accelerations, model.multipliers(sol.y, t=sol.t)])


def states_and_negative_multipliers(model, sol):
    return np.hstack([sol.y, -model.multipliers(sol.y, t=sol.t)])


def reference(name):
    data = json.loads((DATA / f"{name}.json").read_text("utf-8"))
    return {**data, "rows": np.array(data["rows"])}


LEVEL = {"theta": 0.0, "phi": 0.0, "x": 1.5}
ROAD = {"x_l": 0.0, "y_l": 0.5, "x_r": 1.0, "y_r": 0.5, "vx_l": -0.5, "vx_r": -0.5}
HANGING = {"s": 0.5, "alpha_1": pi / 6, "alpha_2": pi / 6, "omega": 2 * pi}
UPRIGHT = {"q_0": pi / 2, "q_1": -pi / 2, "q_2": -pi / 2, "q_3": 0.0, "q_4": -pi / 2,
           "u_0": -1.0, "u_1": 1.0, "u_2": -1.0, "u_4": -1.0}  # fmt: skip
SQUEEZED = dict(zip(ANGLES, reference("andrews")["rows"][0, 1:8], strict=True))
TURN = 2.0

PROBLEMS = {
    "pendulum_1": Problem("pendulum", {"theta_0": -pi / 2}, place_and_velocity("p_1"), condition=3),
    "slider_crank": Problem("slider_crank", LEVEL, columns("theta", "omega", "x")),
    "andrews": Problem("andrews", SQUEEZED, motion_and_forces),
    # Its one row has rates of a hundredth of their largest.
    "car_axis": Problem("car_axis", ROAD, states_and_negative_multipliers, condition=20),
    "flyball_governor": Problem(
        "flyball_governor", HANGING, columns("s", "alpha_1", "v", "nu_1", "psi", "omega")
    ),
    "pendulum_2": Problem(
        "pendulum",
        {"theta_0": pi / 2, "theta_1": pi / 2},
        columns("theta_0", "theta_1", "omega_0", "omega_1"),
        condition=54,
        options={"links": 2},
    ),
    "pendulum_5": Problem(
        "pendulum",
        {f"theta_{k}": pi / 2 for k in range(5)},
        columns(*[f"theta_{k}" for k in range(5)], *[f"omega_{k}" for k in range(5)]),
        options={"links": 5},
    ),
    "heavy_top": Problem("heavy_top", {"w_y": 150.0, "w_z": -4.61538}, spin_and_centre),
    "rigid_body": Problem(
        "rigid_body", {"e_0": 1.0, "y_2": 1.0, "y_3": 1.0}, columns("y_1", "y_2", "y_3")
    ),
    "windows_2": Problem(
        "windows",
        UPRIGHT,
        place_and_velocity("B_0", TURN),
        condition=10,
        params={"tilt": TURN},
    ),
}
CONSERVATIVE = ("pendulum_1", "pendulum_2", "pendulum_5", "heavy_top", "rigid_body", "windows_2")
ANALYTIC = ("pendulum_1", "pendulum_2", "heavy_top", "rigid_body", "flyball_governor")
CONSTRAINED = ("slider_crank", "andrews", "car_axis", "windows_2")
BEFORE_THE_CROSSING = 0.7
LONG_TO_COMPILE = {"andrews", "car_axis", "flyball_governor", "pendulum_5", "windows_2"}


def cases(names):
    """Names of problems, those slow that take long to compile."""
    return slow_among(names, LONG_TO_COMPILE & {*names})


@pytest.fixture(scope="module")
def model_of():
    """A problem's model by name, compiled once."""

    def compiled(name):
        return mechc.load(PROBLEMS[name].mechanism, **PROBLEMS[name].options)

    return compiled


def start_of(model, problem):
    y0 = np.zeros(len(model.coordinates) + len(model.speeds))
    for name, value in problem.start.items():
        y0[model.state_index(name)] = value
    return y0


def run(model, name, rows, **policy):
    """The problem from its start, reported at the times of the reference's rows."""
    problem, times = PROBLEMS[name], rows[:, 0]
    sol = model.simulate(
        (0.0, times[-1]), start_of(model, problem), problem.params, t_eval=times, **policy
    )
    assert sol.status.ok, str(sol.status)
    return sol


def error_of(model, name, sol, rows):
    """Largest error of any column over the largest value of that column in the reference."""
    difference = np.abs(PROBLEMS[name].known(model, sol) - rows[:, 1:]).max(axis=0)
    size = np.abs(rows[:, 1:]).max(axis=0)
    return float((difference / np.where(size > 0, size, 1.0)).max())


def rows_of(name):
    """What is compared at every tolerance; the windows before they first lie flat."""
    rows = reference(name)["rows"]
    return rows[rows[:, 0] <= BEFORE_THE_CROSSING] if name == "windows_2" else rows


@pytest.mark.parametrize("method", ["dopri5", "dop853"])
@pytest.mark.parametrize("name", cases(PROBLEMS))
def test_the_error_follows_rtol_down_to_rounding(model_of, name, method):
    """No plateau: within rtol times the condition at each tolerance, and falling."""
    falls(model_of(name), name, method)


@pytest.mark.parametrize("name", slow_among(ANALYTIC, ANALYTIC[2:]))
def test_that_of_taylor_series_does_too(model_of, name):
    falls(model_of(name), name, "taylor")


def falls(model, name, method):
    rows, problem = rows_of(name), PROBLEMS[name]
    tolerances = EVERY_TOLERANCE[:-1] if method == "dopri5" else EVERY_TOLERANCE
    before = np.inf
    for rtol in tolerances:
        sol = run(model, name, rows, rtol=rtol, method=method)
        error = error_of(model, name, sol, rows)
        assert error < MARGIN * problem.condition * rtol, f"rtol {rtol}: error {error}"
        assert error < max(before / 5, FLOOR), f"rtol {rtol}: {error} after {before}"
        before = error


@pytest.mark.parametrize("name", cases(CONSTRAINED))
def test_closure_is_kept_to_rounding_on_the_dense_output(model_of, name):
    model, rows = model_of(name), rows_of(name)
    sol = run(model, name, rows, rtol=1e-8)
    times = np.linspace(0.0, rows[-1, 0], 500)
    y = sol(times)
    assert np.abs(model.constraints(y, sol.params, times)).max() < 1e-13
    assert np.abs(model.velocity_constraints(y, sol.params, times)).max() < 1e-12
    assert sol.closure.max() < 1e-13
    assert sol.velocity_closure.max() < 1e-12


@pytest.mark.parametrize("name", cases(CONSERVATIVE))
def test_energy_is_kept_as_tightly_as_asked(model_of, name):
    model, rows = model_of(name), rows_of(name)
    for rtol in (1e-7, 1e-11):
        assert run(model, name, rows, rtol=rtol).energy_drift < rtol


@pytest.mark.parametrize(("name", "angle", "torque"), [
    ("slider_crank", "theta", 10.0),
    pytest.param("andrews", "beta", 0.033, marks=pytest.mark.slow),
])  # fmt: skip
def test_energy_grows_by_the_work_of_the_torque(model_of, name, angle, torque):
    """The spring's pair of forces has the potential it is given, and closure does no work."""
    sol = run(model_of(name), name, rows_of(name), rtol=1e-12)
    work = torque * (sol[angle] - sol[angle][0])
    np.testing.assert_allclose(sol.energy - sol.energy[0], work, atol=1e-11 * abs(work[-1]), rtol=0)


def test_slider_crank_at_one_second(model_of):
    sol = model_of("slider_crank").simulate(1.0, [0.0, 0.0, 1.5, 0.0, 0.0, 0.0], rtol=1e-12)
    assert sol["x"][-1] == pytest.approx(1.3550640434287042, rel=1e-12)


@pytest.mark.slow
def test_andrews_mechanism_to_ten_digits(model_of):
    """Angles, rates, accelerations and forces at 0.03 s, each to 1e-10 of its own size."""
    rows = rows_of("andrews")
    model = model_of("andrews")
    sol = run(model, "andrews", rows, rtol=1e-12)
    got = PROBLEMS["andrews"].known(model, sol)[-1]
    np.testing.assert_allclose(got, rows[-1, 1:], rtol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dop853", LOCKSTEP])
def test_andrews_mechanisms_in_lockstep(model_of, method):
    """Of several torques and lengths, against collocation, and each as by itself, bit for bit."""
    model, y0, span = model_of("andrews"), rows_of("andrews")[0, 1:15], 0.03
    params = {"T": np.linspace(0.0, 0.05, 11), "sa": np.linspace(0.017, 0.02, 11)}
    batch = model.simulate_batch(span, y0, params, rtol=1e-10, **by(method))
    exact = model.simulate_batch(span, y0, params, rtol=1e-13, method="gauss8")
    assert batch.ok.all()
    scale = np.abs(exact.y).max(axis=0)
    assert (np.abs(batch.y - exact.y) / scale).max() < 1e-8
    for k in (0, 4, 10):
        each = {name: values[k] for name, values in params.items()}
        sol = model.simulate(span, y0, each, rtol=1e-10, **by(method))
        assert np.array_equal(sol.y[-1], batch.y[k])
    if method == "dop853":  # alone every stage is put on the constraints
        assert batch["closure_iterations"].max() < 0.5 * batch["rhs_evaluations"].max()


@pytest.mark.slow
def test_andrews_mechanism_is_assembled_from_one_angle(model_of):
    """The published start, from Theta = 0 and a rough guess; four ways to close in all."""
    model = model_of("andrews")
    guess = {name: round(value, 1) for name, value in SQUEEZED.items() if name != "Theta"}
    y0 = model.assemble({"Theta": 0.0}, guess=guess)
    np.testing.assert_allclose(y0[:7], list(SQUEEZED.values()), atol=1e-14)
    ways = model.assemblies({"Theta": 0.0})
    assert len(ways) == 4
    assert np.abs(model.constraints(ways)).max() < 1e-15


@pytest.mark.slow
def test_car_axis_is_continued_and_runs_backwards(model_of):
    """A constraint that depends on time holds from any time, in either direction."""
    model, rows = model_of("car_axis"), rows_of("car_axis")
    start = start_of(model, PROBLEMS["car_axis"])
    half = model.simulate((0.0, 1.3), start, rtol=1e-12)
    rest = model.simulate((1.3, 3.0), half.y[-1], rtol=1e-12)
    np.testing.assert_allclose(rest.y[-1], rows[-1, 1:9], atol=1e-11)
    back = model.simulate((3.0, 0.0), rows[-1, 1:9], rtol=1e-12)
    np.testing.assert_allclose(back.y[-1], start, atol=1e-10)
    assert back.closure.max() < 1e-14
    with pytest.raises(mechc.AssemblyError, match="y0 leaves 'left end across the axle' at"):
        model.simulate((1.0, 3.0), start)


@pytest.mark.slow
def test_car_axis_is_nearer_to_the_reference_than_the_published_solution(model_of):
    data = reference("car_axis")
    model = model_of("car_axis")
    error = error_of(model, "car_axis", run(model, "car_axis", data["rows"], rtol=1e-12),
                     data["rows"])  # fmt: skip
    published = np.abs(np.array(data["published"]) / data["rows"][0, 1:] - 1).max()
    assert error < published / 10


@pytest.mark.slow
def test_both_rods_of_the_governor_move_alike(model_of):
    """Their angles are independent coordinates; symmetry is a result."""
    sol = run(model_of("flyball_governor"), "flyball_governor", rows_of("flyball_governor"),
              rtol=1e-9)  # fmt: skip
    np.testing.assert_allclose(sol["alpha_1"], sol["alpha_2"], rtol=0, atol=1e-13)


def test_pendulum_after_844_periods(model_of):
    """At 2000 s an error of the period has grown 844 times."""
    model = model_of("pendulum_1")
    sol = model.simulate(2000.0, [pi / 2, 0.0], rtol=1e-12, dense=False)
    place = model.points(sol.y[-1])[-1, :2]
    np.testing.assert_allclose(place, reference("pendulum_1")["far"], atol=2e-8)


def test_free_body_keeps_angular_momentum_and_a_unit_quaternion(model_of):
    """Four coordinates, three speeds, q' = N(q) u: the attitude is as right as the speeds."""
    rows = rows_of("rigid_body")
    for rtol in (1e-8, 1e-12):
        sol = run(model_of("rigid_body"), "rigid_body", rows, rtol=rtol)
        momentum = model_of("rigid_body").momenta(sol.y).angular[:, 0]
        assert np.abs(momentum - momentum[0]).max() < 10 * rtol
        assert np.abs((sol.q**2).sum(axis=1) - 1).max() < rtol
        assert np.ptp(sol.q[:, 0]) > 1


def test_a_length_does_not_loosen_the_tolerance_of_plain_numbers(model_of):
    """A quaternion is of size one whatever the body's size is."""
    model = model_of("rigid_body")
    start = start_of(model, PROBLEMS["rigid_body"])
    one, other = (model.simulate(5.0, start, {"d": d}).y for d in (1.0, 1000.0))
    np.testing.assert_array_equal(one, other)


@pytest.mark.slow
@pytest.mark.parametrize("turn", [0.0, 0.3, 2.0, -1.1])
@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_windows_pass_the_crossings_however_the_scene_is_turned(model_of, turn, rtol):
    """Flat, the windows have two constraints fewer; relative angles, so nothing is zero by luck."""
    model, data = model_of("windows_2"), reference("windows_2")
    rows, problem = data["rows"], PROBLEMS["windows_2"]
    sol = model.simulate(
        rows[-1, 0], start_of(model, problem), {"tilt": turn}, rtol=rtol, t_eval=rows[:, 0]
    )
    assert sol.status.ok, str(sol.status)
    known = place_and_velocity("B_0", turn)(model, sol)
    assert np.abs(known - rows[:, 1:]).max() < 1000 * rtol
    first, second = data["crossings"]
    expected = [first, second, first + data["period"]]
    np.testing.assert_allclose([c.t for c in sol.change_points], expected, atol=100 * rtol)


@pytest.mark.slow
def test_windows_at_tight_tolerance_are_right_or_flagged(model_of):
    """Where doubles make it hard, a run that ends well is right; none is silently wrong."""
    model, data = model_of("windows_2"), reference("windows_2")
    rows = data["rows"]
    for turn in (0.0, 0.3, 2.0):
        sol = model.simulate(
            rows[-1, 0], start_of(model, PROBLEMS["windows_2"]), {"tilt": turn},
            rtol=1e-11, t_eval=rows[:, 0], max_steps=5000,
        )  # fmt: skip
        known = place_and_velocity("B_0", turn)(model, sol)
        assert np.abs(known - rows[: len(sol), 1:]).max() < 1e-7
        assert sol.status.ok == (len(sol) == len(rows))


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_steps_know_the_rounding_of_their_errors(model_of, method):
    """The top passes gimbal lock at 5e-7 rad, where rates round by 4e-10 of themselves: no shorter
    step lowers that."""
    model = model_of("heavy_top")
    start, tight = model.assemble(), {"dop853": 1e-13, "dopri5": 1e-12}[method]
    order = {"dop853": 8, "dopri5": 5}[method]
    exact = model.points(model.simulate(10.0, start, method="gauss8", rtol=1e-14).y)[-1]
    runs = [model.simulate(10.0, start, method=method, rtol=r) for r in (1e-9, tight)]
    decades = np.log10(1e-9 / tight)
    assert all(run.t[-1] == 10.0 for run in runs)
    assert abs(model.points(runs[1].y)[-1] - exact).max() < 2e-10
    grows = (runs[1].stats["steps"] / runs[0].stats["steps"]) ** (1 / decades)
    assert grows < 1.2 * 10 ** (1 / order)
