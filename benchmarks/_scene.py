"""The one place where these benchmarks touch the compiled driver."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from _results import OUT, write
from mechc.native._driver import Scene
from numpy.typing import NDArray

from mechc._scenes import four_bar

Array = NDArray[np.float64]
DATA = Path(__file__).resolve().parent / "data"
__all__ = ["OUT", "FourBar", "Outcome", "reference", "write"]
METHODS = {"dopri5": 0, "dop853": 1, "gauss8": 3}
STATUS = {
    1: "finished", 2: "not closed", 3: "step too small", 4: "not finite", 5: "singular mass",
    6: "too many steps", 7: "no memory", 8: "undecided", 9: "at a change point", 10: "stopped",
}  # fmt: skip
FINISHED = 1


@dataclass
class Outcome:
    """How a run ended, its accepted states and the change points that it reports."""

    status: int
    t: Array
    y: Array
    change_points: Array
    gaps: Array
    stats: dict[str, Any]
    seconds: float
    run: Any

    @property
    def ok(self) -> bool:
        return self.status == FINISHED

    @property
    def word(self) -> str:
        return STATUS[self.status]


class FourBar:
    """The shipped four-bar with its own parameters, thin rods of 1, 2, 3 kg unless given."""

    def __init__(self, lengths: tuple[float, ...], instruction_set: str | None = None) -> None:
        self.scene = Scene(four_bar.model, instruction_set)
        given = np.zeros(self.scene.parameters, np.uint8)
        given[:4] = 1
        self.p = np.zeros(self.scene.parameters)
        self.p[:4] = lengths
        self.scene.complete(given, self.p)

    def project(self, y: Array) -> Array:
        return np.asarray(self.scene.project(0.0, y, self.p)[1])

    def run(
        self, y0: Array, t_end: float, rtol: float, method: str, *, dense: bool = False,
        max_steps: int = 2_000_000, on_change_point: int = 0,
    ) -> Outcome:  # fmt: skip
        start = time.perf_counter()
        run = self.scene.start(
            0.0, t_end, np.ascontiguousarray(y0), self.p, rtol, None, np.ones(self.scene.width),
            0.0, np.inf, max_steps, METHODS[method], dense, on_change_point,
        )  # fmt: skip
        run.advance(10**9)
        seconds = time.perf_counter() - start
        t, y = run.states()
        times, _, gaps = run.change_points()
        return Outcome(run.status, t, y, times, gaps, run.stats(), seconds, run)

    def closure(self, y: Array) -> tuple[float, float]:
        """Largest closure gap (m) and velocity residual (m/s) of states."""
        l, q, u = self.p[:3], y[:, :3], y[:, 3:]
        gap = (l * np.exp(1j * q)).sum(1) - self.p[3]
        rate = (1j * l * u * np.exp(1j * q)).sum(1)
        size = [np.abs(np.stack([z.real, z.imag])).max() for z in (gap, rate)]
        return float(size[0]), float(size[1])


def reference(name: str) -> dict[str, Any]:
    return json.loads((DATA / f"{name}.json").read_text())  # type: ignore[no-any-return]
