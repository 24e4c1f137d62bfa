"""Memory of processes of their own."""

from benchmarks.timing import processes


def test_memory_is_that_of_the_process_asked():
    """A hundred megabytes of this process are not counted to the one that it starts."""
    held = bytearray(10**8)
    held[::4096] = b"x" * len(held[::4096])
    small = processes.said("print(json.dumps(peak_bytes()))")
    large = processes.said("x = b'x' * 50_000_000; print(json.dumps(peak_bytes()))")
    assert 4e7 < large - small < 7e7
    assert small < 5e7
