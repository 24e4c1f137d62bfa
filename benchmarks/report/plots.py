"""Log-log plots as SVG that takes its colours from the page's style sheet.

A point tells what it is when the pointer rests on it; a crossed hollow point is a wrong result.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from .html import Markup, element

WIDTH, HEIGHT = 720, 420
LEFT, RIGHT, TOP, BOTTOM = 62, 12, 12, 44
SIZE = 4.2  # half of a marker
SHAPES = ("circle", "square", "diamond", "up", "down", "pentagon", "plus", "star", "hexagon")
COLOURS = 16  # in the style sheet
DASHES = ("", "6 3", "2 3", "8 3 2 3")


@dataclass(frozen=True)
class Point:
    """Where, what the pointer is told, and whether the result is wrong."""

    x: float
    y: float
    title: str
    wrong: bool = False


@dataclass(frozen=True)
class Curve:
    """Points of one colour and one shape, joined by a line in their order.

    ``envelope`` are further points, joined by a broad line and not marked.
    """

    colour: int
    shape: int
    points: Sequence[Point]
    strong: bool = False
    dash: int = 0
    envelope: Sequence[tuple[float, float]] = ()


@dataclass(frozen=True)
class Axis:
    """A logarithmic axis; ``falling`` has the large values first."""

    label: str
    values: Sequence[float] = field(repr=False)
    falling: bool = False

    def limits(self) -> tuple[float, float]:
        """Decimal logarithms of its ends, with some room."""
        logs = [math.log10(value) for value in self.values]
        low, high = min(logs), max(logs)
        room = max(0.04 * (high - low), 0.1)
        return low - room, high + room

    def place(self, value: float, start: float, end: float) -> float:
        low, high = self.limits()
        part = (math.log10(value) - low) / (high - low)
        return start + (1 - part if self.falling else part) * (end - start)

    def ticks(self) -> list[tuple[float, bool]]:
        """Values at which lines are drawn, and whether they are labelled."""
        low, high = self.limits()
        decades = range(math.ceil(low), math.floor(high) + 1)
        if len(decades) >= 3:
            every = math.ceil(len(decades) / 9)
            return [(10.0**k, k % every == 0) for k in decades]
        several = [m * 10.0**k for k in range(math.floor(low), math.ceil(high)) for m in (1, 2, 5)]
        return [(value, True) for value in several if low <= math.log10(value) <= high]


def log_plot(curves: Sequence[Curve], x: str, y: str, *, falling: bool = False) -> Markup:
    """The curves over two logarithmic axes; points that are not positive are left out."""
    points = [p for curve in curves for p in curve.points if p.x > 0 and p.y > 0]
    if not points:
        return element("p", "Nothing to draw.", class_="quiet")
    across = Axis(x, [p.x for p in points], falling)
    upward = Axis(y, [p.y for p in points])
    drawn = [_curve(curve, across, upward) for curve in sorted(curves, key=lambda c: c.strong)]
    return element(
        "svg", _grid(across, upward), *drawn, class_="plot",
        viewBox=f"0 0 {WIDTH} {HEIGHT}", role="img", aria_label=f"{y} over {x}",
    )  # fmt: skip


def _grid(across: Axis, upward: Axis) -> Markup:
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    parts = []
    for value, told in across.ticks():
        at = across.place(value, LEFT, right)
        parts.append(_line((at, TOP), (at, bottom)))
        if told:
            parts.append(_number(value, at, bottom + 17, "middle"))
    for value, told in upward.ticks():
        at = upward.place(value, bottom, TOP)
        parts.append(_line((LEFT, at), (right, at)))
        if told:
            parts.append(_number(value, LEFT - 7, at + 4, "end"))
    parts.append(_text(across.label, (LEFT + right) / 2, HEIGHT - 6, "middle"))
    turned = _text(upward.label, 0, 0, "middle")
    move = f"translate(13 {(TOP + bottom) / 2:.0f}) rotate(-90)"
    return element("g", *parts, element("g", turned, transform=move), class_="grid")


def _line(start: tuple[float, float], end: tuple[float, float]) -> Markup:
    (x1, y1), (x2, y2) = start, end
    return element("line", x1=f"{x1:.1f}", y1=f"{y1:.1f}", x2=f"{x2:.1f}", y2=f"{y2:.1f}")


def _text(text: str, x: float, y: float, anchor: str) -> Markup:
    return element("text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)


def _number(value: float, x: float, y: float, anchor: str) -> Markup:
    """A power of ten with its exponent raised, where it is one; else the number."""
    exponent = math.log10(value)
    whole = round(exponent)
    if abs(exponent - whole) > 1e-9 or -2 < whole < 3:
        return _text(f"{value:g}", x, y, anchor)
    raised = element("tspan", str(whole).replace("-", "−"), dy="-5", font_size="9")
    return element("text", "10", raised, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)


def _curve(curve: Curve, across: Axis, upward: Axis) -> Markup:
    def placed(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
        low, high = (10.0**end for end in across.limits())
        return [
            (across.place(min(max(x, low), high), LEFT, WIDTH - RIGHT),
             upward.place(y, HEIGHT - BOTTOM, TOP))
            for x, y in points if x > 0 and y > 0
        ]  # fmt: skip

    kept = [p for p in curve.points if p.x > 0 and p.y > 0]
    places = placed((p.x, p.y) for p in kept)
    joined = [place for place, p in zip(places, kept, strict=True) if not p.wrong]
    parts = [_path(placed(curve.envelope), "envelope")] if curve.envelope else []
    parts.append(_path(joined, "joined", DASHES[curve.dash % len(DASHES)]))
    for place, point in zip(places, kept, strict=True):
        mark = wrong_mark(*place) if point.wrong else marker(curve.shape, *place)
        parts.append(element("g", element("title", point.title), mark))
    strong = " strong" if curve.strong else ""
    return element("g", *parts, class_=f"tool c{curve.colour % COLOURS}{strong}",
                   data_tool=curve.colour)  # fmt: skip


def _path(places: Sequence[tuple[float, float]], class_: str, dash: str = "") -> Markup:
    if len(places) < 2:
        return Markup()
    joined = "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
    return element("path", d=f"M{joined}", class_=class_, stroke_dasharray=dash or None)


def marker(shape: int, x: float, y: float, size: float = SIZE) -> Markup:
    """The marker of a method."""
    name = SHAPES[shape % len(SHAPES)]
    if name == "circle":
        return element("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=f"{size:.1f}", class_="mark")
    corners = " ".join(f"{x + size * a:.1f},{y + size * b:.1f}" for a, b in _corners(name))
    return element("polygon", points=corners, class_="mark")


def _corners(name: str) -> list[tuple[float, float]]:
    """Of a shape whose circle has about the radius one."""
    if name == "square":
        return [(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]
    if name == "plus":
        a, b = 0.42, 1.15
        return [(-a, -b), (a, -b), (a, -a), (b, -a), (b, a), (a, a),
                (a, b), (-a, b), (-a, a), (-b, a), (-b, -a), (-a, -a)]  # fmt: skip
    count, turn = {"diamond": (4, 0), "up": (3, 0), "down": (3, 1), "pentagon": (5, 0),
                   "hexagon": (6, 1), "star": (10, 0)}[name]  # fmt: skip
    angles = [2 * math.pi * k / count + turn * math.pi / count - math.pi / 2 for k in range(count)]
    sizes = [0.5 if name == "star" and k % 2 else 1.25 for k in range(count)]
    return [(r * math.cos(a), r * math.sin(a)) for r, a in zip(sizes, angles, strict=True)]


def wrong_mark(x: float, y: float) -> Markup:
    """Hollow and crossed: another motion than the exact one."""
    s = SIZE + 1
    cross = f"M{x - s:.1f} {y - s:.1f}L{x + s:.1f} {y + s:.1f}M{x - s:.1f} {y + s:.1f}L{x + s:.1f} {y - s:.1f}"  # noqa: E501
    circle = element("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=f"{SIZE:.1f}", class_="hollow")
    return element("g", circle, element("path", d=cross, class_="hollow"))


def key(shape: int | None, colour: int, dash: int = 0) -> Markup:
    """The small picture beside a name in a legend; a line where there is no shape."""
    line = element("line", x1="0", y1="7", x2="22", y2="7", class_="joined",
                   stroke_dasharray=DASHES[dash % len(DASHES)] or None)  # fmt: skip
    mark = Markup() if shape is None else marker(shape, 11, 7)
    return element("svg", line, mark, class_=f"key c{colour % COLOURS}", viewBox="0 0 22 14",
                   aria_hidden="true")  # fmt: skip
