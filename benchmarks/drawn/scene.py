"""A scene: the text of a program, the ranges of its numbers, and what it was made of."""

from __future__ import annotations

import signal
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sm
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import KanesMethod, LagrangesMethod

import mechc

from .grammar import by_hand, closures, joints, mjcf, open_mechanisms, rolling
from .grammar.writer import Interval, Writer

HEAD = """\
import mechc
import sympy as sm
import sympy.physics.mechanics as me
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols

t = dynamicsymbols._t
"""
KINDS: dict[str, tuple[float, Callable[[Writer], None]]] = {
    "KanesMethod": (0.28, open_mechanisms.write_kane),
    "KanesMethod of a rotor": (0.14, open_mechanisms.write_rotor),
    "LagrangesMethod": (0.08, open_mechanisms.write_lagrange),
    "equations by hand": (0.26, by_hand.write),
    "equations by hand with constraints": (0.08, by_hand.write_closed),
    "KanesMethod with constraints": (0.15, closures.write_kane),
    "LagrangesMethod with constraints": (0.08, closures.write_lagrange),
    "rolling and blades": (0.06, rolling.write),
    "joints": (0.12, joints.write),
    "joints and a cut": (0.06, joints.write_closed),
    "MJCF": (0.06, mjcf.write),
}


FORMING = 15.0  # processor seconds that SymPy may take to form equations


class TooLongError(Exception):
    """SymPy takes too long."""


class UnbuiltError(Exception):
    """SymPy does not form the equations of a scene: of dependent speeds that do not depend."""


def _too_long(*_: object) -> None:
    raise TooLongError


@dataclass(frozen=True)
class Scene:
    """The text of a scene and what is known of it without running it."""

    kind: str
    text: str
    given: str  # keywords of mechc.compile
    ranges: dict[str, Interval]
    starts: dict[str, Interval]
    used: frozenset[str] = frozenset()
    span: float = 2.0  # s

    def built(self) -> dict[str, Any]:
        """The names of the text after it has run."""
        names: dict[str, Any] = {}
        signal.signal(signal.SIGVTALRM, _too_long)
        signal.setitimer(signal.ITIMER_VIRTUAL, FORMING)
        try:
            exec(compile(HEAD + self.text, "<scene>", "exec"), names)
        except (sm.matrices.exceptions.NonInvertibleMatrixError, TooLongError) as error:
            raise UnbuiltError(type(error).__name__) from None
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        described = names.get("described")
        if isinstance(described, KanesMethod | LagrangesMethod):
            whole = described.mass_matrix_full.row_join(described.forcing_full)
            if not names.get("fixed", {}).keys() <= whole.free_symbols:
                raise UnbuiltError("what is fixed is in no equation")  # a load on a point at rest
        held = [sm.sympify(row) for row in names.get("position", ())]
        if any(row != 0 and not row.atoms(AppliedUndef) & {*names["q"]} for row in held):
            raise UnbuiltError("a loop without coordinates")  # a rod from a point at rest
        return names

    def compiled(self, names: dict[str, Any], *, open_inputs: bool = False) -> mechc.Model:
        """The model of its description, without values of inputs if they are to be open."""
        given = eval(f"dict({self.given})", names)
        model: mechc.Model = mechc.compile(names["described"], **given)
        has = "inputs" in names and model.inputs and not open_inputs
        return model.with_inputs(names["inputs"]) if has else model

    def program(self, numbers: Numbers) -> str:
        """A program that runs it by itself."""
        return (
            f"{HEAD}{self.text}\nmodel = mechc.compile(described{', ' * bool(self.given)}"
            f"{self.given})\nparams = {numbers.params}\n"
            f"sol = model.simulate({numbers.span}, {numbers.start}, params"
            f"{', inputs=inputs' * ('inputs = ' in self.text)}"
            f"{', events=events' * ('events = ' in self.text)})\n"
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
    w.drop_unused()
    if kind != "MJCF":
        w.finished()
    given = ", ".join(f"{key}={text}" for key, text in w.given.items())
    return Scene(
        kind, "\n".join(w.lines) + "\n", given, w.ranges, w.starts, frozenset(w.used),
        round(float(rng.uniform(1.0, 3.0)), 2),
    )  # fmt: skip


def numbers(scene: Scene, key: tuple[int, int], draw: int) -> Numbers:
    """Values and a start; they do not depend on how many others are drawn."""
    rng = np.random.default_rng([*key, draw, 1])

    def of(ranges: dict[str, Interval]) -> dict[str, float]:
        return {n: round(float(rng.uniform(*ends)), 4) for n, ends in ranges.items()}

    return Numbers(of(scene.ranges), of(scene.starts), scene.span)
