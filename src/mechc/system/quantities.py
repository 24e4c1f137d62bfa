"""One number of a model that a text names: ``theta_0``, ``energy``, ``points[C,x]``.

The grammar, wherever a quantity is named::

    quantity  = name [ "[" index { "," index } "]" ]

A name is a coordinate, a speed, ``energy``, or an output.  An index counts from 0, or is the name
of what it counts: a body, a point, a joint, a constraint, a speed, or x, y, z.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError, brief
from mechc.system.names import name_of
from mechc.system.parameters import Array
from mechc.system.quantity import SUMS, Kind, NamedQuantity
from mechc.system.system import System

NAME = re.compile(r"[^\W\d]\w*")
ELEMENT = re.compile(r"(?<!\w)([^\W\d]\w*+)\s*+\[([^\[\]]*+)\]")
_SINGULAR = {"bodies": "body", "xyz": "axis"}  # of the words for what an index counts


@dataclass(frozen=True)
class Quantity:
    """One number of a model, which varies along a motion.

    Attributes
    ----------
    name
        As it is written: ``theta_0``, ``points[2,0]``.
    output, index
        A coordinate, a speed, the energy or an output, and which number of it.
    entry
        The place of that number in the output, in C order; of a coordinate or speed that in the
        state.
    of_state
        Whether it is a coordinate or a speed.
    meaning
        Its unit and kind; no bounds.
    """

    name: str
    output: str
    index: tuple[int, ...]
    entry: int
    of_state: bool
    meaning: NamedQuantity

    @property
    def unit(self) -> str:
        return self.meaning.unit

    @property
    def kind(self) -> Kind:
        return self.meaning.kind

    @property
    def parts(self) -> tuple[str, ...]:
        """The outputs of which this number is the sum."""
        return SUMS.get(self.output, (self.output,))

    def rows(self, system: System) -> list[int]:
        """The rows of the outputs' Jacobians whose sum is its derivative."""
        return [system.derivative_rows[part][0][self.entry] for part in self.parts]

    def values(self, system: System, y: Array, p: Array, t: Any) -> Array:
        """Values (...) on states (..., nq + nu)."""
        return values_of([self], system, y, p, t)[..., 0]


def read_quantity(system: System, given: Any, *, differentiable: bool = False) -> Quantity:
    """The quantity that a text or symbol names; ``differentiable``: one that has derivatives.

    The system has the outputs: see :func:`outputs_in`.

    Raises :class:`UnknownNameError` for a name that the model does not have,
    :class:`ValueOutOfBoundsError` for a text that is none, and for an index that there is not.
    """
    text = given if isinstance(given, str) else name_of(given)
    match = ELEMENT.fullmatch(text.strip()) if isinstance(text, str) else None
    name = match[1] if match else text.strip() if isinstance(text, str) else ""
    if not NAME.fullmatch(name):
        raise ValueOutOfBoundsError(
            f"{brief(text)} is not a quantity: write theta_0, energy or points[2,0]"
        )
    shape = shape_of(system, name, differentiable=differentiable)
    index = index_of(system, name, shape, match[2]) if match else ()
    if len(index) != len(shape):
        raise ValueOutOfBoundsError(_no_number(name, shape))
    written = "".join(text.split())
    of_state = name in (*system.coordinates, *system.speeds)
    kind = Kind.LENGTH if name == "points" else Kind.OTHER
    free, unit = (-math.inf, math.inf, False), "J" if "energy" in name else ""
    unit = system.data.get("output_units", {}).get(name, unit)
    meaning = NamedQuantity(written, unit, name, *free, kind)
    if of_state:
        known = system.quantities[name]
        meaning = NamedQuantity(written, known.unit, name, *free, known.kind)
    flat = int(np.ravel_multi_index(index, shape)) if shape else 0
    entry = system.state_index(name) if of_state else flat
    return Quantity(written, name, index, entry, of_state, meaning)


def quantities_of(
    system: System, output: Any, *, differentiable: bool = False
) -> tuple[tuple[int, ...], list[Quantity]]:
    """The shape of an output, and a quantity for each of its numbers, in C order; of a quantity ().

    Raises as :func:`read_quantity`.
    """
    text = output if isinstance(output, str) else str(name_of(output))
    single = "[" in text or not NAME.fullmatch(text.strip())
    shape = () if single else shape_of(system, text.strip(), differentiable=differentiable)
    names = [f"{text}[{','.join(map(str, index))}]" for index in np.ndindex(shape)]
    names = names if shape else [text]
    return shape, [read_quantity(system, each, differentiable=differentiable) for each in names]


def shape_of(system: System, name: str, *, differentiable: bool = False) -> tuple[int, ...]:
    """The shape of a coordinate, a speed, the energy or an output; () of a number.

    Raises :class:`UnknownNameError`, :class:`UnavailableOutputError` if the system has none.
    """
    states, known = (*system.coordinates, *system.speeds), dict[str, tuple[int, ...]]()
    known |= {name: tuple(shape) for name, shape in system.array_outputs.items()}
    if differentiable:
        known |= {name: shape for name, (_, shape) in system.derivative_rows.items()}
    else:
        shapes = system.data["shapes"]
        known |= {n: tuple(shapes.get(n, [size])) for n, size in system.scene.outputs.items()}
    known |= dict.fromkeys(states, ()) | {
        whole: () for whole, parts in SUMS.items() if known.keys() >= {*parts}
    }
    if name not in known:
        for part in SUMS.get(name, (name,)):
            if part in system.data["unavailable"] and part not in known:
                system.refuse_output(part)
        raise UnknownNameError("quantity", name, (*states, *(n for n in known if n not in states)))
    return known[name]


def index_of(system: System, name: str, shape: Sequence[int], text: str) -> tuple[int, ...]:
    """The index of a number of an output of this shape, from numbers or names.

    Raises :class:`UnknownNameError` for a name that is not there, :class:`ValueOutOfBoundsError`
    for a number that is not, and where there are not as many as the shape has axes.
    """
    typed = text.rsplit(",", max(len(shape) - 1, 0))  # a constraint's name may contain commas
    axes = system.data.get("axes", {}).get(name, [""] * len(shape))
    if not shape or len(typed) != len(shape):
        raise ValueOutOfBoundsError(_no_number(name, shape))
    places = []
    for given, size, axis in zip(typed, shape, axes, strict=True):
        given = "".join(given.split())  # as reductions and quantities are kept
        names = [each for key in axis.split() for each in _counted(system, key)][:size]
        bare = ["".join(each.split()) for each in names]
        numbers = list(map(str, range(size)))
        if names and not given.isdecimal() and given not in ("", *bare):
            raise _unknown_index(name, axis, given, names)
        if given not in numbers and bare.count(given) != 1:
            raise ValueOutOfBoundsError(_no_number(name, shape))
        places.append(numbers.index(given) if given in numbers else bare.index(given))
    return tuple(places)


def _counted(system: System, key: str) -> list[str]:
    """The names that an index of this kind may be."""
    if key == "xyz":
        return list(key)
    return [one if isinstance(one, str) else one["name"] for one in system.data[key]]


def _unknown_index(name: str, axis: str, given: str, names: Sequence[str]) -> UnknownNameError:
    what = " or ".join(_SINGULAR.get(key, key.removesuffix("s")) for key in axis.split())
    return UnknownNameError.with_message(
        f"{name}: no {what} is called {given!r}; known are {', '.join(names)}"
    )


def output_of(system: System, name: Any, evaluate: Callable[[Any], Array]) -> Array:
    """``evaluate(name)`` of an output; of ``name[index]`` that number of it.

    Raises as :func:`read_quantity`, and as :meth:`System.with_output`.
    """
    match = ELEMENT.fullmatch(name.strip()) if isinstance(name, str) else None
    if match is None or name in system.scene.outputs:
        return evaluate(name)
    one = read_quantity(system.with_output(match[1]), name)
    found = evaluate(one.output)
    leading = found.shape[: found.ndim - len(one.index)]
    return np.ascontiguousarray(found.reshape(*leading, -1)[..., one.entry])


def _no_number(name: str, shape: Sequence[int]) -> str:
    if not shape:
        return f"{name} is one number: write {name} without an index"
    first, last = (",".join(map(str, ends)) for ends in ([0] * len(shape), [n - 1 for n in shape]))
    told = f"{name}[{first}]" if first == last else f"one of its numbers, from {name}[{first}] to "
    return f"{name} has the shape {shape}: write {told}" + f"{name}[{last}]" * (first != last)


def is_quantity(text: Any) -> bool:
    """Whether a text is of the grammar."""
    typed = text.strip() if isinstance(text, str) else ""
    return bool(NAME.fullmatch(typed) or ELEMENT.fullmatch(typed))


def outputs_in(given: Iterable[Any]) -> list[str]:
    """Every name in texts and symbols, for :meth:`System.with_output` and ``differentiable``."""
    texts = (one if isinstance(one, str) else name_of(one) for one in given)
    bare = [ELEMENT.sub(r"\1", text) for text in texts if isinstance(text, str)]
    return [name for text in bare for name in NAME.findall(text)]


def values_of(
    quantities: Sequence[Quantity], system: System, y: Array,
    p: Array, t: Any,
) -> Array:  # fmt: skip
    """Values (..., k) of quantities on states (..., nq + nu); every output is evaluated once."""
    leading = np.broadcast_shapes(y.shape[:-1], p.shape[:-1], np.shape(t))
    outputs = {}
    for output in dict.fromkeys(one.output for one in quantities if not one.of_state):
        found = system.evaluate(output, y, p, t)
        outputs[output] = found.reshape(*leading, math.prod(found.shape[len(leading) :]))
    columns = [(y if one.of_state else outputs[one.output])[..., one.entry] for one in quantities]
    shown = [np.broadcast_to(column, leading) for column in columns]
    return np.stack(shown, axis=-1) if shown else np.zeros((*leading, 0))


def slopes_of(
    quantities: Sequence[Quantity], by: str, system: System, y: Array,
    p: Array, t: Any,
) -> Array:  # fmt: skip
    """Derivatives (..., k, n) of differentiable quantities at states (..., nq + nu), ``by`` the
    ``"state"``, a ``"parameter"`` or the value of an ``"input"``."""
    widths = {"state": y.shape[-1], "parameter": p.shape[-1], "input": len(system.input_values)}
    leading = np.broadcast_shapes(y.shape[:-1], p.shape[:-1], np.shape(t))
    if all(one.of_state for one in quantities) or not widths[by]:
        found = np.zeros((*leading, len(quantities), widths[by]))
    else:
        found = rows_of(quantities, system, system.evaluate(f"own_{by}_jacobian", y, p, t))
    for k, one in enumerate(quantities):
        if one.of_state and by == "state":
            found[..., k, one.entry] = 1.0
    return found


def rows_of(quantities: Sequence[Quantity], system: System, own: Array) -> Array:
    """The rows (..., k, n) of quantities among those of all outputs; 0 of a state's components."""
    found = np.zeros((*own.shape[:-2], len(quantities), own.shape[-1]))
    for k, one in enumerate(quantities):
        if not one.of_state:
            found[..., k, :] = own[..., one.rows(system), :].sum(axis=-2)
    return found
