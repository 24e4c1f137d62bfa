"""Initial configurations that close the loops, with speeds that keep them closed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from mechc import branches
from mechc.errors import AssemblyError, UnknownNameError, ValueOutOfBoundsError
from mechc.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.model import Model

STARTS_PER_UNKNOWN = 24
ITERATIONS = 60
POLISHES = 30
SAME = 1e-6  # two solutions closer than this (rad, or of the model's length) are one
DEAD = 1e-7  # relative singular value of a dead point, found to half the digits as it is
EPS = float(np.finfo(float).eps)


def assemble(
    model: Model,
    coordinates: Mapping[str, float],
    speeds: Mapping[str, float] | None = None,
    guess: Mapping[str, float] | None = None,
    params: Parameters = None,
    t: float = 0.0,
) -> Array:
    """One state that closes the loops to rounding.

    Parameters
    ----------
    coordinates
        Values to keep (rad, m); the other coordinates are solved for, as angles in (-pi, pi].
    speeds
        Values to keep (rad/s, m/s); the others are made consistent, the least ones where the
        constraints leave a choice.
    guess
        Some coordinates near which the configuration is wanted; of several assemblies the
        nearest is taken, in the turn of the guess.  Without it the mechanism's preferred one is
        taken: the elbow-up configuration of a planar loop.  At a change point also some speeds,
        near which those of one branch are wanted.
    params
        As in every output of the model.
    t
        The time in s, where constraints depend on it.

    Returns
    -------
    y0 : (nq + nu,)

    Raises
    ------
    AssemblyError
        If the loops cannot close (by how many metres they miss), if the coordinates given leave
        a choice and there is no guess, if the speeds contradict each other, or if the
        configuration is a change point and the speeds lead along more than one branch.
    """
    guess = guess or {}
    pace = {name: value for name, value in guess.items() if name in model.speeds}
    pace = _checked(model, pace, model.speeds, "speed")
    beside = {name: value for name, value in guess.items() if name not in pace}
    near = _checked(model, beside, model.coordinates, "coordinate")
    if near and set(near) & set(coordinates):
        both = sorted(set(near) & set(coordinates))[0]
        raise AssemblyError(f"{both} is both given and guessed; leave it out of one of them")
    found = _configurations(model, coordinates, params, near, t)
    chosen = _nearest(model, found, near) if near else found[0]
    return _only(
        model, _with_speeds(model, chosen[None], coordinates, speeds, params, t), speeds, pace
    )


def assemblies(
    model: Model,
    coordinates: Mapping[str, float],
    speeds: Mapping[str, float] | None = None,
    params: Parameters = None,
    t: float = 0.0,
) -> Array:
    """Every state that closes the loops with the coordinates given: (n, nq + nu).

    The mechanism's preferred assembly comes first; at a change point there is one state for
    every branch on which the speeds lead.  Parameters and errors as in :func:`assemble`.
    """
    found = _configurations(model, coordinates, params, {}, t)
    return _with_speeds(model, found, coordinates, speeds, params, t)


def _checked(
    model: Model, values: Mapping[str, float], known: tuple[str, ...], kind: str
) -> dict[str, float]:
    checked = {}
    for name, value in values.items():
        if name not in known:
            raise UnknownNameError(kind, name, known)
        try:
            checked[name] = float(value)
        except (TypeError, ValueError):
            raise ValueOutOfBoundsError(f"{name} must be a number, not {value!r}") from None
        if not np.isfinite(checked[name]):
            raise ValueOutOfBoundsError(f"{name} = {checked[name]} is not a finite number")
    return checked


def _configurations(
    model: Model,
    coordinates: Mapping[str, float],
    params: Parameters,
    near: Mapping[str, float],
    t: float,
) -> Array:
    """All configurations found, preferred first: (n, nq)."""
    given = _checked(model, coordinates, model.coordinates, "coordinate")
    values = model._parameters.resolve(params)
    if values.ndim != 1:
        raise ValueOutOfBoundsError("assembly takes one set of parameters at a time")
    kept = [model.state_index(name) for name in given]
    free = [i for i in range(len(model.coordinates)) if i not in kept]
    fixed = np.zeros(len(model.coordinates))
    fixed[kept] = list(given.values())
    loop = Loop(model, values, fixed, free, t)
    if not free or not loop.rows:
        return _without_search(model, loop, near)
    _refuse_choice(model, loop, near)
    return _preferred_first(model, values, loop.solve(_starts(model, loop, near)))


class Loop:
    """The configuration constraints as equations in the free coordinates."""

    def __init__(
        self, model: Model, values: Array, fixed: Array, free: list[int], t: float = 0.0
    ) -> None:
        self.model, self.values, self.fixed, self.free = model, values, fixed, free
        self.t = t
        self.rows = model._scene.holonomic
        self.length = model._parameters.length(values)
        self.angular = np.array([model.units[model.coordinates[i]] == "rad" for i in free])
        self.scale = np.where(self.angular, 1.0, self.length)

    def states(self, x: Array) -> Array:
        """Full states at rest for free coordinates x (n, free)."""
        width = len(self.model.coordinates)
        y = np.zeros((len(x), width + len(self.model.speeds)))
        y[:, :width] = self.fixed  # (nq,), or (n, nq) with values of their own
        y[:, self.free] = x
        return y

    def gap(self, x: Array) -> Array:
        return self.model.constraints(self.states(x), self.values, self.t)

    def gradient(self, x: Array) -> Array:
        scene = self.model._scene.outputs
        name = "constraint_gradient" if "constraint_gradient" in scene else "constraint_jacobian"
        whole = self.model._evaluate(name, self.states(x), self.values, self.t)
        return whole[:, : self.rows, self.free]

    def solve(self, x: Array) -> Array:
        """Closed configurations (n, nq) reached from the starts, each once."""
        x, closed = self.search(x)
        gaps = np.linalg.norm(self.gap(x), axis=1)
        if not closed.any():
            raise AssemblyError(self._miss(self._least_gap(x[np.argmin(gaps)])))
        order = np.argsort(gaps[closed], kind="stable")
        wrapped = np.where(self.angular, wrap(x[closed]), x[closed])[order]
        return self.states(self._distinct(wrapped))[:, : len(self.fixed)]

    def search(self, x: Array) -> tuple[Array, Array]:
        """Where each start (n, free) leads, and whether the loops close there."""
        before = np.full(len(x), np.inf)
        for _ in range(ITERATIONS):
            x = self._descend(x)
            size = np.linalg.norm(self.gap(x), axis=1)
            if ((size <= 1e-12 * self.length) | (size > 0.999 * before)).all():
                break
            before = size
        x = self._polish(x)
        return x, np.linalg.norm(self.gap(x), axis=1) <= 64 * EPS * self.length

    def _descend(self, x: Array) -> Array:
        """A Levenberg-Marquardt step with the damping of Yamashita & Fukushima (2001)."""
        gap, gradient = self.gap(x), self.gradient(x) * self.scale
        size = np.linalg.norm(gap, axis=1)
        damping = (size / self.length) ** 2 * np.linalg.norm(gradient, axis=(1, 2)) ** 2
        transposed = np.swapaxes(gradient, 1, 2)
        square = transposed @ gradient
        square += (damping + 1e-300)[:, None, None] * np.eye(x.shape[1])
        square += 1e-14 * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(x.shape[1])
        step = -np.linalg.solve(square, transposed @ gap[:, :, None])[:, :, 0]
        step *= np.minimum(1.0, 0.7 / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
        best, best_size = x, size
        for factor in (1.0, 0.25, 0.0625):
            trial = x + factor * step * self.scale
            trial_size = np.linalg.norm(self.gap(trial), axis=1)
            better = trial_size < best_size
            best = np.where(better[:, None], trial, best)
            best_size = np.where(better, trial_size, best_size)
        return best

    def _polish(self, x: Array) -> Array:
        """Gauss-Newton steps, each kept where it closes the loop further.

        Where two assemblies meet they gain one bit a step, so there may be many.
        """
        for _ in range(POLISHES):
            gap = self.gap(x)
            step = np.linalg.pinv(self.gradient(x), rcond=1e-13) @ gap[:, :, None]
            trial = x - step[:, :, 0]
            better = np.abs(self.gap(trial)).max(axis=1) < np.abs(gap).max(axis=1)
            if not better.any():
                break
            x = np.where(better[:, None], trial, x)
        return x

    def _distinct(self, x: Array) -> Array:
        kept: list[Array] = []
        for row in x:
            if all(self._distance(row, other) > SAME for other in kept):
                kept.append(row)
        return np.array(kept)

    def _distance(self, a: Array, b: Array) -> float:
        difference = np.where(self.angular, wrap(a - b), a - b)
        return float(np.abs(difference / self.scale).max())

    def _least_gap(self, x: Array) -> float:
        """How close the ends come from x on, m."""
        from scipy.optimize import minimize

        def square(z: Array) -> tuple[float, Array]:
            gap = self.gap((z * self.scale)[None])[0]
            slope = gap @ self.gradient((z * self.scale)[None])[0] * self.scale
            return float(gap @ gap) / 2, slope

        found = minimize(square, x / self.scale, jac=True, method="BFGS", options={"gtol": 1e-12})
        return float(np.sqrt(2 * found.fun))

    def _miss(self, gap: float) -> str:
        model = self.model
        kept = [i for i in range(len(self.fixed)) if i not in self.free]
        at = ", ".join(
            _in_words(model.coordinates[i], self.fixed[i], model.units[model.coordinates[i]])
            for i in kept
        )
        return (
            f"the loop cannot close at {at}: the ends miss each other by at least {gap:.6g} m "
            "with these lengths. Change the lengths or the coordinates given"
        )


def _without_search(model: Model, loop: Loop, near: Mapping[str, float]) -> Array:
    """Nothing to solve for, or nothing to close."""
    q = loop.fixed.copy()
    for name, value in near.items():
        q[model.state_index(name)] = value
    if loop.rows:
        gap = float(np.abs(loop.gap(np.zeros((1, 0)))).max())
        if gap > 1e-8 * loop.length:
            raise AssemblyError(
                f"the coordinates given leave the loop open by {gap:.6g} m; give fewer of them "
                "and let the others be solved for"
            )
    return q[None]


def _refuse_choice(model: Model, loop: Loop, near: Mapping[str, float]) -> None:
    excess = len(loop.free) - loop.rows
    if excess > 0 and not near:
        names = ", ".join(model.coordinates[i] for i in loop.free)
        raise AssemblyError(
            f"{loop.rows} constraints do not determine {names}: give {excess} more of them, or "
            "a guess"
        )


def _starts(model: Model, loop: Loop, near: Mapping[str, float]) -> Array:
    """Points spread evenly over the free coordinates, and the guess."""
    size = len(loop.free)
    count = STARTS_PER_UNKNOWN * size * size
    spread = even_points(count, size) * np.where(loop.angular, np.pi, loop.length)
    if not near:
        return spread
    guess = np.array([near.get(model.coordinates[i], np.nan) for i in loop.free])
    near_guess = np.where(np.isnan(guess), spread, guess)
    return near_guess if size > loop.rows else np.vstack([near_guess, spread])


def even_points(count: int, size: int) -> Array:
    """Points (count, size) spread evenly over (-1, 1) in every component (Roberts 2018)."""
    ratio = 2.0
    for _ in range(40):
        ratio = (1.0 + ratio) ** (1.0 / (size + 1))
    steps = ratio ** -np.arange(1.0, size + 1.0)
    return np.asarray(2.0 * ((0.5 + np.outer(np.arange(count), steps)) % 1.0) - 1.0)


def _preferred_first(model: Model, values: Array, found: Array) -> Array:
    order = np.lexsort(found.T[::-1])
    if "preference" in model._scene.outputs:
        states = np.hstack([found, np.zeros((len(found), len(model.speeds)))])
        preference = model._evaluate("preference", states, values, 0.0)
        order = np.lexsort((*found.T[::-1], -preference))
    return found[order]


def _nearest(model: Model, found: Array, near: Mapping[str, float]) -> Array:
    """The configuration nearest to the guess, its angles in the guess's turn."""
    index = [model.state_index(name) for name in near]
    target = np.array(list(near.values()))
    angular = np.array([model.units[name] == "rad" for name in near])
    away = found[:, index] - target
    away = np.where(angular, wrap(away), away)
    chosen = int(np.argmin(np.linalg.norm(away, axis=1)))
    q = found[chosen].copy()
    turns = np.round((target - q[index]) / (2 * np.pi))
    q[index] += np.where(angular, turns * 2 * np.pi, 0.0)
    return np.asarray(q)


def _with_speeds(
    model: Model,
    q: Array,
    coordinates: Mapping[str, float],
    speeds: Mapping[str, float] | None,
    params: Parameters,
    t: float,
) -> Array:
    """States (n, nq + nu) on the configurations given, at a change point one for every branch."""
    given = _checked(model, speeds or {}, model.speeds, "speed")
    values = model._parameters.resolve(params)
    states = np.hstack([q, np.zeros((len(q), len(model.speeds)))])
    kept = [model.state_index(name) for name in coordinates]
    return np.vstack([_speeds_at(model, y, kept, given, values, t) for y in states])


def _speeds_at(
    model: Model, y: Array, fixed: list[int], given: dict[str, float], values: Array, t: float
) -> Array:
    at = branches.find(model, y, values, t)
    if at is None or (at.q[fixed] != y[fixed]).any():
        _consistent_speeds(model, y, given, values, t)
        return y[None]
    kept = {model.speeds.index(name): value for name, value in given.items()}
    speeds = branches.speeds_on_branches(model, at, kept, values, t)
    if speeds is None or not len(speeds):
        _refuse_speeds(model, y, given, at, values, t, leave_a_choice=speeds is None)
    assert speeds is not None
    return np.hstack([np.tile(at.q, (len(speeds), 1)), speeds])


def _refuse_speeds(
    model: Model, y: Array, given: dict[str, float], at: branches.ChangePoint, values: Array,
    t: float, *, leave_a_choice: bool,
) -> None:  # fmt: skip
    """At a change point: speeds that lead along no branch, or do not say along which."""
    words = ", ".join(f"{name} = {value:g}" for name, value in given.items())
    if leave_a_choice:
        raise AssemblyError(
            f"{_place(model, y)} is a change point, and {words} leaves more than one freedom "
            "open there: give more of the speeds"
        )
    lines = [
        _motion(model, row)
        for name, value in given.items()
        if value
        for row in _or_none(branches.speeds_on_branches(
            model, at, {model.speeds.index(name): value}, values, t
        ))
    ][:8]  # fmt: skip
    told = f": {'; or '.join(dict.fromkeys(lines))}" if lines else ""
    raise AssemblyError(
        f"{_place(model, y)} is a change point, and no branch of the motion leads on with {words}. "
        f"Give one speed, and a second one near those of a branch as a guess{told}"
    )


def _or_none(rows: Array | None) -> Array:
    return np.zeros((0, 0)) if rows is None else rows


def _only(
    model: Model, states: Array, speeds: Mapping[str, float] | None, pace: Mapping[str, float]
) -> Array:
    """The one state, or of several branches the one whose speeds are nearest to a guess."""
    if len(states) == 1:
        return np.asarray(states[0])
    if not pace:
        words = ", ".join(f"{name} = {value:g}" for name, value in (speeds or {}).items())
        ways = "; or ".join(_motion(model, y[len(model.coordinates) :]) for y in states)
        raise AssemblyError(
            f"{_place(model, states[0])} is a change point, where {words} leads along "
            f"{len(states)} branches: {ways}. Give another of these speeds as a guess "
            "(guess={...}), or take one of model.assemblies(...)"
        )
    columns = [model.state_index(name) for name in pace]
    away = np.linalg.norm(states[:, columns] - list(pace.values()), axis=1)
    return np.asarray(states[np.argmin(away)])


def _motion(model: Model, u: Array) -> str:
    return ", ".join(f"{n} = {x:.6g}" for n, x in zip(model.speeds, u, strict=True))


def _place(model: Model, y: Array) -> str:
    return ", ".join(
        _in_words(n, x, model.units[n]) for n, x in zip(model.coordinates, y, strict=False)
    )


def _consistent_speeds(
    model: Model, y: Array, given: Mapping[str, float], params: Parameters, t: float
) -> None:
    """Fill the speeds of one state in place."""
    u = y[len(model.coordinates) :]
    kept = [model.speeds.index(name) for name in given]
    free = [i for i in range(len(u)) if i not in kept]
    u[kept] = list(given.values())
    jacobian = model.constraint_jacobian(y, params, t)
    if not len(jacobian):
        return
    residual = model.velocity_constraints(y, params, t)
    if free:
        u[free] -= np.linalg.lstsq(jacobian[:, free], residual, rcond=DEAD)[0]
        residual = model.velocity_constraints(y, params, t)
    size = np.abs(jacobian).max() * max(1.0, float(np.abs(u).max()))
    if np.abs(residual).max() > 1e-9 * size:
        row = int(np.abs(residual).argmax())
        names = ", ".join(f"{name} = {value:g}" for name, value in given.items()) or "rest"
        raise AssemblyError(
            f"no speeds with {names} keep the constraint {model.constraint_names[row]!r}: it "
            f"opens at {abs(residual[row]):.6g} per second. Give other speeds, or fewer"
        )


def wrap(angle: Array) -> Array:
    """The same angle in (-pi, pi]."""
    return np.asarray(np.pi - (np.pi - angle) % (2 * np.pi))


def _in_words(name: str, value: float, unit: str) -> str:
    return f"{name} = {np.degrees(value):.6g} deg" if unit == "rad" else f"{name} = {value:.6g} m"
