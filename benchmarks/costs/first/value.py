"""From a description to the first value of the right-hand side, in new processes.

Of the four-bar in absolute angles as a notebook has it (a KanesMethod object), and of mechanisms of
the library.  Cold: nothing is in the cache.  Cached: another process has compiled it.  Import of
sympy and making the object are not counted; import of mechc is listed separately.  Each figure is
the least of the runs, so the stages need not add up; "processor" is the processor time of the first
value, which is nearly its time where the machine has nothing else to do.  Python may keep the
bytecode of modules, as pip does.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ...timing.processes import answer, module_command, peak_bytes, processor_seconds

BY_HAND = "by hand"  # the four-bar, which the limits are for
DURATION = 0.01  # s of motion: it is the wait that counts
LIMITS = {"cold": 1.5, "cached": 0.020}  # s
STAGES = (
    "import mechc", "read", "describe", "derive", "differentiate", "optimize", "emit",
    "first unit", "load", "first value", "processor", "whole",
)  # fmt: skip


def measured(form: str, runs: int) -> dict[str, Any]:
    """The least seconds of every stage for one form, cold and cached; the values must agree."""
    with tempfile.TemporaryDirectory() as name:
        kept = Path(name) / "kept"
        first = process(form, kept, "whole")
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


def process(form: str, cache: Path, until: str = "value") -> dict[str, Any]:
    """Seconds and the value in a separate process.

    ``until``: the first value, the end of the first "motion", or the "whole" being compiled.
    """
    command = [*module_command("costs", "first", "value"), form, until]
    told: dict[str, Any] = answer(command, MECHC_CACHE_DIR=str(cache), PYTHONDONTWRITEBYTECODE="")
    return told


def one(form: str, until: str) -> None:
    """The work of each process."""
    import numpy as np

    method = made(form)
    start = time.perf_counter()
    import mechc

    imported, before = time.perf_counter(), processor_seconds()
    model = mechc.compile(method)
    if until == "motion":
        value = model.simulate(DURATION, model.assemble()).y[-1]
    else:
        state = np.linspace(0.3, 0.8, len(model.coordinates) + len(model.speeds))
        value = model.rhs(0.0, state, np.linspace(1.0, 2.0, len(model.parameters)))
    finished, after = time.perf_counter(), processor_seconds()
    seconds = {"import mechc": imported - start, **model.build["seconds"]}
    seconds |= {"first value": finished - imported, "processor": after - before}
    if until == "whole":
        _ = model.capsule  # waits for all of it
        seconds["whole"] = time.perf_counter() - imported
    print(json.dumps({"value": value.tolist(), "seconds": seconds, "peak": peak_bytes()}))


def made(form: str) -> Any:
    if form == BY_HAND:
        from ...formulations.four_bar_kane import by_hand

        return by_hand()
    from mechc_codegen import SHIPPED

    return SHIPPED[form].build()


if __name__ == "__main__":
    one(*sys.argv[1:])
