"""A motion that is checked as a reviewer would: errors, passages, equations, files, the shell."""

from dataclasses import replace

import numpy as np
import pytest
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import particle
from mechc.cli.commands import main
from mechc.errors import MechcError
from mechc.simulation.record import Record


@pytest.fixture(scope="module")
def model():
    return mechc.load("four_bar")


@pytest.fixture(scope="module")
def start(model):
    return model.assemble({"theta_0": np.radians(85)})


def test_a_motion_through_change_points_is_sound(model, start):
    sol = model.simulate(4, start)
    found, count = sol.check(), len(sol.change_points)
    assert found.ok
    assert not found.notes
    assert found.states == 40
    assert found.rates < 1e-8
    assert count > 0
    assert [(each.what, each.count, each.again) for each in found.passages] == [
        ("change points", count, count)
    ]
    assert "error of theta_0" in str(found)
    assert "sound" in repr(found)


@pytest.mark.parametrize("method", ["dopri5", "dop853", "gauss8", "radau5"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_estimates_are_the_errors(model, start, method, rtol):
    sol = model.simulate(3, start, method=method, rtol=rtol)
    exact = model.simulate(3, start, method="gauss8", rtol=1e-13)
    times = np.linspace(0, 3, 400)
    true = np.abs(sol(times) - exact(times)).max()
    estimate = max(sol.check().error)
    assert true / 10 < estimate < 10 * true


def test_a_leap_to_another_branch_is_found(model, start):
    """In the record it follows on without a jump, as a run that leapt would have it."""
    whole = model.simulate(4, start)
    at = whole.change_points[0].t + 0.2
    before = model.simulate((0, whole.change_points[0].t - 1e-3), start)
    q, u = np.split(whole(at), 2)
    theta = dict(zip(model.coordinates, q, strict=True))
    others = model.assemblies({"theta_0": theta["theta_0"]}, {"omega_0": u[0]})
    other = max(others, key=lambda y: np.abs(y[:3] - q).max())
    after = model.simulate((before.span[1], 4), other)
    after.record = Record([*before.record.pieces, *after.record.pieces], after.stats)
    found = after.check()
    assert not found.ok
    assert "or one of the motions is wrong" in " ".join(found.warnings)


def test_a_motion_that_was_joined_is_refused(model, start):
    first = model.simulate(1, start)
    kicked = first.y[-1] * [1, 1, 1, 0, 0, 0]
    whole = first.followed_by(model.simulate((1, 2), kicked))
    with pytest.raises(MechcError, match="joined of several runs"):
        whole.check()
    with pytest.raises(MechcError, match="joined of several runs"):
        whole.continue_to(2.1).check()


@pytest.mark.parametrize("amplitude", [1e-3, 1e-6])
def test_roundings_of_the_energy_are_no_fault(amplitude):
    pendulum = mechc.load("pendulum")
    found = pendulum.simulate(10, [amplitude, 0.0]).check()
    assert found.ok, found.warnings


def test_the_error_of_another_motion_is_not_this_ones():
    """Over many periods that of an explicit method grows, and is told as its own."""
    pendulum = mechc.load("pendulum")
    sol = pendulum.simulate(2000, [3.1, 0.0], rtol=1e-4, method="gauss8")
    found = sol.check()
    true = np.abs(sol.y[-1] - pendulum.simulate(2000, [3.1, 0.0], rtol=1e-12).y[-1]).max()
    assert max(np.abs(found.error_at_end)) == pytest.approx(true, rel=0.5)
    for warning in found.warnings:
        if "times rtol" in warning:
            assert max(found.error) > 1000 * 1e-4
        else:
            assert "the motion by dop853 differs" in warning


def test_a_stiff_motion_is_checked_in_its_own_time():
    q, u = dynamicsymbols("q u")
    bead = mechc.compile(particle([q], [u], [-1e6 * u - q]), defaults={"m": 1.0})
    found = bead.simulate(10, [1.0, 0.0], method="gauss8").check()
    assert found.ok, found.warnings


def test_a_motion_that_ends_early_is_compared_as_far_as_it_got(model, start):
    sol = model.simulate(10, start, max_steps=60)
    found = sol.check()
    assert sol.t[-1] < 9
    assert max(found.error) < 1e-6
    assert [each.split(" (")[0] for each in found.warnings] == ["the motion ended early"]


def test_a_motion_is_not_compared_with_itself(model, start):
    found = model.simulate(1, start, rtol=1e-13).check()
    assert found.method not in [method for method, _ in found.others]
    assert min(found.error) > 0


def test_jumps_of_a_function_are_found_by_collocation():
    """By the rates at the ends of its steps, which no stage is near; it missed some of them."""
    q, u = dynamicsymbols("q u")
    cart = mechc.compile(particle([q], [u], [dynamicsymbols("F") - 40 * q]), defaults={"m": 2.0})
    slowed = mechc.Event("q", reset={"u": "0.9*u"})  # at times that differ by rounding
    asked = {"t_span": 5, "y0": [0.1, 0.0], "rtol": 1e-10, "events": [slowed]}
    for at in np.linspace(1.0, 1.5, 20):
        jump = mechc.Signal([0, at, 5], [5.0, -5.0, -5.0], "previous")
        true = cart.simulate(**asked, inputs={"F": jump}).y[-1]
        function = {"F": lambda t, at=at: 5.0 if t < at else -5.0}
        sol = cart.simulate(**asked, inputs=function, method="gauss8")
        np.testing.assert_allclose(sol.y[-1], true, rtol=0, atol=1e-8)
        assert np.abs(sol.check().error_at_end).max() < 1e-8


def test_without_dense_output_it_is_refused(model, start):
    with pytest.raises(MechcError, match="dense=True"):
        model.simulate(1, start, dense=False).check()


def test_events_are_compared(model, start):
    sol = model.simulate(4, start, events=[mechc.Event("theta_0 - pi/2")])
    found = sol.check()
    assert found.ok
    zeros = found.passages[-1]
    assert "theta_0" in zeros.what
    assert zeros.count == zeros.again > 0
    assert zeros.apart < 1e-9


def test_it_is_saved_and_repeated(model, start, tmp_path, capsys):
    sol = model.simulate(2, start)
    plain, checked = tmp_path / "plain.nc", tmp_path / "checked.nc"
    sol.save(plain)
    sol.check()
    sol.save(checked)
    assert main(["verify", str(plain)]) == 0
    assert "check" not in capsys.readouterr().out
    assert main(["verify", str(checked)]) == 0
    told = capsys.readouterr().out
    assert told.count("Newton and Euler") == 2
    assert "made again" in told


def test_what_cannot_be_checked_now_is_said(tmp_path, capsys):
    model = mechc.load("four_bar")
    sol = model.simulate(1, model.assemble({"theta_0": 1.2}), events=[mechc.Stop("2 - theta_0")])
    sol.check()
    sol.save(tmp_path / "solution.nc")
    assert main(["verify", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "it cannot be made again here: a file has the times of events" in told
    assert told.splitlines()[-1].endswith("whether its motion is right was not checked now")


def test_the_verdict_names_what_was_not_checked(model, start):
    found = model.simulate(1, start).check()
    assert found.rows()[-1] == ("result", "sound")
    lacking = replace(found, notes=("the equations of motion: they come from a Lagrangian",))
    assert str(lacking).endswith("sound as far as checked; not checked: the equations of motion")
    assert "not checked: the equations of motion" in repr(lacking)


def test_the_folder_of_a_sweep_is_verified_and_that_of_a_run_opened(model, start, tmp_path, capsys):
    model.simulate_batch(0.1, [start] * 2, out=tmp_path / "batch", progress=False)
    assert main(["verify", str(tmp_path)]) == 0
    assert "all sound" in capsys.readouterr().out
    model.simulate(0.1, start).save(tmp_path / "solution.nc")
    assert main(["open", str(tmp_path), "--view", str(tmp_path / "seen.html")]) == 0
    assert (tmp_path / "seen.html").is_file()


def test_the_shell_prints_it(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "four_bar", "--t-end", "1", "--check", "--json"]) == 0
    assert '"rates"' in capsys.readouterr().out
