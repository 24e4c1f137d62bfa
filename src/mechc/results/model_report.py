"""The report of a model: operations compiled and omitted, and the time of each stage."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from mechc.analysis.constraint_rank import redundant_constraints
from mechc.errors import AssemblyError, MissingParameterError
from mechc.results.sampling import clean_text
from mechc.results.summary import html_table
from mechc.system.system import System

ONE_BY_ONE = "they are evaluated one state after the other, to the same bits"
GENERAL = "they are by the unit that serves all scenes of this kind, to the same bits"
LONGEST = 4000  # characters of a cell
Row = tuple[str, ...]
Whole = Mapping[str, Any] | None  # operations with nothing fixed and all default outputs
PARTS = ("augmented_mass_matrix", "augmented_forcing", "constraint_gradient", "kinematic_matrix")
STAGES = {
    "read": "the SymPy object read",
    "describe": "described as a mechanism",
    "derive": "equations derived",
    "differentiate": "constraints differentiated",
    "optimize": "operations optimised",
    "sensitivity": "Jacobians of the motion derived",
    "emit": "functions written",
    "tape": "functions as a tape",
    "first unit": "first unit made",
    "driver": "the driver of runs compiled",
    "collocation": "collocation compiled",
    "explicit": "explicit pairs and lockstep compiled",
    "sweeps": "collocation in lockstep compiled",
    "implicit": "implicit method compiled",
    "taylor": "Taylor series compiled",
    "outputs": "outputs in lanes compiled",
    "derivatives": "derivatives of runs compiled",
    "whole": "the whole compiled for its capsule",
    "load": "loaded",
}


@dataclass(frozen=True)
class ReportSection:
    """A table with a head, or without one pairs of what and how."""

    heading: str
    rows: tuple[Row, ...]
    head: Row = ()

    def text(self) -> list[str]:
        """Lines without control characters of names."""
        rows = [tuple(clean_text(cell, LONGEST) for cell in row) for row in self.rows]
        plain = [f"{fact}: {value}" if fact else f"  {value}" for fact, value, *_ in rows]
        return ["", self.heading, *(_align(self.head, rows) if self.head else plain)]

    def html(self) -> str:
        return f"<b>{escape(self.heading)}</b>{html_table(self.head or ('', ''), self.rows)}"


class Report(str):
    """A report as text; in a notebook, as tables."""

    sections: tuple[ReportSection, ...]
    heading: str

    @classmethod
    def of(cls, title: str, sections: Iterable[ReportSection]) -> Report:
        kept = tuple(sections)
        report = cls(
            "\n".join([clean_text(title, LONGEST), *(line for s in kept for line in s.text())])
        )
        report.heading, report.sections = title, kept
        return report

    def _repr_html_(self) -> str:
        return f"<b>{escape(self.heading)}</b>" + "".join(s.html() for s in self.sections)


def model_report(system: System, *, compare: bool = True) -> Report:
    """See :meth:`mechc.Model.report`."""
    whole = _whole(system) if compare else None
    sections = [_operations(system, whole), _calls(system), _omitted_section(system, whole)]
    if system.constraint_names:
        sections.append(_redundant(system))
    if system.build.get("seconds"):
        sections.append(_build(system))
    lanes = f"{system.instruction_set}, {system.scene.lanes} lanes"
    in_code = "" if system.name in system.title else f" ({system.name})"
    return Report.of(f"{system.title}{in_code}, {lanes}", sections)


def _whole(system: System) -> Whole:
    """The counts, if it is another scene and this process can derive it."""
    other = system.data["fixed"] or system.data["skipped"]
    return system.operations_of_all() if system.operations_of_all is not None and other else None


def _operations(system: System, whole: Whole) -> ReportSection:
    counts = system.data["operations"]
    named = {n: c for n, c in counts["outputs"].items() if n not in PARTS}
    own = set(system.data["own"])
    rows: list[Row] = [
        (name if name in own else name.replace("_", " "), str(before), str(after))
        for name, (before, after) in named.items()
    ]
    rows.append(("all at once", str(counts["before"]), str(counts["after"])))
    head: Row = ("output", "as derived", "compiled")
    if whole is not None and system.data["fixed"]:
        free = [str(whole["outputs"].get(name, ("", ""))[1]) for name in named]
        rows = [(r[0], n, *r[1:]) for r, n in zip(rows, [*free, ""], strict=True)]
        head = ("output", "with nothing fixed", *head[1:])
    return ReportSection("operations an evaluation (functions included)", tuple(rows), head)


def _calls(system: System) -> ReportSection:
    """Values computed once per run, and those of every right-hand side."""
    counts, rows = system.data["operations"], len(system.constraint_names)
    solved = f"{len(system.speeds)} accelerations"
    if rows:
        solved += f" and {rows} constraint rows"
    given = (("given with a run (inputs)", ", ".join(system.inputs)),) if system.inputs else ()
    if links := system.data["walked"]:
        solved += f", M and F link by link, {links} links"
    facts = (
        ("once a run, of parameters alone", f"{counts['once_per_run']} operations, kept in "
         f"{counts['constants']} constants"),
        ("configuration", f"{counts['stages']['configuration']} operations"),
        ("speeds", f"{counts['stages']['motion']} operations"),
        ("solution", solved),
        *_row_blocks(system),
        *given,
    )  # fmt: skip
    return ReportSection("a right-hand side", facts)


def _row_blocks(system: System) -> tuple[tuple[str, str], ...]:
    """The blocks by which the constraint rows are eliminated, where that is done by blocks."""
    found = system.data.get("row_blocks")
    if not found:
        return ()
    sizes = ", ".join(f"{rows} x {speeds}" for rows, speeds in found["blocks"])
    costs = ", ".join(
        f"{what} {found['by_block'][what]} operations (all together {found['together'][what]})"
        for what in ("factors", "solution", "conditioning")
    )
    return (("constraint rows", f"in blocks of {sizes}: {costs}"),)


def _omitted_section(system: System, whole: Whole) -> ReportSection:
    """The section on parts that the scene does not need."""
    data = system.data
    given, zero = data["loads"]["given"], data["loads"]["zero"]
    loads = f"{given}, of which {zero or 'none'} vanish" if given else "none"
    facts = [("loads", loads), ("third dimension", _third_dimension(data))]
    if not system.constraint_names:
        facts.append(("constraints", "none: no closing of loops, no projection, no multipliers"))
    if data["fixed"]:
        values = ", ".join(f"{name} = {value:g}" for name, value in data["fixed"].items())
        facts.append(("fixed", values + _saved_by_fixing(data, whole)))
    if data["skipped"]:
        names = ", ".join(data["skipped"])
        every = {} if whole is None else whole["outputs"]
        absent = [c[1] for n, c in every.items() if n not in data["operations"]["outputs"]]
        names += f"; {sum(absent)} operations" if absent else ""
        facts.append(("not in this scene", names))
    return ReportSection("what is omitted", tuple(facts))


def _third_dimension(data: Mapping[str, Any]) -> str:
    """The third dimension in words, from the elements that are always zero."""
    vectors = ("points", "point_velocities", "linear_momenta", "angular_momenta")
    zeros = data["operations"]["zeros"]
    found = [zeros[name] for name in vectors if name in zeros]
    zero, size = sum(z for z, _ in found), sum(n for _, n in found)
    told = f"{zero} of {size} components of vectors are zero for any state" if size else ""
    if data["planar"] is not None:
        links = "three numbers a motion" if data["planar"] else "six numbers a motion"
        told = f"{links} of a link; {told}" if told else f"{links} of a link"
    return told or "no vectors requested"


def _saved_by_fixing(data: Mapping[str, Any], whole: Whole) -> str:
    if whole is None:
        return ""
    counts = data["operations"]
    shared = [name for name in counts["outputs"] if name in whole["outputs"]]
    free, left = (sum(c["outputs"][n][1] for n in shared) for c in (whole, counts))
    once = whole["once_per_run"], counts["once_per_run"]
    return (
        f"; {free - left} of {free} operations of the outputs are omitted, "
        f"{once[0] - once[1]} of {once[0]} once a run"
    )


def _redundant(system: System) -> ReportSection:
    """The constraints that follow from others, and from which."""
    what = "redundant constraints"
    try:
        found = redundant_constraints(system, system.parameter_set.resolve(None))
    except AssemblyError:
        facts = [(what, "not known, the loops do not close with these parameters")]
    except MissingParameterError:
        facts = [(what, "ask model.redundant_constraints(params)")]
    else:
        rows = any(each.name in system.constraint_names for each in found)
        others = "omitted, as they always hold" if found else "none"
        facts = [(what, "multipliers are those of least norm" if rows else others)]
        facts += [("", str(each)) for each in found]
    return ReportSection("constraints", tuple(facts))


def _build(system: System) -> ReportSection:
    seconds = dict(system.build["seconds"])
    known = [name for name in STAGES if name in seconds]
    facts = [(name, f"{seconds[name]:.3f} s, {STAGES[name]}") for name in known]
    if system.scene.evaluator.serves_runs:
        facts.append(("until runs have parts of their own", GENERAL))
    if "first unit" in seconds:
        facts.append(("until outputs in lanes are compiled", ONE_BY_ONE))
    return ReportSection("the build", tuple(facts))


def _align(head: Row, rows: Sequence[Row]) -> list[str]:
    """Columns aligned: the first to the left, numbers to the right."""
    table = [head, *rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in table
    ]
