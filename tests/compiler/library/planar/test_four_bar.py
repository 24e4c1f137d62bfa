"""What a four-bar may be asked for beyond weight: each does what mechanics says, and no more."""

import json

import numpy as np
import pytest
from scipy.integrate import quad
from sympy import Float, Heaviside, sin
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.cli.commands import main
from mechc.compilation import build
from mechc.compilation.library import library
from mechc.errors import MechcError
from tests.support.linkages.synthesis import four_bar as placed_four_bar

REGULAR = {"l_3": 3.5}
TORQUE, SHUT_OFF, END = "log(2.5 - t)", 1.5, 2.5


def test_a_placed_linkage_is_the_same_one_turned_and_moved():
    placed, params = placed_four_bar(), {"x_C": 0.7, "y_C": -1.2}
    at_rest = {"l_3": 3.5, "Omega_0": 0.0, **params}
    turned = {**at_rest, "alpha": 0.7, "x_O": -1.0, "y_O": 2.0}
    first = placed.assemble({"theta_0": 1.1}, params=at_rest)
    second = placed.assemble({"theta_0": 1.8}, params=turned)
    np.testing.assert_allclose(second[:3], first[:3] + 0.7, rtol=1e-14)
    c, s = np.cos(0.7), np.sin(0.7)
    moved = placed.points(first, at_rest)[:, :2] @ np.array([[c, s], [-s, c]]) + [-1.0, 2.0]
    np.testing.assert_allclose(placed.points(second, turned)[:, :2], moved, atol=1e-14)


@pytest.fixture(scope="module")
def loaded():
    """Friction, a traced coupler point and a torque that leaves its domain at 2.5 s, in one."""
    return mechc.load("four_bar", friction=True, crank_torque=TORQUE, coupler_point=True)


def run(model, params, t_end=2.0, **speeds):
    start = model.assemble({"theta_0": np.radians(85)}, speeds or None, params=params)
    return model.simulate(t_end, start, params, rtol=1e-11)


def work(sol, power):
    """The integral of power(t, state) over the run."""
    value, error = quad(
        lambda t: power(t, sol(t)), *sol.span, epsabs=1e-11, epsrel=1e-11, limit=400
    )
    assert error < 1e-8
    return value


def gain(sol):
    return sol.energy[-1] - sol.energy[0]


@pytest.mark.slow
def test_options_bring_their_parameters_at_zero(loaded):
    new = ("c_0", "c_1", "c_2", "c_3", "x_C", "y_C")
    assert set(loaded.parameters) - set(mechc.load("four_bar").parameters) == set(new)
    assert [loaded.defaults[name] for name in new[:4]] == [0.0] * 4
    assert loaded.options == {"friction": True, "crank_torque": TORQUE, "coupler_point": True}
    assert all(loaded.units[name] and loaded.descriptions[name] for name in new)
    assert "crank_speed" in loaded.report()


def test_at_zero_nothing_changes(loaded):
    plain, y = mechc.load("four_bar"), np.random.default_rng(3).normal(size=(50, 6))
    for output in ("mass_matrix", "forcing", "energy", "constraints"):
        expected = getattr(plain, output)(y)
        scale = np.abs(expected).max()
        got = getattr(loaded, output)(y, t=SHUT_OFF)
        np.testing.assert_allclose(got, expected, atol=1e-13 * scale)


def dissipation(c, y):
    """Power taken out by the joints: c_k times the square of the speed across joint k."""
    across = np.diff(np.concatenate([[0.0], y[3:], [0.0]]))
    return float(np.dot(c, across**2))


@pytest.mark.parametrize(
    "c", [(0.3, 0, 0, 0), (0, 0.2, 0, 0), (0, 0, 0.4, 0), (0, 0, 0, 0.5), (0.1, 0.2, 0.3, 0.4)]
)
def test_friction_takes_out_what_the_joints_dissipate(loaded, c):
    sol = run(loaded, REGULAR | {f"c_{k}": float(value) for k, value in enumerate(c)})
    put_in = work(sol, lambda t, y: np.log(2.5 - t) * y[3])
    lost = work(sol, lambda t, y: dissipation(c, y))
    assert lost > 0.1
    assert gain(sol) == pytest.approx(put_in - lost, abs=1e-7)


def test_a_torque_of_time_puts_in_its_power(loaded):
    sol = run(loaded, REGULAR)
    assert gain(sol) == pytest.approx(work(sol, lambda t, y: np.log(2.5 - t) * y[3]), abs=1e-7)
    assert abs(gain(sol)) > 0.1
    assert sol.closure.max() < 1e-13


def test_friction_coefficients_are_not_negative(loaded):
    with pytest.raises(MechcError, match=r"c_1 = -1 N m s .* >= 0"):
        loaded.energy(np.zeros(6), {"c_1": -1.0})


def test_the_coupler_point_is_fixed_to_the_coupler(loaded):
    params = REGULAR | {"x_C": 0.7, "y_C": -1.2}
    sol = run(loaded, params)
    assert loaded.traced == ("C",)
    points = loaded.points(sol.y, sol.params)
    p_1, p_2, C = (points[:, loaded.point_names.index(name)] for name in ("p_1", "p_2", "C"))
    np.testing.assert_allclose(np.linalg.norm(C - p_1, axis=1), np.hypot(0.7, 1.2), rtol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(C - p_2, axis=1), np.hypot(1.3, 1.2), rtol=1e-14)
    turn = np.cross((p_2 - p_1), (C - p_1))[:, 2]
    np.testing.assert_allclose(turn, 2.0 * -1.2, rtol=1e-13)
    velocity = loaded.point_velocities(sol.y, sol.params)[:, loaded.point_names.index("C")]
    arm = C - p_1
    swung = sol["omega_1"][:, None] * np.stack([-arm[:, 1], arm[:, 0], 0 * arm[:, 0]], axis=1)
    of_p_1 = loaded.point_velocities(sol.y, sol.params)[:, loaded.point_names.index("p_1")]
    np.testing.assert_allclose(velocity, of_p_1 + swung, atol=1e-13)


@pytest.fixture(scope="module")
def driven():
    """A prescribed crank speed, and a torque on the crank beside it."""
    return mechc.load("four_bar", crank_speed=True, crank_torque=True)


@pytest.mark.slow
def test_a_prescribed_speed_is_held_and_the_loop_stays_closed(driven):
    params = {"l_0": 1.0, "l_1": 3.0, "l_2": 3.0, "l_3": 3.5, "Omega_0": 4.0}
    start = driven.assemble({"theta_0": 0.5}, params=params)
    assert start[3] == pytest.approx(4.0, abs=1e-14)
    sol = driven.simulate(5.0, start, params)
    t = np.linspace(0, 5, 1001)
    y = sol(t)
    np.testing.assert_allclose(y[:, 3], 4.0, rtol=0, atol=1e-13)
    np.testing.assert_allclose(y[:, 0], 0.5 + 4.0 * t, rtol=0, atol=1e-9)
    assert sol.closure.max() < 1e-13
    assert np.abs(driven.constraints(y, sol.params)).max() < 1e-13
    assert np.abs(driven.velocity_constraints(y, sol.params)).max() < 1e-13
    assert driven.constraint_names[-1] == "prescribed crank speed"


def test_the_drive_torque_is_the_power_balance(driven):
    """The multiplier of the drive is the torque that accounts for the energy."""
    params = {"l_1": 3.0, "l_3": 3.5, "Omega_0": 4.0}
    sol = driven.simulate(1.3, driven.assemble({"theta_0": 0.5}, params=params), params, rtol=1e-11)
    put_in = work(sol, lambda t, y: -4.0 * driven.multipliers(y, sol.params)[2])
    assert gain(sol) == pytest.approx(put_in, abs=1e-7)
    assert abs(gain(sol)) > 0.1


def test_a_torque_on_the_crank_is_one_that_the_drive_need_not_give(driven):
    params = {"l_1": 3.0, "l_3": 3.5, "Omega_0": 4.0}
    y = driven.assemble({"theta_0": 0.5}, params=params)
    alone = driven.multipliers(y, params)
    helped = driven.multipliers(y, params | {"T_0": 2.5})
    np.testing.assert_allclose(helped - alone, [0.0, 0.0, 2.5], atol=1e-12 * np.abs(alone).max())
    assert driven.defaults["T_0"] == driven.defaults["Omega_0"] == 0.0


def test_the_speed_prescribed_cannot_be_contradicted(driven):
    with pytest.raises(MechcError, match=r"no speeds with omega_0 = 1 .*prescribed crank speed"):
        driven.assemble({"theta_0": 0.5}, {"omega_0": 1.0}, params=REGULAR)


def test_not_a_number_ends_the_run_by_name_and_keeps_what_was_computed(loaded):
    sol = run(loaded, REGULAR, t_end=4.0)
    assert not sol.status.ok
    assert sol.status.code in ("not finite", "step too small")
    assert sol.status.t == pytest.approx(END, abs=1e-6)
    assert "at t = 2.5 s" in str(sol.status) or "at t = 2.49999" in str(sol.status)
    assert np.isfinite(sol.y).all()
    assert sol.t[-1] == sol.status.t
    np.testing.assert_allclose(sol(0.5), run(loaded, REGULAR, 0.5).y[-1], atol=1e-8)


def test_a_variant_opens_again_from_a_file(loaded, tmp_path):
    sol = run(loaded, REGULAR, t_end=0.5)
    again = mechc.open(sol.save(tmp_path / "run.nc"))
    assert again.model is loaded
    np.testing.assert_array_equal(again.y, sol.y)


def test_variants_run_from_the_command_line(capsys, loaded):
    options = ("--with", "friction", "--with", f"crank_torque={TORQUE}", "--with", "coupler_point")
    arguments = ("run", "four_bar", *options, "--set", "l_3=3.5", "--set", "c_0=0.5", "--json")
    assert main([*arguments, "--t-end", "1"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["parameters"]["c_0"] == 0.5
    assert told["energy_drift"] < 1e-9  # besides the work of friction and torque
    assert abs(told["work"]) > 0.01


def test_an_instruction_set_cannot_be_asked_of_a_variant():
    with pytest.raises(ValueError, match="omit instruction_set"):
        mechc.load("four_bar", instruction_set="baseline", friction=True)


def test_a_variant_that_is_cached_is_not_derived_again(loaded, monkeypatch):
    options = {"friction": True, "crank_torque": TORQUE, "coupler_point": True}
    monkeypatch.setattr(build, "_compiled", {})
    monkeypatch.setattr(library, "mechanism_of", None)
    again = mechc.load("four_bar", **options)
    assert again.build["key"] == loaded.build["key"]
    assert again.options == loaded.options
    with pytest.raises(TypeError):
        mechc.load("four_bar", friction=True)


def test_options_that_cannot_be_read_again_are_not_promised(loaded):
    """What a file or a pickle keeps of an expression is its text."""
    t = dynamicsymbols._t
    assert library._reads_again({"crank_torque": 2 * sin(3 * t)}, {"crank_torque": "2*sin(3*t)"})
    for torque in (Heaviside(t), Float("0.1234567890123456789", 17) * t):
        assert not library._reads_again({"crank_torque": torque}, {"crank_torque": str(torque)})
