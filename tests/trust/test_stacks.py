"""What wide scenes take of the stacks that they are given, and C functions of their callers'."""

import os
import subprocess
import sys

import pytest

from tests.support.trust import preloadable

pytestmark = pytest.mark.slow

MEASURED = """
import ctypes
import sys
import numpy as np
import mechc
from mechc.simulation.settings import METHODS_OF_USERS

counter = ctypes.CDLL(sys.argv[1])
counter.stack_taken.restype = counter.stack_given.restype = ctypes.c_size_t


def told(what, given=None):
    given = given or counter.stack_given()
    print(what, counter.stack_taken(), given, flush=True)
    counter.stack_forget()


name, option, count = sys.argv[2:]
model = mechc.load(name, **{option: int(count)})
start = model.assemble()
for method in METHODS_OF_USERS:
    if method == "taylor" and not model.system.data.get("taylor"):
        continue
    sol = model.simulate(1e-3, start, method=method, rtol=1e-5, max_steps=3)
    if len(start) >= 64:
        told(method)
if len(start) >= 90:
    sol(np.linspace(*sol.span, 3))
    model.simulate_batch(1e-4, np.stack([start, start]), threads=1, max_steps=2)
    told("dense output, batch")
for output in ("rates", *model.system.scene.outputs):
    f = model.c_function(output)
    y, out = np.array(start), np.empty(f.width)
    arguments = (ctypes.c_void_p(a) for a in (f.address, y.ctypes.data, out.ctypes.data, f.data))
    assert not counter.stack_of_call(*arguments)
    told(f"C function {output}", f.stack)
"""


@pytest.fixture(scope="module")
def counter(tmp_path_factory):
    """The library that counts what is touched of a stack."""
    return preloadable("stacks", tmp_path_factory.mktemp("stacks"))


@pytest.mark.parametrize(
    "scene",
    [
        ("planar_chain", "links", 31),  # of those without a stack of their own, nearly the widest
        ("windows", "count", 22),
        ("planar_chain", "links", 60),
        pytest.param(("planar_chain", "links", 200), id="the longest"),
    ],
    ids=lambda scene: "-".join(map(str, scene)),
)
def test_stacks_are_large_enough(scene, counter, request, thorough):
    """Half of it is taken at most, so that another compiler's frames fit too."""
    if not thorough and request.node.callspec.id != "planar_chain-links-31":
        pytest.skip("compiling it takes minutes: --thorough")
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, str(counter), *map(str, scene)], check=True,
        capture_output=True, text=True, env={**os.environ, "LD_PRELOAD": str(counter)},
        timeout=3600 if thorough else 600,
    )  # fmt: skip
    lines = done.stdout.splitlines()
    assert len(lines) > 4
    for line in lines:
        what, taken, given = line.rsplit(" ", 2)
        print(f"{scene[0]}({scene[2]}), {what:<30} {int(taken) / 2**10:8.0f} of"
              f" {int(given) / 2**10:8.0f} KiB")  # fmt: skip
        assert 0 < int(taken) < 0.5 * int(given), line
