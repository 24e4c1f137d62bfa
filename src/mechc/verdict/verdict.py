"""The verdict on a mechanism before it moves: asked for by :func:`judge`, as data and in words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from textwrap import shorten
from typing import Any

from mechc.analysis.constraint_rank import Redundancy
from mechc.compilation.compiler import of_compiler
from mechc.compilation.exports.standalone import described
from mechc.compilation.facts import Ends, Facts, facts_of
from mechc.load import compile as compile_mechanism
from mechc.model import Model
from mechc.results.model_report import Report, ReportSection
from mechc.system.names import by_name
from mechc.verdict.loops import LoopGroup, find_loops

WIDEST, LISTED = 160, 12  # letters of a line of skipped parts; names in a line
OUTSIDE = 1e-9  # rad or m that are no rounding


@dataclass(frozen=True)
class Verdict(Facts):
    """What is to be known of a mechanism before it moves; as text, and in a notebook as tables.

    Attributes
    ----------
    freedoms
        Speeds less the independent rows; None where no closed configuration was found.
    coordinates, speeds, rows, ranges
        Names, those of constraints that do not always hold included; positions of all joints.
    loops, groups
        The joints that are cut, why, and the joints of their loops; loops that share coordinates,
        with their freedoms, assemblies and change points.
    redundant
        Rows that follow from others, and constraints of cuts that always hold: of a plane loop of
        pins in space three.
    gaps, is_open, moved
        Name of a row -> by how much the drawn pose leaves it open, and its unit, ``"m"`` or
        ``"rad"`` (the sine of an angle); whether this is more than rounding; and the largest change
        of a drawn coordinate (m, rad) that closes the pose.  Empty and None where none is drawn.
    inertias, massless, impossible
        How many links a file has; bodies without mass and inertia; name of a link -> its mass and
        principal moments, rising, that no body has.
    skipped, not_known
        What the file has and the mechanism does not; what was not looked at or found, and why.
    """

    freedoms: int | None = None
    redundant: tuple[Redundancy, ...] = ()
    gaps: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    is_open: bool | None = None
    moved: float | None = None
    groups: tuple[LoopGroup, ...] = ()
    not_known: tuple[str, ...] = ()

    @property
    def report(self) -> Report:
        """The verdict as a text, which is tables in a notebook."""
        count = "an unknown number of" if self.freedoms is None else self.freedoms
        noun = "degree" if count == 1 else "degrees"
        return Report.of(f"{self.name}: {count} {noun} of freedom", _sections(self))

    def __str__(self) -> str:
        return str(self.report)

    def _repr_html_(self) -> str:
        return self.report._repr_html_()


def judge(mechanism: Any, params: Mapping[Any, float] | None = None) -> Verdict:
    """What is to be known of a mechanism before it moves; compiles it only if it has constraints.

    Parameters
    ----------
    mechanism
        A :class:`mechc.Mechanism`, whose method ``judge`` this is; whatever else
        :func:`mechc.compile` takes; or a compiled :class:`mechc.Model`.
    params
        Values of parameters (SI units), by name or symbol; defaults otherwise.

    Returns
    -------
    Verdict
        Freedoms, redundant rows and assemblies are those that searches for closed configurations
        find.  Ranges of loops with one freedom are those that driving each coordinate reaches, from
        the drawn pose and from where others led it, in steps of a degree: a limit that is exceeded
        for less is passed over.

    Raises
    ------
    TypeError, MechcError
        If it is none of these; if it lacks something needed.
    """
    given = by_name(params or {}, "params")
    model = mechanism if isinstance(mechanism, Model) else None
    if model is None and not isinstance(mechanism, of_compiler("Mechanism")):
        model = compile_mechanism(mechanism)
    description = mechanism if model is None else described(model.system)[0]
    facts = facts_of(description, given if model is None else {**model.defaults, **given})
    if facts.rows:
        found = find_loops(model or compile_mechanism(mechanism), facts, given)
    else:
        found = {"freedoms": len(facts.speeds)}
    return Verdict(**{**vars(facts), **found})


# -- in words --------------------------------------------------------------------------------------


def _sections(verdict: Verdict) -> Iterator[ReportSection]:
    """The parts, in the order in which one asks."""
    ranges = "ranges of the joints, as limits and loops leave them around this pose"
    if any(x.range is None for x in verdict.ranges):
        ranges += "; ?: not found, where it depends on several freedoms, or was not looked at"
    rows = [(x.name, _ends(x.limits, x.unit), _ends(x.range, x.unit)) for x in verdict.ranges]
    for section in (
        ReportSection("how it moves", tuple(_freedoms(verdict))),
        ReportSection("loops", tuple(_loops(verdict))),
        ReportSection("the drawn pose", tuple(_pose(verdict))),
        _lines("redundant constraints, which need no care", map(str, verdict.redundant)),
        ReportSection(ranges, tuple(rows), ("joint", "limits", "range")),
        ReportSection("masses and inertias", tuple(_inertias(verdict))),
        _lines("not taken from the file", verdict.skipped),
        _lines("not looked at", verdict.not_known),
    ):
        if section.rows:
            yield section


def _lines(heading: str, lines: Iterable[str]) -> ReportSection:
    short = (shorten(line, WIDEST, placeholder=" ...") for line in lines)
    return ReportSection(heading, tuple(("", line) for line in short))


def _freedoms(verdict: Verdict) -> Iterator[tuple[str, str]]:
    speeds, rows = len(verdict.speeds), len(verdict.rows)
    told = f"{verdict.freedoms} = {speeds} speeds - {rows} rows of constraints"
    if dependent := sum(each.name in verdict.rows for each in verdict.redundant):
        told += f" + {dependent} redundant ones"
    yield "degrees of freedom", "not known" if verdict.freedoms is None else told
    if following := [f"{x.name} ({x.coordinate})" for x in verdict.ranges if x.follows]:
        yield "joints that follow coordinates of others", _listed(following)


def _loops(verdict: Verdict) -> Iterator[tuple[str, str]]:
    group_of = {cut: group for group in verdict.groups for cut in group.loops}
    for loop in verdict.loops:
        if loop.joints:
            yield loop.cut, f"closes the loop of {', '.join(loop.joints)}"
        yield ("  cut because" if loop.joints else loop.cut), loop.why
        if group := group_of.get(loop.cut):
            told = f"{group.freedoms} of its {len(group.coordinates)} coordinates"
            if others := [cut for cut in group.loops if cut != loop.cut]:
                told = f"together with the loop of {_listed(others)}, {told}"
            yield "  free", told if group.freedoms else f"{told}: nothing of it can move"


def _pose(verdict: Verdict) -> Iterator[tuple[str, str]]:
    if outside := [
        f"{x.name} ({x.drawn + 0.0:.4g}, not {_ends(x.limits, x.unit)})"
        for x in verdict.ranges
        if x.drawn is not None and not x.limits[0] - OUTSIDE <= x.drawn <= x.limits[1] + OUTSIDE
    ]:
        yield "joints outside their limits", _listed(outside)
    if verdict.loops and verdict.is_open is None:
        yield "gap", "the description draws no whole pose; what follows is where assemble() starts"
    elif verdict.loops:
        yield "loops", "open" if verdict.is_open else "closed to rounding"
    for unit in dict.fromkeys(unit for _, unit in verdict.gaps.values()):
        size, worst = max((abs(gap), n) for n, (gap, of) in verdict.gaps.items() if of == unit)
        yield "largest gap", f"{size:.3g} {unit} ({worst})"
    if verdict.is_open and verdict.moved is not None:
        yield "nearest closed pose", f"coordinates differ by up to {verdict.moved:.3g} rad or m"
    for group in verdict.groups:
        of = f"of the loop of {_listed(group.loops)}"
        given = ", ".join(f"{name} = {value:.6g}" for name, value in group.given.items())
        if group.assemblies is not None:
            yield f"assemblies {of}", f"{group.assemblies} found with {given or 'nothing given'}"
        for point in group.change_points:
            at = ", ".join(f"{name} = {round(value, 5) + 0.0:.4g}" for name, value in point.items())
            yield f"change point {of}", f"{at}, where motions branch"
        if group.stops:
            yield f"motion {of}", f"stopped by the limits of {_listed(group.stops)}"


def _ends(ends: Ends | None, unit: str) -> str:
    if ends is None or all(map(math.isinf, ends)):
        return "?" if ends is None else "unbounded"
    lower, upper = (f"{0.0 if abs(x) <= OUTSIDE else x:.6g}" for x in ends)
    told = f"fixed at {lower}" if ends[1] - ends[0] <= OUTSIDE else f"{lower} to {upper}"
    return f"{told} {unit}".rstrip()


def _inertias(verdict: Verdict) -> Iterator[tuple[str, str]]:
    if verdict.massless:
        yield "bodies without mass and inertia", _listed(verdict.massless)
    if count := verdict.inertias:
        yield "impossible inertias", f"{len(verdict.impossible)} of {count} links of the file"
    for name, (mass, one, two, most) in verdict.impossible.items():
        told = f"{most:.4g} > {one:.4g} + {two:.4g} kg m^2, by {most - one - two:.3g}"
        yield f"  {name}", f"its mass is negative, {mass:g} kg" if mass < 0.0 else told


def _listed(names: Iterable[str]) -> str:
    every = list(names)
    more = len(every) - LISTED
    return ", ".join(every[:LISTED]) + (f" and {more} more" if more > 0 else "")
