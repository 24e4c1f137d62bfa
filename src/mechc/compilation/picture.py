"""The picture of a system from its description, made when a picture is asked for.

The points of a picture are not compiled unless they were requested; here the few small matrices
between frames and points are evaluated with NumPy, for all states of a run at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

import numpy as np

from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.system.parameters import Array
from mechc.system.picture import Picture, Solid, Strut
from mechc.system.system import System

WHOLE = 1e-9  # rad
Described = Callable[[], tuple[Any, Any]]  # the mechanism and its options


@one_at_a_time
def described_picture(
    system: System, described: Described, added: Any = None, *, in_space: bool = False
) -> Picture:
    """The picture of a description, with what a user's ``mechc.Drawing`` adds.

    ``in_space``: with solids, springs and dampers.

    Raises :class:`MechanismError` if that drawing names a point that is not there.
    """
    from mechc_codegen.description.drawing import Drawing
    from mechc_codegen.drawing.plan import picture_plan

    errors_of_compiler()
    mechanism, requested = described()
    fixed = {symbol.name: float(value) for symbol, value in requested.fixed.items()}
    known = {*system.parameters, *fixed}
    plan = picture_plan(mechanism, added or Drawing(), known, in_space=in_space)
    drawing = plan.drawing
    places = _Positions(plan, system.parameters, fixed)
    shown = drawing.links, drawing.ground, drawing.traced, drawing.view
    sliders = [(label, name, is_block) for label, name, is_block, _, _ in plan.sliders]
    struts = [
        Strut("muscle", label, line, places.activation(given))
        for label, line, given in plan.muscles
    ]
    if not in_space:
        return Picture(
            plan.names, *shown, places, sliders=sliders, sliding=places.sliding, struts=struts
        )
    struts += [Strut("spring", *strut) for strut in drawing.springs]
    struts += [Strut("damper", *strut) for strut in drawing.dampers]
    solids = [
        Solid(s.kind, s.label, s.axis, s.path, s.triangles, places.of_parameters(s.entries))
        for s, _, _ in plan.solids
    ]
    weight = None if plan.weight is None else places.of_parameters(plan.weight)
    joints = [name for name, _ in plan.joints]
    return Picture(
        plan.names, *shown, places, solids, places.placed, struts, weight, joints, places.acting,
        [name for name, _, _ in plan.loads], places.pushing, sliders, places.sliding,
    )  # fmt: skip


class _Positions:
    """Positions of the points of a plan, (..., points, 3)."""

    def __init__(self, plan: Any, parameters: tuple[str, ...], fixed: dict[str, float]) -> None:
        self._plan, self._fixed = plan, fixed
        time, state, values = plan.arguments
        self._index = {s.name: parameters.index(s.name) for s in values if s.name not in fixed}
        self._names = [symbol.name for symbol in values]
        entries = [entry for _, turn in plan.frames for entry in turn]
        arms = [arms for _, arms in plan.points] + [axis for *_, axis in plan.wraps]
        entries += [entry for several in arms for _, arm in several for entry in arm]
        self._entries = numeric([time, *state, *values], entries)

    def __call__(self, y: Array, p: Array, t: float | Array) -> Array:
        points, _ = self._all(y, p, t)
        return np.stack([points[k] for k in self._plan.places], axis=-2)

    def placed(self, y: Array, p: Array, t: float | Array) -> tuple[Array, Array]:
        """Positions of the solids, and the matrices that turn their axes to the inertial ones."""
        points, turns = self._all(y, p, t)
        where = [points[point] for _, point, _ in self._plan.solids]
        turned = [turns[frame] for _, _, frame in self._plan.solids]
        return np.stack(where, axis=-2), np.stack(turned, axis=-3)

    def acting(self, y: Array, p: Array, t: float | Array) -> Array:
        """The places where the reactions of the joints act."""
        points, _ = self._all(y, p, t)
        return np.stack([points[point] for _, point in self._plan.joints], axis=-2)

    def sliding(self, y: Array, p: Array, t: float | Array) -> tuple[Array, Array]:
        """Points of the lines along which bodies slide, and their directions."""
        points, _ = self._all(y, p, t)
        base = np.stack([points[k] for *_, k, _ in self._plan.sliders], axis=-2)
        ways = np.stack([points[k] for *_, k in self._plan.sliders], axis=-2) - base
        return base, ways / np.linalg.norm(ways, axis=-1, keepdims=True)

    def pushing(self, y: Array, p: Array, t: float | Array) -> tuple[Array, Array]:
        """The places of the forces among the loads, and the forces, along the inertial axes."""
        points, turns = self._all(y, p, t)
        numbers = iter(self._forces(t, *self._states(y), *self._values(p)))
        forces = [_sum(arms, numbers, turns) for _, _, arms in self._plan.loads]
        where = [points[point] for _, point, _ in self._plan.loads]
        return np.stack(where, axis=-2), np.stack(forces, axis=-2)

    @cached_property
    def _forces(self) -> Any:
        """A function of time, state, speeds and parameters for all components of the loads."""
        entries = [entry for _, _, arms in self._plan.loads for _, arm in arms for entry in arm]
        return self._of_states(entries)

    def _of_states(self, entries: list[Any]) -> Any:
        time, state, values = self._plan.arguments
        return numeric([time, *state, *self._plan.speeds, *values], entries)

    def _states(self, y: Array) -> list[Array]:
        return [y[..., k] for k in range(len(self._plan.arguments[1]) + len(self._plan.speeds))]

    def activation(self, given: Any) -> Any:
        """A muscle's activation as a function of states; as it is if it is a name, or None."""
        if given is None or isinstance(given, str):
            return given
        function = self._of_states([given])

        def activation(y: Array, p: Array, t: float | Array) -> Array:
            (found,) = function(t, *self._states(y), *self._values(p))
            return np.broadcast_to(found, y.shape[:-1])

        return activation

    def _values(self, p: Array) -> list[Any]:
        index, fixed = self._index, self._fixed
        return [p[..., index[n]] if n in index else fixed[n] for n in self._names]

    def of_parameters(self, entries: Any) -> Callable[[Array], Array]:
        """Expressions of parameters as a function of all parameters' values."""
        from sympy import lambdify

        symbols = self._plan.arguments[2]
        function = lambdify([list(symbols)], list(entries), "numpy", dummify=True)
        return lambda p: np.array(function(self._values(p)), dtype=float)

    def _all(self, y: Array, p: Array, t: float | Array) -> tuple[list[Array], list[Array]]:
        """The points and frames of the plan."""
        leading = np.broadcast_shapes(y.shape[:-1], p.shape[:-1], np.shape(t))
        count = len(self._plan.arguments[1])
        state = [y[..., k] for k in range(count)]
        numbers = iter(self._entries(t, *state, *self._values(p)))
        turns = [np.broadcast_to(np.eye(3), (*leading, 3, 3))]  # of components into inertial ones
        for before, _ in self._plan.frames:
            turns.append(turns[before] @ _next(numbers, 9, leading).reshape(*leading, 3, 3))
        points = [np.zeros((*leading, 3))]
        for before, arms in self._plan.points:
            points.append(points[before] + _sum(arms, numbers, turns))
        for before, after, centre, arms in self._plan.wraps:
            axis = _sum(arms, numbers, turns) if arms else None
            arc = around(points[before] - points[centre], points[after] - points[centre], axis)
            points += [points[centre] + way for way in arc]
        return points, turns


def around(first: Array, last: Array, axis: Array | None) -> list[Array]:
    """The points (..., 3) that divide a muscle's way around the origin into ``ARC`` equal parts.

    By the right-hand rule about an axis, whose length does not matter; without one the short way.
    """
    from mechc_codegen.drawing.plan import ARC

    along = np.cross(first, last) if axis is None else axis
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    along = along / np.where(length > 0.0, length, 1.0)
    heights = [(way * along).sum(axis=-1, keepdims=True) for way in (first, last)]
    begin, end = first - heights[0] * along, last - heights[1] * along
    beside = np.cross(along, begin)
    parts = [(way * end).sum(axis=-1, keepdims=True) for way in (beside, begin)]
    angle = np.arctan2(*parts) % (2 * np.pi)
    angle = np.where(angle > 2 * np.pi - WHOLE, 0.0, angle)  # rounding is no whole turn
    shares = [part / ARC for part in range(1, ARC)]
    return [
        np.cos(share * angle) * begin + np.sin(share * angle) * beside
        + (heights[0] + share * (heights[1] - heights[0])) * along
        for share in shares
    ]  # fmt: skip


def numeric(arguments: list[Any], entries: list[Any]) -> Any:
    """Expressions as a function over arrays."""
    from mechc_codegen.description.piecewise import Floor, Step, Where
    from sympy import lambdify

    own = {
        Step.__name__: lambda x: np.where(x > 0, 1.0, 0.0),
        Where.__name__: lambda chosen, one, other: np.where(chosen != 0, one, other),
        Floor.__name__: np.floor,
    }
    return lambdify(arguments, entries, modules=[own, "numpy"], cse=True, dummify=True)


def _sum(arms: Any, numbers: Iterator[Any], turns: list[Array]) -> Array:
    """The vector (..., 3) along the inertial axes with the next numbers as components in frames."""
    leading = turns[0].shape[:-2]
    parts = [(frame, _next(numbers, 3, leading)) for frame, _ in arms]
    turned = (np.einsum("...ij,...j->...i", turns[frame], arm) for frame, arm in parts)
    return sum(turned, np.zeros((*leading, 3)))


def _next(numbers: Any, count: int, leading: tuple[int, ...]) -> Array:
    parts = [np.broadcast_to(np.asarray(next(numbers), dtype=float), leading) for _ in range(count)]
    return np.stack(parts, axis=-1)
