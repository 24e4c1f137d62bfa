"""The system of a compiled scene: all that loading one needs."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.compilation.picture import Described
from mechc.system.picture import Picture
from mechc.system.reference import ModelReference, Origin
from mechc.system.system import System

Seconds = dict[str, float]


def system_with(
    scene: Any,
    reference: ModelReference,
    seconds: Seconds | None = None,
    origin: Origin | None = None,
) -> System:
    """The system of a scene; empty fields of the reference are filled in from its metadata."""
    data = json.loads(scene.metadata)
    state = tuple(q["name"] for kind in ("coordinates", "speeds") for q in data[kind])
    found = replace(reference, mechanism=data["name"], state=state)
    build: dict[str, Any] = {"custom": True} if found.custom else {}
    build |= {"options": dict(found.options)} if found.options else {}
    build |= {"key": found.key} if found.key else {}
    build |= {} if seconds is None else {"seconds": seconds}
    count = None if origin is None else lambda: _operations_of_all(origin.description)
    if data.get("inputs"):
        from mechc.inputs.driven_scene import scene_with_inputs

        scene = scene_with_inputs(scene, data)
    system = System(data, scene, found, build, count)
    system.origin = origin
    return system if origin is None else system.drawn_by(drawn_by(origin.description), more=True)


def drawn_by(described: Described, added: Any = None) -> Callable[..., Picture]:
    """A function that makes the picture of a description, with what a user's drawing adds."""

    def picture(system: System, *, in_space: bool = False) -> Picture:
        from mechc.compilation.picture import described_picture

        return described_picture(system, described, added, in_space=in_space)

    return picture


@one_at_a_time
def _operations_of_all(described: Described) -> dict[str, Any] | None:
    """Operation counts with nothing fixed and all default outputs."""
    from mechc_codegen.compiler import operations_of_all

    found: dict[str, Any] | None = operations_of_all(*described())
    return found
