"""The n-th call on files, or for memory, fails, for every n: nothing wrong, nothing lost, all told.

Each n is a process of its own in which one call fails, or which is killed there.  It may end in the
right value or in an error of mechc's that names the place; then the same is done again with all
well, and has to give what a run without faults gives.  What was there before is there still.
"""

import json
import subprocess
import sys
from collections import Counter

import pytest

from tests.support import ROOT
from tests.support.trust import preloadable

pytestmark = pytest.mark.slow
SECONDS = 240

# scenario -> every which n is tried in a usual run, and the least number of calls that there are
SCENARIOS = {
    "saving": (1, 20),
    "saving, killed": (1, 20),
    "caching": (1, 20),
    "caching, killed": (1, 20),
    "opening": (11, 60),
    "streaming": (23, 100),
    "streaming, killed": (29, 100),
    "compiling": (31, 20),
    "calculating": (3, 8),
}


@pytest.fixture(scope="module")
def shim(tmp_path_factory):
    """The library that makes calls fail."""
    return preloadable("faults", tmp_path_factory.mktemp("faults"))


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_every_call_that_fails_is_told_and_loses_nothing(scenario, shim, thorough, tmp_path):
    import os

    stride, least = SCENARIOS[scenario]
    folder = tmp_path / "work"
    command = [sys.executable, "-m", "tests.support.trust.fault_scenarios", scenario, str(folder)]
    done = subprocess.run(
        [*command, f"1:5000:{1 if thorough else stride}"], capture_output=True, text=True, cwd=ROOT,
        env={**os.environ, "LD_PRELOAD": str(shim), "MECHC_CACHE_DIR": str(tmp_path / "cache")},
        timeout=3600 if thorough else SECONDS,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = [json.loads(line) for line in done.stdout.splitlines()]
    failed = [one for one in found if one.get("fired", 1)]
    wrong = [one for one in failed if one["ended"] == "wrong"]
    assert not wrong, f"n = {wrong[0]['n']} of {scenario}:\n{wrong[0]['why']}"
    assert max(one["n"] for one in failed) >= least
    told = [one["ended"] for one in failed if ": " in one["ended"]]
    for text in told:
        assert str(folder) in text or text.startswith(("MemoryError", "CompilerError")), text
    calls = Counter((one["call"], one["ended"].partition(":")[0]) for one in failed)
    for (call, ended), count in sorted(calls.items()):
        print(f"{scenario}: {call} failed {count} times: {ended}")
