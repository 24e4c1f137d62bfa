"""What mechc takes of a disk."""

from benchmarks.costs import footprint


def test_what_is_installed_is_counted_whole_and_by_part():
    found = footprint.installed()
    assert found["bytes"] == sum(found["parts"].values())
    assert {"compiler", "runtime, Python", "mechanisms, compiled"} <= set(found["parts"])
    assert 0 < found["packed"] < found["bytes"]
    assert found["files"] > 100
