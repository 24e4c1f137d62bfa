"""Error estimates of ``sol.check()`` over true errors."""

from benchmarks.suite import checks


def _row(true, estimate, warnings=()):
    return {"true": true, "estimate": estimate, "warnings": list(warnings)}


def test_estimates_within_a_factor_and_silent_ones_are_counted():
    rows = [_row(1e-6, 2e-6), _row(1e-6, 2e-5), _row(1e-6, 1e-8), _row(1e-6, 1e-8, ["chaos"])]
    assert checks.counts(rows) == {"count": 4, "within": 1, "silent": 1}


def test_a_scene_of_the_suite_is_checked(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("MECHC_BENCH_OUT", str(tmp_path))
    assert checks.main(["--quick", "--scene", "pendulum_1"]) == 0
    told = capsys.readouterr().out
    assert "gauss8" in told
    assert "0 below a tenth without a warning" in told
    assert (tmp_path / "check.json").is_file()
