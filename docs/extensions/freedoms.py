"""Pictures of what joints leave free, for the page on joints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

AXES = {"x": (-0.6, -0.45), "y": (1.0, 0.0), "z": (0.0, 1.0)}  # on the paper
GREY, BLUE, ORANGE = "#9ca3af", "#0072b2", "#d55e00"


def picture(joints: Mapping[str, tuple[str, str]], columns: int = 3) -> Figure:
    """One field for each joint: the axes along which and about which the child may move.

    Blue arrows along an axis are displacements, orange ones around it rotations, both positive;
    grey axes are those of the parent, along and about which nothing moves.
    """
    rows = -(-len(joints) // columns)
    figure = Figure(figsize=(2.3 * columns, 2.1 * rows), layout="constrained")
    fields = figure.subplots(rows, columns).ravel()
    for field in fields:
        field.set_axis_off()
        field.set(xlim=(-1.3, 1.5), ylim=(-1.2, 1.5), aspect="equal")
    for field, (name, (along, about)) in zip(fields, joints.items(), strict=False):
        field.set_title(name, fontsize=10)
        for axis, end in AXES.items():
            arrow = {"arrowstyle": "-|>", "lw": 1.8, "color": BLUE if axis in along else GREY}
            field.annotate("", end, (0, 0), arrowprops=arrow)
            field.text(*np.multiply(end, 1.22), axis, ha="center", va="center", fontsize=9)
            if axis in about:
                _turn(field, axis)
        field.plot(0, 0, "o", color="#1c2430", markersize=5)
    return figure


def _turn(field: Axes, axis: str) -> None:
    """An arrow around an axis, by the right hand."""
    order = "xyzxy"
    first, second = (np.array(AXES[order[order.index(axis) + k]]) for k in (1, 2))
    angle = np.radians(np.linspace(-60, 210, 60))[:, None]
    circle = 0.62 * np.array(AXES[axis]) + 0.24 * (np.cos(angle) * first + np.sin(angle) * second)
    field.plot(*circle.T, color=ORANGE, lw=1.6)
    arrow = {"arrowstyle": "-|>", "lw": 1.6, "color": ORANGE}
    field.annotate("", circle[-1], circle[-4], arrowprops=arrow)
