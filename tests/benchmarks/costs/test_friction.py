"""Costs of dry friction are measured, and events are the same in every way to say them."""

import json

from benchmarks.costs import friction


def test_a_ball_has_the_same_steps_and_events_in_every_way(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(friction, "REPEATS", 1)
    assert friction.main(["--members", "8", "--out", str(tmp_path / "friction.json")]) == 0
    found = json.loads((tmp_path / "friction.json").read_text("utf-8"))
    assert found["friction over plain"] > 0
    assert len(found["ball"]) == 3
    assert "us a step, friction" in capsys.readouterr().out
