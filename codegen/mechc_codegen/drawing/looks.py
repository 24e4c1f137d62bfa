"""The data that determine the picture of some bodies, as a value that can be compared.

Two descriptions with the same equations share one compiled scene; they have one picture only if
the points and frames around their bodies are the same too.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from sympy.physics.mechanics import Particle, RigidBody

from mechc_codegen.description.placement import steps_from


def looks_of(bodies: Iterable[RigidBody | Particle]) -> tuple[Any, ...]:
    """Names of the bodies, and every step between the points and frames around them."""
    listed = tuple(bodies)
    points = _around([body.masscenter for body in listed], "_pos_dict")
    ways = [way for point in points for way in point._pos_dict.values()]
    frames = _around([frame for way in ways for _, frame in way.args], "_dcm_dict")
    return (
        tuple((body.name, body.masscenter.name) for body in listed),
        tuple((p.name, tuple((o.name, _parts(w)) for o, w in p._pos_dict.items())) for p in points),
        tuple((f.name, tuple((o.name, tuple(m)) for o, m in f._dcm_dict.items())) for f in frames),
    )


def _around(starts: Iterable[Any], neighbours: str) -> list[Any]:
    """These places and all places connected to them, each once."""
    found: dict[int, Any] = {}
    for start in starts:
        if id(start) not in found:
            connected = steps_from(start, lambda place: getattr(place, neighbours))
            found |= {id(place): place for place in (start, *connected)}
    return list(found.values())


def _parts(way: Any) -> tuple[Any, ...]:
    return tuple((frame.name, tuple(matrix)) for matrix, frame in way.args)
