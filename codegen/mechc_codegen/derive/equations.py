"""Derived equations: named matrices of expressions over symbols.

Invariant: expressions contain only the symbols in :class:`Symbols`; functions of time and rates
are gone.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from sympy import Expr, S, Symbol

from mechc_codegen.errors import MechanismError


@dataclass(frozen=True)
class Symbols:
    """The symbols of all expressions, in the order of the arrays that hold their values.

    Accelerations and multipliers appear only in outputs that are evaluated after the motion is
    solved.

    ``inputs``: value and time derivatives, in this order, of each specified function that is given
    at run time.  ``covector``: the numbers that a function of reverse derivatives is given.
    """

    time: Symbol
    q: tuple[Symbol, ...]
    u: tuple[Symbol, ...]
    parameters: tuple[Symbol, ...]
    accelerations: tuple[Symbol, ...] = ()
    multipliers: tuple[Symbol, ...] = ()
    inputs: tuple[tuple[Symbol, ...], ...] = ()
    covector: tuple[Symbol, ...] = ()

    @property
    def motion(self) -> tuple[Symbol, ...]:
        """The symbols that are known only after the motion is solved."""
        return (*self.accelerations, *self.multipliers)

    def rates_of_inputs(self, expression: Expr) -> list[tuple[Symbol, Symbol]]:
        """Pairs of value and rate for each value of an input in the expression.

        Raises
        ------
        MechanismError
            Where the rate of the highest available derivative is needed.
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

    ``equation`` describes it in one line; ``labels`` describe its elements, in comments of the
    generated code.
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

    @cached_property
    def symbols(self) -> Set[Symbol]:
        """Every symbol in its elements."""
        return {symbol for element in self.elements for symbol in element.free_symbols}


@dataclass(frozen=True)
class Tree:
    """Links, each a child of an earlier one (or of the ground, -1), with the speeds that move them.

    ``columns``: for each link the indices of the speeds of its motion relative to its parent, of
    which one may move several links (``shared``);
    vectors of motion are angular then linear, (x, y, z) each, or (z; x, y) where ``planar``.
    ``rows``: of each constraint the pairs of links on which it acts with opposite wrenches;
    ``moments``: whether some of these have a moment beside their force.
    ``several_loops``: whether several cuts, or constraints on several coordinates, close loops.
    """

    parents: tuple[int, ...]
    columns: tuple[tuple[int, ...], ...]
    planar: bool
    rows: tuple[tuple[tuple[int, int], ...], ...] = ()
    moments: bool = False
    several_loops: bool = False

    @property
    def shared(self) -> bool:
        """Whether some speed moves several links, as in joints that mimic others."""
        every = [speed for own in self.columns for speed in own]
        return len(every) > len(set(every))


@dataclass(frozen=True)
class Equations:
    """Everything derived for one mechanism.

    The last ``states`` of the coordinates have rates that may be nonlinear in the speeds;
    displacements do not change them.

    ``holonomic`` of the constraints are on the configuration; the remaining rows of the
    constraint Jacobian constrain the speeds only.  ``mass_scale`` is an expression of the size of
    M's entries.

    With a ``tree``, mass matrix and forcing are not among the outputs: the runtime computes them
    from the outputs of the tree.  ``intermediates``: named values that outputs share, each an
    expression of symbols and of earlier intermediates.
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
    def movable_coordinates(self) -> tuple[Symbol, ...]:
        """The coordinates without the states: displacements and projections change only these."""
        return self.symbols.q[: len(self.symbols.q) - self.states]
