"""Pieces of HTML: whatever is not :class:`Markup` is escaped; and figures in words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

NONE = "–"


class Markup(str):
    """Text that is HTML already."""


def html(value: Any) -> str:
    """The HTML of a value: Markup as it is, anything else escaped."""
    return value if isinstance(value, Markup) else escape(str(value))


def element(name: str, *content: Any, **attributes: Any) -> Markup:
    """``<name ...>content</name>``; ``class_`` stands for class, None leaves an attribute out."""
    given = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Markup(f"<{name}{given}>{''.join(map(html, content))}</{name}>")


def table(heads: Sequence[Any], rows: Iterable[Sequence[Any]], **attributes: Any) -> Markup:
    """A table in a box that scrolls by itself; a cell may be a whole ``td`` or ``th``."""
    head = element("tr", *(_cell(text, "th") for text in heads))
    body = [element("tr", *(_cell(value, "td") for value in row)) for row in rows]
    whole = element("table", element("thead", head), element("tbody", *body), **attributes)
    return element("div", whole, class_="scroll")


def _cell(value: Any, name: str) -> Markup:
    if isinstance(value, Markup) and value.startswith(("<td", "<th")):
        return value
    return element(name, value)


def details(title: Any, *content: Any) -> Markup:
    """Something that is unfolded on request."""
    return element("details", element("summary", title), *content)


def seconds(value: float | None) -> str:
    """A time with the unit that suits it."""
    if value is None:
        return NONE
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


def times(ratio: float | None) -> str:
    """A ratio as it is said, 3.2×; near one with more digits, so that 1 is one."""
    if ratio is None:
        return NONE
    return f"{ratio:,.0f}×" if ratio >= 10 else f"{ratio:.2g}×" if ratio > 2 else f"{ratio:.3g}×"


def figure(value: Any) -> str:
    """Any value of the JSON in a few characters."""
    if value is None:
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:,.0f}" if value.is_integer() and abs(value) < 1e9 else f"{value:.4g}"
    return str(value)


def quantity(value: Any, unit: str | None) -> str:
    """A value with its unit; seconds and bytes with the multiple that suits them."""
    if value is None or isinstance(value, str):
        return value or NONE
    if unit in ("s", "us"):
        return seconds(value * (1e-6 if unit == "us" else 1.0))
    if unit == "bytes" and value >= 1024:
        return f"{value / 2**20:.3g} MiB" if value >= 2**20 else f"{value / 2**10:.3g} KiB"
    return f"{figure(value)} {unit or ''}".rstrip()


def power(value: float) -> Markup:
    """A power of ten as it is written by hand."""
    exponent = f"{value:e}".split("e")[1]
    return Markup(f"10<sup>{'−' if exponent[0] == '-' else ''}{int(exponent[1:])}</sup>")
