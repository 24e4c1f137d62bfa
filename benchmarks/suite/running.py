"""One script of the benchmarks in separate processes, ended after its time or on request."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ..timing.processes import environment, module_command
from ..timing.results import FOLDER_VARIABLE

TOO_LONG = 124  # the exit code that timeout(1) gives
INTERRUPTS = (signal.SIGINT, signal.SIGTERM)
GRACE = 5.0  # s between asking a script to end and ending it


def run_script(script: str, options: Sequence[str], out: Path, limit: float | None) -> int:
    """Run a script by its name with its figures going to ``out``; its exit code.

    Parameters
    ----------
    limit
        Seconds after which the script and all processes that it started are ended (exit code
        124); None for as long as it takes.

    Raises
    ------
    KeyboardInterrupt
        When interrupted, after all of them have been ended.
    """
    with _interrupts_held() as held:
        child = subprocess.Popen(
            [*module_command("__main__"), script, *options],
            env=environment(**{FOLDER_VARIABLE: str(out)}),
            start_new_session=True,  # so that the processes it starts can be ended with it
        )
    try:
        if held:
            raise KeyboardInterrupt
        return child.wait(limit)
    except subprocess.TimeoutExpired:
        return TOO_LONG
    finally:
        _end(child)


@contextmanager
def _interrupts_held() -> Iterator[list[int]]:
    """Interrupts that come meanwhile: a process half started could not be ended."""
    held: list[int] = []
    before = [signal.signal(number, lambda got, _: held.append(got)) for number in INTERRUPTS]
    try:
        yield held
    finally:
        for number, handler in zip(INTERRUPTS, before, strict=True):
            signal.signal(number, handler)


def _end(child: subprocess.Popen[bytes]) -> None:
    """Ask what is left of the script's processes to end; end what has not after a while."""
    if not _send(child, signal.SIGTERM):
        return
    with suppress(subprocess.TimeoutExpired):
        child.wait(GRACE)
    _send(child, signal.SIGKILL)
    child.wait()


def _send(child: subprocess.Popen[bytes], number: int) -> bool:
    """To the script and all that it started; False where nobody is left."""
    try:
        os.killpg(child.pid, number)
    except ProcessLookupError:
        return False
    return True
