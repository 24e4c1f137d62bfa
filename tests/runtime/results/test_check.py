"""A motion that is checked as a reviewer would: errors, passages, equations, files, the shell."""

import numpy as np
import pytest

import mechc
from mechc.cli.commands import main
from mechc.errors import MechcError


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
    assert found.accelerations < 1e-8
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
    whole = model.simulate(4, start)
    at = whole.change_points[0].t + 0.2
    before = model.simulate((0, whole.change_points[0].t - 1e-3), start)
    q, u = np.split(whole(at), 2)
    theta = dict(zip(model.coordinates, q, strict=True))
    others = model.assemblies({"theta_0": theta["theta_0"]}, {"omega_0": u[0]})
    other = max(others, key=lambda y: np.abs(y[:3] - q).max())
    after = model.simulate((before.span[1], 4), other)
    found = before.followed_by(after).check()
    assert not found.ok
    assert "or one of the motions is wrong" in " ".join(found.warnings)


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


def test_the_shell_prints_it(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "four_bar", "--t-end", "1", "--check", "--json"]) == 0
    assert '"accelerations"' in capsys.readouterr().out
