"""Sizes of what is installed."""

from benchmarks.costs import installed


def test_what_is_installed_is_counted_whole_and_by_part():
    found = installed.installed()
    assert found["bytes"] == sum(found["parts"].values())
    assert {"compiler", "runtime, Python", "mechanisms, compiled"} <= set(found["parts"])
    assert 0 < found["packed"] < found["bytes"]
    assert found["files"] > 100
