"""What a user hands over and asks for -> a scene that can be named, and built when it is new.

The name (a digest) of a SymPy object is made from what was read of it, without deriving anything;
that is what makes a warm start quick.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sympy import Expr, Symbol, sympify

from mechc_codegen.convert import Settings, convert, find_symbol, number, reachable
from mechc_codegen.errors import MechanismError
from mechc_codegen.from_sympy import read, readable
from mechc_codegen.mechanism import Mechanism
from mechc_codegen.walk import Walk, walk
from mechc_codegen.wishes import OPTIONAL, Wishes


@dataclass(frozen=True)
class Asked:
    """Besides the settings: parameters to fix, and outputs (None: all there are)."""

    settings: Settings
    fix: Mapping[Any, Any] = field(default_factory=dict)
    outputs: tuple[Any, ...] | None = None


class Scene:
    """A SymPy object or a Mechanism, with what is asked of it."""

    def __init__(self, thing: Any, asked: Asked) -> None:
        self.asked = asked
        self._mechanism = thing if isinstance(thing, Mechanism) else None
        self._source = None if self._mechanism else read(thing)
        self._walk = walk(self._source) if self._source else None
        if self._mechanism:
            _refuse_settings(asked.settings)

    @property
    def digest(self) -> str | None:
        """Names everything that decides the derivation; None where only deriving tells."""
        if self._walk is None or self._source is None:
            return None
        text = Walk(self._source.frame)
        text.lines.append(self._walk.digest())
        _say_asked(text, self.asked)
        return text.digest()

    def described(self) -> tuple[Mechanism, Wishes]:
        """The mechanism and what is wished of it."""
        mechanism = self._mechanism
        if mechanism is None:
            assert self._source is not None
            mechanism = convert(self._source, self.asked.settings, self._walk)
        return mechanism, _wishes(mechanism, self.asked, of_object=self._source is not None)


def compilable(thing: object) -> bool:
    """Whether it is a mechanism or an object of SymPy's that can be read as one."""
    return isinstance(thing, Mechanism) or readable(thing)


def _refuse_settings(settings: Settings) -> None:
    if settings != Settings():
        given = next(k for k, v in vars(settings).items() if v != getattr(Settings(), k))
        raise MechanismError(
            f"{given} is for objects of SymPy's; a Mechanism says it itself, in its description"
        )


def _wishes(mechanism: Mechanism, asked: Asked, *, of_object: bool) -> Wishes:
    symbols = [p.symbol for p in mechanism.parameters]
    fixed: dict[Symbol, Expr] = {}
    for key, value in asked.fix.items():
        symbol = find_symbol(key, symbols, "fix", "parameter")
        exact = number(value)
        if exact is None or not exact.is_number:
            raise MechanismError(f"fix: {symbol} must be a number, not {value!r}")
        fixed[symbol] = exact
    if asked.outputs is None:
        chosen = ("energy",) if of_object else OPTIONAL
        return Wishes(frozenset(chosen), fixed)
    names, expressions = _outputs(asked.outputs)
    if of_object and {"momenta", "points"} & set(names):
        _refuse_unplaced(mechanism)
    return Wishes(frozenset(names), fixed, expressions)


def _refuse_unplaced(mechanism: Mechanism) -> None:
    linked = {id(point) for point in reachable([mechanism.origin])}
    for body in mechanism.bodies:
        if id(body.masscenter) not in linked:
            raise MechanismError(
                f"outputs: points and momenta need positions, and that of {body.name} from a "
                "point at rest in the inertial frame is not known; say where its mass centre is "
                "with set_pos or locatenew, from a point with set_vel(frame, 0)"
            )
    if not mechanism.bodies:
        raise MechanismError("outputs: points and momenta need bodies; a Lagrangian has none")


def _outputs(asked: Iterable[Any]) -> tuple[list[str], dict[str, Expr]]:
    names: list[str] = []
    expressions: dict[str, Expr] = {}
    for item in asked:
        if isinstance(item, Mapping):
            expressions.update({str(name): sympify(value) for name, value in item.items()})
        elif item in OPTIONAL:
            names.append(item)
        else:
            raise MechanismError(
                f"outputs: {item!r} is not one of {', '.join(OPTIONAL)}; an expression of your "
                "own is asked for as {name: expression}"
            )
    return names, expressions


def _say_asked(text: Walk, asked: Asked) -> None:
    """Write down what is asked, in an order of its own."""
    settings = asked.settings
    text.say("name", [repr(settings.name)])
    for label, pairs in (
        ("fix", asked.fix),
        ("defaults", settings.defaults),
        ("units", settings.units),
        ("inputs", settings.inputs),
    ):
        said = [f"{_text(text, key)}={_text(text, value)}" for key, value in pairs.items()]
        text.say(label, sorted(said))
    extra = settings.configuration_constraints
    text.say("added", ["None"] if extra is None else [_text(text, sympify(e)) for e in extra])
    outputs = [repr(o) if not isinstance(o, Mapping) else "" for o in asked.outputs or ()]
    text.say("outputs", [str(asked.outputs is None), *outputs])
    for item in asked.outputs or ():
        if isinstance(item, Mapping):
            text.say("own", [f"{n!r}={_text(text, sympify(e))}" for n, e in item.items()])


def _text(text: Walk, value: Any) -> str:
    return text.expression(value) if isinstance(value, Expr) else repr(value)
