"""What several tests share: scenes, mechanisms, references, and where the repository is."""

from pathlib import Path

LOCKSTEP = "gauss8 in lockstep"
ROOT = Path(__file__).parents[2]
DATA = ROOT / "benchmarks" / "data"


def by(method):
    """The arguments of a run, or of a batch of such, by a method, or by ``LOCKSTEP``."""
    together = method == LOCKSTEP
    return {"method": "gauss8" if together else method, "lockstep": together}
