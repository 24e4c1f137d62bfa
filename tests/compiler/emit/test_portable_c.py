"""The generated C for processors that are not x86-64: compiled for aarch64 and run by an emulator,
it gives the values of 30-digit evaluation and the motions that are computed here."""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mechc_codegen import build_scene
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.extension.flags import FLAGS, RUNTIME, STRICT

import mechc
from mechc.simulation.settings import METHODS
from tests.compiler.emit.test_sanitizers import (
    MAIN,
    SECONDS,
    STATES,
    numbers,
    reference,
    with_broken_states,
)
from tests.support import scenes
from tests.support.exact_values import printed

COMPILER, EMULATOR = "aarch64-linux-gnu-gcc", "qemu-aarch64"
RTOL = 1e-9  # of the program's runs

pytestmark = pytest.mark.skipif(
    shutil.which(COMPILER) is None or shutil.which(EMULATOR) is None,
    reason=f"{COMPILER} and {EMULATOR} are needed: apt-get install gcc-aarch64-linux-gnu qemu-user",
)


@pytest.fixture(scope="module")
def start() -> np.ndarray:
    return mechc.load("four_bar").assemble({"theta_0": math.radians(85)})


@pytest.fixture(scope="module")
def lines(tmp_path_factory: pytest.TempPathFactory, start: np.ndarray) -> list[list[str]]:
    """What the program says: a name and its numbers in each line."""
    program = cross_compiled(tmp_path_factory.mktemp("aarch64"))
    inputs = (*with_broken_states(reference(), start), start)
    done = subprocess.run(
        [EMULATOR, str(program), "baseline"],
        input=b"".join(np.ascontiguousarray(a, dtype=np.float64).tobytes() for a in inputs),
        capture_output=True,
        check=True,
    )
    return [line.split() for line in done.stdout.decode().splitlines()]


def cross_compiled(folder: Path) -> Path:
    build = build_scene(scenes.SCENES["four_bar"](), (BASELINE,))
    build.write(folder)
    (folder / "main.c").write_text(MAIN)
    chosen = (f"-DN_STATES={STATES}", f"-DN_METHODS={len(METHODS)}", f"-DSECONDS={SECONDS}")
    headers = (f"-I{RUNTIME}", f"-I{folder}")
    flags = (*FLAGS, *STRICT, *chosen, *headers, "-static")
    command = [COMPILER, *flags, *build.sources, "main.c", "-lm", "-o", "scene"]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "scene"


@pytest.mark.slow
def test_outputs_are_those_of_exact_evaluation(lines: list[list[str]]) -> None:
    at = reference()
    named = {words[0]: numbers(words[1:]) for words in lines if words[0] not in ("status", "end")}
    good = slice(0, len(at.t))
    for name in at.names:
        at.check(name, printed(named, name, STATES)[good])
    multipliers = named["multipliers"].reshape(STATES, -1)
    for rates in ("rates", "scalar_rates"):
        accelerations = named[rates].reshape(STATES, -1)[:, 3:]
        at.check_motion(np.hstack([accelerations, multipliers])[good])


@pytest.mark.slow
def test_every_method_moves_as_it_does_here(lines: list[list[str]], start: np.ndarray) -> None:
    """Through a change point, within what the tolerance allows."""
    model = mechc.load("four_bar")
    exact = model.simulate(SECONDS, start, rtol=1e-12).y[-1]
    ends = [numbers(words[1:]) for words in lines if words[0] == "end"]
    assert [words[1] for words in lines if words[0] == "status"] == ["1"] * len(METHODS)
    for method, end in zip(METHODS, ends, strict=True):
        here = np.abs(model.simulate(SECONDS, start, rtol=RTOL, method=method).y[-1] - exact).max()
        assert np.abs(end - exact).max() <= 10 * here + 1e-10, method
