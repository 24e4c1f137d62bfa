"""The functions of a scene without C: one text, over floats for one state, over arrays for many.

The text is executed.  It comes from the compiler package in this process, which puts no text of a
user into it; it is never read from a file or a cache.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from types import CodeType
from typing import Any

import numpy as np

from mechc.system.parameters import Array
from mechc.system.tables import Pieces

Filled = list[Array]
ARRAYS: dict[str, Any] = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "asin": np.arcsin, "acos": np.arccos,
    "atan": np.arctan, "atan2": np.arctan2, "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh,
    "exp": np.exp, "log": np.log, "sqrt": np.sqrt, "pow": np.power, "fabs": np.fabs, "nan": np.nan,
    "floor": np.floor,
}  # fmt: skip
FLOATS = {name: getattr(math, name) for name in ARRAYS}
ARRAYS["table"] = FLOATS["table"] = lambda orders, *data: partial(Pieces(*data), orders)
ARRAYS |= {
    "Step": lambda x: np.where(x > 0.0, 1.0, 0.0),
    "Where": lambda chosen, one, other: np.where(chosen != 0.0, one, other),
}
FLOATS |= {
    "Step": lambda x: 1.0 if x > 0.0 else 0.0,
    "Where": lambda chosen, one, other: one if chosen != 0.0 else other,
}


class NoInputs:
    """Values of inputs that were not given: NaN, as in C."""

    def __getitem__(self, place: int) -> float:
        return math.nan


class InputValues:
    """The values of a scene's inputs at one state or many, each evaluated when it is first read."""

    def __init__(self, inputs: Any, t: Array, q: Array, u: Array) -> None:
        self._inputs, self._at = inputs, tuple(map(np.ascontiguousarray, (t, q, u)))
        self._known: dict[int, Any] = {}

    def __getitem__(self, place: int) -> Any:
        if place not in self._known:
            values = self._inputs.values(place, *self._at)
            self._known[place] = values.item() if len(values) == 1 else values
        return self._known[place]


class Functions:
    """The functions that a text defines, each called with columns of states and lists to fill."""

    def __init__(self, text: str) -> None:
        code = compile(text, "<mechc scene>", "exec")
        self._floats, self._arrays = _defined(code, FLOATS), _defined(code, ARRAYS)

    def fill(
        self, name: str, lengths: Sequence[int], t: Array, *rows: Array, inputs: Any = None
    ) -> Filled:
        """The results of a function: arrays (n, length), one for each of the lengths.

        Times (n,) or (1,), and rows (n, width) or (1, width) of each further argument.  Undefined
        values (a root of -1) are NaN, as in C.
        """
        count = max(len(t), *map(len, rows))
        w = NoInputs() if inputs is None else InputValues(inputs, t, *rows[:2])
        if count == 1:
            try:
                return self._of_one(name, lengths, t, w, rows)
            except (ArithmeticError, ValueError):
                pass  # floats raise where arrays give NaN or infinity
        columns = [list(np.ascontiguousarray(each.T)) for each in rows]
        targets = [[0.0] * length for length in lengths]
        with np.errstate(all="ignore"):
            self._arrays[name](t, w, *columns, *targets)
        return [_stacked(target, count) for target in targets]

    def _of_one(
        self, name: str, lengths: Sequence[int], t: Array, w: Any, rows: Sequence[Array]
    ) -> Filled:
        targets = [[0.0] * length for length in lengths]
        self._floats[name](t.item(), w, *(each[0].tolist() for each in rows), *targets)
        return [np.array([target]) for target in targets]

    def constants(self, count: int, p: Array) -> Array:
        """The values that depend on parameters only, for every row of them: (rows, count)."""
        targets = [0.0] * count
        with np.errstate(all="ignore"):
            self._arrays["hoist"](list(np.ascontiguousarray(p.T)), targets)
        return _stacked(targets, len(p))

    def complete(self, given: Any, rows: Array) -> None:
        """Fill the parameters (n, np) that are not given, in place."""
        columns = list(rows.T.copy())
        with np.errstate(all="ignore"):
            self._arrays["complete"](given.tolist(), columns)
        for i, column in enumerate(columns):
            rows[:, i] = column


def _defined(code: CodeType, functions: dict[str, Any]) -> dict[str, Callable[..., None]]:
    names: dict[str, Any] = {"__builtins__": {}, **functions}
    exec(code, names)
    return names


def _stacked(columns: Sequence[Any], count: int) -> Array:
    out = np.empty((count, len(columns)))
    for i, column in enumerate(columns):
        out[:, i] = column
    return out
