"""What the closed loops of a compiled mechanism leave: freedoms, assemblies, ranges of joints.

Input: a model, the facts of its description, parameters.  Output: fields of the verdict; what fails
leaves a sentence.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechc.analysis.linearize import least_tied, scaled_rows
from mechc.assembly.closer import even_points
from mechc.assembly.directions import at_rest
from mechc.assembly.positions import are_closed, closed_states
from mechc.compilation.facts import Facts
from mechc.errors import MechcError
from mechc.model import Model
from mechc.system.parameters import Array
from mechc.verdict.ranges import LoopRanges, loop_rows

SAMPLES = 16  # closed configurations that tell which rows contain which coordinates
MOST_SOLVED = 16  # coordinates of loops whose assemblies are counted
MOVED = 1e-12  # of the largest entry of J: a smaller one is rounding


@dataclass(frozen=True)
class LoopGroup:
    """Loops that share coordinates with each other, and with no other loop.

    ``loops``: the joints that are cut in them.  ``freedoms``: how many of the ``coordinates`` may
    be ``given``, here with their values at the drawn pose, closed.  ``assemblies``: how many a
    search finds with these; None: not counted.  ``change_points``: coordinates by name, and
    ``stops``: joints whose limits stop it, of a group with one freedom.
    """

    loops: tuple[str, ...]
    coordinates: tuple[str, ...]
    freedoms: int
    given: dict[str, float]
    assemblies: int | None = None
    change_points: tuple[dict[str, float], ...] = ()
    stops: tuple[str, ...] = ()


def find_loops(model: Model, facts: Facts, given: Mapping[str, float]) -> dict[str, Any]:
    """Fields of the verdict, by name; parameters by name."""
    unknown, parts = list[str](), (_freedoms, _drawn, _around)
    found: dict[str, Any] = {"ranges": [replace(x, range=None, drawn=None) for x in facts.ranges]}
    for part in parts if model.system.scene.holonomic else parts[:1]:
        try:
            p = model._one_set_for_closing(given, "judge takes one set of parameters at a time")
            found |= part(model, facts, p, unknown)
        except MechcError as error:
            unknown.append(f"loops: {error}")
    return {**found, "ranges": tuple(found["ranges"]), "not_known": tuple(dict.fromkeys(unknown))}


def _freedoms(model: Model, _: Facts, p: Array, __: list[str]) -> dict[str, Any]:
    redundant, rows = model.redundant_constraints(p), model.constraint_names
    dependent = sum(each.name in rows for each in redundant)
    return {"redundant": redundant, "freedoms": len(model.speeds) - len(rows) + dependent}


def _drawn(model: Model, _: Facts, p: Array, __: list[str]) -> dict[str, Any]:
    """The gap of every row where the description draws the mechanism, if it does so wholly."""
    system, start = model.system, model.start
    if not {*model.coordinates} <= {*start}:
        return {}
    q = np.array([[float(start[name]) for name in model.coordinates]])
    gaps = system.constraints(at_rest(system, q), p, 0.0)[0].tolist()
    units = ("rad" if unit == "1" else unit for unit in system.closure_units)
    pairs = zip(model.constraint_names, zip(gaps, units, strict=False), strict=False)
    return {"gaps": dict(pairs), "is_open": not are_closed(system, q, p, 0.0)[0]}


def _around(model: Model, facts: Facts, p: Array, unknown: list[str]) -> dict[str, Any]:
    """The groups of loops and the ranges of joints around the pose, closed."""
    q = model.assemble(params=p)[None, : len(model.coordinates)]
    pose = dict(zip(model.coordinates, q[0].tolist(), strict=True))
    with suppress(MechcError):  # none is found from these starts
        more = closed_states(model.system, even_points(SAMPLES, q.size), p, 0.0)
        q = np.concatenate([q, more[:, : q.size]])
    groups, ranges = list[LoopGroup](), {**facts.limits}
    limits = np.array([x or (-np.inf, np.inf) for x in facts.limits.values()]).T
    for places, rows in _connected(model, q, p):
        names = tuple(model.coordinates[i] for i in places)
        loops = tuple(loop.cut for loop in facts.loops if rows & {*loop.rows})
        independent = [least_tied(scaled_rows(x)) for x in loop_rows(model.system, places, q, p)]
        given = {names[i]: pose[names[i]] for i in independent[0]}
        group = LoopGroup(loops, names, min(map(len, independent)), given)
        ranges |= {name: None if group.freedoms else (pose[name],) * 2 for name in names}
        try:
            if len(given) > group.freedoms:
                raise MechcError(
                    "the drawn pose is a change point, where motions branch and no range is "
                    "defined; draw it elsewhere"
                )
            if group.freedoms == 1:
                walk = LoopRanges(model.system, places, q[0], p, limits)
                if walk.explore():
                    ranges |= {names[k]: tuple(walk.ranges[:, i]) for k, i in enumerate(places)}
                else:
                    unknown.append(f"ranges of the loop of {', '.join(loops)}: no end was met")
                stops = tuple(model.coordinates[i] for i in sorted(walk.stops))
                points = [zip(names, x[places].tolist(), strict=True) for x in walk.change_points]
                group = replace(group, change_points=tuple(map(dict, points)), stops=stops)
            group = replace(group, assemblies=_count(model, group, pose, p))
        except MechcError as error:
            unknown.append(f"the loop of {', '.join(loops)}: {error}")
        groups.append(group)
    moved = max(abs(x - model.start.get(name, x)) for name, x in pose.items())
    joints = [joint.at(pose, ranges) for joint in facts.ranges]
    return {"groups": tuple(groups), "ranges": joints, "moved": moved}


def _connected(model: Model, q: Array, p: Array) -> Iterator[tuple[list[int], set[str]]]:
    """The places of coordinates that rows tie to each other, and the names of these rows."""
    from scipy.sparse.csgraph import connected_components

    gradient = model.system.constraint_gradient(at_rest(model.system, q), p, 0.0)
    sizes = np.abs(gradient).max(axis=0)
    tied = sizes > MOVED * sizes.max(initial=0.0)  # (rows, coordinates)
    count, label = connected_components(tied.T.astype(int) @ tied)
    for k in range(count):
        if names := {model.constraint_names[i] for i in np.flatnonzero(tied @ (label == k))}:
            yield np.flatnonzero(label == k).tolist(), names


def _count(model: Model, group: LoopGroup, pose: Mapping[str, float], p: Array) -> int:
    """The assemblies with all coordinates at the pose but those of a group that are not given."""
    solved = {*group.coordinates} - group.given.keys()
    if len(solved) > MOST_SOLVED:
        raise MechcError(f"model.assemblies may search for {len(solved)} coordinates for minutes")
    held = {name: value for name, value in pose.items() if name not in solved}
    return len(np.unique(model.assemblies(held, params=p)[:, : len(pose)], axis=0))
