"""Motions of random laws, many unit masses in one scene, each judged by its own reference."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import sympy as sm
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.library.parts import coordinates, fixed_point, parameter, speeds
from sympy.physics.mechanics import Particle, ReferenceFrame, dynamicsymbols

import mechc

from ...timing.cases import Array, TookTooLongError, interrupted_after
from ..judge import Row, attempt, bounded, limit_of, row, speeds_apart
from .draw import Law, a, drawn
from .reference import Reference

TIMES = (1.0, 2.0, 3.0)  # s
MANY = 40  # laws in one scene
SHIFT = 1e-7  # of the start, for the condition
DRAWING = 20.0  # s that SymPy may take to build a law
TOLD = 1e-2  # a limit above that tells nothing
FINER = 100  # the second reference's steps are so much shorter: it sees short visits to a cell
QUICK, FULL = 8, 400  # seeds


def random_laws(quick: bool) -> Iterator[Row]:
    """The first laws; a run has many of them, by ``auto`` at rtol 1e-9."""
    yield from of_seeds(range(QUICK if quick else FULL))


def of_seeds(seeds: range) -> Iterator[Row]:
    """A row for each seed; laws whose motion ends early are not judged."""
    waiting: list[Case] = []
    for seed in seeds:
        found = followed(seed)
        if isinstance(found, str):
            yield row(f"law {seed}", "unjudged", status=found)
        else:
            waiting.append(found)
        if len(waiting) == MANY:
            yield from judged(waiting)
            waiting = []
    if waiting:
        yield from judged(waiting)


class Case(NamedTuple):
    """A law whose motion lasts, its states at TIMES, and how errors of the start grow."""

    seed: int
    law: Law
    exact: Array
    condition: float


def followed(seed: int) -> Case | str:
    """The case of a seed, or why its motion ends."""
    try:
        with interrupted_after(DRAWING):
            law = drawn(seed)
    except TookTooLongError:  # SymPy looks for the imaginary part of a high power
        return "SymPy does not build it"
    reference = Reference(law)
    found = reference.follow(TIMES, law.y0, law.a)
    if found.word:
        return found.word
    beside = reference.follow(TIMES, law.y0 + SHIFT, law.a)
    if beside.word or len(beside.signature) != len(found.signature):
        return "grazes"
    condition = float(np.abs(beside.y - found.y).max()) / SHIFT
    return Case(seed, law, found.y, condition)


def scene(laws: Sequence[Law]) -> Mechanism:
    """Uncoupled unit masses on lines, one or two for each law."""
    count = sum(law.size for law in laws)
    q, u = (list(dynamicsymbols(f"{x}_0:{count}")) for x in "qu")
    r, loads, bodies, points, names, at = ReferenceFrame("r"), [], [], [], [], 0
    origin = fixed_point("O", r)
    for k, law in enumerate(laws):
        own, own_a = slice(at, at + law.size), sm.Symbol(f"a_{k}")
        known = {a: own_a}
        for j in range(law.size):
            known |= {sm.Symbol(f"q{j}"): q[at + j], sm.Symbol(f"u{j}"): u[at + j]}
        for x, v, force in zip(q[own], u[own], law.forces, strict=True):
            point = origin.locatenew(f"P_{len(points)}", x * r.x)
            point.set_vel(r, v * r.x)
            points.append(point)
            bodies.append(Particle(f"mass_{len(bodies)}", point, 1))
            loads.append((point, force.expr.xreplace(known) * r.x))
        if any(a in f.expr.free_symbols for f in law.forces):
            names.append(parameter(own_a, law.a, "1", f"of law {k}"))
        at += law.size
    return Mechanism(
        name="laws", title="Masses under random laws", frame=r, origin=origin,
        coordinates=coordinates(q, "m", *["place"] * count),
        speeds=speeds(u, "m/s", *["velocity"] * count),
        kinematics=tuple(u), parameters=tuple(names), bodies=tuple(bodies), loads=tuple(loads),
        points=(origin, *points),
    )  # fmt: skip


def states_of(laws: Sequence[Law], y: Array) -> list[Array]:
    """The states of each law among those of a scene, which come first by coordinate."""
    count, at, found = sum(law.size for law in laws), 0, []
    for law in laws:
        own = np.r_[at : at + law.size, count + at : count + at + law.size]
        found.append(y[..., own])
        at += law.size
    return found


def start_of(laws: Sequence[Law]) -> Array:
    halves = [np.split(law.y0, 2) for law in laws]
    return np.concatenate([part[k] for k in (0, 1) for part in halves])


def judged(cases: Sequence[Case], *, method: str = "auto", rtol: float = 1e-9) -> Iterator[Row]:
    """A row for each law of one scene; a scene that ends early is halved until one law is left, and
    one that is off is judged alone."""
    laws = [case.law for case in cases]
    try:
        model = mechc.compile(scene(laws), outputs=())
    except (mechc.MechcError, ValueError) as error:
        outcome: mechc.Solution | str = str(error)
    else:
        outcome = attempt(
            model, TIMES[-1], start_of(laws), t_eval=TIMES, rtol=rtol, method=method, dense=False
        )
    told = isinstance(outcome, str) or not outcome.status.ok
    if told and len(cases) > 1:
        half = len(cases) // 2
        for part in (cases[:half], cases[half:]):
            yield from judged(part, method=method, rtol=rtol)
        return
    if isinstance(outcome, str):
        yield row(_named(cases[0], method, rtol), "refused", status=outcome)
        return
    if not outcome.status.ok:
        yield row(_named(cases[0], method, rtol), "flagged", status=outcome.status.code)
        return
    for case, found in zip(cases, states_of(laws, outcome.y), strict=True):
        made = _judged(case, found, method, rtol)
        if made["word"] == "WRONG" and len(cases) > 1:  # the mean error of many is controlled
            yield from judged([case], method=method, rtol=rtol)
        else:
            yield made


def _judged(case: Case, found: Array, method: str, rtol: float) -> Row:
    """One law's states; beyond the limit the reference is asked again with shorter steps."""
    limit = limit_of(rtol, case.condition)
    name = _named(case, method, rtol)
    if limit > TOLD:
        return row(name, "unjudged")
    scale = speeds_apart(case.exact[-1], case.law.size)
    error = float((np.abs(found - case.exact) / scale).max())
    if not error <= limit:
        again = Reference(case.law, 0.02 / FINER).follow(TIMES, case.law.y0, case.law.a)
        if again.word:
            return row(name, "unjudged")
        error = float((np.abs(found - again.y) / scale).max())
    return bounded(name, error, limit)


def _named(case: Case, method: str, rtol: float) -> str:
    forces = "; ".join(str(force.expr) for force in case.law.forces)
    return f"law {case.seed}, {method}, {rtol:g}: {forces}"
