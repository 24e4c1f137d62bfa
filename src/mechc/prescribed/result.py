"""A prescribed motion: positions, speeds, accelerations, and the inputs that make it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import UnknownNameError
from mechc.inputs.signals import Signal
from mechc.results.figures import new_figure
from mechc.results.mathtext import plain, typeset
from mechc.results.panels import COLOURS
from mechc.system.names import name_of, names_of
from mechc.system.parameters import Array
from mechc.system.quantities import Quantity, read_quantity
from mechc.system.quantity import shown_in
from mechc.system.system import System

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class PrescribedMotion:
    """A motion on a path, in SI units.

    Attributes
    ----------
    t : (nt,)
        Times, s.
    y : (nt, nq + nu)
        States: coordinates, then speeds.
    accelerations : (nt, nu)
        Rates of the speeds.
    names
        The inputs that were solved for.
    inputs : (nt, m)
        Their values.
    multipliers : (nt, nc)
        Multipliers of the constraints.
    path
        The numbers that were prescribed.
    params : (np,)
        The parameters.
    """

    system: System
    path: Sequence[Quantity]
    params: Array
    t: Array
    y: Array
    accelerations: Array
    names: Sequence[str]
    inputs: Array
    multipliers: Array

    def __getitem__(self, name: Any) -> Array:
        """A coordinate, speed, input or number of an output, ``"points[2,0]"``, (nt,).

        Raises
        ------
        UnknownNameError
            If there is none of this name.
        """
        known = name_of(name)
        if known in self.names:
            return np.asarray(self.inputs[:, list(self.names).index(known)])
        return read_quantity(self.system, name).values(self.system, self.y, self.params, self.t)

    def acceleration(self, speed: Any) -> Array:
        """The rate of a speed, (nt,).

        Raises
        ------
        UnknownNameError
            If there is no such speed.
        """
        name = name_of(speed)
        if name not in self.system.speeds:
            raise UnknownNameError("speed", name, self.system.speeds)
        return np.asarray(self.accelerations[:, list(self.system.speeds).index(name)])

    def signals(self) -> dict[str, Signal]:
        """The inputs as ``simulate(..., inputs=)`` takes them: splines of degree five.

        Raises
        ------
        ValueOutOfBoundsError
            For fewer than six times.
        """
        return {n: Signal(self.t, self.inputs[:, k], "quintic") for k, n in enumerate(self.names)}

    def plot(self, *names: Any, degrees: bool = True) -> Figure:
        """One matplotlib figure over time, a panel for each unit.

        Parameters
        ----------
        names
            What is drawn, as in ``motion[name]``; by default the path, and the inputs.
        degrees
            Show angles in degrees; False: in radians.
        """
        chosen = names_of(names) or [*(q.name for q in self.path), *self.names]
        panels: dict[tuple[str, float], list[str]] = {}
        for name in chosen:
            panels.setdefault(self._shown(name, degrees), []).append(name)
        with new_figure((7.4, 0.8 + 2.4 * len(panels))) as figure:
            every = figure.subplots(len(panels), squeeze=False, sharex=True)[:, 0]
            for axes, ((unit, factor), members) in zip(every, panels.items(), strict=True):
                for name, colour in zip(members, COLOURS * len(members), strict=False):
                    axes.plot(self.t, factor * self[name], color=colour, label=typeset(name))
                axes.set_ylabel(plain(unit))
                axes.legend(fontsize=8)
            every[-1].set_xlabel("time (s)")
            figure.suptitle(plain(f"{self.system.title}: on a path"), x=0.01, ha="left")
        return figure

    def _shown(self, name: str, degrees: bool) -> tuple[str, float]:
        """The unit of a quantity in pictures, and the factor for it; inputs are in SI units."""
        if name in self.names:
            return "inputs (SI units)", 1.0
        meaning = read_quantity(self.system, name).meaning
        return shown_in(meaning.kind, meaning.unit) if degrees else (meaning.unit, 1.0)

    def __repr__(self) -> str:
        told = ", ".join(q.name for q in self.path)
        return (
            f"<mechc.PrescribedMotion of {self.system.name}: {len(self.t)} times on a path of "
            f"{told}; inputs {', '.join(self.names)}>"
        )
