"""What all models in Exudyn have in common; imported only where Exudyn is there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import exudyn as exu
from exudyn.itemInterface import (
    MarkerNodeCoordinate,
    NodePointGround,
    ObjectConnectorCoordinate,
    ObjectConnectorSpringDamper,
)

from ...formulations.rigid_bodies import Anchor, Bodies
from ...problems.problem import Array


@dataclass(frozen=True)
class Assembled:
    """A system, the container that owns it, and how its present state is read as the model's."""

    container: Any
    mbs: Any
    state: Callable[[], Array]


def empty() -> tuple[Any, Any]:
    """A container and a system in it."""
    container = exu.SystemContainer()
    return container, container.AddSystem()


def add_springs(mbs: Any, bodies: Bodies, marker: Callable[[Anchor], Any]) -> None:
    for spring in bodies.springs:
        mbs.AddObject(
            ObjectConnectorSpringDamper(
                markerNumbers=[marker(end) for end in spring.ends], stiffness=spring.stiffness,
                damping=spring.damping, referenceLength=spring.length,
            )
        )  # fmt: skip


def hold(mbs: Any, node: Any, coordinates: range) -> None:
    """Constrain coordinates of a node to their reference values."""
    ground = mbs.AddNode(NodePointGround())
    for k in coordinates:
        ends = [
            mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=ground, coordinate=0)),
            mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=k)),
        ]
        mbs.AddObject(ObjectConnectorCoordinate(markerNumbers=ends))
