"""The sensitivities of a run, for its reader."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import UnknownNameError
from mechc.sensitivities.columns import Columns
from mechc.sensitivities.events import EventSensitivity, event_sensitivities
from mechc.sensitivities.steps import Piece
from mechc.system.names import name_of
from mechc.system.parameters import Array, doubles
from mechc.system.units import SECONDS

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
        self._sol, self.pieces = sol, tuple(pieces)
        self.columns, self.notes = columns, notes
        self.names = columns.names

    def __getitem__(self, name: Any) -> Array:
        return self._of(name, self._at_own_times)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __call__(self, t: float | Array) -> dict[str, Array]:
        """The derivatives of the state at any times (...) of the run, (..., nq + nu) each.

        Raises
        ------
        ValueOutOfBoundsError
            For times the run did not reach.
        """
        times = doubles(t, "the times", of=SECONDS)
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

    @cached_property
    def _at_own_times(self) -> Array:
        return self.at(self._sol.t, self._sol.y)

    def at(self, t: Array, y: Array, *, before: bool = False) -> Array:
        """All columns (n, nx, k) at times and states of the run.

        At a jump those after it; of two equal times in a row there, the first is before it, as all
        are with ``before``.
        """
        found = np.empty((len(t), y.shape[1], self.columns.count))
        forwards = 1.0 if self.pieces[-1].t[-1] >= self.pieces[0].t[0] else -1.0
        starts = np.array([forwards * piece.t[0] for piece in self.pieces[1:]])
        place = np.searchsorted(starts, forwards * t, side="left" if before else "right")
        twice = np.flatnonzero(t[1:] == t[:-1])
        place[twice] = np.searchsorted(starts, forwards * t[twice], side="left")
        for number in np.unique(place):
            here = np.flatnonzero(place == number)
            found[here] = self._tangent(self.pieces[number], t[here], y[here])
        return found

    def _tangent(self, piece: Piece, t: Array, y: Array) -> Array:
        """Columns within a piece; at its accepted states they are on the tangent space already."""
        found = piece.at(t)
        between = np.isin(t, piece.t, invert=True)
        if between.any() and self._sol.system.scene.rows:
            found[between] = piece.on_tangent_space(t[between], y[between], found[between])
        return found

    @cached_property
    def events(self) -> tuple[EventSensitivity, ...]:
        """The derivatives of the times and states at the zeros of each event of the run:
        ``sol.sensitivity.events[0].t["l_3"]`` (k,), ``.y["l_3"]`` (k, nq + nu).

        NaN where an event only touches its zero.  A function of Python is taken not to depend on
        parameters; an expression of SymPy is differentiated by them too.
        """
        return event_sensitivities(self._sol, self.columns, partial(self.at, before=True))
