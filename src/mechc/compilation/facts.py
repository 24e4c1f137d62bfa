"""Facts of a description that need no equations: loops, positions of joints, inertias.

Input: a mechanism, and the values of its parameters.  Output: plain data.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.system.quantity import NamedQuantity

ROUNDING = 1e-9  # of the largest principal moment
Ends = tuple[float, float]
UNBOUNDED: Ends = (-math.inf, math.inf)


@dataclass(frozen=True)
class Loop:
    """A loop: the joint that is cut, why, the other joints, and the rows of the cut that are no
    identities.  A constraint that is written as an equation names no joint."""

    cut: str
    why: str
    joints: tuple[str, ...] = ()
    rows: tuple[str, ...] = ()


@dataclass(frozen=True)
class JointRange:
    """The range of a joint's position, or of a coordinate where no joint is known.

    ``limits``: those of the description, infinite where it has none.  ``slope``, ``offset``: the
    position is ``slope`` times its ``coordinate`` + ``offset``; zero where it is no such product.
    ``follows``: as a mimic, which has no coordinate itself.  ``range``: what limits and loops leave
    around the drawn pose, infinite where it turns round, and ``drawn``: the position at that pose,
    closed; None where they are not known.
    """

    name: str
    unit: str
    limits: Ends
    coordinate: str
    slope: float
    offset: float
    follows: bool
    range: Ends | None = None
    drawn: float | None = None

    def at(self, q: Mapping[str, float], ranges: Mapping[str, Ends | None]) -> JointRange:
        """The joint where coordinates, by name, have these values and ranges."""
        ends, drawn = ranges.get(self.coordinate), q.get(self.coordinate)
        if not self.slope or drawn is None:
            return self
        one, other = sorted(self.slope * x + self.offset for x in ends or UNBOUNDED)
        drawn = self.slope * drawn + self.offset
        return replace(self, drawn=drawn, range=None if ends is None else (one, other))


@dataclass(frozen=True)
class Facts:
    """What a description says: fields as of :class:`mechc.Verdict`, ranges as limits alone leave
    them, and ``quantities`` by name, ``values`` of those parameters that have one, and ``limits``
    of the coordinates, which those of mimics bound too."""

    name: str
    coordinates: tuple[str, ...]
    speeds: tuple[str, ...]
    rows: tuple[str, ...]
    loops: tuple[Loop, ...]
    ranges: tuple[JointRange, ...]
    massless: tuple[str, ...]
    impossible: Mapping[str, tuple[float, ...]]
    inertias: int
    skipped: tuple[str, ...]
    quantities: Mapping[str, NamedQuantity]
    values: Mapping[str, float]
    limits: Mapping[str, Ends | None]


@one_at_a_time
def facts_of(mechanism: Any, given: Mapping[str, float]) -> Facts:
    """The facts, with the parameters given and defaults for the others."""
    from mechc_codegen.emit.metadata import described_quantities
    from sympy import sympify

    errors_of_compiler()
    told = {p.symbol: given.get(p.symbol.name, p.default) for p in mechanism.parameters}
    values = {symbol: sympify(value) for symbol, value in told.items() if value is not None}
    for _ in values:  # a default may follow others
        if any(not value.is_number for value in values.values()):
            values = {symbol: value.xreplace(values) for symbol, value in values.items()}
    values = {symbol: value for symbol, value in values.items() if value.is_number}
    known = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
    named = map(NamedQuantity.from_metadata, described_quantities(known))
    joints = tuple(_joints(mechanism, values))
    names = tuple(q.func.__name__ for q in mechanism.q)
    limits = {name: _intersection([x for x in joints if x.coordinate == name]) for name in names}
    start = {name: float(mechanism.start.get(name, 0.0)) for name in names}
    return Facts(
        name=mechanism.name,
        coordinates=names,
        speeds=tuple(u.func.__name__ for u in mechanism.u),
        rows=mechanism.rows,
        loops=_loops(mechanism),
        skipped=mechanism.skipped if mechanism.links else (),  # elsewhere options not taken
        quantities={quantity.name: quantity for quantity in named},
        values={symbol.name: float(value) for symbol, value in values.items()},
        ranges=tuple(joint.at(start, limits) for joint in joints),
        limits=limits,
        **_inertias(mechanism.links),
    )


def _loops(mechanism: Any) -> tuple[Loop, ...]:
    from mechc_codegen.description.joints.loops import loop_joints

    rows = {closure.name: tuple(closure.names) for closure in mechanism.closures}
    rows |= {each.name: (each.name,) for each in mechanism.configuration_constraints}
    why = dict.fromkeys(rows, "a constraint of the description, which names no joint")
    joints = loop_joints(mechanism)
    why |= dict.fromkeys(joints, "the description cuts it") | dict(mechanism.cut_reasons)
    names = dict.fromkeys((*joints, *rows))
    return tuple(Loop(name, why[name], joints.get(name, ()), rows.get(name, ())) for name in names)


def _joints(mechanism: Any, values: Mapping[Any, Any]) -> Iterator[JointRange]:
    """Joints with limits, then the coordinates that are not in their positions."""
    from sympy import sympify

    units = {q.symbol: q.quantity.unit for q in mechanism.coordinates}
    passive = {joint.name for joint in mechanism.joints if not joint.coordinates}
    told = {x for joint in mechanism.joints for x in getattr(joint, "quaternion", ())}
    for name, limits in mechanism.limits.items():
        position = sympify(limits.position).xreplace(values)
        pairs = zip((limits.lower, limits.upper), UNBOUNDED, strict=True)
        given = (sympify(end if x is None else x).xreplace(values) for x, end in pairs)
        lower, upper = map(float, given)
        by = [q for q in mechanism.q if position.has(q)]
        told.update(by)
        slope = position.diff(by[0]) if len(by) == 1 else sympify(0)
        slope = slope if slope.is_number else sympify(0)
        offset = position.xreplace(dict.fromkeys(by, 0)) if slope else 0.0
        ends = (lower, upper) if lower < upper else UNBOUNDED
        names, unit = ", ".join(q.func.__name__ for q in by), units[by[0]] if by else ""
        yield JointRange(name, unit, ends, names, float(slope), float(offset), name in passive)
    for q in (q for q in mechanism.q if q not in told):
        name = q.func.__name__
        yield JointRange(name, units[q], UNBOUNDED, name, 1.0, 0.0, follows=False)


def _intersection(joints: list[JointRange]) -> Ends | None:
    """What the limits of joints with one coordinate leave of this; None: nothing."""
    found = UNBOUNDED
    for joint in joints:
        if joint.slope:
            one, other = sorted((end - joint.offset) / joint.slope for end in joint.limits)
            found = max(found[0], one), min(found[1], other)
    return found if found[0] <= found[1] else None


def _inertias(links: Mapping[str, tuple[str, float, tuple[float, ...]]]) -> dict[str, Any]:
    """Masses and principal moments of the links of a file, judged."""
    found = {}
    for name, (_, mass, (xx, xy, xz, yy, yz, zz)) in links.items():
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        found[name] = (float(mass), *moments.tolist())
    heavy = {body for name, (body, *_) in links.items() if any(found[name])}
    return {
        "massless": tuple({body: 0 for body, *_ in links.values() if body and body not in heavy}),
        "impossible": {
            name: x
            for name, x in found.items()
            if x[0] < 0.0 or x[3] - x[1] - x[2] > ROUNDING * max(map(abs, x[1:]))
        },
        "inertias": len(links),
    }
