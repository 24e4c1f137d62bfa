"""Reference motions of thirty digits, each computed in two ways that share nothing.

First way: M, F, J, gamma of the open tree by SymPy's KanesMethod, the Schur complement, Gauss's
collocation.  Second way: other equations (the pendulum's from Lagrange's by hand; the bicycle's by
Kane with dependent speeds, LU decomposition), Gragg's extrapolated midpoint rule.  Both have 50
digits; what is written into data/ are those on which both agree; fewer than 30 are an error.
Parameters are the doubles that everybody is given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import sympy
from mechc_codegen.library.chains.pendulum import pendulum
from mechc_codegen.library.spatial.bicycle import bicycle, values
from mpmath import mpf
from sympy.physics.mechanics import dynamicsymbols

from ..formulations.described import described
from ..formulations.equations import Equations, derive
from ..formulations.program import program
from ..problems.bicycle import COORDINATES, SPEEDS
from .arithmetic import (
    DIGITS,
    FUNCTIONS,
    Vector,
    agreed,
    cos,
    number,
    numbers,
    of_mpmath,
    sin,
    solution,
    texts,
)
from .extrapolation import Rates, by_extrapolation
from .sensitivities import dual_numbers
from .sensitivities.gauss import along


@dataclass(frozen=True)
class Reference:
    """A motion: its mechanism, parameters, start ``[q, u]``, times, and the second equations."""

    source: str
    mechanism: Any
    values: Mapping[str, float]
    start: Callable[[Callable[..., Vector], Vector], Vector]
    times: tuple[float, ...]
    second: Callable[[], Rates]
    longest: str  # step of both ways (s)


def compute(reference: Reference) -> dict[str, Any]:
    """Rows of the motion as text, and on how many digits the two ways agree."""
    equations = derive(described(reference.mechanism, reference.values), {})
    parameters = [mpf(reference.values[p.name]) for p in equations.parameters]
    start = reference.start(equations.constraints().function("mpmath"), parameters)
    longest = reference.longest
    first = by_collocation(equations, parameters, start, reference.times, longest)
    ends = by_extrapolation(reference.second(), numbers(start), reference.times, longest)
    second = [[of_mpmath(x) for x in end] for end in ends]
    digits = agreed(first, second)
    names = [str(x.func) for x in (*reference.mechanism.q, *reference.mechanism.u)]
    motion = [(0.0, start), *zip(reference.times, first, strict=True)]
    rows = [[str(t), *texts(row, digits)] for t, row in motion]
    return {"source": reference.source, "digits": digits, "columns": ["t", *names], "rows": rows}


# -- first way ------------------------------------------------------------------------------------


def by_collocation(
    equations: Equations, parameters: Vector, start: Vector, times: Sequence[float], longest: str
) -> list[Vector]:
    """Gauss's collocation of order 40; the parameters stay parameters, so that none is rounded."""
    rates, rows, now = rates_of_tree(equations), [start], mpf(0)
    for t in times:
        end = along(rates, parameters, rows[-1], mpf(t) - now, longest)
        rows.append([x.value for x in end])
        now = mpf(t)
    return rows[1:]


def rates_of_tree(equations: Equations) -> Callable[[Vector], Rates]:
    """Of parameters, in plain or dual numbers, the rates of the state."""
    program = equations.rates()
    refuse_rounded_numbers(program)
    function = program.function(dual_numbers.FUNCTIONS)
    return lambda p: lambda y: function(*y, *p)


def refuse_rounded_numbers(program: Any) -> None:
    """Quotients such as 1/12 would become doubles on the way; halves and their like are exact."""
    for _, value in program.assignments:
        for quotient in value.atoms(sympy.Rational):
            if quotient.q & (quotient.q - 1):
                raise ValueError(f"{quotient} in the equations is no double: make it a parameter")


# -- the pendulum ---------------------------------------------------------------------------------

LINKS, GRAVITY = 10, 9.81


def pendulum_10() -> Reference:
    given = {f"{x}_{k}": 1.0 for x in "ml" for k in range(LINKS)} | {"g": GRAVITY}
    angle = mpf(math.pi / 2)  # the double that everybody starts from
    return Reference(
        source="ten-link pendulum of unit point masses and links, g = 9.81, from rest at 90 "
        "degrees (the double next to pi/2); see references/motions.py",
        mechanism=pendulum(LINKS), values=given,
        start=lambda *_: [angle] * LINKS + [mpf(0)] * LINKS,
        times=(1.0, 2.0, 3.0, 4.0), second=pendulum_by_hand, longest="0.05",
    )  # fmt: skip


def pendulum_by_hand() -> Rates:
    """Lagrange's equations in absolute angles: sum_j (n - max(i, j)) (c_ij a_j + s_ij w_j^2)."""
    gravity = number(GRAVITY)
    below = [[LINKS - max(i, j) for j in range(LINKS)] for i in range(LINKS)]

    def rates(y: Vector) -> Vector:
        angles, squares = y[:LINKS], [w**2 for w in y[LINKS:]]
        c, s = [cos(x) for x in angles], [sin(x) for x in angles]
        rows = []
        for i in range(LINKS):
            row, force = [], -below[i][i] * gravity * s[i]
            for j in range(LINKS):
                row.append(below[i][j] * (c[i] * c[j] + s[i] * s[j]))
                force -= below[i][j] * (s[i] * c[j] - c[i] * s[j]) * squares[j]
            rows.append([*row, force])
        return [*y[LINKS:], *solution(rows)]

    return rates


# -- the bicycle ----------------------------------------------------------------------------------


DEPENDENT = 5  # speeds, which follow the independent ones in the state


def bicycle_motion() -> Reference:
    method = bicycle()
    return Reference(
        source="the bicycle of Meijaard et al. (2007), benchmark values, without hands from a "
        "general state at 4.6 m/s, nonlinear; see references/motions.py",
        mechanism=described(method, values()), values=values(), start=bicycle_start,
        times=(0.5, 1.0, 1.5, 2.0), second=lambda: bicycle_reduced(method), longest="0.05",
    )  # fmt: skip


def bicycle_start(
    constraints: Callable[..., Vector], parameters: Vector, given: Mapping[str, Any] | None = None
) -> Vector:
    """The independent ones as given; pitch by Newton, the dependent speeds by their rows."""
    other = given or {}
    q, u = ([mpf(other.get(name, x)) for name, x in known.items()]
            for known in (COORDINATES, SPEEDS))  # fmt: skip
    residual = lambda pitch, *others: constraints(*q, pitch, *u, *others, *parameters)  # noqa: E731
    guess = [mpmath.pi / 10, *([mpf(0)] * DEPENDENT)]
    pitch, *others = mpmath.findroot(residual, guess, tol=mpf(10) ** (10 - 2 * DIGITS))
    return [*q, pitch, *u, *others]


def bicycle_reduced(method: Any) -> Rates:
    """Kane's equations for the independent speeds beside the rows of the dependent ones."""
    matrices, given = [method.mass_matrix, method.forcing], values()
    symbols = set().union(*(m.free_symbols for m in matrices)) - {dynamicsymbols._t}
    names = sorted(symbols, key=str)
    rows = method.mass_matrix.row_join(method.forcing)
    terms = program([*method.q, *method.u, *names], [*rows])
    refuse_rounded_numbers(terms)
    function = terms.function(FUNCTIONS)
    parameters = numbers(given[symbol.name] for symbol in names)
    order = rates_in_the_order_of_coordinates(method)
    width = rows.cols

    def rates(y: Vector) -> Vector:
        values = function(*y, *parameters)
        entries = [values[k : k + width] for k in range(0, len(values), width)]
        return [*(y[len(order) + k] for k in order), *solution(entries)]

    return rates


def rates_in_the_order_of_coordinates(method: Any) -> list[int]:
    """Of every coordinate, the place of the speed that is its rate."""
    names = [str(u.func) for u in method.u]
    return [names.index(f"{q.func}_rate") for q in method.q]


REFERENCES = {"pendulum_10": pendulum_10, "bicycle_motion": bicycle_motion}
