"""Events and resets as expressions, typed or of SymPy, turned into functions of t and y."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError, brief
from mechc.simulation.events.event import Event
from mechc.simulation.events.friction import DryFriction, FrictionLaw
from mechc.simulation.events.levels import read_level
from mechc.simulation.events.stops import NEWTON, POISSON, Stop, StopReset
from mechc.system.names import by_name, name_of
from mechc.system.parameters import Array, one_double
from mechc.system.system import System
from mechc.system.units import SECONDS, in_si, is_with_unit, refuse_names

MOST_KEPT = 256  # functions of expressions, from one run to the next
_DIRECTIONS = {">": 1.0, ">=": 1.0, "<": -1.0, "<=": -1.0, "==": 0.0}  # SymPy's names


Parse = Callable[[str, Mapping[str, Any]], Any]


def read_events(given: Any, system: System, p: Array, parse: Parse) -> list[Event]:
    """Events, or one by itself: expressions are functions of t and y.

    ``parse(text, names)``: the expression that a text of the grammar is.

    Raises
    ------
    UnknownNameError, ValueOutOfBoundsError, ExpressionError
        For names that the model does not have, resets of what is no state, and texts that are not
        of the grammar.
    """
    if not isinstance(given, (tuple, list)) and is_one_event(given):
        given = [given]
    reader = EventReader(system, p, parse)
    events = [Event.of(reader.event(event)) for event in given]
    if len({e.reset.law for e in events if isinstance(e.reset, StopReset)}) > 1:
        raise ValueOutOfBoundsError("the stops of a run have one law of restitution")
    return events


def is_of_expressions(event: Any) -> bool:
    """Whether an event and its reset, if it has one, are expressions."""
    return (
        isinstance(event, Event)
        and isinstance(event.function, ValueExpression)
        and (event.reset is None or isinstance(event.reset, (ResetExpressions, StopReset)))
    )


def changes_parameters(event: Any) -> bool:
    """Whether the reset of an event, by expressions, changes parameters."""
    return bool(getattr(getattr(event, "reset", None), "values", None))


def is_one_event(given: Any) -> bool:
    """Whether a value is one event by itself, not several."""
    if (
        callable(given)
        or isinstance(given, (Event, Stop, DryFriction, Mapping))
        or is_expression(given)
    ):
        return True
    return not isinstance(given, Iterable) or getattr(given, "ndim", 1) == 0


def is_expression(event: Any) -> bool:
    """Whether a value is a text, or a symbol or an expression of SymPy, not a function."""
    return isinstance(event, str) or (hasattr(event, "free_symbols") and hasattr(event, "xreplace"))


def as_written(given: Any) -> str:
    """An expression as text, functions of time without their argument."""
    return " ".join(str(given).replace("(t)", "").split())


@dataclass(frozen=True)
class StateNames:
    """The names that events of a description may contain, before there is a system."""

    coordinates: Sequence[str]
    speeds: Sequence[str]
    parameters: Sequence[str]
    states: Sequence[str] = ()


class EventReader:
    """Reads the events of one model with parameters p (np,)."""

    def __init__(self, system: Any, p: Array, parse: Callable[..., Any]) -> None:
        self.system, self.p, self.parse = system, p, parse
        self.width = len(system.coordinates) + len(system.speeds)
        self.known = getattr(system, "cache", {}).setdefault(EventReader, {})  # expressions

    @cached_property
    def names(self) -> dict[str, Any]:
        """Name -> plain symbol: y0, y1, ... for the state, p0, ... for parameters, t for time."""
        from sympy import Symbol

        system = self.system
        state = {n: f"y{k}" for k, n in enumerate((*system.coordinates, *system.speeds))}
        every = {"t": "t", **{n: f"p{k}" for k, n in enumerate(system.parameters)}, **state}
        return {name: Symbol(plain, real=True) for name, plain in every.items()}

    def event(self, given: Any) -> Any:
        if isinstance(given, Stop):
            return self._stop(given)
        if isinstance(given, DryFriction):
            return Event(self._friction(given))
        if is_expression(given):
            given = Event(given)
        if not isinstance(given, Event):
            return given
        if is_expression(given.function):
            expression, direction = self._difference(given.function)
            function = ValueExpression(expression, self.p, self.width)
            own = one_double(given.direction, "a direction")
            function.title = as_written(given.function)
            given = replace(given, function=function, direction=own or direction)
        if isinstance(given.reset, Mapping):
            given = replace(given, reset=self._reset(given.reset))
        return given

    def _difference(self, given: Any) -> tuple[Any, float]:
        """The expression that is zero at the event, and its direction: for ``q > 1`` q - 1, up."""
        if isinstance(given, str):
            relation = next((sign for sign in _DIRECTIONS if sign in given), None)
            if relation is None:
                return self.plain(given), 0.0
            left, right = given.split(relation, 1)
            relation = relation + "=" if right.startswith("=") else relation
            right = right.removeprefix("=")
            if is_with_unit(left):
                value = self.plain(right)
                return self._level(left, value, right) - value, _DIRECTIONS[relation]
            value = self.plain(left)
            return value - self._level(right, value, left), _DIRECTIONS[relation]
        direction = _DIRECTIONS.get(getattr(given, "rel_op", ""))
        if direction is None:
            return self.plain(given), 0.0
        return self.plain(given.lhs - given.rhs), direction

    def _level(self, text: str, value: Any, title: str) -> Any:
        """The level of a comparison: an expression, or a number with a unit that the value has."""
        if not is_with_unit(text):
            return self.plain(text)
        known = {"t": SECONDS, **getattr(self.system, "quantities", {})}
        quantities = {s: known[n] for n, s in self.names.items() if n in known and value.has(s)}
        if not all(quantity.unit for quantity in quantities.values()):
            refuse_names(title.strip(), text, self.names)
        return self.plain(read_level(text, value, title.strip(), quantities))

    def _stop(self, given: Stop) -> Event:
        system = self.system
        if not is_expression(given.gap) or hasattr(given.gap, "rel_op"):
            raise ValueOutOfBoundsError(
                "a gap is an expression of coordinates, of SymPy or as text, not "
                f"{brief(given.gap)}"
            )
        gap = ValueExpression(self.plain(given.gap), self.p, self.width)
        gap.title = as_written(given.gap)
        kept = ValueExpression(self.plain(given.restitution), self.p, self.width)
        for name in (*system.speeds, *system.states):
            symbol = self.names[name]
            if gap.expression.has(symbol) or kept.expression.has(symbol):
                raise ValueOutOfBoundsError(
                    f"a gap and its restitution depend on coordinates, not on {name}"
                )
        if not 0.0 <= kept(0.0, np.zeros(self.width)) <= 1.0:
            raise ValueOutOfBoundsError(f"restitution = {given.restitution} must be 0 to 1")
        if not isinstance(given.law, str) or given.law not in (NEWTON, POISSON):
            raise ValueOutOfBoundsError(
                f"law = {given.law!r}: the law of restitution is {NEWTON!r} or {POISSON!r}"
            )
        friction = self._friction_of_stop(given)
        reset = StopReset(gap, kept, system, self.p, friction, given.law)
        return Event(gap, -1.0, given.terminal, reset)

    def _friction_of_stop(self, given: Stop) -> FrictionLaw:
        none = bool(self.plain(given.friction).is_zero) and given.static is None
        if given.slip is None and not none:
            raise ValueOutOfBoundsError(
                "friction at a stop needs the speed of sliding there: slip='u_x + r*omega'"
            )
        if given.slip is None or none:
            return FrictionLaw(None, 0.0, 0.0)
        return self._law(given.slip, given.friction, given.static, 1.0)

    def _friction(self, given: DryFriction) -> FrictionLaw:
        slip = given.slip
        if len(getattr(slip, "speeds", ())) == 1:  # a joint of SymPy
            slip = slip.speeds[0]
        return self._law(slip, given.mu, given.static, given.normal)

    def _law(self, slip: Any, friction: Any, static: Any, normal: Any) -> FrictionLaw:
        from sympy import S, diff

        speeds = [self.names[name] for name in self.system.speeds]
        one = is_expression(slip) and not getattr(slip, "is_Matrix", False)
        speed = self.plain(slip) if one else S.Zero
        rows = [diff(speed, u) for u in speeds]
        if not any(rows) or any(row.has(u) for row in rows for u in speeds):
            raise ValueOutOfBoundsError(
                "a speed of sliding is one expression, linear in the speeds of the model, not "
                f"{brief(slip)}. Friction in a plane, where the slip is (v_x, v_y), is given as "
                "loads by a smooth law instead: -mu*N*v_x/sqrt(v_x**2 + v_y**2 + v_s**2) along x "
                "and likewise along y, with a small speed v_s"
            )
        press, slides = self.plain(normal), self.plain(friction)
        sticks = slides if static is None else self.plain(static)
        for coefficient, told in ((slides, friction), (sticks, static), (press, normal)):
            if coefficient.is_number and not coefficient >= 0:
                raise ValueOutOfBoundsError(
                    f"friction = {told} must not be negative, nor the force that presses"
                )
        if sticks.is_number and slides.is_number and sticks < slides:
            raise ValueOutOfBoundsError(
                f"static = {static} must be at least the friction while it slides, {friction}"
            )
        return FrictionLaw(speed, slides * press, sticks * press)

    def _reset(self, given: Mapping[Any, Any]) -> ResetExpressions:
        state, parameters = self.state, tuple(self.system.parameters)
        changes, values = {}, {}
        known_kinds = getattr(self.system, "quantities", {})
        for name, value in by_name(given, "a reset", "{'u': '-0.8*u'}").items():
            if name in known_kinds and (not isinstance(value, str) or is_with_unit(value)):
                value = in_si(value, known_kinds[name])
            if name in parameters:
                values[parameters.index(name)] = self.plain(value)
            elif name in state:
                changes[state.index(name)] = self.plain(value)
            else:
                known = (*state, *parameters)
                raise UnknownNameError("coordinate, speed or parameter", name, known)
        split = len(self.system.coordinates)
        return ResetExpressions(changes, self.p, split, len(state), values)

    @property
    def state(self) -> tuple[str, ...]:
        return (*self.system.coordinates, *self.system.speeds)

    def plain(self, given: Any) -> Any:
        """A number, a text of the grammar or an expression of SymPy, over plain symbols.

        Each is read once: a search asks for the same at many parameters.
        """
        key: Any = type(given), given
        try:
            found = self.known.get(key)
            if found is not None:
                return found
        except TypeError:  # of what has no hash
            key = None
        from sympy import (
            Derivative,
            Dummy,
            Expr,
            I,
            Symbol,
            SympifyError,
            nan,
            oo,
            sympify,
            zoo,
        )  # fmt: skip
        from sympy.core.function import AppliedUndef

        if isinstance(given, str):
            return self._keep(key, _over_reals(self.parse(given, self.names)))
        try:
            expression = sympify(given, strict=True)
        except (SympifyError, AttributeError, TypeError, ValueError):  # of arrays of anything
            expression = None
        if not isinstance(expression, Expr) or expression.has(I, nan, oo, -oo, zoo):
            raise ValueOutOfBoundsError(
                "events are made of finite real numbers, texts and expressions of SymPy, not "
                f"{brief(given)}"
            )
        known, stand_ins, rest = {}, set[Any](), expression
        for kind in (Derivative, AppliedUndef, Symbol):  # from the outside inwards
            for atom in rest.atoms(kind) - stand_ins:
                name = name_of(atom)
                if name not in self.names:
                    raise UnknownNameError("coordinate, speed or parameter", name, self.names)
                known[atom] = self.names[name]
            replaced = {atom: Dummy() for atom in known}
            stand_ins |= {*replaced.values()}
            rest = rest.xreplace(replaced)
        return self._keep(key, _over_reals(expression.xreplace(known)))

    def _keep(self, key: Any, expression: Any) -> Any:
        if key is not None:
            if len(self.known) >= MOST_KEPT:
                self.known.clear()
            self.known[key] = expression
        return expression


def _over_reals(expression: Any) -> Any:
    """The expression with derivatives over real numbers also where SymPy cannot tell what is real.

    For it abs(log(g)) may be that of a complex number, whose derivative no language has.
    """
    from sympy import Abs, Piecewise, sign, sqrt

    def is_of_complex(part: Any) -> bool:
        return isinstance(part, (Abs, sign)) and not part.args[0].is_extended_real

    def real_form(part: Any) -> Any:
        x = part.args[0]
        return (
            sqrt(x**2) if isinstance(part, Abs) else Piecewise((-1, x < 0), (1, x > 0), (0, True))
        )

    return expression.replace(is_of_complex, real_form)


def function_of(expressions: Sequence[Any]) -> Callable[[float, Array, Array], Any]:
    """A function of t, y and p for expressions over plain symbols: infinite or NaN as in C."""
    return _function_of(tuple(expressions))


@lru_cache(MOST_KEPT)
def _function_of(expressions: tuple[Any, ...]) -> Callable[[float, Array, Array], Any]:
    from sympy import Symbol, lambdify

    free = sorted({s for e in expressions for s in e.free_symbols}, key=str)
    places = {kind: [s for s in free if s.name.startswith(kind)] for kind in "yp"}
    at = {kind: np.array([int(s.name[1:]) for s in found], np.intp)
          for kind, found in places.items()}  # fmt: skip
    arguments = [Symbol("t", real=True), places["y"], places["p"]]
    compiled = lambdify(arguments, list(expressions), "numpy", cse=True)
    of_state, of_parameters = at["y"], at["p"]

    def values(t: float, y: Array, p: Array) -> Any:
        with np.errstate(all="ignore"):
            return compiled(np.float64(t), y[of_state], p[of_parameters])

    return values


@lru_cache(MOST_KEPT)
def _derivatives(
    values: tuple[Any, ...], width: int, parameters: int
) -> Callable[[float, Array, Array], tuple[Array, Array, Array]]:
    """A function of t, y, p: derivatives of n values by t (n,), y (n, width) and p (n, np)."""
    from sympy import DiracDelta, Symbol, diff

    by = ["t", *(f"y{k}" for k in range(width)), *(f"p{k}" for k in range(parameters))]
    symbols = [Symbol(name, real=True) for name in by]

    def slope(value: Any, x: Symbol) -> Any:
        found = diff(value, x)
        if not found.has(DiracDelta):
            return found
        return found.replace(DiracDelta, lambda *_: 0)  # it is not defined at a jump

    entries = [(i, j, slope(value, x)) for i, value in enumerate(values)
               for j, x in enumerate(symbols) if value.has(x)]  # fmt: skip
    function = function_of([entry for _, _, entry in entries])

    def slopes(t: float, y: Array, p: Array) -> tuple[Array, Array, Array]:
        table = np.zeros((len(values), len(by)))
        for (i, j, _), value in zip(entries, function(t, y, p), strict=True):
            table[i, j] = value
        return table[:, 0], table[:, 1 : 1 + width], table[:, 1 + width :]

    return slopes


class ValueExpression:
    """The function of t and y that an expression over plain symbols is.

    Attributes
    ----------
    title
        The expression as it was given.
    """

    def __init__(self, expression: Any, p: Array, width: int) -> None:
        self.expression, self.p, self.width = expression, p, width
        self.__name__ = "expression"
        self.title = ""

    def __call__(self, t: float, y: Array) -> float:
        return self.at(t, y, self.p)

    def at(self, t: float, y: Array, p: Array) -> float:
        """The value of the expression for parameters p (np,)."""
        return float(self._values_of(t, y, p)[0])

    @cached_property
    def _values_of(self) -> Callable[..., Any]:
        return function_of([self.expression])

    @cached_property
    def _derivatives(self) -> Callable[..., Any]:
        return _derivatives((self.expression,), self.width, len(self.p))

    def slopes(self, t: float, y: Array, p: Array | None = None) -> tuple[float, Array, Array]:
        """Derivatives by time, state (nq + nu,) and parameters (np,), for those of the run or p."""
        by_time, by_state, by_parameters = self._derivatives(t, y, self.p if p is None else p)
        return float(by_time[0]), by_state[0], by_parameters[0]


class ResetExpressions:
    """The reset of q and u that expressions over plain symbols are; see :class:`Event`.

    Attributes
    ----------
    changes
        Place in the state -> expression of its value after the event.
    values
        Place among the parameters -> expression of its value after the event.
    """

    takes_parameters = True

    def __init__(
        self, changes: Mapping[int, Any], p: Array, split: int, width: int,
        values: Mapping[int, Any],
    ) -> None:  # fmt: skip
        self.changes, self.values = dict(sorted(changes.items())), dict(sorted(values.items()))
        self.p, self.split, self.width = p, split, width
        self.__name__ = "of expressions"

    def __call__(self, t: float, q: Array, u: Array, p: Array | None = None) -> tuple[Array, ...]:
        """New q and u, and all parameters (np,) where it changes some.  ``p``: other parameters
        than those of the run."""
        y, before = np.concatenate([q, u]), self.p if p is None else p
        found = self._values_of(t, y, before)
        y[list(self.changes)] = found[: len(self.changes)]
        if not self.values:
            return y[: self.split], y[self.split :]
        after = before.copy()
        after[list(self.values)] = found[len(self.changes) :]
        return y[: self.split], y[self.split :], after

    @cached_property
    def _values_of(self) -> Callable[..., Any]:
        return function_of([*self.changes.values(), *self.values.values()])

    @cached_property
    def _derivatives(self) -> Callable[..., Any]:
        return _derivatives(tuple(self.changes.values()), self.width, len(self.p))

    def slopes(self, t: float, y: Array) -> tuple[Array, Array, Array]:
        """Slopes of the state after it by time (nx,), state (nx, nx) and parameters (nx, np)."""
        by_time, by_state = np.zeros(self.width), np.eye(self.width)
        by_parameters, rows = np.zeros((self.width, len(self.p))), list(self.changes)
        by_time[rows], by_state[rows], by_parameters[rows] = self._derivatives(t, y, self.p)
        return by_time, by_state, by_parameters
