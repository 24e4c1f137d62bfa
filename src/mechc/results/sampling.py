"""A run for pictures and animation: sampled, projected and named.

Input: a finished solution.  Output: plain arrays and text ready to be drawn.
Invariant: every text from here is one printable line of bounded length; it must still be escaped
for its format (HTML, JSON, matplotlib).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mechc.simulation.trajectory import Trajectory
from mechc.system.description import Description
from mechc.system.parameters import Array
from mechc.system.picture import Picture, Strut
from mechc.system.quantity import Kind, shown_in
from mechc.system.system import System

StateFunction = Callable[[Array, Array, Any], Array]


# --- names and units -------------------------------------------------------------------------

GREEK_NAMES = (
    "alpha beta gamma delta epsilon zeta eta theta kappa lamda",
    "mu nu xi rho sigma tau phi chi psi omega",
)
GREEK = dict(zip(" ".join(GREEK_NAMES).split(), "αβγδεζηθκλμνξρστφχψω", strict=True))
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def clean_text(text: str, limit: int = 32) -> str:
    """One printable line of at most `limit` characters; control and bidi marks are escaped."""
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return shown if len(shown) <= limit else shown[: limit - 1] + "…"


def pretty_name(name: str) -> str:
    """A symbol for display: theta_0 -> θ₀; anything unusual stays unchanged."""
    match = re.fullmatch(r"([A-Za-z]+)(?:_?([0-9]{1,4}))?", name)
    if match is None:
        return clean_text(name)
    base, index = match.groups()
    return clean_text(GREEK.get(base, base) + (index or "").translate(SUBSCRIPTS))


def power_of_ten(exponent: int) -> str:
    """10 to a whole power, in plain characters: -14 -> 10⁻¹⁴."""
    return "10" + str(exponent).translate(SUPERSCRIPTS)


@dataclass(frozen=True)
class ShownUnit:
    """The unit in which a quantity is shown: its values times `factor` are in `label`."""

    factor: float
    label: str
    quantity: str


_SHOWN = {
    Kind.ANGLE: "angle",
    Kind.ANGULAR_SPEED: "angular speed",
    Kind.LENGTH: "position",
    Kind.SPEED: "speed",
}


def shown_unit(model: Description, name: str) -> ShownUnit:
    """The unit in which a coordinate or speed of a model is shown."""
    quantity = model.quantities.get(name)
    return shown_as(Kind.PURE, "") if quantity is None else shown_as(quantity.kind, quantity.unit)


def shown_as(kind: Kind, unit: str, degrees: bool = True) -> ShownUnit:
    """The unit in which a quantity is shown: ``degrees`` where the API has radians."""
    if kind is Kind.PURE:
        return ShownUnit(1.0, "", "value")
    label, factor = shown_in(kind, unit) if degrees else (unit, 1.0)
    powers = re.sub(r"\^(\d)", lambda match: match[1].translate(SUPERSCRIPTS), label)
    return ShownUnit(factor, clean_text(powers), _SHOWN.get(kind, "value"))


def is_joint(name: str) -> bool:
    """Whether a point is drawn with a mark; points of curves begin with a dot and are not."""
    return not name.startswith(".")


# --- the sampled run -------------------------------------------------------------------------


BEYOND = 0.2  # of its travel a guide is longer at each end
HELD = 1e-7  # of the longest way of a point
MOST_CORNERS = 4


@dataclass(frozen=True)
class Guide:
    """The line along which a body slides, by its point ``at``, drawn between two named ends.

    ``is_block``: the body is drawn as a block.
    """

    label: str
    at: str
    is_block: bool
    ends: tuple[str, str]


@dataclass(frozen=True)
class Run:
    """A solution on a uniform grid: t (n,) s, ascending; y (n, nq+nu).

    ``forces``: which are drawn, as :func:`~mechc.results.player.forces.forces_of` takes them.
    """

    solution: Trajectory
    t: Array
    y: Array
    in_space: bool = False
    forces: Any = False

    @property
    def system(self) -> System:
        """The system that ran."""
        return self.solution.system

    @cached_property
    def picture(self) -> Picture:
        """The picture of the system; ``in_space``: with its solids."""
        return self.system.picture_in_space if self.in_space else self.system.picture

    @property
    def point_names(self) -> list[str]:
        """The picture's points, then both ends of each guide."""
        ends = [name for guide in self.guides for name in guide.ends]
        return [*self.picture.point_names, *ends]

    @cached_property
    def positions(self) -> Array:
        """The points and the ends of guides, (n, points, 3) m."""
        if not self.picture.point_names:
            return np.zeros((len(self.t), 0, 3))
        points = self.evaluate(self.picture.points)
        return np.concatenate([points, self._ends_of_guides(points)], axis=1)

    @cached_property
    def guides(self) -> tuple[Guide, ...]:
        """The lines along which bodies slide."""
        return tuple(
            Guide(label, point, is_block, (f".{label} guide begin", f".{label} guide end"))
            for label, point, is_block in self.picture.sliders
        )

    def activation(self, strut: Strut) -> Array | None:
        """The activation of a muscle, (n,) from 0 to 1; None where it is not known."""
        if strut.activation is None:
            return None
        if isinstance(strut.activation, str):
            if strut.activation not in self.system.inputs:  # as no equation contains it
                return None
            values = curve(self, strut.activation, False)[1]
        else:
            values = self.evaluate(strut.activation)
        return np.clip(np.nan_to_num(values), 0.0, 1.0)

    def _ends_of_guides(self, points: Array) -> Array:
        """From the one end of a body's travel to the other and a little beyond, (n, ends, 3) m."""
        if not self.guides or self.picture.sliding is None:
            return np.zeros((len(self.t), 0, 3))
        base, along = self.picture.sliding(self.y, self.params, self.t)
        names = list(self.picture.point_names)
        at = points[:, [names.index(guide.at) for guide in self.guides]]
        place = np.einsum("nsi,nsi->ns", at - base, along)
        low, high = np.nanmin(place, axis=0), np.nanmax(place, axis=0)
        more = BEYOND * np.maximum(high - low, np.ptp(points, axis=(0, 1)).max() / 10)
        ends = np.stack([low - more - place, high + more - place], axis=-1)
        found = at[:, :, None] + ends[..., None] * along[:, :, None]
        return np.asarray(found.reshape(len(at), -1, 3))

    @cached_property
    def ground(self) -> tuple[str, ...]:
        """The pivots: those of the picture, and points of links that the loops' closing holds."""
        return (*self.picture.ground, *self._still_points)

    @property
    def traced(self) -> tuple[str, ...]:
        """The points whose path is drawn, each path once; those that closing holds have none."""
        moving = [name for name in self.picture.traced if name not in self._still_points]
        return self._apart(moving) or (self._corners or self._ends)[:MOST_CORNERS]

    def _apart(self, names: Sequence[str]) -> tuple[str, ...]:
        """The points that move with no earlier one, as the two ends that a loop joins do."""
        found: dict[str, Array] = {}
        near = HELD * float(np.abs(self.positions).max(initial=0.0))
        for name in names:
            path = self.positions[:, self.picture.point_names.index(name)]
            if not any(np.abs(path - other).max() <= near for other in found.values()):
                found[name] = path
        return tuple(found)

    @cached_property
    def _still_points(self) -> tuple[str, ...]:
        """Points of links, placed by coordinates, that do not move while others do."""
        if self.system.constraints(self.y[:1], self.solution.params, self.t[:1]).shape[-1] == 0:
            return ()
        names = {n for n in self._points_of_links - {*self.picture.ground} if is_joint(n)}
        if not names:
            return ()
        travel = np.linalg.norm(np.ptp(self.positions, axis=0), axis=-1)
        if travel.max() <= HELD * np.abs(self.positions).max():
            return ()
        still = dict(zip(self.point_names, travel <= HELD * travel.max(), strict=True))
        return tuple(n for n in self.picture.point_names if n in names and still[n])

    @property
    def _points_of_links(self) -> set[str]:
        return {n for _, line in self.picture.skeleton if len(line) > 1 for n in line}

    @property
    def _corners(self) -> tuple[str, ...]:
        """The points at which moving links meet."""
        lines = [{*line} for _, line in self.picture.skeleton]
        joints = {n for n in self._points_of_links - {*self.ground} if is_joint(n)}
        meeting = {n for n in joints if sum(n in line for line in lines) > 1}
        return tuple(n for n in self.picture.point_names if n in meeting)

    @property
    def _ends(self) -> tuple[str, ...]:
        """The ends of links that no other link has, in space or not at rest."""
        ends = {n for _, line in self.picture.skeleton for n in (line[0], line[-1]) if is_joint(n)}
        return tuple(n for n in self.picture.point_names if n in ends - {*self.ground})

    @property
    def change_times(self) -> tuple[float, ...]:
        """Times when the run crossed change points, in seconds."""
        return tuple(float(point.t) for point in self.solution.change_points)

    def evaluate(self, function: StateFunction) -> Array:
        """A function of the system along the run: (n, ...)."""
        return np.asarray(function(self.y, self.params, self.t), dtype=float)

    @property
    def params(self) -> Array:
        """The parameters (np,), or (n, np) where resets change them."""
        return np.asarray(self.solution.values_along(self.t))


def energies(run: Run) -> dict[str, Array]:
    """The energies along a run, J."""
    system = run.system
    functions = (system.kinetic_energy, system.potential_energy, system.energy)
    names = ("kinetic", "potential", "total")
    return {name: run.evaluate(each) for name, each in zip(names, functions, strict=True)}


def curve(run: Run, name: str, degrees: bool) -> tuple[ShownUnit, Array]:
    """A quantity or an input along a run: unit, values (n,).

    Raises :class:`UnknownNameError`, :class:`UnavailableOutputError` if there is none,
    :class:`ValueOutOfBoundsError` for an output of several numbers.
    """
    system = run.system
    if name in system.inputs:
        assert system.driven is not None
        return ShownUnit(1.0, "", clean_text(name)), system.driven.values([name], run.t, run.y)[0]
    one, values = run.solution.quantity_along(name, run.t, run.y)
    if one.of_state:
        return shown_as(one.kind, one.unit, degrees), values
    return ShownUnit(1.0, one.unit, "energy" if one.unit == "J" else clean_text(name)), values


SAMPLES_A_STEP, MOST_SAMPLES = 4, 20_000  # long runs need more, else chords are visible


def sample(solution: Trajectory, samples: int, *, jumps: bool = False) -> Run:
    """The dense output at `samples` equal steps; one row where the run has no duration.

    ``jumps``: and before and after every jump of the state, in two rows of the same time.
    """
    first, last = sorted(solution.span)
    if first == last:
        return Run(solution, np.array([first]), np.asarray(solution.y[:1], dtype=float))
    steps = int(solution.stats["steps"])
    t = np.linspace(first, last, max(samples, min(SAMPLES_A_STEP * steps, MOST_SAMPLES)))
    parts = solution.segments[1:] if jumps else ()
    if parts:
        t = np.sort(np.append(t, np.repeat([part.t0 for part in parts], 2)))
    return Run(solution, t, np.asarray(solution(t), dtype=float))


@dataclass(frozen=True)
class PlaneView:
    """The points (n, points, 3) m of a motion, and the axes of the plane they are drawn in."""

    points: Array
    names: tuple[str, ...]
    axes: tuple[str, str]
    projected: bool

    @cached_property
    def positions(self) -> Array:
        """The points in the plane, (n, points, 2) m."""
        return self.of(self.points)

    def of(self, vectors: Array) -> Array:
        """The components (..., 2) in the plane of vectors (..., 3)."""
        columns = [  # along "x", "-x" and so on
            (-1.0 if axis[0] == "-" else 1.0) * vectors[..., "xyz".index(axis[-1])]
            for axis in self.axes
        ]
        return np.stack(columns, axis=-1)

    def path(self, name: str) -> Array:
        """Positions of one point: (n, 2) m."""
        return self.positions[:, self.names.index(name)]

    @property
    def box(self) -> tuple[Array, Array]:
        """Smallest and largest position over the whole run, (2,) m each."""
        flat = self.positions.reshape(-1, 2)
        flat = flat[np.isfinite(flat).all(axis=1)]
        if len(flat) == 0:
            return np.zeros(2), np.zeros(2)
        return flat.min(axis=0), flat.max(axis=0)

    @property
    def size(self) -> float:
        """The larger side of the box in metres, 1 if all are in one point."""
        low, high = self.box
        return float((high - low).max()) or 1.0

    @property
    def note(self) -> str:
        """A note on the projection; empty for a planar mechanism."""
        return f"spatial motion, projected on {self.axes[0]} and {self.axes[1]}" * self.projected


def plane_view(run: Run) -> PlaneView:
    """Positions in the x-y plane; of a spatial motion along the axes of its view.

    These are the mechanism's ``view``, or by default the two between which it spreads most.
    """
    names, points = tuple(run.point_names), run.positions
    size = np.nanmax(np.abs(points), initial=0.0)
    spatial = bool(np.nanmax(np.abs(points[..., 2]), initial=0.0) > 1e-9 * size)
    axes = (run.picture.view or _widest_axes(points)) if spatial else ("x", "y")
    return PlaneView(points, names, axes, spatial)


def _widest_axes(points: Array) -> tuple[str, str]:
    """The two axes between which the points spread most, by the area of their ellipse.

    Along the two of largest extent a motion in an upright plane at 45 degrees would be a line.
    """
    flat = points.reshape(-1, 3)
    flat = flat[np.isfinite(flat).all(axis=1)]
    spread = np.cov(flat.T) if len(flat) > 1 else np.eye(3)
    area = {pair: np.linalg.det(spread[np.ix_(pair, pair)]) for pair in ((0, 1), (0, 2), (1, 2))}
    first, second = max(area, key=lambda pair: area[pair])
    return "xyz"[first], "xyz"[second]
