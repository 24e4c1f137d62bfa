"""Five scenes under the address and undefined-behaviour sanitizers: runs, batches, C functions.

Closed and open, planar and spatial, redundant and nonholonomic; batches by two threads, alone and
in lockstep, members being the runs that they are by themselves; a member that is not finite.
"""

import os
import subprocess

import numpy as np
import pytest
from mechc_codegen import build_scene
from mechc_codegen.emit.units.instruction_sets import instruction_sets
from mechc_codegen.extension.flags import FLAGS, RUNTIME, STRICT
from mechc_codegen.library.catalogue import shipped_mechanism

import mechc
from mechc.compilation import toolchain
from mechc.simulation.settings import METHODS
from tests.support import ROOT

pytestmark = pytest.mark.slow

SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-O0", "-g1")
MEMBERS = 11  # no multiple of any number of lanes; the last is not finite
SCENES = {
    "four_bar": {},
    "windows": {"count": 2},
    "pendulum": {"links": 3},
    "heavy_top": {},
    "bicycle": {},
}
WITH_SERIES = ("pendulum", "heavy_top")


def widest():
    """The widest instruction set that this processor is known to have."""
    with open("/proc/cpuinfo") as file:
        told = file.read()
    every = {each.name: each for each in instruction_sets()}
    return every["avx2"] if " avx2" in told and "avx2" in every else every["baseline"]


def built(scene, folder):
    """The scene's own sources and the program that drives them, one executable."""
    chosen = widest()
    build = build_scene(shipped_mechanism(scene, SCENES[scene]), (chosen,))
    build.write(folder)
    main = (ROOT / "tests" / "support" / "trust" / "sanitized_main.c").read_text()
    (folder / "main.c").write_text(main)
    numbers = (f"-DN_MEMBERS={MEMBERS}", f"-DN_METHODS={len(METHODS)}", "-DSECONDS=0.2")
    sources = [(name, (*FLAGS, *STRICT, *flags, *SANITIZED)) for name, flags in build.flags.items()]
    sources.append(("main.c", (*FLAGS, *STRICT, *SANITIZED, *numbers)))
    objects = toolchain.compile_all(folder, sources, (str(RUNTIME), str(folder)))
    program = folder / "scene"
    command = [*toolchain.compiler(), *SANITIZED, *map(str, objects), "-lm", "-lpthread"]
    subprocess.run([*command, "-o", str(program)], check=True)
    return program, chosen.name


def starts(scene):
    """States and parameters: each member with other speeds, as far as the constraints let it."""
    model = mechc.load(scene, **SCENES[scene], outputs=("energy",))
    start = model.assemble()
    factors = 1.0 + 0.01 * np.arange(MEMBERS)
    nq = len(model.coordinates)
    y = np.tile(start, (MEMBERS, 1))
    y[:, nq:] *= factors[:, None]  # linear constraints on the speeds let them be scaled
    y[-1, 0] = np.nan
    return y, np.tile([model.defaults[name] for name in model.parameters], (MEMBERS, 1))


@pytest.mark.parametrize("scene", SCENES)
def test_a_scene_is_sound(scene, tmp_path):
    program, chosen = built(scene, tmp_path)
    data = b"".join(np.ascontiguousarray(a, dtype=np.float64).tobytes() for a in starts(scene))
    done = subprocess.run(
        [str(program), chosen], input=data, capture_output=True, check=False, timeout=600,
        env={**os.environ, "UBSAN_OPTIONS": "print_stacktrace=1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()[:6000]
    assert done.stderr == b""
    lines = done.stdout.decode().splitlines()
    alone = len(METHODS) - 2 * (scene not in WITH_SERIES)
    assert len(lines) == alone + 3  # of three methods in lockstep too
    for line in lines:
        assert line.endswith("differ 0"), line
        assert int(line.split()[5]) >= MEMBERS - 1, line
