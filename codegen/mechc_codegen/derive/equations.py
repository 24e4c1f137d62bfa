"""The data that derivation hands on: named matrices of expressions over plain symbols.

Invariant: expressions hold only the symbols in :class:`Symbols`; functions of time and rates
are gone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

from sympy import Expr, S, Symbol

from mechc_codegen.errors import MechanismError


@dataclass(frozen=True)
class Symbols:
    """The inputs of every expression, in the order of the arrays that carry them.

    Accelerations and multipliers stand in outputs only, which are evaluated once the motion is
    solved.

    ``inputs``: of each specified function of time that is given at run time its value and its
    derivatives by time, in their order.
    """

    time: Symbol
    q: tuple[Symbol, ...]
    u: tuple[Symbol, ...]
    parameters: tuple[Symbol, ...]
    accelerations: tuple[Symbol, ...] = ()
    multipliers: tuple[Symbol, ...] = ()
    inputs: tuple[tuple[Symbol, ...], ...] = ()

    @property
    def motion(self) -> tuple[Symbol, ...]:
        """What is known only once the motion is solved."""
        return (*self.accelerations, *self.multipliers)

    def rates_of_inputs(self, expression: Expr) -> list[tuple[Symbol, Symbol]]:
        """Of each value of an input in the expression: the value and its rate.

        Raises
        ------
        MechanismError
            Where a rate is needed of the last derivative there is.
        """
        found = []
        held = expression.free_symbols if self.inputs else ()
        for chain in self.inputs:
            if chain[-1] in held:
                raise MechanismError(
                    "the equations need the time derivative of order "
                    f"{len(chain)} of an input; {len(chain) - 1} is the highest that can be given"
                )
            found += [pair for pair in pairwise(chain) if pair[0] in held]
        return found


@dataclass(frozen=True)
class Output:
    """A named array of expressions, row by row.

    ``equation`` says in one line what it is; ``labels`` what each element is, for the reader of
    the generated code.
    """

    name: str
    equation: str
    elements: tuple[Expr, ...]
    shape: tuple[int, ...]
    labels: tuple[str, ...]

    def __post_init__(self) -> None:
        size = 1
        for extent in self.shape:
            size *= extent
        if size != len(self.elements) or len(self.labels) != size:
            raise ValueError(f"{self.name}: shape {self.shape} for {len(self.elements)} elements")


@dataclass(frozen=True)
class Tree:
    """Links, each of which hangs on an earlier one (or on the ground, -1) and moves by speeds.

    ``columns`` holds, link by link, the indices of the speeds that move it against its parent;
    vectors of motion are angular then linear, (x, y, z) each, or (z; x, y) where ``planar``.
    ``cuts``: the two links that each constraint holds together.
    """

    parents: tuple[int, ...]
    columns: tuple[tuple[int, ...], ...]
    planar: bool
    cuts: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Equations:
    """Everything derived for one mechanism.

    The last ``states`` of the coordinates have rates of their own, which are nonlinear in the
    speeds, and no displacement moves them.

    ``holonomic`` of the constraints are on the configuration; the remaining rows of the
    constraint Jacobian constrain the speeds alone.  ``mass_scale`` is an expression of the size of
    M's entries.

    Where ``tree`` is given, mass matrix and forcing are not among the outputs: the runtime makes
    them from the tree's.  ``intermediates`` are values that several outputs are written in, each
    by symbols and by those before it.
    """

    symbols: Symbols
    outputs: Mapping[str, Output]
    parameter_defaults: tuple[Expr | None, ...]
    holonomic: int
    nonholonomic: int
    identity_kinematics: bool
    speed_names: tuple[str, ...]
    mass_scale: Expr = S.One
    intermediates: tuple[tuple[Symbol, Expr], ...] = ()
    tree: Tree | None = None
    states: int = 0

    @property
    def moved(self) -> tuple[Symbol, ...]:
        """The coordinates without the states: what displacements and projections move."""
        return self.symbols.q[: len(self.symbols.q) - self.states]

    def __str__(self) -> str:
        lines = [f"{symbol} = {value}" for symbol, value in self.intermediates]
        for output in self.outputs.values():
            lines.append(f"{output.name} {output.shape}: {output.equation}")
            lines += [
                f"  {label} = {value}"
                for label, value in zip(output.labels, output.elements, strict=True)
            ]
        return "\n".join(lines)
