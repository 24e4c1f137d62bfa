"""What a user hands over and asks for -> a scene that can be named, and built when it is new.

The name (a digest) of a SymPy object is made from what was read of it, without deriving anything;
that is what makes a warm start quick.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeGuard

from sympy import Expr

from mechc_codegen.convert.fingerprint import Walk, walk
from mechc_codegen.description.source import Settings
from mechc_codegen.description.terms import as_expression
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.read import read, readable

if TYPE_CHECKING:
    from mechc_codegen.description.mechanism import Mechanism
    from mechc_codegen.description.request import Wishes


@dataclass(frozen=True, eq=False, repr=False)
class Asked:
    """Besides the settings: parameters to fix, and outputs (None: all there are)."""

    settings: Settings
    fix: Mapping[Any, Any] = field(default_factory=dict)
    outputs: tuple[Any, ...] | None = None


class Scene:
    """A SymPy object or a Mechanism, with what is asked of it."""

    def __init__(self, thing: Any, asked: Asked) -> None:
        self.asked = asked = _with_expressions(asked)
        self._mechanism = thing if _is_mechanism(thing) else None
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
        try:
            _say_asked(text, self.asked)
        except _UntoldError:
            return None
        return text.digest()

    def described(self) -> tuple[Mechanism, Wishes]:
        """The mechanism and what is wished of it."""
        from mechc_codegen.convert.convert import convert
        from mechc_codegen.frontend.read_request import wishes_of

        mechanism = self._mechanism
        if mechanism is None:
            assert self._source is not None
            mechanism = convert(self._source, self.asked.settings, self._walk)
        return mechanism, wishes_of(
            mechanism, self.asked.fix, self.asked.outputs, of_object=self._source is not None
        )


def compilable(thing: object) -> bool:
    """Whether it is a mechanism or an object of SymPy's that can be read as one."""
    return _is_mechanism(thing) or readable(thing)


def _is_mechanism(thing: object) -> TypeGuard[Mechanism]:
    """Nothing is one before its module is loaded, which takes longer than finding a scene."""
    module = sys.modules.get("mechc_codegen.description.mechanism")
    return module is not None and isinstance(thing, module.Mechanism)


def _refuse_settings(settings: Settings) -> None:
    if settings != Settings():
        given = next(k for k, v in vars(settings).items() if v != getattr(Settings(), k))
        raise MechanismError(
            f"{given} is for objects of SymPy's; a Mechanism says it itself, in its description"
        )


def _with_expressions(asked: Asked) -> Asked:
    """All that is to be an expression is one from here on, and none was made of a text."""
    settings, outputs = asked.settings, asked.outputs
    added = settings.configuration_constraints
    read = replace(
        settings,
        inputs={
            key: None if value is None else as_expression(value, f"inputs: {key}")
            for key, value in settings.inputs.items()
        },
        states={x: as_expression(rate, f"states: {x}") for x, rate in settings.states.items()},
        configuration_constraints=None
        if added is None
        else tuple(as_expression(each, "configuration_constraints") for each in added),
    )
    told = tuple(
        {name: as_expression(value, f"outputs: {name!r}") for name, value in item.items()}
        if isinstance(item, Mapping)
        else item
        for item in outputs or ()
    )
    return replace(asked, settings=read, outputs=None if outputs is None else told)


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
    rates = [f"{_text(text, x)}={_text(text, rate)}" for x, rate in settings.states.items()]
    text.say("states", rates)
    extra = settings.configuration_constraints
    text.say("added", ["None"] if extra is None else [_text(text, e) for e in extra])
    outputs = [repr(o) if not isinstance(o, Mapping) else "" for o in asked.outputs or ()]
    text.say("outputs", [str(asked.outputs is None), *outputs])
    for item in asked.outputs or ():
        if isinstance(item, Mapping):
            text.say("own", [f"{n!r}={_text(text, e)}" for n, e in item.items()])


class _UntoldError(Exception):
    """Something whose text does not say all that it is, as that of a long array."""


def _text(text: Walk, value: Any) -> str:
    if isinstance(value, Expr):
        return text.expression(value)
    if value is None or isinstance(value, (str, int, float)):  # numpy's numbers among them
        return repr(value)
    raise _UntoldError
