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


def test_the_best_peer_is_the_fastest_at_that_error_and_no_batch():
    def row(tool, method, error, seconds):
        return {"tool": tool, "method": method, "error": error, "seconds": seconds,
                "label": "right"}  # fmt: skip

    rows = [row("mechc", "auto", 1e-9, 1.0), row("A", "x", 1e-9, 3.0), row("A", "y", 1e-9, 2.0),
            row("B", "x", 1e-5, 0.5), row("A batch", "x", 1e-9, 0.1)]  # fmt: skip
    times = envelope.times_of(rows)
    best = envelope.best_peer(rows, times)
    assert best["1e-08"] == {"tool": "A", "method": "y", "ratio": 2.0}
    assert best["1e-04"] == {"tool": "B", "method": "x", "ratio": 0.5}
    assert best["1e-10"] is None
    assert envelope.ratios(times)["A batch"]["1e-08"] is None  # no batch of mechc's here
