"""The face of every answer: values by name, the motion, words, a table, a file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from mechc.errors import ValueOutOfBoundsError
from mechc.files import path_of, write_text
from mechc.results.summary import html_table
from mechc.system.parameters import Array
from mechc.system.quantity import shown_in


class Answer:
    """Fits, optimal motions, cycles and designs.

    Attributes
    ----------
    model
        The :class:`mechc.Model` that was asked.
    values
        Name -> what was found, in SI units.
    params, y0
        Parameters by name and the start (nq + nu,), as ``simulate`` takes them.
    converged, message
        Whether the search ended at a solution, and how it ended.
    """

    model: Any
    converged: bool
    message: str

    @property
    def values(self) -> dict[str, float]:
        raise NotImplementedError

    @property
    def params(self) -> dict[str, Any]:
        raise NotImplementedError

    @property
    def y0(self) -> Array:
        raise NotImplementedError

    @property
    def run(self) -> dict[str, Any]:
        """Keywords of ``simulate`` with which the question was asked, and its ``t_span``."""
        raise NotImplementedError

    def to_json(self) -> Mapping[str, Any]:
        """Numbers and words as JSON data; a number that is not finite is null."""
        raise NotImplementedError

    @property
    def status(self) -> str:
        """``"converged"``, or how the search ended."""
        return "converged" if self.converged else self.message

    def __getitem__(self, name: str) -> float:
        """A value by name."""
        return self.values[name]

    def simulate(self, t_span: Any = None, **options: Any) -> Any:
        """The motion with what was found, by default over the time of the question.

        ``options``: keywords of :meth:`mechc.Model.simulate`, in place of those of the question.
        """
        asked = {**self.run, **options}
        span = asked.pop("t_span") if t_span is None else t_span
        asked.pop("t_span", None)
        if span is None:
            raise ValueOutOfBoundsError("this answer has no time of its own: give t_span, in s")
        return self.model.simulate(span, self.y0, self.params, **asked)

    def save(self, path: str | Path) -> Path:
        """Write numbers and words as JSON, with the mechanism's name and all its parameters."""
        return write_json(path, saved_data(self))

    def _repr_html_(self) -> str:
        """A table for a notebook, with the report's other lines around it."""
        first, *lines = str(self).splitlines()
        rows = [(name, f"{value:.9g}", unit) for name, value, unit in shown_values(self)]
        named = {name for name, _, _ in rows}
        rest = "\n".join(line for line in lines if line and line.split()[0] not in named)
        table = html_table(("name", "value", "unit"), rows)
        return f"<b>{escape(first)}</b>{table}<pre>{escape(rest)}</pre>"


def saved_data(answer: Answer) -> dict[str, Any]:
    """The data of an answer's file: the mechanism's name, all parameters, numbers and words."""
    p = answer.model.system.parameter_set.resolve(answer.params)
    every = dict(zip(answer.model.parameters, p.tolist(), strict=True))
    return {"mechanism": answer.model.name, "params": finite(every), **answer.to_json()}


def write_json(path: str | Path, data: Mapping[str, Any]) -> Path:
    """Write JSON data, and return the path."""
    text = json.dumps(data, indent=1, allow_nan=False)
    write_text(path_of(path), text + "\n")
    return path_of(path)


def shown_quantity(model: Any, name: str) -> tuple[str, float]:
    """The unit in which a named quantity is shown, and the factor that values have for it."""
    quantity = model.quantities.get(name)
    if quantity is None:
        return ("s" if name in ("duration", "period") else ""), 1.0
    return shown_in(quantity.kind, quantity.unit)


def shown_values(answer: Answer) -> list[tuple[str, float, str]]:
    """Name, value and unit of what was found, as it is shown; starts of several motions too."""
    found = []
    for name, value in answer.values.items():
        unit, factor = shown_quantity(answer.model, name.partition("[")[0])
        found.append((name, factor * value, unit))
    return found


def value_lines(
    answer: Answer, notes: Mapping[str, str], form: str = "14.9g", least: int = 12
) -> list[str]:
    """A line for each value, with a note where there is one; the least width of names."""
    every = shown_values(answer)
    width = max(least, *(len(name) for name, _, _ in every)) if every else least
    return [
        f"  {name:{width}} {value:{form}} {unit}{notes.get(name, '')}".rstrip()
        for name, value, unit in every
    ]


def finite(value: Any) -> Any:
    """A number, or None for one that JSON has not; likewise within mappings and sequences."""
    if isinstance(value, Mapping):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(each) for each in value]
    if value is None or isinstance(value, (bool, int, str)):
        return value
    return float(value) if math.isfinite(value) else None
