"""A figure, with its unit and the limit that it is to keep."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

NOISE = 1.25  # times a limit of seconds: what a busy machine adds to the least of several runs
COUNTED = ("bytes", "files", "instructions", "operations")


@dataclass(frozen=True)
class Figure:
    """A figure, and its limit if there is one: the most that it may be, or the ``least``."""

    what: str
    value: float
    unit: str = ""
    limit: float | None = None
    least: bool = False

    @property
    def kept(self) -> bool | None:
        if self.limit is None:
            return None
        return bool(self.value >= self.limit if self.least else self.value <= self.limit)

    @property
    def missed(self) -> bool:
        """Whether the limit is missed by more than noise."""
        return self.limit is not None and self.value > NOISE * self.limit

    def record(self) -> dict[str, Any]:
        """A row of the JSON."""
        limit = f">= {self.limit:g}" if self.least else self.limit
        shown = {key: x for key, x in asdict(self).items() if key != "least"}
        return {**shown, "limit": limit, "kept": self.kept}

    def line(self) -> str:
        """In words."""
        value = f"{self.value:16,.0f}" if self.unit in COUNTED else f"{self.value:16.4g}"
        told = f"{self.what:64s}{value} {self.unit}".rstrip()
        if self.limit is None:
            return told
        at = "at least" if self.least else "limit"
        return f"{told}  {at} {self.limit:g} {'kept' if self.kept else 'MISSED'}"
