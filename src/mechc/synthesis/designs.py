"""Designs that a synthesis found: values, errors, the curve, words and a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mechc.results.answer import Answer, saved_data, shown_values, write_json
from mechc.synthesis.problem import SynthesisProblem
from mechc.synthesis.search import Candidate
from mechc.system.parameters import Array
from mechc.system.quantity import shown_in


@dataclass(frozen=True)
class Design(Answer):
    """One linkage.

    Attributes
    ----------
    model
        The model that it is one of.
    zeros
        Coordinate -> the value from which its targets are counted, of those whose zero was free.
    driven : (n,)
        The driven coordinate at the positions as they are passed, rad or m.
    q : (n, nq)
        The configurations at the positions.
    cost
        Half the sum of squares of the deviations over their tolerances.
    warnings
        The conditions that it does not meet, in words.
    sweep
        The :class:`mechc.PositionSweep` of its assembly, from the first position on: its curve.
    """

    model: Any
    problem: SynthesisProblem = field(repr=False)
    given: dict[str, float]
    zeros: dict[str, float]
    driven: Array
    q: Array = field(repr=False)
    cost: float
    warnings: tuple[str, ...]
    sweep: Any = field(repr=False)

    @property
    def params(self) -> dict[str, Any]:
        """Its parameters, those found and those given: for ``simulate`` and all outputs."""
        return dict(self.given)

    @property
    def values(self) -> dict[str, float]:
        """The numbers that were found: parameters, and zeros of coordinates."""
        every = {**self.given, **self.zeros}
        return {name: every[name] for name in self.problem.names}

    @property
    def y0(self) -> Array:
        """The state (nq + nu,) at the first position, at rest."""
        return self.assemble()

    @property
    def run(self) -> dict[str, Any]:
        """See :attr:`Answer.run`; a design has no time of its own."""
        return {"t_span": None}

    @property
    def converged(self) -> bool:  # type: ignore[override]
        """Whether it meets all conditions."""
        return not self.warnings

    @property
    def message(self) -> str:  # type: ignore[override]
        """The conditions that it does not meet."""
        return "; ".join(self.warnings)

    @cached_property
    def deviations(self) -> dict[str, Array]:
        """Target -> found minus asked for (n, k), in SI units; NaN where nothing was asked."""
        problem = self.problem
        x = np.array([*self.values.values()])
        apart = problem.deviations(x[None], self.q[None], problem.values(x[None]))[0]
        ends = np.cumsum([len(one.quantities) for one in problem.targets.each])[:-1]
        parts = np.split(apart, ends, axis=1)
        return {one.name: part for one, part in zip(problem.targets.each, parts, strict=True)}

    @property
    def errors(self) -> dict[str, float]:
        """Target -> the largest deviation of a position, in SI units: of points a distance."""
        return {
            name: float(np.sqrt(np.nansum(apart**2, axis=1)).max())
            for name, apart in self.deviations.items()
        }

    def assemble(self, speeds: Mapping[str, float] | None = None) -> Array:
        """The state (nq + nu,) at the first position, with speeds as of ``Model.assemble``."""
        named = dict(zip(self.model.coordinates, self.q[0].tolist(), strict=True))
        driven = self.problem.driven
        given = {driven: named.pop(driven), **self.problem.kept}
        near = {name: value for name, value in named.items() if name not in given}
        return np.asarray(self.model.assemble(given, speeds, near, self.params, self.problem.t))

    def to_json(self) -> dict[str, Any]:
        """Numbers and words as JSON data."""
        return {
            "values": self.values, "driven": self.driven.tolist(), "cost": self.cost,
            "errors": self.errors, "warnings": list(self.warnings),
        }  # fmt: skip

    def plot(self) -> Any:
        """The linkage at its positions and the curves of its targets, in one matplotlib figure."""
        from mechc.synthesis.figures import draw_design

        return draw_design(self)

    def __str__(self) -> str:
        told = [f"{name} = {value:.6g} {unit}".rstrip() for name, value, unit in shown_values(self)]
        off = []
        for one in self.problem.targets.each:
            unit, factor = shown_in(one.kind, one.unit)
            off.append(f"{one.name} off by {self.errors[one.name] * factor:.3g} {unit}".rstrip())
        return "\n    ".join([", ".join(told), ", ".join(off), *self.warnings])


class Designs(tuple[Design, ...]):
    """Designs, the best first: those that meet all conditions, then the others, each by cost.

    ``tried``, ``closed``: how many linkages were drawn, and how many of them close at all
    positions; ``seconds``: the time that it took.
    """

    tried: int
    closed: int
    seconds: float

    @classmethod
    def of(
        cls, model: Any, problem: SynthesisProblem, found: Sequence[Candidate], tried: int,
        closed: int, seconds: float,
    ) -> Designs:  # fmt: skip
        """The designs of what was found."""
        designs = cls(_design(model, problem, one) for one in found)
        designs.tried, designs.closed, designs.seconds = tried, closed, seconds
        return designs

    def plot(self) -> Any:
        """The best design, as its own ``plot``."""
        return self[0].plot()

    def to_json(self) -> dict[str, Any]:
        """Numbers and words as JSON data."""
        told = {"tried": self.tried, "closed": self.closed, "seconds": self.seconds}
        return {**told, "designs": [one.to_json() for one in self]}

    def save(self, path: str | Path) -> Path:
        """Write all designs as JSON, each with the mechanism's name and all its parameters."""
        return write_json(path, {**self.to_json(), "designs": [saved_data(one) for one in self]})

    def __str__(self) -> str:
        meet = sum(not one.warnings for one in self)
        head = (
            f"{len(self)} designs, of which {meet} meet all conditions: {self.closed} of "
            f"{self.tried} linkages drawn close, {self.seconds:.3g} s"
        )
        return "\n".join([head, *(f"{k:3} {one}" for k, one in enumerate(self))])

    def __repr__(self) -> str:
        return f"<mechc.Designs: {len(self)} of {self.tried} linkages drawn>"


def _design(model: Any, problem: SynthesisProblem, found: Candidate) -> Design:
    values = dict(zip(problem.names, found.z[: len(problem.names)].tolist(), strict=True))
    zeros = {name: value for name, value in values.items() if name not in problem.parameters}
    params = {**problem.fixed, **{name: values[name] for name in problem.parameters}}
    return Design(
        model, problem, params, zeros, found.values, found.q,
        found.cost, found.broken, found.sweep,
    )  # fmt: skip
