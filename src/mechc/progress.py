"""Progress of work of more than a second: a bar on a terminal, elsewhere lines now and then."""

from __future__ import annotations

import sys
import threading
import time
from typing import Self

WIDTH, NOTE, PATIENCE, INTERVAL = 40, 30, 1.0, 0.1
SILENCE = 2.0  # s before a notice where there is no terminal
LINES = 10.0  # s between two lines of a bar where there is no terminal, and before the first


class ProgressBar:
    """``with ProgressBar("simulating") as bar: ... bar.update(fraction)``."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.started = self.shown_at = time.monotonic()
        self.shown = False

    def update(self, fraction: float, note: str = "") -> None:
        """Show the fraction done: after the first second, at most ten times a second.

        Where stderr is no terminal, as in a log, it is a line every ten seconds.
        """
        now, drawn = time.monotonic(), sys.stderr.isatty()
        patience, interval = (PATIENCE, INTERVAL) if drawn else (LINES, LINES)
        if now - self.started < patience or now - self.shown_at < interval:
            return
        self.shown_at = now
        if not drawn:
            print(f"{self.title}: {fraction:.0%} {note}".rstrip(), file=sys.stderr, flush=True)
            return
        done = round(WIDTH * min(1.0, fraction))
        bar = "#" * done + "." * (WIDTH - done)
        text = f"\r{self.title} [{bar}] {fraction:4.0%} {note:{NOTE}}"
        print(text, end="", file=sys.stderr, flush=True)
        self.shown = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.shown:
            print(f"\r{' ' * (len(self.title) + WIDTH + NOTE + 10)}\r", end="", file=sys.stderr)


class Notice:
    """``with Notice("compiling ..."): ...``: shown after a second on a terminal, until the end.

    Elsewhere it is a line, after two seconds.  Within another notice of the thread it takes the
    place of its text, so that long work in several stages says which one it has come to.

    ``told``: what has been done, printed with its seconds in a line that stays, if it took more
    than one, also where there is no terminal.
    """

    _thread = threading.local()

    def __init__(self, text: str, told: str = "") -> None:
        self.text, self.told = text, told
        self.started = time.monotonic()
        self.outer: Notice | None = getattr(Notice._thread, "notice", None)
        self.due, self.shown = False, ""

    def _show(self) -> None:
        self.due = True
        self.change(self.text)

    def change(self, text: str) -> None:
        """Show what is done from now on, at once if the work has lasted so long."""
        self.text = text
        if self.outer is not None:
            self.outer.change(text)
        elif self.due:
            self._erase()
            drawn = sys.stderr.isatty()
            print(text, end="" if drawn else "\n", file=sys.stderr, flush=True)
            self.shown = text if drawn else ""

    def _erase(self) -> None:
        if self.outer is not None:
            self.outer._erase()
        elif self.shown:
            print(f"\r{' ' * len(self.shown)}\r", end="", file=sys.stderr, flush=True)
            self.shown = ""

    def __enter__(self) -> Self:
        Notice._thread.notice = self
        if self.outer is not None:
            self.outer.change(self.text)
            return self
        self._timer = threading.Timer(PATIENCE if sys.stderr.isatty() else SILENCE, self._show)
        self._timer.daemon = True
        self._timer.start()
        return self

    def __exit__(self, error: object, *_: object) -> None:
        Notice._thread.notice = self.outer
        if self.outer is None:
            self._timer.cancel()
            self._timer.join()
        self._erase()
        seconds = time.monotonic() - self.started
        if self.told and error is None and seconds > PATIENCE:
            print(f"{self.told} in {seconds:.1f} s", file=sys.stderr, flush=True)


class CountBar(ProgressBar):
    """A bar for many equal items: ``update_count`` also shows the rate and the time left."""

    def __init__(self, title: str, total: int) -> None:
        super().__init__(title)
        self.total = total
        self.before: int | None = None

    def update_count(self, done: int) -> None:
        """``done`` of them; those done before the first call do not count in the rate."""
        if self.before is None:
            self.before = done
        rate = (done - self.before) / max(time.monotonic() - self.started, 1e-9)
        left = f", {_in_words((self.total - done) / rate)} left" if rate > 0 else ""
        self.update(done / max(self.total, 1), f"{rate:,.0f}/s{left}")


def _in_words(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"
