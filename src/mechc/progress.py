"""A progress bar on a terminal, for what takes over a second."""

from __future__ import annotations

import sys
import time
from types import TracebackType

WIDTH, PATIENCE, INTERVAL = 40, 1.0, 0.1


class ProgressBar:
    """``with ProgressBar("simulating") as bar: ... bar.update(fraction)``."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.started = self.shown_at = time.monotonic()
        self.shown = False

    def update(self, fraction: float) -> None:
        """Show how much is done, once it has taken a second, at most ten times a second."""
        now = time.monotonic()
        if now - self.started < PATIENCE or now - self.shown_at < INTERVAL:
            return
        if not sys.stderr.isatty():
            return
        done = round(WIDTH * min(1.0, fraction))
        bar = "#" * done + "." * (WIDTH - done)
        print(f"\r{self.title} [{bar}] {fraction:4.0%}", end="", file=sys.stderr, flush=True)
        self.shown, self.shown_at = True, now

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self.shown:
            print(f"\r{' ' * (len(self.title) + WIDTH + 10)}\r", end="", file=sys.stderr)
