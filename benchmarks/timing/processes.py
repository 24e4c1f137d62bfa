"""Seconds of calls; separate processes: how they are started, their time, output and memory."""

from __future__ import annotations

import inspect
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .results import HOME

IMPORTS = "import json, resource\nfrom pathlib import Path\n\n"
PACKAGE = __name__.split(".")[0]  # ``benchmarks`` in a clone, ``mechc_bench`` where installed


def module_command(*path: str) -> list[str]:
    """Python with a module of the benchmarks, nothing being taken from where it is started."""
    return [sys.executable, "-P", "-m", ".".join((PACKAGE, *path))]


def environment(**variables: str) -> dict[str, str]:
    """Of this process, with the benchmarks where modules are looked for."""
    path = filter(None, (str(HOME.parent), os.environ.get("PYTHONPATH")))
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path), **variables}


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


def said(script: str) -> Any:
    """The last line that the script prints, as JSON; it has ``json`` and ``peak_bytes()``."""
    return answer([sys.executable, "-c", f"{IMPORTS}{inspect.getsource(peak_bytes)}{script}"])


def answer(command: Sequence[str], **variables: str) -> Any:
    """The last line that a process prints, as JSON."""
    done = subprocess.run(
        command, env=environment(**variables), stdout=subprocess.PIPE, text=True, check=True
    )
    return json.loads(done.stdout.splitlines()[-1])


def peak_bytes() -> int:
    """Most memory that this process or one that it started held.

    Linux counts the parent's memory into ru_maxrss of a child that it starts; VmHWM is its own.
    """
    lines = Path("/proc/self/status").read_text("utf-8").splitlines()
    own = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    return 1024 * max(own, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)


def processor_seconds() -> float:
    """Of this process and its children: what is left where the machine has other work too."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def clocked(run: Callable[[], Any], clock: Callable[[], float] | None = None) -> float:
    """Seconds of one call."""
    clock = clock or time.perf_counter
    began = clock()
    run()
    return clock() - began


def least_of_rounds(rounds: int, *calls: Callable[[], object]) -> list[float]:
    """The least seconds of each, called turn by turn."""
    least = [np.inf] * len(calls)
    for _ in range(rounds):
        for k, call in enumerate(calls):
            least[k] = min(least[k], clocked(call))
    return least


def least_of_a_call(call: Callable[[], object], budget: float = 0.4) -> float:
    """The least seconds of a call, of as many rounds as the budget (s) has; several a round where
    they are short."""
    call()
    repeats, until = max(1, int(2e-4 / max(clocked(call), 1e-7))), time.perf_counter() + budget
    least = np.inf
    while time.perf_counter() < until:
        least = min(least, clocked(lambda: [call() for _ in range(repeats)]) / repeats)
    return float(least)
