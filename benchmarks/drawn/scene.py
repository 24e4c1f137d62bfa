"""A scene: the text of a program, the ranges of its numbers, and what it was made of."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

from ..timing.cases import Array
from .grammar import by_hand, open_mechanisms
from .grammar.writer import Interval, Writer

HEAD = """\
import mechc
import sympy as sm
import sympy.physics.mechanics as me
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols

t = dynamicsymbols._t
"""
KINDS: dict[str, tuple[float, Callable[[Writer], None]]] = {
    "KanesMethod": (0.45, open_mechanisms.write_kane),
    "LagrangesMethod": (0.15, open_mechanisms.write_lagrange),
    "equations by hand": (0.4, by_hand.write),
}


@dataclass(frozen=True)
class Scene:
    """The text of a scene and what is known of it without running it."""

    kind: str
    text: str
    given: str  # keywords of mechc.compile
    ranges: dict[str, Interval]
    starts: dict[str, Interval]
    used: frozenset[str]
    kinks: bool
    jumps: bool
    span: float  # s

    def built(self) -> dict[str, Any]:
        """The names of the text after it has run."""
        names: dict[str, Any] = {}
        exec(compile(HEAD + self.text, "<scene>", "exec"), names)
        return names

    def compiled(self, names: dict[str, Any]) -> mechc.Model:
        """The model of its description."""
        given = eval(f"dict({self.given})", names)
        model: mechc.Model = mechc.compile(names["described"], **given)
        return model

    def program(self, numbers: Numbers) -> str:
        """A program that runs it by itself."""
        return (
            f"{HEAD}{self.text}\nmodel = mechc.compile(described{', ' * bool(self.given)}"
            f"{self.given})\nparams = {numbers.params}\n"
            f"sol = model.simulate({numbers.span}, {numbers.start}, params)\n"
        )


@dataclass(frozen=True)
class Numbers:
    """Values of the parameters and a start."""

    params: dict[str, float]
    start: dict[str, float]
    span: float


def drawn(seed: int, case: int) -> Scene:
    """The scene of a case of a seed."""
    rng = np.random.default_rng([seed, case])
    names, shares = list(KINDS), np.array([share for share, _ in KINDS.values()])
    kind = str(rng.choice(names, p=shares / shares.sum()))
    w = Writer(rng)
    w.note(f"as {kind}")
    KINDS[kind][1](w)
    given = ", ".join(f"{key}={text}" for key, text in w.given.items())
    text = _without_unused("\n".join(w.lines) + "\n", given, w.ranges)
    return Scene(
        kind, text, given, w.ranges, w.starts, frozenset(w.used),
        w.kinks or w.jumps, w.jumps, round(float(rng.uniform(1.0, 3.0)), 2),
    )  # fmt: skip


def _without_unused(text: str, given: str, ranges: dict[str, Interval]) -> str:
    """The text without symbols that were drawn for nothing."""
    for name in list(ranges):
        if len(re.findall(rf"\b{name}\b", text + given)) == 2:  # its own line has two
            text = re.sub(rf"^{name} = .*\n", "", text, flags=re.M)
            del ranges[name]
    return text


def numbers(scene: Scene, seed: int, case: int, draw: int) -> Numbers:
    """Values and a start; they do not depend on how many others are drawn."""
    rng = np.random.default_rng([seed, case, draw, 1])

    def of(ranges: dict[str, Interval]) -> dict[str, float]:
        return {n: round(float(rng.uniform(*ends)), 4) for n, ends in ranges.items()}

    return Numbers(of(scene.ranges), of(scene.starts), scene.span)


@dataclass(frozen=True)
class Equations:
    """``matrix`` y' = ``forcing``: what SymPy has formed, or what is given by hand."""

    states: list[Any]
    matrix: sm.Matrix
    forcing: sm.Matrix


def equations(names: dict[str, Any]) -> Equations:
    """Those of SymPy's own matrices, of the states [q, u]."""
    formed = names.get("formed")
    if isinstance(formed, me.KanesMethod):
        states = [*formed.q, *formed.u]
        return Equations(states, formed.mass_matrix_full, formed.forcing_full)
    if isinstance(formed, me.LagrangesMethod):
        states = [*formed.q, *formed.u]
        return Equations(states, formed.mass_matrix_full, formed.forcing_full)
    q, u = names["q"], names["u"]
    n, M = len(q), names["M"]
    mass = sm.eye(n) if M is None else sm.Matrix(M)
    matrix = sm.diag(sm.eye(n), mass)
    return Equations([*q, *u], matrix, sm.Matrix([*names["rates"], *names["F"]]))


def state_of(model: mechc.Model, start: dict[str, float]) -> Array:
    """The start in the model's order."""
    return np.array([start[name] for name in (*model.coordinates, *model.speeds)])
