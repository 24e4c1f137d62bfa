"""What several tests share: scenes, mechanisms, references, and where the repository is."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
DATA = ROOT / "benchmarks" / "data"
