"""The runs of one motion, one after the other, and the record that they make."""

from __future__ import annotations

from typing import Any

from mechc.simulation.record import Piece, Record
from mechc.system.parameters import Array

ADDED = ("steps", "rejected", "rhs_evaluations", "closure_iterations", "examined")
LEAST = {"least_singular": "least_singular_time", "critical_gap": "critical_time"}


class Chain:
    """Runs of which the last is under way; ``before``: a record that they continue."""

    def __init__(self, runs: tuple[Any, ...], params: Array, before: Record | None = None) -> None:
        self.runs: list[Any] = []
        self.record = Record(() if before is None else before.pieces)
        self.before = len(self.record.pieces)
        self.stats_before = None if before is None else before.stats
        for run in runs:
            self.add(run, params)

    def add(
        self, run: Any, params: Array, *, jumps: bool = False, causes: tuple[int, ...] = (),
        contacts: tuple[str, ...] = (),
    ) -> None:  # fmt: skip
        """Go on with a run."""
        self.runs.append(run)
        steps = run.steps
        for each in steps if isinstance(steps, list) else [steps]:
            piece = Piece(each, params, jumps=jumps, causes=causes, contacts=contacts)
            self.record.pieces.append(piece)
            jumps = False

    def replace_last(self, run: Any, contacts: tuple[str, ...]) -> None:
        """Another run from the start of the last one, which has not advanced."""
        self.runs.pop()
        last = self.record.pieces.pop()
        piece = Piece(run.steps, last.params, contacts=contacts)
        before = self.record.pieces[-1] if self.record.pieces else piece
        changes = before.contacts != contacts and (before.lasts or piece.lasts)
        self.add(run, last.params, jumps=last.jumps or changes, contacts=contacts)

    @property
    def last(self) -> Any:
        return self.runs[-1]

    @property
    def status(self) -> int:
        return int(self.last.status)

    @property
    def t(self) -> float:
        return float(self.last.t)

    def advance(self, steps: int) -> int:
        """At most so many attempted steps."""
        return int(self.last.advance(steps))

    def recorded(self) -> Record:
        """The record, with counters: sums, and the least of minima."""
        parts = [run.stats() for run in self.runs]
        parts = parts if self.stats_before is None else [self.stats_before, *parts]
        told = {**parts[-1], **{name: sum(part[name] for part in parts) for name in ADDED}}
        for name, time in LEAST.items():
            least = min(parts, key=lambda part: part[name])
            told |= {name: least[name], time: least[time]}
        self.record.stats = {**told, "rounding": max(part["rounding"] for part in parts)}
        return self.record
