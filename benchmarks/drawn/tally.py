"""The counts of a run of drawn scenes: by construct, by door, and how near they came."""

from __future__ import annotations

from collections import Counter
from typing import Any

SLOW = 60.0  # s
OFTEN = 50  # cases between two lines that tell how far a run is


class Tally:
    """Adds outcomes up and prints them."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.failed = self.cases = self.scenes = 0
        self.constructs: Counter[str] = Counter()
        self.compared: Counter[str] = Counter()
        self.seconds: Counter[str] = Counter()
        self.ended: Counter[str] = Counter()
        self.largest: dict[str, float] = {}
        self.slow: list[tuple[int, int]] = []

    def add(self, case: int, outcome: Any, seconds: float, *, show: bool = False) -> None:
        """An outcome, or the text that says how its process ended."""
        self.cases += 1
        if self.cases % OFTEN == 0:
            print(f"... {self.cases} cases, {self.failed} with a difference", flush=True)
        if seconds > SLOW:
            self.slow.append((round(seconds), case))
        if isinstance(outcome, str):
            self._tell(case, [outcome])
            return
        self.scenes += outcome.scenes
        self.constructs.update(outcome.used)
        self.compared.update(outcome.compared)
        self.seconds.update(outcome.seconds)
        self.ended.update(outcome.ended)
        for door, share in outcome.largest.items():
            self.largest[door] = max(self.largest.get(door, 0.0), share)
        if show:
            print(outcome.text)
        self._tell(case, outcome.faults)

    def _tell(self, case: int, faults: list[str]) -> None:
        self.failed += bool(faults)
        for fault in faults:
            print(f"--seed {self.seed} --only-case {case}: {fault}", flush=True)

    def print_constructs(self) -> None:
        """How many cases have each construct."""
        print("\nconstructs, in cases:")
        for name, n in sorted(self.constructs.items()):
            print(f"  {name:48s}{n:8d}")

    def print(self, seconds: float) -> None:
        """All counts."""
        self.print_constructs()
        print(f"\n{'door':40s}{'compared':>10s}{'largest share of what is allowed':>36s}")
        for door, n in sorted(self.compared.items()):
            print(f"  {door:38s}{n:10d}{self.largest[door]:36.2g}")
        print("\nwithout a comparison:")
        for why, n in sorted(self.ended.items()):
            print(f"  {why:58s}{n:8d}")
        spent = ", ".join(f"{what} {s:.1f}" for what, s in self.seconds.most_common())
        print(f"\nprocessor seconds: {spent}")
        if self.slow:
            print(f"slowest, s and case: {sorted(self.slow, reverse=True)[:5]}")
        rate = self.scenes / max(seconds, 1e-9)
        print(f"{self.cases} cases, {self.scenes} scenes from seed {self.seed} in {seconds:.0f} s "
              f"({seconds / max(self.cases, 1):.2f} s a case, {rate:.1f} scenes a second); "
              f"{self.failed} cases with a difference")  # fmt: skip
