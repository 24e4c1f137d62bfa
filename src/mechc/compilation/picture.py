"""The picture of a system from its description, made when a picture is asked for.

The points of a picture are not compiled unless they were requested; here the few small matrices
between frames and points are evaluated with NumPy, for all states of a run at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.system.parameters import Array
from mechc.system.picture import Picture, Solid
from mechc.system.system import System

Described = Callable[[], tuple[Any, Any]]  # the mechanism and its options


@one_at_a_time
def described_picture(
    system: System, described: Described, added: Any = None, *, in_space: bool = False
) -> Picture:
    """The picture of a description, with what a user's ``mechc.Drawing`` adds.

    ``in_space``: with solids, springs and dampers.

    Raises
    ------
    MechanismError
        If that drawing names a point that is not there.
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
    if not in_space:
        return Picture(plan.names, *shown, places)
    struts = [("spring", *strut) for strut in drawing.springs]
    struts += [("damper", *strut) for strut in drawing.dampers]
    solids = [
        Solid(s.kind, s.label, s.axis, s.path, places.of_parameters(s.entries))
        for s, _, _ in plan.solids
    ]
    weight = None if plan.weight is None else places.of_parameters(plan.weight)
    joints = [name for name, _ in plan.joints]
    return Picture(
        plan.names, *shown, places, solids, places.placed, struts, weight, joints, places.acting
    )


class _Positions:
    """Positions of the points of a plan, (..., points, 3)."""

    def __init__(self, plan: Any, parameters: tuple[str, ...], fixed: dict[str, float]) -> None:
        from mechc_codegen.description.piecewise import Floor, Step, Where
        from sympy import lambdify

        self._plan, self._fixed = plan, fixed
        time, state, values = plan.arguments
        self._index = {s.name: parameters.index(s.name) for s in values if s.name not in fixed}
        self._names = [symbol.name for symbol in values]
        entries = [entry for _, turn in plan.frames for entry in turn]
        entries += [entry for _, arms in plan.points for _, arm in arms for entry in arm]
        own = {Step.__name__: _step, Where.__name__: _where, Floor.__name__: np.floor}
        self._entries = lambdify(
            [time, *state, *values], entries, modules=[own, "numpy"], cse=True, dummify=True
        )

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
        """Where the reactions of the joints act."""
        points, _ = self._all(y, p, t)
        return np.stack([points[point] for _, point in self._plan.joints], axis=-2)

    def of_parameters(self, entries: Any) -> Callable[[Array], Array]:
        """Expressions of parameters as a function of all parameters' values."""
        from sympy import lambdify

        symbols = self._plan.arguments[2]
        function = lambdify([list(symbols)], list(entries), "numpy", dummify=True)

        def evaluated(p: Array) -> Array:
            values = [
                p[self._index[n]] if n in self._index else self._fixed[n] for n in self._names
            ]
            return np.array(function(values), dtype=float)

        return evaluated

    def _all(self, y: Array, p: Array, t: float | Array) -> tuple[list[Array], list[Array]]:
        """Every point and every frame of the plan."""
        leading = np.broadcast_shapes(y.shape[:-1], p.shape[:-1], np.shape(t))
        count = len(self._plan.arguments[1])
        state = [y[..., k] for k in range(count)]
        index, fixed = self._index, self._fixed
        values = [p[..., index[n]] if n in index else fixed[n] for n in self._names]
        numbers = iter(self._entries(t, *state, *values))
        turns = self._turns(numbers, leading)
        points = [np.zeros((*leading, 3))]
        for before, arms in self._plan.points:
            place = points[before]
            for frame, _ in arms:
                arm = _next(numbers, 3, leading)
                place = place + np.einsum("...ij,...j->...i", turns[frame], arm)
            points.append(place)
        return points, turns

    def _turns(self, numbers: Any, leading: tuple[int, ...]) -> list[Array]:
        """Of each frame the matrix that turns its components into inertial ones."""
        turns = [np.broadcast_to(np.eye(3), (*leading, 3, 3))]
        for before, _ in self._plan.frames:
            turns.append(turns[before] @ _next(numbers, 9, leading).reshape(*leading, 3, 3))
        return turns


def _next(numbers: Any, count: int, leading: tuple[int, ...]) -> Array:
    parts = [np.broadcast_to(np.asarray(next(numbers), dtype=float), leading) for _ in range(count)]
    return np.stack(parts, axis=-1)


def _step(x: Any) -> Any:
    return np.where(x > 0, 1.0, 0.0)


def _where(chosen: Any, one: Any, other: Any) -> Any:
    return np.where(chosen != 0, one, other)
