"""How long a tool needs for an error: read off its lower envelope, the best peer named."""

import pytest

from benchmarks.timing import envelope


def test_time_at_an_error_is_read_off_the_lower_envelope():
    """Log-log between points that nothing beats; nothing where the error is not reached."""
    time_at = envelope.time_at
    points = [(1e-4, 1.0), (1e-8, 4.0), (1e-6, 9.0), (1e-9, 5.0)]
    assert time_at(points, 1e-6) == pytest.approx(2.0)
    assert time_at(points, 1e-3) == 1.0
    assert time_at(points, 1e-10) is None


def test_a_tool_has_the_time_of_its_fastest_method():
    """Each along its own line: a loose point of one does not displace the line of another."""
    loose = {"tool": "A", "method": "x", "label": "right", "error": 1e-7, "seconds": 3.0}
    line = [{"tool": "A", "method": "y", "label": "right", "error": error, "seconds": seconds}
            for error, seconds in ((1e-4, 1.0), (1e-8, 4.0), (1e-12, 3.5))]  # fmt: skip
    times = envelope.times_of([loose, *line])["A"]
    assert times["1e-06"] == pytest.approx(3.5 ** (1 / 4))
    assert times["1e-12"] == 3.5
    assert envelope.method_of([loose, *line], "A", 1e-6) == "y"


def test_the_best_peer_is_the_fastest_at_that_error_and_no_batch():
    def row(tool, method, error, seconds):
        return {"tool": tool, "method": method, "error": error, "seconds": seconds,
                "label": "right"}  # fmt: skip

    rows = [row("mechc", "auto", 1e-9, 1.0), row("A", "x", 1e-9, 3.0), row("A", "y", 1e-9, 2.0),
            row("B", "x", 1e-5, 0.5), row("A batch", "x", 1e-9, 0.1)]  # fmt: skip
    times = envelope.times_of(rows)
    assert envelope.fastest(times, "1e-08") == ("A", 2.0)
    assert envelope.fastest(times, "1e-08", batch=True) == ("A batch", 0.1)
    assert envelope.fastest(times, "1e-04") == ("B", 0.5)
    assert envelope.fastest(times, "1e-10") is None
