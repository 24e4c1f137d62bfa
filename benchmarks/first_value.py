"""From a KanesMethod object to the first value of the right-hand side, in new processes.

    python benchmarks/first_value.py [runs]

The four-bar in absolute angles as a notebook has it, and of SymPy's joints in relative angles;
costs.py asks for mechanisms of the library too.
Cold: nothing is in the cache.  Cached: another process has compiled it.  Import of sympy and making
the KanesMethod are not counted; import of mechc stands beside.  Each figure is the least of the
runs, so the stages need not add up; "processor" is the processor time of the first value, which
is nearly its time where the machine has nothing else to do.  Python may keep the bytecode of
modules, as pip does.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
OBJECTS = FOLDER.parent / "tests" / "codegen"
FORMS = ("by hand", "of joints")  # of the four-bar
LIBRARY = ("slider_crank", "flyball_governor", "andrews", "bicycle")
LIMITS = {"cold": 1.5, "cached": 0.020}  # s
STAGES = (
    "import mechc", "read", "describe", "derive", "differentiate", "optimize", "emit",
    "first unit", "load", "first value", "processor", "whole",
)  # fmt: skip


def main(runs: int) -> None:
    from _machine import about
    from _scene import write

    rows = [measured(form, runs) for form in FORMS]
    for row in rows:
        print_table(row)
    write("first_value", {"about": about(), "runs": runs, "forms": rows})


def measured(form: str, runs: int) -> dict[str, Any]:
    """Of one form the least seconds of every stage, cold and cached; the values must agree."""
    with tempfile.TemporaryDirectory() as name:
        kept = Path(name) / "kept"
        first = process(form, kept, wait=True)
        cached = [process(form, kept) for _ in range(runs)]
        cold = [process(form, Path(name) / f"cold {k}") for k in range(runs)]
    far = max(abs(a - b) for run in (*cached, *cold) for a, b in pairs(run, first))
    assert far < 1e-12, f"{form}: values differ by {far}"
    return {
        "form": form, "cold": least(cold) | least([first], ("whole",)), "cached": least(cached),
        "largest difference": far, "peak_bytes": first["peak"],
    }  # fmt: skip


def pairs(run: dict[str, Any], other: dict[str, Any]) -> Iterable[tuple[float, float]]:
    return zip(run["value"], other["value"], strict=True)


def least(runs: Iterable[dict[str, Any]], stages: Iterable[str] = STAGES) -> dict[str, float]:
    told = [run["seconds"] for run in runs]
    return {stage: min(run[stage] for run in told) for stage in stages if stage in told[0]}


def process(form: str, cache: Path, *, wait: bool = False) -> dict[str, Any]:
    """Seconds and the value in a process of its own; ``wait``: until all is compiled and kept."""
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(
        [sys.executable, __file__, "--one", form, str(int(wait))],
        env={**kept, "MECHC_CACHE_DIR": str(cache)}, stdout=subprocess.PIPE, check=True,
    )  # fmt: skip
    told: dict[str, Any] = json.loads(done.stdout)
    return told


def one(form: str, wait: bool) -> None:
    """What each process does."""
    import numpy as np

    method = made(form)
    start = time.perf_counter()
    import mechc

    imported, before = time.perf_counter(), processor_time()
    model = mechc.compile(method)
    state = np.linspace(0.3, 0.8, len(model.coordinates) + len(model.speeds))
    value = model.rhs(0.0, state, np.linspace(1.0, 2.0, len(model.parameters)))
    finished, after = time.perf_counter(), processor_time()
    seconds = {"import mechc": imported - start, **model.build["seconds"]}
    seconds |= {"first value": finished - imported, "processor": after - before}
    if wait:
        assert model.capsule
        seconds["whole"] = time.perf_counter() - imported
    print(json.dumps({"value": value.tolist(), "seconds": seconds, "peak": peak_bytes()}))


def peak_bytes() -> int:
    """Most memory that this process or one of its compilers held."""
    lines = Path("/proc/self/status").read_text().splitlines()
    own = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    return 1024 * max(own, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)


def processor_time() -> float:
    """Of this process and its compilers: what is left where the machine has other work too."""
    compilers = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + compilers.ru_utime + compilers.ru_stime


def made(form: str) -> Any:
    if form == "by hand":
        from _four_bar_kane import by_hand

        return by_hand()
    if form in LIBRARY:
        from mechc_codegen import SHIPPED

        return SHIPPED[form].build()
    sys.path.insert(0, str(OBJECTS))
    from sympy_objects import four_bar_kane

    return four_bar_kane()


def print_table(row: dict[str, Any]) -> None:
    print(f"\n{row['form'] + ', s':30s}{'cold':>10s}{'cached':>10s}")
    for stage in STAGES:
        cells = [row[way].get(stage) for way in LIMITS]
        shown = ("" if cell is None else f"{cell:.4f}" for cell in cells)
        print(f"{stage:30s}{''.join(f'{cell:>10s}' for cell in shown)}")
    for way, limit in LIMITS.items():
        met = "met" if row[way]["first value"] < limit else "NOT MET"
        print(f"{way}: first value under {limit:g} s {met}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[2], bool(int(sys.argv[3])))
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 7)
