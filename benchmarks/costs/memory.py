"""Memory: after the import, of a run and of a batch, each in its own process."""

from __future__ import annotations

from ..timing.processes import said

IMPORTED = "import numpy, {more}; print(json.dumps(peak_bytes()))"


RUN = """
import mechc
model = mechc.load("four_bar")
start = model.assemble({"theta_0": 1.4835}, params={"l_3": 3.5})
model.simulate(1.0, start, {"l_3": 3.5})
before = peak_bytes()
sol = model.simulate(5000.0, start, {"l_3": 3.5})
print(json.dumps([peak_bytes() - before, sol.stats["steps"]]))
"""

BATCH = """
import mechc, numpy
model = mechc.load("four_bar")
def run(members):
    start = mechc.Assembly({"theta_0": numpy.linspace(1.0, 1.6, members)})
    given = {"l_3": numpy.full(members, 3.5)}
    return model.simulate_batch(1.0, start, given, t_eval=[0.5, 1.0], threads=1)
run(10)
before = peak_bytes()
batch = run(20_000)
print(json.dumps((peak_bytes() - before) / 20_000))
"""


def after_import() -> tuple[int, int]:
    """Bytes that Python holds with numpy, and those that mechc adds."""
    bare = said(IMPORTED.format(more="json"))
    return bare, said(IMPORTED.format(more="mechc")) - bare


def of_a_run() -> float:
    """Bytes an accepted step, dense output kept."""
    added, steps = said(RUN)
    return float(added / steps)


def of_a_batch() -> float:
    """Bytes a member that reports two states."""
    return float(said(BATCH))
