"""The result of a sweep: the batch, what varied, maps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from mechc.batch.results import Batch
from mechc.batch.sweeps.sweep import Plan, sweep_json, sweep_summary
from mechc.system.parameters import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mechc.results.solution import Solution


@dataclass(frozen=True, repr=False)
class Sweep:
    """Many runs over ranges of values.

    Attributes
    ----------
    batch
        The results, member by member; ``sweep["max(theta_2)"]`` is one of them on the grid.
    plan
        What varied: ``plan.columns`` has the values (n,) by name, ``plan.shape`` the grid.
    seconds
        Wall time, s.
    """

    batch: Batch
    plan: Plan
    seconds: float

    @overload
    def __getitem__(self, name: int) -> Solution: ...

    @overload
    def __getitem__(self, name: Any) -> Array: ...

    def __getitem__(self, name: Any) -> Any:
        """A result by name, of the grid's shape; (n, ...) where members were drawn.

        A member's motion by number, as of the batch.
        """
        found, shape = self.batch[name], self.plan.shape
        if shape is None or not isinstance(found, np.ndarray):
            return found
        return found.reshape(*shape, *found.shape[1:])

    def plot(self, reduction: str | None = None) -> Figure:
        """The map of one reduction, by default the first: a matplotlib figure."""
        from mechc.batch.sweeps.maps import draw_map

        texts = self.batch.recipe.reductions
        return draw_map(self.batch, self.plan, texts[0] if reduction is None else reduction)

    def save_maps(self, folder: str | Path) -> list[Path]:
        """Write the map of each reduction, ``map_0.png`` and ``.svg`` and so on; the paths."""
        from mechc.batch.sweeps.maps import save_maps

        return save_maps(self.batch, self.plan, Path(folder))

    def to_json(self) -> dict[str, Any]:
        """Outcomes and extremes in SI units, as ``mechc sweep --json`` prints them."""
        return sweep_json(self.batch, self.plan, self.seconds)

    def __str__(self) -> str:
        return sweep_summary(self.batch, self.plan, self.seconds)

    def __repr__(self) -> str:
        return f"<mechc.Sweep of {', '.join(self.plan.columns)}: {self.batch!r}>"
