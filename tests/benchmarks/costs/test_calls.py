"""What a call of ``simulate`` costs beside the integration."""

from benchmarks.costs import calls


def test_the_parts_of_a_call_are_less_than_the_call(monkeypatch):
    monkeypatch.setattr(calls, "ROUNDS", 5)
    parts = calls.parts()
    assert all(value > 0 for value in parts.values())
    assert set(calls.parts()) == set(parts)
