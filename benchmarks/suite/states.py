"""Last states of the library's mechanisms after 20 s by each method, to the last bit.

    mechc bench states --out BEFORE.json [NAME ...]
    mechc bench states --against BEFORE.json [NAME ...]
    mechc bench states --builds [NAME ...]

Of two commits on one machine: what changes no arithmetic changes no bit.  Compared runs begin at
the starts of the earlier file; where a start itself is assembled otherwise, it is listed.  Exits
with 1 where one differs.

``--builds`` compiles the mechanisms anew in several ways, each in an empty cache, and compares: as
for users, without optimisation, with two, four and eight lanes, by clang where there is one, with
arrays larger than the scene needs (``runtime/dynamics/bounds.h``), and by the unit that serves all
scenes of a kind (``runtime/general/``).
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

import mechc

from ..timing import results
from ..timing.processes import environment, module_command
from ..timing.results import command_parser

T_END, RTOL, MAX_STEPS = 20.0, 1e-8, 20_000
SIZES: dict[str, dict[str, int]] = {
    "pendulum": {"links": 3},
    "planar_chain": {"links": 8},
    "windows": {"count": 3},
}
METHODS = ("dopri5", "dop853", "gauss8", "radau5", "auto")
USUAL, CLANG, WIDER, GENERAL = "-O3", "clang", "wider bounds", "general unit"
BUILDS = (USUAL, "-O0", "2 lanes", "4 lanes", "8 lanes", CLANG, WIDER, GENERAL)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("states", __doc__)
    parser.add_argument("--out", type=Path, metavar="JSON", help="write the states to this file")
    parser.add_argument("--against", type=Path, metavar="JSON", help="compare with those of a file")
    parser.add_argument("--builds", action="store_true", help="compare ways of compiling")
    parser.add_argument("--build", choices=BUILDS, help="compile the mechanisms in this way")
    parser.add_argument(
        "--digests", action="store_true", help="outputs, derivatives and batches besides"
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="mechanisms [all of the library]")
    chosen = parser.parse_args(arguments)
    names = chosen.names or mechc.mechanisms()
    if chosen.builds:
        return _compare_builds(names, ["--digests"] * chosen.digests)
    before = results.read_option(parser, chosen.against)  # now, not after the whole run
    load = _compiled_by(chosen.build) if chosen.build else mechc.load
    states = last_states(names, before or {}, load)
    if chosen.digests:
        states |= digests(names, load)
    if chosen.out:
        chosen.out.write_text(json.dumps(states, indent=1) + "\n", "utf-8")
    if before is None:
        return 0
    apart = differing(states, before)
    print(f"{len(states) - len(apart)} equal, {len(apart)} differ{': ' if apart else ''}"
          + ", ".join(apart))  # fmt: skip
    return 1 if apart else 0


def last_states(
    names: Sequence[str],
    before: dict[str, list[Any]],
    load: Callable[..., mechc.Model] = mechc.load,
) -> dict[str, list[Any]]:
    """By mechanism and method: how the run ended, its steps, time and state in hexadecimal.

    By mechanism: its start, from which the runs begin where there was none before.
    """
    states: dict[str, list[Any]] = {}
    for name in names:
        model = load(name, **SIZES.get(name, {}))
        assembled = states[f"{name} start"] = [x.hex() for x in model.assemble().tolist()]
        start = np.array([float.fromhex(x) for x in before.get(f"{name} start", assembled)])
        for method in METHODS:
            sol = model.simulate(T_END, start, method=method, rtol=RTOL, max_steps=MAX_STEPS)
            numbers = [float(x).hex() for x in (sol.t[-1], *sol.y[-1])]
            states[f"{name} {method}"] = [sol.status.code, sol.stats["steps"], *numbers]
            print(name, method, sol.status.code, sol.stats["steps"], flush=True)
    return states


def digests(names: Sequence[str], load: Callable[..., mechc.Model]) -> dict[str, list[Any]]:
    """By mechanism: of outputs along a motion, its derivatives, and the ends of a batch."""
    found: dict[str, list[Any]] = {}
    for name in names:
        model = load(name, **SIZES.get(name, {}))
        start = model.assemble()
        sol = model.simulate(1.0, start, rtol=RTOL)
        t = np.linspace(0.0, sol.t[-1], 20)
        gradient = sol.gradient(end=np.ones(len(start)))
        ends = model.simulate_batch(1.0, np.tile(start, (9, 1)), rtol=RTOL)
        numbers = [sol(t), model.energy(sol(t)), [*gradient.values()], ends.y]
        found[f"{name} digests"] = [
            sha256(np.array(each).tobytes()).hexdigest() for each in numbers
        ]
    return found


def differing(states: dict[str, list[Any]], before: dict[str, list[Any]]) -> list[str]:
    """Mechanisms and methods whose end is another one, or was not known."""
    return [key for key, value in states.items() if value != before.get(key)]


def of_builds(
    names: Sequence[str], builds: Sequence[str] = BUILDS, more: Sequence[str] = ()
) -> Iterator[tuple[str, dict[str, list[Any]]]]:
    """Each way of compiling that is possible here, with the last states of its motions."""
    for build in builds:
        compiler = {} if build != CLANG else {"CC": _clang()}
        if None in compiler.values():
            continue
        with tempfile.TemporaryDirectory() as folder:
            out, cache = Path(folder) / "states.json", Path(folder) / "cache"
            cache.mkdir(mode=0o700)
            command = [*module_command("suite", "states"), f"--build={build}", f"--out={out}"]
            variables = environment(MECHC_CACHE_DIR=str(cache), **compiler)
            subprocess.run([*command, *more, *names], env=variables, check=True, stdout=sys.stderr)
            yield build, json.loads(out.read_text("utf-8"))


def _compare_builds(names: Sequence[str], more: Sequence[str]) -> int:
    apart, first = list[str](), dict[str, list[Any]]()
    for build, states in of_builds(names, more=more):
        first = first or states
        found = differing(states, first)
        print(f"{build}: {len(states) - len(found)} equal, {len(found)} differ", *found, flush=True)
        apart += found
    return 1 if apart else 0


def _clang() -> Any:
    """The command of a clang, or None."""
    if find_spec("ziglang"):
        return f"{sys.executable} -m ziglang cc"
    return shutil.which("clang")


def _compiled_by(build: str) -> Callable[..., mechc.Model]:
    """``mechc.load`` in a process that compiles all mechanisms in that way."""
    from mechc_codegen import compiler, shipped_mechanism
    from mechc_codegen.extension import flags

    optimised = build if build.startswith("-") else USUAL
    wider = _wider_bounds(flags.RUNTIME) if build == WIDER else ()
    flags.FLAGS = (*(optimised if flag == "-O3" else flag for flag in flags.FLAGS), *wider)
    flags.OUTPUTS_ONLY_FLAGS += wider

    from mechc.compilation import build as module
    from mechc.compilation import parts

    if build == GENERAL:
        parts.Parts.made = lambda *_: False  # type: ignore[method-assign]
    else:
        compiler.kind_of = lambda *_: ()
    usual = module.native()
    lanes = int(build.removesuffix(" lanes")) if build.endswith(" lanes") else usual.lanes
    module.native = lambda: replace(usual, lanes=lanes)
    shipped = {"four_bar"}  # which mechc.load takes as it was installed

    def load(name: str, **sizes: int) -> mechc.Model:
        compiled = name in shipped
        return mechc.compile(shipped_mechanism(name)) if compiled else mechc.load(name, **sizes)

    return load


def _wider_bounds(runtime: Path) -> tuple[str, ...]:
    """Flags by which each bound of arrays is larger than its count, by another number.

    None stays none: what is not counted is not compiled (``general unit`` has all).
    """
    texts = (header.read_text("utf-8") for header in sorted(runtime.rglob("*.h")))
    names = re.findall(r"#ifndef MECHC_(\w+)_MAX", "".join(texts))
    wider = (f"(MECHC_{name}?MECHC_{name}+{n}:0)" for n, name in enumerate(names, 1))
    return tuple(f"-DMECHC_{name}_MAX={bound}" for name, bound in zip(names, wider, strict=True))


if __name__ == "__main__":
    sys.exit(main())
