"""What whole processes take: the least seconds of several, and the most memory they held."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

# Linux counts the parent's memory into ru_maxrss of a child that it starts; VmHWM is its own.
PEAK = """
import json, resource
def peak():
    lines = open("/proc/self/status").read().splitlines()
    own = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    return max(own, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss) * 1024
"""


def least_seconds(arguments: Sequence[str], runs: int) -> float:
    """Of Python with these arguments; processor time where the machine had other work."""
    return min(_seconds(arguments) for _ in range(runs))


def _seconds(arguments: Sequence[str]) -> float:
    began = time.perf_counter()
    with subprocess.Popen([sys.executable, *arguments], stdout=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, process.args)
    return min(time.perf_counter() - began, used.ru_utime + used.ru_stime)


def said(script: str, **environment: str) -> Any:
    """What the script prints last, as JSON; ``peak()`` is there for it, bytes."""
    done = subprocess.run(
        [sys.executable, "-c", PEAK + script], env={**os.environ, **environment},
        stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    return json.loads(done.stdout.splitlines()[-1])
