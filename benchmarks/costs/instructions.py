"""Instructions of the most frequent calls, counted by valgrind's callgrind, the same every time.

One process holds all sections.  Each call is made n and 2n times, and the difference over n is its
count, so that nothing around the calls is in it.  valgrind has no AVX-512: the shipped four-bar is
counted in narrower instruction sets, which the processor or valgrind may lack too.  Hash seed and
environment are fixed, garbage is not collected, and the clock, by which long work is cut into
pieces, goes on by a nanosecond a call.
"""

from __future__ import annotations

import ctypes
import gc
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mechc.compilation.toolchain import compiler
from mechc.errors import CompilerError

from ..timing.processes import environment, module_command
from .calls import INSTANT, PARAMS, calls_of

MARKS = Path(__file__).with_name("marks.c")
SETS = ("baseline", "avx2")
STATES = 64  # for the lanes
SECONDS, RTOL = 5.0, 1e-8
METHODS = ("gauss8", "dop853")
KEPT = ("PATH", "HOME", "PYTHONPATH", "LD_LIBRARY_PATH", "MECHC_CACHE_DIR")
LONGEST = 300  # s

Section = tuple[str, Callable[[int], Any], int]


class NotCountedError(Exception):
    """Without valgrind, its header or a compiler; the message names what is missing."""


def counted(words: Sequence[str] = ("",)) -> list[dict[str, Any]]:
    """Name and number of instructions of every section that one of the words names.

    Raises
    ------
    NotCountedError
        If valgrind, its header or a compiler is missing.
    """
    if shutil.which("valgrind") is None:
        raise NotCountedError("valgrind is not installed")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _compile_marks(folder / "marks.so")
        _run_under_callgrind(folder, words)
        totals = dict(_totals(folder))
    return [
        {"what": what, "value": count, "unit": "instructions"}
        for what, count in differences(totals).items()
    ]


def differences(totals: dict[str, int]) -> dict[str, int]:
    """From the totals of "what|n" and "what|2n" to the count of one call of what."""
    found: dict[str, dict[int, int]] = {}
    for mark, total in totals.items():
        what, _, calls = mark.rpartition("|")
        found.setdefault(what, {})[int(calls)] = total
    return {
        what: round((at[max(at)] - at[min(at)]) / (max(at) - min(at))) for what, at in found.items()
    }


def _compile_marks(target: Path) -> None:
    options = ["-O1", "-shared", "-fPIC", "-o", str(target), str(MARKS)]
    try:
        subprocess.run([*compiler(), *options], capture_output=True, check=True)
    except (CompilerError, OSError, subprocess.CalledProcessError):
        raise NotCountedError("no compiler, or no valgrind/callgrind.h") from None


def _run_under_callgrind(folder: Path, words: Sequence[str]) -> None:
    command = ["valgrind", "--quiet", "--tool=callgrind", f"--callgrind-out-file={folder}/out"]
    fixed = {name: value for name, value in environment().items() if name in KEPT}
    marks = str(folder / "marks.so")
    fixed |= {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1", "LD_PRELOAD": marks}
    done = subprocess.run(
        [*command, *module_command("costs", "instructions"), marks, *words],
        env=fixed,
        capture_output=True, text=True, check=False, timeout=LONGEST,
    )  # fmt: skip
    if done.returncode:
        last = (done.stderr.strip() or "no word").splitlines()[-1]
        raise NotCountedError(f"valgrind ended with {done.returncode}: {last}")


def _totals(folder: Path) -> Iterator[tuple[str, int]]:
    """Of the sections, in the order in which they ran."""
    for path in sorted(folder.glob("out.*"), key=lambda path: int(path.suffix[1:])):
        text = path.read_text()
        mark = re.search(r"^desc: Trigger: Client Request: (.+\|\d+)$", text, re.MULTILINE)
        total = re.search(r"^totals: (\d+)", text, re.MULTILINE)
        if mark and total:
            yield mark[1], int(total[1])


def run_sections(marks: str, words: Sequence[str]) -> None:
    """The work of the process under callgrind."""
    end = ctypes.CDLL(marks).mark
    made = [
        (what.encode(), run, calls)
        for what, run, calls in sections()
        if any(word in what for word in words)
    ]
    gc.disable()
    for what, run, calls in made:
        run(calls)
        for count in (calls, 2 * calls):
            end(b"between")
            run(count)
            end(b"%s|%d" % (what, count))


def sections() -> Iterator[Section]:
    """The name counted, a function of the number of calls, and that number."""
    import mechc

    for chosen in SETS:
        try:
            model = mechc.load("four_bar", instruction_set=chosen)
        except ValueError:  # this processor or build has none
            continue
        yield from _of_the_model(model, f"four_bar, {chosen}")
    yield from _of_the_calls(mechc.load("four_bar", instruction_set="baseline"))


def _of_the_model(model: Any, name: str) -> Iterator[Section]:
    scene, values, y = (
        model.system.scene,
        np.array(model.system.parameter_set.resolve(PARAMS)),
        _start(model),
    )
    many, t, rows = np.tile(y, (2 * STATES, 1)), np.zeros(1), values[None]
    out = np.empty_like(many)
    yield f"{name}: rhs, one state", lambda n: scene.rates_seconds(0.0, y, values, n), 200
    yield (
        f"{name}: rhs, {scene.lanes} lanes, a state",
        lambda n: scene.evaluate_into("rates", t, many[:n], rows, out[:n]),
        STATES,
    )
    for method in METHODS:
        yield f"{name}: {SECONDS:g} s by {method}", _trajectories(model, y, values, method), 1


def _trajectories(model: Any, y: Any, values: Any, method: str) -> Callable[[int], None]:
    from mechc.native._codes import RUNNING
    from mechc.simulation.initialise import begin

    policy = model.simulate(INSTANT, y, PARAMS, rtol=RTOL, method=method, dense=False).policy

    def trajectory() -> None:
        run = begin(model.system, (0.0, SECONDS), y, values, policy)
        while run.advance(10**9) == RUNNING:
            pass

    return partial(_repeat, trajectory)


def _of_the_calls(model: Any) -> Iterator[Section]:
    """Calls that are mostly Python."""
    for what, call in calls_of(model, _start(model)).items():
        yield f"four_bar: {what}", partial(_repeat, call), 25
    yield "four_bar: assemble", partial(_repeat, lambda: _start(model)), 1


def _repeat(call: Callable[[], object], count: int) -> None:
    for _ in range(count):
        call()


def _start(model: Any) -> Any:
    return model.assemble({"theta_0": 1.0}, speeds={"omega_0": 1.0}, params=PARAMS)


if __name__ == "__main__":
    run_sections(sys.argv[1], sys.argv[2:])
