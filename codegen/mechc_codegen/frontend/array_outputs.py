"""User-defined outputs that are vectors, matrices and lists -> named scalars and their shapes.

An element is a separate output: ``tip[0]``, ``inertia[1,2]``, row after row.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import product
from typing import Any

from sympy import Expr, MatrixBase, NDimArray
from sympy.physics.mechanics import ReferenceFrame
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.description.terms import as_expression, printed_name
from mechc_codegen.errors import MechanismError

Shape = tuple[int, ...]


def scalar_outputs(
    outputs: Iterable[Any], frame: ReferenceFrame
) -> tuple[tuple[Any, ...], dict[str, Shape]]:
    """The outputs with every element separately, and the shape of each that has several.

    Vectors become their components in ``frame`` (3,), dyadics (3, 3), matrices keep their rows and
    columns, lists and tuples of any of these have one axis more.  What stands in a dict within is
    called ``group.name``.

    Raises
    ------
    MechanismError
        For rows of different lengths, and for anything but an expression.
    """
    shapes: dict[str, Shape] = {}
    scalars: list[Any] = []
    for item in outputs:
        if not isinstance(item, Mapping):
            scalars.append(item)
            continue
        elements: dict[Any, Expr] = {}
        for name, value in _by_names(item):
            shape, flat = _elements(value, f"outputs: {name!r}", frame)
            if shape:
                shapes[name] = shape
            # name[0,0], name[0,1], ...: row after row
            indices = product(*map(range, shape))
            names = [f"{name}[{','.join(map(str, k))}]" for k in indices] if shape else [name]
            for element, expression in zip(names, flat, strict=True):
                if element in elements:
                    raise MechanismError(
                        f"outputs: {element!r} is the name of another output; choose another"
                    )
                elements[element] = expression
        scalars.append(elements)
    return tuple(scalars), shapes


def _by_names(outputs: Mapping[Any, Any]) -> Iterator[tuple[Any, Any]]:
    """Name and value; those of a dict within are called ``group.name``."""
    for key, value in outputs.items():
        name = printed_name(key) if isinstance(key, Expr) else key
        if isinstance(value, Mapping):
            yield from ((f"{name}.{inner}", each) for inner, each in _by_names(value))
        else:
            yield name, value


def _elements(value: Any, place: str, frame: ReferenceFrame) -> tuple[Shape, list[Expr]]:
    """Shape, () for a scalar, and elements row after row."""
    if isinstance(value, Vector):
        return (3,), list(value.to_matrix(frame))
    if isinstance(value, Dyadic):
        value = value.to_matrix(frame)
    if isinstance(value, (MatrixBase, NDimArray)):
        return tuple(value.shape), list(value.flat() if isinstance(value, MatrixBase) else value)
    if not isinstance(value, (list, tuple)):
        return (), [as_expression(value, place)]
    parts = [_elements(part, place, frame) for part in value]
    shapes = {shape for shape, _ in parts}
    if len(shapes) != 1:
        raise MechanismError(f"{place}: a list needs parts of one shape, and at least one")
    return (len(parts), *shapes.pop()), [element for _, flat in parts for element in flat]
