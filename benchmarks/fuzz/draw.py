"""A random case: parameters of a topology, a start with closed loops, tolerance and span."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..timing.cases import Array
from .scenes import TOPOLOGIES, Topology, compiled

KINDS = ("planar", "spherical", "spatial")
RTOLS = (1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12)
T_ENDS = (0.5, 1.0, 2.0)
PARALLEL = 0.05  # of linkages that no rod is redundant in: with change points, where rows vanish
DIGITS = (1, 3, 17)  # decimals of the lengths: neutral linkages are among those with one


@dataclass(frozen=True)
class Case:
    """What is simulated; ``seed`` draws it again."""

    seed: int
    topology: str
    kind: str
    params: dict[str, float]
    y0: Array
    t_end: float
    rtol: float

    def __str__(self) -> str:
        return f"seed {self.seed}: {self.topology}, {self.kind}, rtol {self.rtol:g}"


def drawn(seed: int) -> Case:
    """The case of a seed; its rods are as long as the start needs."""
    rng = np.random.default_rng(seed)
    topology, kind = str(rng.choice(list(TOPOLOGIES))), str(rng.choice(KINDS))
    shape = TOPOLOGIES[topology]
    redundant = len(shape.rods) >= shape.cranks
    parallel = redundant or np.random.default_rng([seed, 1]).random() < PARALLEL
    params = _parallel(rng, shape) if parallel else _cranks(rng, shape, kind)
    q = rng.uniform(-np.pi, np.pi, shape.cranks)
    if parallel:
        q[:], kind = q[0], "planar"
    elif rng.random() < 0.2:  # near or at a dead point, where cranks and rods come in line
        q = np.round(q * 2 / np.pi) * np.pi / 2
    ends = [_end(params, k, q[k]) for k in range(shape.cranks)]
    for i, j in shape.rods:
        params[f"L_{i}{j}"] = max(float(np.linalg.norm(ends[j] - ends[i])), 0.05)
    params["g"] = float(rng.choice([0.0, 9.81]))
    u = _speeds(rng, shape, params, q)
    t_end, rtol = float(rng.choice(T_ENDS)), float(rng.choice(RTOLS))
    return Case(seed, topology, kind, params, np.concatenate([q, u]), t_end, rtol)


def _cranks(rng: np.random.Generator, shape: Topology, kind: str) -> dict[str, float]:
    """Axes that are parallel, meet in the origin, or neither."""
    params, decimals = {}, int(rng.choice(DIGITS))
    for k in range(shape.cranks):
        place = rng.uniform(-1, 1, 3) + np.array([2.0 * k, 0, 0])
        a, b, h = rng.uniform(-1.2, 1.2), rng.uniform(-1.2, 1.2), rng.uniform(-0.5, 0.5)
        if kind == "planar":
            place[1:], a, b, h = 0.0, 0.0, 0.0, 0.0
        if kind == "spherical":
            place[:], h = 0.0, rng.uniform(0.5, 1.5)
        r = rng.uniform(0.3, 2.0)
        values = [round(float(v), decimals) for v in (*place, a, b, r, h, rng.uniform(0.3, 3.0))]
        params |= dict(zip((f"{kind}_{k}" for kind in "xyzabrhm"), values, strict=True))
    return params


def _parallel(rng: np.random.Generator, shape: Topology) -> dict[str, float]:
    """Equal cranks whose ends keep their distances; a rod that closes a ring is redundant."""
    r, decimals = rng.uniform(0.3, 2.0), int(rng.choice(DIGITS))
    params = {}
    for k in range(shape.cranks):
        place = np.array([2.0 * k, 0.0, 0.0]) + rng.uniform(-0.5, 0.5, 3) * [1, 1, 0]
        values = [round(float(v), decimals) for v in (*place, 0, 0, r, 0, rng.uniform(0.3, 3.0))]
        params |= dict(zip((f"{kind}_{k}" for kind in "xyzabrhm"), values, strict=True))
    return params


def _end(params: dict[str, float], k: int, q: float) -> Array:
    """Where the end of crank k is."""
    x, y, z, a, b, r, h = (params[f"{kind}_{k}"] for kind in "xyzabrh")
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    arm = np.array([r * np.cos(q), r * np.sin(q), h])
    end: Array = np.array([x, y, z]) + about_x @ about_y @ arm
    return end


def _speeds(rng: np.random.Generator, shape: Topology, params: dict[str, float], q: Array) -> Array:
    """Random speeds that the rods allow, or none."""
    if rng.random() < 0.3:
        return np.zeros(shape.cranks)
    step, u = 1e-6, rng.normal(0.0, 3.0, shape.cranks)
    rows = np.zeros((len(shape.rods), shape.cranks))
    for row, (i, j) in zip(rows, shape.rods, strict=True):
        apart = _end(params, j, q[j]) - _end(params, i, q[i])
        for k, sign in ((i, -1.0), (j, 1.0)):
            moved = _end(params, k, q[k] + step) - _end(params, k, q[k] - step)
            row[k] = sign * apart @ moved / (2 * step)
    allowed: Array = u - np.linalg.pinv(rows, rcond=1e-7) @ (rows @ u)
    return allowed


def model_of(case: Case):  # type: ignore[no-untyped-def]
    return compiled(case.topology)
