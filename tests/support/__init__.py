"""What several tests share: scenes, mechanisms, references, and where the repository is."""

from pathlib import Path

LOCKSTEP = "gauss8 in lockstep"
ROOT = Path(__file__).parents[2]
DATA = ROOT / "benchmarks" / "data"


def by(method):
    """The arguments of a run by a method, or by ``LOCKSTEP``."""
    return {"method": "gauss8", "lockstep": True} if method == LOCKSTEP else {"method": method}
