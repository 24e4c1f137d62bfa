"""A mechanism or SymPy object with compile options -> a request with a digest.

The digest of a SymPy object is computed from what was read of it, before anything is derived: a
binary in the cache is found by it without deriving again.
"""

from __future__ import annotations

import hashlib
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, TypeGuard

from sympy import Basic, Expr, Symbol, sympify
from sympy.physics.mechanics import (
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
)
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.convert.fingerprint import Fingerprint, fingerprint
from mechc_codegen.description.parsing.parser import parse_expression
from mechc_codegen.description.placement import reachable
from mechc_codegen.description.request import default_outputs
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.description.terms import as_expression, printed_name
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.array_outputs import Shape, scalar_outputs
from mechc_codegen.frontend.described import with_settings
from mechc_codegen.frontend.law_numbers import numbers_apart
from mechc_codegen.frontend.read import read, readable

if TYPE_CHECKING:
    from mechc_codegen.description.mechanism import Mechanism
    from mechc_codegen.description.request import OutputRequest

UNCOMPILED = ("notes", "limits", "links", "cut_reasons")  # what decides nothing that is compiled


@dataclass(frozen=True, eq=False, repr=False)
class CompileOptions:
    """Settings of the conversion, parameters to fix, and outputs (None: the default ones).

    ``form``: see :func:`mechc_codegen.frontend.read.read`.
    """

    settings: ConversionSettings
    fix: Mapping[Any, Any] = field(default_factory=dict)
    outputs: tuple[Any, ...] | None = None
    form: str | None = None


class CompileRequest:
    """A SymPy object or a Mechanism, with the options to compile it with.

    ``numbers``: default values of a Mechanism, which are not compiled in.
    """

    def __init__(self, thing: Any, options: CompileOptions) -> None:
        self.numbers: dict[Any, float] = {}
        self._mechanism = None
        self._source = None if _is_mechanism(thing) else read(thing, options.form)
        self._fingerprint = fingerprint(self._source) if self._source else None
        frame = thing.frame if self._source is None else self._source.frame
        symbols = _symbols_of(thing) if self._fingerprint is None else self._fingerprint.leaves
        self._names = _by_printed_name([*symbols, *options.settings.parameters])
        self.options, self._shapes = _with_expressions(options, frame, self._names)
        if self._source is None:
            if options.form is not None:
                raise MechanismError("form is an option for SymPy objects; a Mechanism needs none")
            given = with_settings(thing, self.options.settings)
            self.numbers, self._mechanism = _without_numbers(given)
            self.options = replace(self.options, settings=ConversionSettings())

    def including(self, outputs: Iterable[str]) -> CompileRequest:
        """This request with further outputs, by name."""
        own = self.options.outputs
        if own is None:
            bare = self._mechanism is None or not self._mechanism.bodies
            own = default_outputs(of_object=bare)
        more = copy(self)
        more.options = replace(self.options, outputs=(*own, *sorted(outputs)))
        return more

    def driven_by(self, laws: Mapping[str, str]) -> tuple[CompileRequest, dict[str, float]]:
        """This request with inputs that are these expressions, as texts, and their numbers,
        which are parameters by these names."""
        settings = self.options.settings
        inputs: dict[Any, Expr] = {}
        numbers: dict[Symbol, float] = {}
        for key, law in laws.items():
            read = _input(key, law, self._names)
            inputs[key], own = numbers_apart(read, printed_name(key), self._names)
            numbers |= own
        more = copy(self)
        if self._mechanism is None:
            settings = replace(settings, inputs={**settings.inputs, **inputs})
            more.options = replace(self.options, settings=settings)
        else:
            more._mechanism = with_settings(self._mechanism, ConversionSettings(inputs=inputs))
        return more, {symbol.name: value for symbol, value in numbers.items()}

    @property
    def digest(self) -> str | None:
        """Hash of everything that decides the derivation; None if it has no complete text."""
        try:
            if self._mechanism is not None:
                text = DescribedText(self._mechanism).fingerprint
            else:
                assert self._source is not None
                assert self._fingerprint is not None
                text = Fingerprint(self._source.frame)
                text.lines.append(self._fingerprint.digest())
            _write_options(text, self.options)
        except NotWritableError:
            return None
        return text.digest()

    @property
    def symbol_names(self) -> set[str]:
        """Names of all symbols and functions of time in the SymPy object."""
        leaves = self._fingerprint.leaves if self._fingerprint else ()
        return {printed_name(leaf) for leaf in leaves}

    @property
    def title(self) -> str:
        """The title for people: that of the mechanism, a name that was given, or its bodies."""
        if self._mechanism is not None:
            return self._mechanism.title
        assert self._source is not None
        return self.options.settings.name or self._source.title

    @property
    def looks(self) -> tuple[Any, ...]:
        """A value that determines the picture of its bodies."""
        described = self._mechanism or self._source
        assert described is not None
        muscles = () if self._source is None else self._source.muscles
        return *_looks_of((*described.bodies, *described.drawn)), muscles

    def description(self) -> tuple[Mechanism, OutputRequest]:
        """The mechanism, and the outputs and fixed parameters requested of it."""
        from mechc_codegen.convert.checks.gradients import check_gradients
        from mechc_codegen.convert.convert import convert
        from mechc_codegen.frontend.read_request import read_request

        mechanism, options = self._mechanism, self.options
        if mechanism is None:
            assert self._source is not None
            mechanism = convert(self._source, options.settings, self._fingerprint)
        else:
            check_gradients(mechanism)
        of_object = self._source is not None
        return mechanism, read_request(
            mechanism, options.fix, options.outputs, of_object=of_object, shapes=self._shapes
        )


def _looks_of(bodies: Sequence[RigidBody | Particle]) -> tuple[Any, ...]:
    """Names of the bodies, and every step between the points and frames around them.

    Two descriptions with the same equations share one compiled scene; they have one picture only if
    the points and frames around their bodies are the same too.
    """
    points = reachable([body.masscenter for body in bodies])
    ways = [way for point in points for way in point._pos_dict.values()]
    frames = reachable([frame for way in ways for _, frame in way.args], "_dcm_dict")

    def parts(way: Vector) -> tuple[Any, ...]:
        return tuple((frame.name, tuple(matrix)) for matrix, frame in way.args)

    return (
        tuple((body.name, body.masscenter.name) for body in bodies),
        tuple((p.name, tuple((o.name, parts(w)) for o, w in p._pos_dict.items())) for p in points),
        tuple((f.name, tuple((o.name, tuple(m)) for o, m in f._dcm_dict.items())) for f in frames),
    )


def compilable(thing: object) -> bool:
    """Whether an object is a Mechanism or a SymPy object that can be converted to one."""
    return _is_mechanism(thing) or readable(thing)


def _is_mechanism(thing: object) -> TypeGuard[Mechanism]:
    """Whether an object is a Mechanism, without importing its module, which takes long."""
    module = sys.modules.get("mechc_codegen.description.mechanism")
    return module is not None and isinstance(thing, module.Mechanism)


def _without_numbers(mechanism: Mechanism) -> tuple[dict[Any, float], Mechanism]:
    """Default values that are numbers, and the mechanism without them."""
    numbers: dict[Any, float] = {}
    for parameter in mechanism.parameters:
        value = None if parameter.default is None else sympify(parameter.default)
        if value is not None and value.is_number and value.is_finite and value.is_real:
            numbers[parameter.symbol] = float(value)
    parameters = tuple(
        replace(p, default=None, preset=True) if p.symbol in numbers else p
        for p in mechanism.parameters
    )
    left = copy(mechanism)  # it is valid: nothing else has to be checked again
    object.__setattr__(left, "parameters", parameters)
    return numbers, left


def with_numbers(mechanism: Mechanism, numbers: Mapping[str, float]) -> Mechanism:
    """The mechanism with default values that are numbers, by the names of parameters."""
    parameters = tuple(
        replace(p, default=numbers[name], given=p.default is None)
        if (name := printed_name(p.symbol)) in numbers
        else p
        for p in mechanism.parameters
    )
    more = copy(mechanism)  # it is valid: nothing else has to be checked again
    object.__setattr__(more, "parameters", parameters)
    return more


def _with_expressions(
    options: CompileOptions, frame: ReferenceFrame, names: Mapping[str, Expr]
) -> tuple[CompileOptions, dict[str, Shape]]:
    """The options with every expression as a scalar of SymPy, and the shapes of outputs.

    Texts are read where they are inputs, and refused elsewhere.
    """
    settings, outputs = options.settings, options.outputs
    added = settings.configuration_constraints
    read = replace(
        settings,
        inputs={
            key: None if value is None else _input(key, value, names)
            for key, value in settings.inputs.items()
        },
        states={x: as_expression(rate, f"states: {x}") for x, rate in settings.states.items()},
        configuration_constraints=None
        if added is None
        else tuple(as_expression(each, "configuration_constraints") for each in added),
    )
    if outputs is None:
        return replace(options, settings=read), {}
    scalars, shapes = scalar_outputs(outputs, frame)
    return replace(options, settings=read, outputs=scalars), shapes


def _symbols_of(mechanism: Mechanism) -> tuple[Expr, ...]:
    parameters = (parameter.symbol for parameter in mechanism.parameters)
    return *mechanism.q, *mechanism.x, *mechanism.u, *mechanism.inputs, *parameters


def _by_printed_name(symbols: Iterable[Any]) -> dict[str, Expr]:
    """The names that texts may contain: time, and symbols of which no two are printed alike."""
    named = {Symbol(each) if isinstance(each, str) else each for each in symbols}
    counts = Counter(map(printed_name, named))
    own = {printed_name(each): each for each in named if counts[printed_name(each)] == 1}
    return {"t": dynamicsymbols._t, **dict(sorted(own.items()))}


def _input(key: Any, value: Any, names: Mapping[str, Expr]) -> Expr:
    if isinstance(value, str):
        others = {name: symbol for name, symbol in names.items() if key not in (name, symbol)}
        return parse_expression(value, others)
    if callable(value) and not isinstance(value, Basic):
        raise MechanismError(
            f"inputs: {key}: a Python function is not compiled; leave it out here and give it with "
            f"each run: model.simulate(..., inputs={{{printed_name(key)!r}: f}})"
        )
    return as_expression(value, f"inputs: {key}")


def _write_options(text: Fingerprint, options: CompileOptions) -> None:
    """Write the options into the fingerprint, in a fixed order."""
    settings = options.settings
    text.write("name", [repr(settings.name)])
    for label, pairs in (
        ("fix", options.fix),
        ("defaults", settings.defaults),
        ("units", settings.units),
        ("inputs", settings.inputs),
    ):
        by_name = sorted(pairs.items(), key=lambda pair: str(pair[0]))  # as sets are not
        lines = [f"{plain_text(text, key)}={plain_text(text, value)}" for key, value in by_name]
        text.write(label, lines)
    rates = ((plain_text(text, x), plain_text(text, rate)) for x, rate in settings.states.items())
    text.write("states", [f"{x}={rate}" for x, rate in rates])
    extra = settings.configuration_constraints
    text.write("reactions", [plain_text(text, each) for each in settings.reactions])
    text.write("parameters", sorted(plain_text(text, each) for each in settings.parameters))
    text.write("added", ["None"] if extra is None else [plain_text(text, e) for e in extra])
    outputs = [repr(o) if not isinstance(o, Mapping) else "" for o in options.outputs or ()]
    text.write("outputs", [str(options.outputs is None), *outputs])
    for item in options.outputs or ():
        if isinstance(item, Mapping):
            text.write("own", [f"{n!r}={plain_text(text, e)}" for n, e in item.items()])


class NotWritableError(Exception):
    """An error for a value whose text does not determine it, such as a long array."""


class DescribedText:
    """The text of one description for a cache key: dataclasses, their fields, and what SymPy gives
    these, each of its objects once.

    A value whose text does not determine it is refused, so that two mechanisms with one text are
    one.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.fingerprint = Fingerprint(mechanism.frame)
        self._bodies: dict[int, int] = {}
        for body in mechanism.bodies:
            self._bodies[id(body)] = len(self._bodies)
            self.fingerprint.body(body)
        for each in fields(mechanism):
            if each.name not in (*UNCOMPILED, "bodies"):
                self.fingerprint.write(each.name, [self.of(getattr(mechanism, each.name))])

    def of(self, value: Any) -> str:
        """The text of a part.

        Raises
        ------
        NotWritableError
            For anything of which a mechanism does not consist.
        """
        if isinstance(value, (RigidBody, Particle)) and id(value) in self._bodies:
            return f"body {self._bodies[id(value)]}"
        if isinstance(value, Point):
            return self.fingerprint.point(value)
        if isinstance(value, ReferenceFrame):
            return self.fingerprint.frame(value)
        if isinstance(value, Vector):
            return self.fingerprint.vector(value)
        if isinstance(value, Dyadic):
            return self.fingerprint.dyadic(value)
        if isinstance(value, (tuple, list)):
            return f"({','.join(map(self.of, value))})"
        if isinstance(value, Mapping):
            return f"{{{','.join(f'{self.of(k)}:{self.of(x)}' for k, x in value.items())}}}"
        if is_dataclass(value) and not isinstance(value, type):
            parts = (self.of(getattr(value, each.name)) for each in fields(value))
            return f"{type(value).__name__}({','.join(parts)})"
        return plain_text(self.fingerprint, value)


def plain_text(fingerprint: Fingerprint, value: Any) -> str:
    """The text of an expression, of a text, of a number or of nothing."""
    if isinstance(value, Expr):
        return fingerprint.expression(value)
    if isinstance(value, Enum):
        return str(value)
    if isinstance(value, bytes):  # the triangles of a mesh
        return hashlib.sha256(value).hexdigest()
    if value is None or isinstance(value, (str, int, float)):  # numpy's numbers among them
        return repr(value)
    raise NotWritableError
