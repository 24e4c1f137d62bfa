"""The wait before the first motion, and the seconds of the compiler by the part of a unit.

    mechc bench wait [--out JSON] [NAME ...]

In a process of its own, of each mechanism of the library, or robot in a file ``.urdf`` or
``.sdf``, which is read before, as a description of one's own: from
`compile` to the end of the first `simulate`, in seconds by the clock, and in parentheses of the
processor, the compiler's too, to the end of a first batch of a thousand members, and to the first
derivatives of a motion by a parameter; with an empty cache.  Import of mechc and making the
description are not counted.  Then each stage by itself: the derivation, with C and the tape as
its result, and the compiler's by the part of the unit.  Of these a first motion needs the first
unit, which is the tape where the scene has a kind; else the driver too, and collocation or
`taylor`.  Last, in processor time, how many times as long a motion by each method, a batch, the
outputs of its states and derivatives take by the tape as by own parts; the numbers have to be the
same.

The script ``costs`` asks for the first value of the right-hand side, in new processes too.

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
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from ..timing.processes import answer, module_command, peak_bytes, processor_seconds
from ..timing.results import command_parser

BY_HAND = "by hand"  # the four-bar, which the limits are for
USUAL = ("pendulum", "four_bar", "andrews", "bicycle")
FIRST = "first unit"
DURATION = 0.01  # s of motion: it is the wait that counts
RUNS, LONG, OF_RUNS = 20, 5.0, {"andrews": 0.03}  # s of motion that are timed by the tape
ROBOTS, OF_ROBOTS = (".urdf", ".sdf"), 0.2
METHODS, BATCH, OUTPUTS = ("auto", "dop853", "gauss8"), "batch", "outputs"
DERIVATIVES = "derivatives"
MEMBERS, FIRST_MEMBERS = 64, 1000
LIMITS = {"cold": 1.5, "cached": 0.020}  # s
STAGES = (
    "import mechc", "read", "describe", "derive", "differentiate", "optimize", "emit",
    "first unit", "load", "first value", "processor", "whole",
)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("wait", __doc__)
    parser.add_argument("--out", type=Path, metavar="JSON", help="a file for the figures")
    parser.add_argument("names", nargs="*", metavar="NAME", default=USUAL, help="mechanisms")
    chosen = parser.parse_args(arguments)
    rows = [first_motion(name) for name in chosen.names or USUAL]
    print("\n".join(line(row) for row in rows))
    if chosen.out:
        chosen.out.write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
    return 0


def line(row: dict[str, Any]) -> str:
    """A row of figures as text."""
    stages = ", ".join(
        f"{stage} {clock:.2f} ({processor:.2f})"
        for stage, (clock, processor) in row["stages"].items()
    )
    wait = f"{row['wait']:.2f} s ({row['processor']:.2f}), batch {row['batch']:.2f} s"
    wait += f", {row['compiled_batch']:.2f} where its parts are compiled before"
    wait += f", derivatives {row[DERIVATIVES]:.2f} s"
    ratios = ", ".join(f"{method} {ratio:.1f}" for method, ratio in row["by_tape"].items())
    return f"{row['name']}: {wait}; {stages}; by its tape over own parts: {ratios}"


def first_motion(name: str) -> dict[str, Any]:
    """The figures of one mechanism, in seconds."""
    with tempfile.TemporaryDirectory() as folder:
        seconds = process(name, Path(folder), "motion")["seconds"]
        by_tape = process(name, Path(folder), "tape")["ratios"]
    batches = {}
    for until in ("batch", "compiled batch", DERIVATIVES):
        with tempfile.TemporaryDirectory() as folder:
            batches[until] = process(name, Path(folder), until)["seconds"]["first value"]
    return {
        "name": name, "wait": seconds["first value"], "processor": seconds["processor"],
        "batch": batches["batch"], "compiled_batch": batches["compiled batch"],
        DERIVATIVES: batches[DERIVATIVES],
        "stages": stages_apart(name), "by_tape": by_tape,
    }  # fmt: skip


def stages_apart(name: str) -> dict[str, tuple[float, float]]:
    """Seconds by the clock and of the processor of each stage, one after the other: derivation,
    first unit, each part."""
    from mechc.native._driver import PARTS
    from mechc_codegen import build_scene

    from mechc.compilation import entries
    from mechc.compilation.toolchain.processor import native

    found = {}

    def measure(stage: str, run: Callable[[], Any]) -> Any:
        began, before = time.perf_counter(), processor_seconds()
        made = run()
        found[stage] = time.perf_counter() - began, processor_seconds() - before
        return made

    mechanism = made(name)
    build = measure("derivation", lambda: build_scene(mechanism, (native(),)))
    makers = {FIRST: lambda folder: entries.make_first(build, folder)}
    for part in PARTS if "MECHC_VARIATIONAL" in build.texts["scene_sizes.h"] else list(PARTS)[:-1]:
        makers[part] = lambda folder, part=part: entries.make_part(build, part, folder)
    for part, make in makers.items():
        with tempfile.TemporaryDirectory() as folder:
            measure(part, lambda make=make, folder=folder: make(Path(folder)))
    return found


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

    ``until``: the first value, the end of the first "motion" or "batch", or of one after parts for
    it are compiled ("compiled batch"), the first "derivatives", or the "whole" being compiled; or
    motions are timed by the "tape" and by own parts.
    """
    command = [*module_command("costs", "first"), form, until]
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
    if until == "tape":
        print(json.dumps({"ratios": by_tape(model, timed(form))}))
        return
    if until in ("batch", "compiled batch"):
        if until == "compiled batch":
            model.wait_compiled()
        starts = np.tile(model.assemble(), (FIRST_MEMBERS, 1))
        value = model.simulate_batch(timed(form), starts, progress=False).y[-1]
    elif until == "motion":
        value = model.simulate(DURATION, model.assemble()).y[-1]
    elif until == DERIVATIVES:
        value = columns(model, DURATION)[-1]
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


def columns(model: Any, duration: float) -> Any:
    """Derivatives of a motion by the first parameter."""
    name = model.parameters[0]
    sol = model.simulate(duration, model.assemble(), method="gauss8", sensitivities=[name])
    return sol.sensitivity[name]


def by_tape(model: Any, duration: float) -> dict[str, float]:
    """How many times as long each takes by the tape as by own parts; the numbers are the same."""
    import numpy as np

    start, native = model.assemble(), model.system.scene.evaluator
    assert native.serves_runs
    values = np.array([[model.defaults[name] for name in model.parameters]])
    states = np.tile(start, (MEMBERS, 1))
    output = max(native.outputs, key=native.outputs.__getitem__)

    def run(what: str) -> Any:
        if what == OUTPUTS:
            return native.evaluate(output, np.zeros(1), states, values)
        if what == DERIVATIVES:
            return columns(model, duration)
        if what == BATCH:
            return model.simulate_batch(duration, states, threads=1, progress=False).y
        return model.simulate(duration, start, method=what).y

    def seconds(what: str) -> float:
        found = []
        for _ in range(1 if what == BATCH else RUNS):
            before = processor_seconds()
            run(what)
            found.append(processor_seconds() - before)
        return min(found)

    asked = (*METHODS, BATCH, OUTPUTS, DERIVATIVES)
    before = {what: (seconds(what), run(what).tobytes()) for what in asked}
    model.wait_compiled()
    model.system.differentiable().wait()
    assert all(run(what).tobytes() == numbers for what, (_, numbers) in before.items())
    return {what: taken / seconds(what) for what, (taken, _) in before.items()}


def timed(form: str) -> float:
    """The seconds of motion that are timed."""
    return OF_RUNS.get(form, OF_ROBOTS if form.endswith(ROBOTS) else LONG)


def made(form: str) -> Any:
    if form == BY_HAND:
        from ..formulations.four_bar_kane import by_hand

        return by_hand()
    if form.endswith(ROBOTS):
        import warnings

        import mechc

        with warnings.catch_warnings(action="ignore", category=mechc.SkippedPartWarning):
            read = mechc.from_urdf if form.endswith(".urdf") else mechc.from_sdf
            return read(form)
    from mechc_codegen import SHIPPED

    return SHIPPED[form].build()


if __name__ == "__main__":
    one(*sys.argv[1:])
