"""Classification of velocity constraints: rates of configuration constraints, or nonholonomic.

KanesMethod keeps both in one list without labels.  They are classified by ranks at random states
that satisfy the constraints: a row in the span of the rates of configuration constraints is one of
these rates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sympy import Derivative, Expr, S, Symbol
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import dynamicsymbols

from mechc_codegen.convert.algebra import (
    Rows,
    eliminate,
    evaluator,
    normalise,
    null_space,
    random_point,
    rank,
    scale_row,
)
from mechc_codegen.errors import MechanismError

_SEEDS = (1, 2)
_STEP, _FLAT, _NOTHING = 1e-5, 1e-6, 1e-9


class Rates:
    """The kinematics q' = N u + n over symbols, by which expressions can be differentiated.

    ``moving``: q' and auxiliary speeds -> their expressions.  Each speed is a symbol, and so is
    every specified function of time and each of its derivatives.
    """

    def __init__(
        self,
        state: tuple[Sequence[AppliedUndef], Sequence[AppliedUndef]],
        kinematics: Sequence[Expr],
        parameters: Sequence[Symbol],
        specified: Mapping[AppliedUndef, Expr],
        auxiliary: Sequence[AppliedUndef] = (),
    ) -> None:
        q, u = state
        rates = zip(q, kinematics, strict=True)
        self.moving = {x.diff(dynamicsymbols._t): rate for x, rate in rates}
        self.moving |= dict.fromkeys(auxiliary, S.Zero)
        self._specified = dict(specified)
        self._plain: dict[Expr, Expr] = {}
        for k, x in enumerate((dynamicsymbols._t, *q, *u)):
            self._plain[x] = Symbol(f"_s{k}")
        self.q = [self._plain[x] for x in q]
        self.u = [self._plain[x] for x in u]
        self.time = self._plain[dynamicsymbols._t]
        self.are_speeds = tuple(kinematics) == tuple(u)
        self._parameters = list(parameters)
        self.known = 1 + len(q) + len(self._parameters)
        self.kinematics = [self.in_symbols(rate) for rate in kinematics]

    def in_symbols(self, expression: Expr) -> Expr:
        """The expression over symbols."""
        rates = (d for d in expression.atoms(Derivative) if d.expr in self._specified)
        values = {d: self._specified[d.expr].diff(*d.variables) for d in rates}
        expression = expression.xreplace(self._specified | values)
        for kind in (Derivative, AppliedUndef):
            found = expression.atoms(kind)
            for x in sorted(found - self._plain.keys(), key=str):
                self._plain[x] = Symbol(f"_s{len(self._plain)}")
            expression = expression.xreplace({x: self._plain[x] for x in found})
        return expression.xreplace(self._plain)

    def input_symbols(self, expressions: Sequence[Expr]) -> list[tuple[Expr, Expr]]:
        """Pairs of symbols: each specified function of time in the expressions, and its rate."""
        own = {self.time, *self.q, *self.u}
        held = {symbol for e in expressions for symbol in e.free_symbols} - own
        functions = [x for x, symbol in self._plain.items() if symbol in held]
        return [(self._plain[f], self.in_symbols(f.diff(dynamicsymbols._t))) for f in functions]

    def values_of(self, state: Sequence[float]) -> dict[Expr, float]:
        """The values of what the symbols stand for, from those of :attr:`symbols` and speeds."""
        given = dict(zip([*self.symbols, *self.u], state, strict=True))
        of_parameters = {parameter: given[parameter] for parameter in self._parameters}
        return of_parameters | {x: given[symbol] for x, symbol in self._plain.items()}

    @property
    def symbols(self) -> list[Expr]:
        """All symbols of such expressions except the speeds."""
        return [*(s for s in self._plain.values() if s not in self.u), *self._parameters]


class SpeedRows:
    """Numerical coefficients of the speeds in expressions that are linear in them."""

    def __init__(self, rates: Rates, expressions: Sequence[Expr]) -> None:
        self.width = len(rates.u)
        self._evaluate = evaluator([*rates.symbols, *rates.u], list(expressions))

    def still(self, point: Sequence[float]) -> list[float]:
        """The part of the expressions that does not depend on the speeds."""
        return self._evaluate(*point, *[0.0] * self.width)

    def at(self, point: Sequence[float]) -> Rows:
        still = self.still(point)
        columns = []
        for k in range(self.width):
            moving = self._evaluate(*point, *(float(k == i) for i in range(self.width)))
            columns.append([a - b for a, b in zip(moving, still, strict=True)])
        return [list(row) for row in zip(*columns, strict=True)]


class RateRows:
    """Numerical coefficients of the speeds in the rates of configuration constraints."""

    def __init__(self, rates: Rates, configuration: Sequence[Expr]) -> None:
        driven = rates.input_symbols(configuration)
        place = {symbol: k for k, symbol in enumerate(rates.symbols)}
        self._places, self._time = [place[q] for q in rates.q], place[rates.time]
        self._driven = [(place[value], place[rate]) for value, rate in driven]
        self._size = len(place)
        gap = evaluator(rates.symbols, list(configuration))
        self._gap = normalise(gap, self._size, self._places) if configuration else None
        self._kinematics = SpeedRows(rates, rates.kinematics)

    def points(self) -> list[list[float]]:
        """Random states in which the constraints hold."""
        found = (random_point(self._gap, self._size, seed, self._places) for seed in _SEEDS)
        return [point for point in found if point is not None]

    def at(self, point: Sequence[float]) -> Rows:
        columns = [
            self._slope(point, motion) for motion in zip(*self._kinematics.at(point), strict=True)
        ]
        return [list(row) for row in zip(*columns, strict=True)]

    def still(self, point: Sequence[float]) -> list[float]:
        """The rates with every speed zero."""
        given = {self._time: 1.0} | {value: point[rate] for value, rate in self._driven}
        return self._slope(point, self._kinematics.still(point), given)

    def _slope(
        self, point: Sequence[float], motion: Sequence[float], given: Mapping[int, float] = {}
    ) -> list[float]:
        """The rates for given rates of the coordinates and given values of the other arguments."""
        direction = [given.get(i, 0.0) for i in range(len(point))]
        for place, rate in zip(self._places, motion, strict=True):
            direction[place] = rate
        return self._gap.slope(point, direction) if self._gap else []


def satisfied_identically(configuration: Sequence[Expr], rates: Rates) -> list[int]:
    """Configuration constraints that the kinematics satisfy identically, as a quaternion's norm."""
    if not configuration:
        return []
    plain = [rates.in_symbols(e) for e in configuration]
    rows = RateRows(rates, plain)
    found = [rows.at(point) for point in rows.points()]
    return [i for i in range(len(plain)) if found and all(_vanishes(rows_[i]) for rows_ in found)]


def _vanishes(row: Sequence[float]) -> bool:
    return max(map(abs, row), default=0.0) < _NOTHING


def nonholonomic(
    configuration: Sequence[Expr], motion: Sequence[Expr], rates: Rates, *, mixed: bool
) -> tuple[Expr, ...]:
    """The rows of ``motion`` that are not rates of the configuration constraints.

    These rates need not be among ``motion``: they are derived from the configuration constraints.
    ``mixed``: they are meant to be there, so that both together leave no less freedom.

    Raises
    ------
    MechanismError
        If no speeds satisfy both, or no configuration satisfies its constraints.
    """
    if not configuration or not motion:
        return tuple(motion)
    plain = [rates.in_symbols(e) for e in configuration]
    given = [rates.in_symbols(e) for e in motion]
    theirs, others = RateRows(rates, plain), SpeedRows(rates, given)
    kept: list[int] | None = None
    for point in theirs.points():
        span, rows = theirs.at(point), others.at(point)
        still = [*theirs.still(point), *others.still(point)]
        whole = [[*row, rest] for row, rest in zip([*span, *rows], still, strict=True)]
        known, held = rank(_significant(rows)), _rank_of([*span, *rows])
        if held < _rank_of(whole) or (mixed and held == len(rates.u) > known):
            left = "no speeds satisfy" if held < len(rates.u) else "no motion satisfies"
            raise MechanismError(
                f"{left} both the velocity constraints and the rates of the configuration "
                "constraints: one of them is wrong. The rates need not be given, they are derived"
            )
        kept = _beyond(_significant(span), rows)
    if kept is None:
        raise MechanismError(
            "no configuration was found in which all configuration constraints vanish: do they "
            "contradict each other?"
        )
    return tuple(motion[i] for i in kept)


def degrees_of_freedom(
    configuration: Sequence[Expr], motion: Sequence[Expr], rates: Rates
) -> tuple[int, int]:
    """The degrees of freedom with the velocity constraints alone, and with the rates of the
    configuration constraints too, at a state that shows the difference if there is any."""
    size = len(rates.u)
    theirs = RateRows(rates, [rates.in_symbols(e) for e in configuration])
    others = SpeedRows(rates, [rates.in_symbols(e) for e in motion])
    counted = [(size, size)]
    for point in theirs.points():
        rows = others.at(point)
        counted.append((size - _rank_of(rows), size - _rank_of([*theirs.at(point), *rows])))
    return max(counted, key=lambda pair: pair[0] - pair[1])


def _significant(rows: Rows) -> Rows:
    return [row for row in rows if not _vanishes(row)]


def _rank_of(rows: Rows) -> int:
    return rank(_significant(rows))


def _beyond(rows: Rows, others: Rows) -> list[int]:
    """The rows of ``others`` that increase the rank when they are added one by one."""
    span, kept = list(rows), list[int]()
    known = rank(span)
    for i, row in enumerate(others):
        if rank([*span, row]) > known:
            span.append(row)
            kept.append(i)
            known += 1
    return kept


def integrable(motion: Sequence[Expr], rates: Rates) -> bool:
    """Whether velocity constraints can be integrated to configuration constraints.

    By the theorem of Frobenius: the constraints are one-forms over the coordinates' rates; all of
    them together, or one of them, have no curvature on the motions that they allow.  Rows that
    depend on time, or on one coordinate only, are excluded: their integral is an initial value.
    """
    if len(rates.q) != len(rates.u):
        return False
    forms = _Forms(rates, [rates.in_symbols(e) for e in motion])
    values = random_point(None, len(rates.symbols), _SEEDS[0]) or []
    rows = forms.at(values)
    if rows is None:
        return False
    coupled = [sum(abs(x) > _NOTHING for x in scale_row(row)) > 1 for row in rows]
    still = forms.rows.still(values)  # terms that are free of the speeds
    suspects = [i for i, b in enumerate(still) if abs(b) < _NOTHING and coupled[i]]
    if not suspects:
        return False
    slopes = forms.slopes(values)
    size = len(rates.q)
    everything = [[float(i == j) for j in range(size)] for i in range(size)]
    closed = any(_curvature(slopes, i, everything) < _FLAT for i in suspects)
    free = null_space(rows, size)
    return closed or all(_curvature(slopes, i, free) < _FLAT for i in suspects)


class _Forms:
    """Velocity constraints as one-forms A(q) dq: rows over the coordinates' rates."""

    def __init__(self, rates: Rates, motion: Sequence[Expr]) -> None:
        self.rates, self.size = rates, len(rates.q)
        self.rows = SpeedRows(rates, motion)
        self.kinematics = SpeedRows(rates, rates.kinematics)

    def at(self, values: Sequence[float]) -> Rows | None:
        """A = J N^-1; None where N has no inverse."""
        matrix = self.kinematics.at(values)
        inverse = _inverse(matrix)
        if inverse is None:
            return None
        return [
            [sum(row[k] * inverse[k][j] for k in range(self.size)) for j in range(self.size)]
            for row in self.rows.at(values)
        ]

    def slopes(self, values: Sequence[float]) -> list[list[list[float]]]:
        """slopes[k][i][j] = d A_ij / d q_k."""
        found = []
        for k in (self.rates.symbols.index(q) for q in self.rates.q):
            sides = []
            for step in (_STEP, -_STEP):
                moved = list(values)
                moved[k] += step
                sides.append(self.at(moved) or [])
            found.append(
                [
                    [(a - b) / (2 * _STEP) for a, b in zip(one, other, strict=True)]
                    for one, other in zip(*sides, strict=True)
                ]
            )
        return found


def _inverse(matrix: Rows) -> Rows | None:
    size = len(matrix)
    augmented = [[*row, *(float(i == j) for j in range(size))] for i, row in enumerate(matrix)]
    pivots, reduced, _ = eliminate(augmented, size, 1e-12)
    if len(pivots) < size:
        return None
    rows: Rows = [[]] * size
    for pivot, row in zip(pivots, reduced, strict=True):
        rows[pivot] = row[size:]
    return rows


def _curvature(slopes: list[list[list[float]]], i: int, directions: Rows) -> float:
    """Largest d omega_i(v, w) over pairs of directions."""
    size = len(slopes)
    two_form = [[slopes[k][i][j] - slopes[j][i][k] for j in range(size)] for k in range(size)]
    largest = 0.0
    for a, v in enumerate(directions):
        for w in directions[:a]:
            value = sum(v[k] * two_form[k][j] * w[j] for k in range(size) for j in range(size))
            largest = max(largest, abs(value))
    return largest
