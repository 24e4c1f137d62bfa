"""The generated C for other machines.

Compiled for aarch64 and for Windows and run by an emulator it gives the values of 30-digit
evaluation and the motions that are computed here; for macOS it compiles.
"""

from __future__ import annotations

import math
import os
import platform
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mechc_codegen import build_scene
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.extension.flags import FLAGS, RUNTIME, STRICT

import mechc
from mechc.compilation import toolchain
from mechc.compilation.toolchain.found import installed_compiler
from tests.compiler.emit.test_sanitizers import (
    MAIN,
    METHOD_NUMBERS,
    SECONDS,
    STATES,
    WHOLE_UNIT,
    checked_outputs,
    numbers,
    reference,
    with_broken_states,
)
from tests.support import scenes
from tests.support.pendulums import pendulum

LESS = tuple("-O1" if flag == "-O3" else flag for flag in FLAGS)
PACKAGED = toolchain.packaged_compiler()
WINE = shutil.which("wine64") or shutil.which("wine64", path="/usr/lib/wine")
EMULATORS = {"qemu-aarch64": shutil.which("qemu-aarch64"), "wine": WINE}
COMPILERS = {  # by name: the emulator, the command
    "gcc": ("qemu-aarch64", ["aarch64-linux-gnu-gcc"]),
    "zig": ("qemu-aarch64", [*(PACKAGED or ["zig"]), "-target", "aarch64-linux-musl"]),
    "windows": ("wine", [*(PACKAGED or ["zig"]), "-target", "x86_64-windows-gnu"]),
}
USABLE = [
    name
    for name, (emulator, command) in COMPILERS.items()
    if EMULATORS[emulator] and shutil.which(command[0])
]
RTOL = 1e-9  # of the program's runs

emulated = pytest.mark.skipif(
    not USABLE,
    reason="a compiler for another machine and its emulator are needed: pip install ziglang, "
    "apt-get install qemu-user wine64",
)


@pytest.fixture(scope="module")
def start() -> np.ndarray:
    return mechc.load("four_bar").assemble({"theta_0": math.radians(85)})


@pytest.fixture(scope="module", params=USABLE or ["none"])
def lines(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, start: np.ndarray
) -> list[list[str]]:
    """What the program says: a name and its numbers in each line."""
    folder = tmp_path_factory.mktemp("other")
    emulator, command = COMPILERS[request.param]
    program = cross_compiled(folder, command)
    inputs = (*with_broken_states(reference(), start), start)
    done = subprocess.run(
        [str(EMULATORS[emulator]), str(program), "baseline"],
        env={**os.environ, "WINEPREFIX": str(folder / "wine"), "WINEDEBUG": "-all"},
        input=b"".join(np.ascontiguousarray(a, dtype=np.float64).tobytes() for a in inputs),
        capture_output=True,
        check=True,
    )
    return [line.split() for line in done.stdout.decode().splitlines()]


def cross_compiled(folder: Path, compiler: list[str]) -> Path:
    build = build_scene(scenes.SCENES["four_bar"](), (BASELINE,))
    build.write(folder)
    (folder / "main.c").write_text(MAIN)
    chosen = (f"-DN_STATES={STATES}", METHOD_NUMBERS, f"-DSECONDS={SECONDS}")
    headers = (f"-I{RUNTIME}", f"-I{folder}")
    flags = (*LESS, *STRICT, *chosen, *headers, "-static")
    command = [*compiler, *flags, *build.sources, "main.c", "-lm", "-o", "scene"]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "scene"


@pytest.mark.slow
@emulated
def test_outputs_are_those_of_exact_evaluation(lines: list[list[str]]) -> None:
    named = {words[0]: numbers(words[1:]) for words in lines if words[0] not in ("status", "end")}
    checked_outputs(reference(), named)


@pytest.mark.slow
@emulated
def test_every_method_moves_as_it_does_here(lines: list[list[str]], start: np.ndarray) -> None:
    """Through a change point, within what the tolerance allows."""
    model = mechc.load("four_bar")
    exact = model.simulate(SECONDS, start, rtol=1e-12).y[-1]
    ends = [numbers(words[1:]) for words in lines if words[0] == "end"]
    assert [words[1] for words in lines if words[0] == "status"] == ["1"] * len(WHOLE_UNIT)
    for method, end in zip(WHOLE_UNIT, ends, strict=True):
        here = np.abs(model.simulate(SECONDS, start, rtol=RTOL, method=method).y[-1] - exact).max()
        assert np.abs(end - exact).max() <= 10 * here + 1e-10, method


@pytest.mark.slow
@pytest.mark.skipif(PACKAGED is None, reason="the package ziglang compiles for other systems")
@pytest.mark.parametrize(
    ("target", "magic"),
    [
        ("aarch64-macos", b"\xcf\xfa\xed\xfe"),
        ("x86_64-windows-gnu", b"\x64\x86"),
        ("aarch64-linux-gnu.2.17", b"\x7fELF"),
    ],
)
def test_units_compile_for_other_systems(target: str, magic: bytes, tmp_path: Path) -> None:
    """To objects, with integrators, outputs and derivatives; nothing is linked or run."""
    build = build_scene(
        pendulum(), (BASELINE,), OutputRequest(frozenset({"energy", "sensitivities"}))
    )
    build.write(tmp_path)
    flags = (*LESS, *STRICT, f"-I{RUNTIME}", f"-I{tmp_path}")
    for source in build.sources:
        command = [*(PACKAGED or ()), "-target", target, *flags, "-c", source, "-o", f"{source}.o"]
        subprocess.run(command, cwd=tmp_path, check=True)
        assert (tmp_path / f"{source}.o").read_bytes().startswith(magic)


THREAD = r"""
#include <stdio.h>
#include "abi/large_stack.h"

static void work(void *data)
{
    volatile char room[8 << 20];
    room[0] = 1, room[sizeof room - 1] = 2;
    *(int *)data = room[0] + room[sizeof room - 1];
}

int main(void)
{
    int found = 0;
    mechc_on_stack job;
    if (!mechc_begin_on_stack(&job, 16 << 20, work, &found)) return 2;
    while (!mechc_wait_on_stack(&job, 0.01)) continue;
    mechc_end_on_stack(&job);
    return found != 3;
}
"""


@pytest.mark.thorough
@pytest.mark.skipif(PACKAGED is None, reason="the package ziglang compiles for Windows")
def test_what_is_compiled_into_the_runtime_compiles_for_windows(tmp_path: Path) -> None:
    """The headers of batches, events and closing; and threads with stacks of their own run."""
    command = [*(PACKAGED or ()), "-target", "x86_64-windows-gnu", "-std=gnu11", f"-I{RUNTIME}"]
    folders = ("abi", "batch", "hybrid", "record", "closing")
    found = (path for folder in folders for path in (RUNTIME / folder).rglob("*.h"))
    headers = [path.relative_to(RUNTIME).as_posix() for path in found]
    text = "".join(f'#include "{header}"\n' for header in sorted(headers))
    (tmp_path / "all.c").write_text(text)
    told = ("-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-Wno-empty-translation-unit")
    subprocess.run([*command, *told, "-c", "all.c", "-o", "all.o"], cwd=tmp_path, check=True)
    (tmp_path / "thread.c").write_text(THREAD)
    subprocess.run(
        [*command, "-static", "thread.c", "-lpthread", "-o", "thread.exe"], cwd=tmp_path, check=True
    )
    if WINE is not None:
        env = {**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all"}
        subprocess.run([WINE, "thread.exe"], cwd=tmp_path, env=env, check=True)


# -- for this machine ---------------------------------------------------------------------------

FEATURES = """
#include <stdio.h>
#include "abi/processor.h"
int main(int count, char **names)
{
    for (int i = 1; i < count; i++)
        if (mechc_processor_has(names[i])) puts(names[i]);
}
"""
HERE = [found for found in (installed_compiler(), PACKAGED) if found]


@pytest.mark.skipif(platform.machine() != "x86_64", reason="of x86-64 processors")
@pytest.mark.parametrize("command", HERE, ids=[Path(found[-1]).name for found in HERE])
def test_a_program_knows_the_instructions_of_its_processor_whoever_compiled_it(
    command: list[str], tmp_path: Path
) -> None:
    """Those that the system tells; with zig's libraries the compiler's own answer is "none"."""
    source, program = tmp_path / "features.c", tmp_path / "features"
    source.write_text(FEATURES, "utf-8")
    subprocess.run([*command, f"-I{RUNTIME}", str(source), "-o", str(program)], check=True)
    names = ["avx2", "fma", "avx512f", "avx512dq", "avx512vl", "no_such"]
    done = subprocess.run([str(program), *names], capture_output=True, text=True, check=True)
    flags = Path("/proc/cpuinfo").read_text("utf-8").split("flags")[1].split("\n")[0].split()
    assert done.stdout.split() == [name for name in names if name in flags]
