"""What several tests share: scenes, mechanisms, references, and where the repository is."""

from pathlib import Path

LOCKSTEP = "gauss8 in lockstep"
ROOT = Path(__file__).parents[2]
DATA = ROOT / "benchmarks" / "data"


def by(method):
    """The arguments of a run, or of a batch of such, by a method, alone or in lockstep."""
    return {"method": method} | ({} if method.endswith("lockstep") else {"lockstep": False})
