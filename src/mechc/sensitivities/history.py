"""The sensitivities of a run, for its reader."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import UnknownNameError
from mechc.sensitivities.columns import Columns
from mechc.sensitivities.steps import Piece
from mechc.sensitivities.tangent import tangent
from mechc.system.names import name_of
from mechc.system.parameters import Array, doubles

if TYPE_CHECKING:
    from mechc.simulation.trajectory import Trajectory


class Sensitivity(Mapping[str, Array]):
    """Derivatives of the states of a run: name -> (nt, nq + nu) at the times of the run.

    ``sensitivity(t)`` has them at other times.  ``"y0"`` has one more axis, (nt, nq + nu, nq + nu):
    by each component of the start.  Where a derivative does not exist it is NaN, and ``notes`` says
    why.

    Attributes
    ----------
    names
        What was asked for.
    notes
        Which derivatives do not exist, from when on, and why.
    """

    def __init__(
        self, sol: Trajectory, columns: Columns, pieces: Sequence[Piece], notes: tuple[str, ...]
    ) -> None:
        self._sol, self._pieces = sol, tuple(pieces)
        self.columns, self.notes = columns, notes
        self.names = columns.names
        self._kept: Array | None = None

    def __getitem__(self, name: Any) -> Array:
        return self._of(name, self._at_own_times())

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __call__(self, t: float | Array) -> dict[str, Array]:
        """The same at any times (...) of the run, (..., nq + nu) each.

        Raises
        ------
        ValueOutOfBoundsError
            For times the run did not reach.
        """
        times = doubles(t, "the times")
        states = self._sol(times)
        found = self.at(times.reshape(-1), states.reshape(-1, states.shape[-1]))
        parts = {name: self._of(name, found) for name in self.names}
        return {n: each.reshape(*times.shape, *each.shape[1:]) for n, each in parts.items()}

    def __repr__(self) -> str:
        return f"<mechc.Sensitivity by {', '.join(self.names)}>"

    def _of(self, name: Any, found: Array) -> Array:
        key = name_of(name)
        if key not in self.columns.places:
            raise UnknownNameError("sensitivity", key, self.names)
        return np.asarray(found[..., self.columns.places[key]])

    def _at_own_times(self) -> Array:
        if self._kept is None:
            self._kept = self.at(self._sol.t, self._sol.y)
        return self._kept

    def at(self, t: Array, y: Array) -> Array:
        """All columns (n, nx, k) at times and states of the run."""
        found = np.empty((len(t), y.shape[1], self.columns.count))
        forwards = 1.0 if self._pieces[-1].t[-1] >= self._pieces[0].t[0] else -1.0
        starts = np.array([forwards * piece.t[0] for piece in self._pieces])
        place = np.maximum(np.searchsorted(starts, forwards * t) - 1, 0)
        for number in np.unique(place):
            here = place == number
            found[here] = self._pieces[number].at(t[here])
        between = np.isin(t, np.concatenate([piece.t for piece in self._pieces]), invert=True)
        if between.any():  # at accepted states they are on the tangent space
            where = y[between], self._sol.params, t[between]
            projected = tangent(self._sol.system, *where, self.columns)
            if projected is not None:
                found[between] = projected[0] @ found[between] + projected[1]
        return found
