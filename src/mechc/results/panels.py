"""The panels of the pictures.

Input: a Run and the cell of a figure's grid to draw in.  Output: that cell, filled with axes.
Invariant: matplotlib is imported inside functions only; user text reaches it through `plain` and
`typeset`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from mechc.errors import MechcError
from mechc.results.curves import draw_curve, draw_curves, legend_layout
from mechc.results.mathtext import plain, typeset
from mechc.results.player.forces import LOAD, REACTION, forces_of, round_down
from mechc.results.sampling import (
    Guide,
    PlaneView,
    Run,
    ShownUnit,
    clean_text,
    energies,
    is_joint,
    plane_view,
    power_of_ten,
    shown_unit,
)
from mechc.system.parameters import Array
from mechc.system.picture import Strut

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.gridspec import SubplotSpec

# Okabe and Ito's palette, in an order in which neighbours differ in grey too.
COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#222222")
MOST_LEGEND_LINES: Final = 12
QUIET: Final = "#6b7280"
RESTING, ACTIVE = "#e8a49c", "#b3261e"  # muscles at the start and at the end
LONG: Final = 0.4  # of the motion's size: the longest arrow of a kind, at most
THIN, THICKER = 1.2, 4.0  # points: a muscle at rest, and how much thicker it becomes


# --- text, legends, colours ------------------------------------------------------------------


def _legend(axes: Axes, handles: Sequence[Any], names: Iterable[str], **where: Any) -> None:
    """A legend of texts for matplotlib: a leading underscore must not hide them."""
    place = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.02), **where}
    legend = axes.legend(handles, [str(i) for i in range(len(handles))], **place)
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_text(name)


def _single(area: SubplotSpec) -> Axes:
    axes: Axes = area.subgridspec(1, 1).subplots(squeeze=False)[0, 0]
    return axes


def _message(area: SubplotSpec, text: str) -> None:
    axes = _single(area)
    axes.set_axis_off()
    axes.text(
        0.5, 0.5, plain(text), ha="center", va="center", wrap=True, color=QUIET,
        transform=axes.transAxes,
    )  # fmt: skip


def _colours(count: int) -> list[Any]:
    """The palette, then an ordered ramp (both safe for the colour-blind)."""
    if count <= len(COLOURS):
        return list(COLOURS[:count])
    from matplotlib import colormaps

    ramp = colormaps["viridis"]
    return [ramp(0.92 * i / (count - 1)) for i in range(count)]


# --- axes against time -----------------------------------------------------------------------


def _limits(values: Array, margin: float = 0.06) -> tuple[float, float]:
    """Limits around finite values; a constant is not blown up to its rounding noise."""
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    size = max(abs(low), abs(high))
    if high - low <= 1e-9 * size or high == low:
        return low - (0.1 * size or 1.0), high + (0.1 * size or 1.0)
    return low - margin * (high - low), high + margin * (high - low)


def _time_axes(area: SubplotSpec, run: Run, rows: int, columns: int = 1) -> list[Axes]:
    grid = area.subgridspec(rows, columns).subplots(sharex=True, squeeze=False)
    panels = list(grid.ravel())
    for axes in grid[-1]:
        axes.set_xlabel("time (s)")
    first, last = float(run.t[0]), float(run.t[-1])
    pad = 0.01 * (last - first) or 0.5
    panels[0].set_xlim(first - pad, last + pad)
    for axes in panels:
        _mark_change_points(axes, run.change_times, label=axes in list(grid[0]))
    return panels


MOST_MARKED = 40  # more lines than this are not drawn, only counted


def _mark_change_points(axes: Axes, times: tuple[float, ...], label: bool) -> None:
    for time in times if len(times) <= MOST_MARKED else ():
        axes.axvline(time, color="#9ca3af", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
    if not (times and label):
        return
    top = axes.secondary_xaxis("top")
    top.spines["top"].set_visible(False)
    top.tick_params(length=3, labelsize=7, pad=1, colors=QUIET)
    first, last = axes.get_xlim()
    few = len(times) <= 6 and bool(np.all(np.diff(sorted(times)) > 0.07 * (last - first)))
    marked = times if len(times) <= MOST_MARKED else ()
    top.set_ticks(marked, [f"{time:.4g}" for time in marked] if few else [""] * len(marked))
    plural = "s" * (len(times) > 1)
    text = f"change point{plural} at (s)" if few else f"{len(times)} change points"
    top.set_xlabel(text, fontsize=7, color=QUIET)


def draw_coordinates(area: SubplotSpec, run: Run) -> None:
    columns = range(len(run.system.coordinates))
    _draw_quantities(area, run, run.system.coordinates, columns, "coordinates")


def draw_speeds(area: SubplotSpec, run: Run) -> None:
    first = len(run.system.coordinates)
    columns = range(first, first + len(run.system.speeds))
    _draw_quantities(area, run, run.system.speeds, columns, "speeds")


def _draw_quantities(
    area: SubplotSpec, run: Run, names: Sequence[str], columns: range, word: str
) -> None:
    if not names:
        return _message(area, f"This scene has no {word}.")
    found = zip(names, columns, strict=True)
    return draw_against_time(
        area, run, {name: (shown_unit(run.system, name), run.y[:, i]) for name, i in found}
    )


def draw_against_time(
    area: SubplotSpec, run: Run, curves: Mapping[str, tuple[ShownUnit, Array]]
) -> None:
    """Quantities by name, each with its unit and its values (n,), in one panel for each unit."""
    groups: dict[ShownUnit, list[str]] = {}
    for name, (unit, _) in curves.items():
        groups.setdefault(unit, []).append(name)
    panels = _time_axes(area, run, len(groups))
    for axes, (unit, members) in zip(panels, groups.items(), strict=True):
        values = unit.factor * np.column_stack([curves[name][1] for name in members])
        names = [typeset(name) for name in members]
        handles = draw_curves(axes, run.t, values, _colours(len(members)))
        # of as many curves as fit, evenly chosen; the legend says if there are more
        most, layout = legend_layout(len(handles), len(groups))
        shown = _evenly(len(handles), most)
        if most < len(handles):
            layout["title"], layout["title_fontsize"] = f"{most} of {len(handles)}", 7.0
        _legend(axes, [handles[i] for i in shown], [names[i] for i in shown], **layout)
        _scale_panel(axes, unit, values)
    return


def _scale_panel(axes: Axes, unit: ShownUnit, values: Array) -> None:
    low, high = _limits(values)
    axes.set_ylim(low, high)
    if unit.quantity == "angle" and high - low > 30.0:
        from matplotlib.ticker import MaxNLocator

        axes.yaxis.set_major_locator(MaxNLocator(7, steps=[1, 1.8, 3, 4.5, 6, 9, 10]))
    axes.set_ylabel(plain(unit.quantity + f" ({unit.label})" * (unit.label != "")))


def _evenly(count: int, most: int) -> list[int]:
    """Indices of at most `most` of `count` items, the first and the last among them."""
    if count <= most:
        return list(range(count))
    return [round(i * (count - 1) / (most - 1)) for i in range(most)]


# --- energy and closure ----------------------------------------------------------------------


def draw_energy(area: SubplotSpec, run: Run, columns: int = 1) -> None:
    try:
        parts = energies(run)
        steps = np.asarray(run.solution.energy, dtype=float)
        work = run.solution.work_until(run.t), run.solution.work
    except MechcError as error:
        return _message(area, clean_text(str(error), 300))
    panels = _time_axes(area, run, 2 // columns, columns)
    _draw_energies(panels[0], run, parts)
    what, total = "total energy", parts["total"]
    largest = float(np.nanmax(parts["kinetic"], initial=0.0))
    if np.isfinite(work[1]).all() and np.any(work[1]):  # what is left is an error
        what, total, steps = "energy less work", total - work[0], steps - work[1]
    _draw_energy_change(panels[1], run, total, steps, (what, largest))
    return None


def _draw_energies(axes: Axes, run: Run, parts: dict[str, Array]) -> None:
    values = np.column_stack(list(parts.values()))
    _legend(axes, draw_curves(axes, run.t, values, COLOURS[:3]), parts)  # as pages have them
    axes.set_ylim(_limits(values))
    axes.set_ylabel("energy (J)")


def _draw_energy_change(
    axes: Axes, run: Run, total: Array, steps: Array, of: tuple[str, float]
) -> None:
    """The drift, in parts of the largest kinetic energy: the potential's zero is arbitrary."""
    what, kinetic = of
    reference = kinetic or abs(float(total[0])) or 1.0
    start = float(steps[0] if len(steps) else total[0])
    change, at_steps = (total - start) / reference, (steps - start) / reference
    largest = float(np.nanmax(np.abs(np.concatenate([change, at_steps])), initial=0.0))
    exponent = int(np.floor(np.log10(largest))) if 1e-300 < largest < np.inf else 0
    change, at_steps = change * 10.0**-exponent, at_steps * 10.0**-exponent
    line = draw_curve(axes, run.t, change, COLOURS[2], linewidth=0.8)
    dots = _step_dots(axes, run, at_steps, COLOURS[6])
    _legend(axes, [line, dots], ["dense output", "at steps"])
    axes.set_ylim(_limits(np.concatenate([change, at_steps])))
    base = "largest kinetic energy" if kinetic else "initial energy" if total[0] else "1 J"
    parts = f"{power_of_ten(exponent)} of" if exponent else "relative to"
    axes.set_ylabel(f"change of {what}\n({parts} {base})")


def _step_dots(axes: Axes, run: Run, values: Array, colour: Any) -> Any:
    """Dots at the integrator's own steps, smaller where there are many."""
    size = float(np.clip(40.0 / np.sqrt(max(len(values), 1)), 0.8, 3.5))
    dots: dict[str, Any] = {"marker": "o", "linestyle": "", "markeredgewidth": 0.0}
    return axes.plot(run.solution.t, values, color=colour, markersize=size, zorder=3, **dots)[0]


def has_closure(run: Run) -> bool:
    """Whether there are constraints: without any there is no picture of their closing."""
    first = run.y[:1], run.solution.params, run.t[:1]
    kinds = (run.system.constraints, run.system.velocity_constraints)
    try:
        return any(np.shape(kind(*first))[-1] > 0 for kind in kinds)
    except MechcError:
        return True  # the panel says why


def draw_closure(area: SubplotSpec, run: Run) -> None:
    try:
        position = run.evaluate(run.system.constraints)
        velocity = run.evaluate(run.system.velocity_constraints)
    except MechcError as error:
        return _message(area, clean_text(str(error), 300))
    if position.shape[-1] == 0 and velocity.shape[-1] == 0:
        return _message(area, "This scene has no constraints.")
    axes = _time_axes(area, run, 1)[0]
    residuals = (
        ("position (m)", position, run.solution.closure, COLOURS[0]),
        ("velocity (m/s)", velocity, run.solution.velocity_closure, COLOURS[1]),
    )
    handles, names, everything = [], [], []
    for name, between, at_steps, colour in residuals:
        largest = np.abs(between).max(axis=-1, initial=0.0)
        draw_curve(axes, run.t, _positive(largest), colour, linewidth=0.7, alpha=0.45)
        handles.append(_step_dots(axes, run, _positive(at_steps), colour))
        names.append(name)
        everything += [largest, np.abs(at_steps)]
    values = np.concatenate(everything)
    sizes = values[np.isfinite(values) & (values > 0.0)]
    low, high = (sizes.min(), sizes.max()) if sizes.size else (1e-17, 1e-15)
    bottom = float(np.floor(np.log10(low))) - 1.0
    axes.set_yscale("log")
    axes.set_ylim(10.0**bottom, 10.0 ** max(float(np.ceil(np.log10(high))) + 0.3, bottom + 3.0))
    zero = (np.array([run.solution.closure, run.solution.velocity_closure]) == 0.0).any(axis=0)
    if zero.any():  # marks on the floor at the steps where a residual is exactly zero
        floor = np.full(int(zero.sum()), 0.03)
        style: dict[str, Any] = {"marker": "v", "linestyle": "", "markersize": 4.0}
        style |= {"color": QUIET, "transform": axes.get_xaxis_transform(), "fillstyle": "none"}
        handles.append(axes.plot(run.solution.t[zero], floor, **style)[0])
        names.append("exactly zero")
    _legend(axes, handles, names)
    axes.set_ylabel("largest closure residual")
    return None


def _positive(values: Array) -> Array:
    """Magnitudes without exact zeros, which a log scale cannot show."""
    sizes = np.abs(np.asarray(values, dtype=float))
    return np.where(sizes > 0.0, sizes, np.nan)


# --- paths -----------------------------------------------------------------------------------


def draw_paths(area: SubplotSpec, run: Run) -> None:
    try:
        view = plane_view(run)
    except MechcError as error:
        return _message(area, clean_text(str(error), 300))
    if not view.names:
        return _message(
            area,
            "No points to draw: locate the bodies' points from one at rest; a model from another "
            "process or from a file draws the compiled points only: open the file with the model.",
        )
    axes = _single(area)
    handles, names = _draw_mechanism_at_ends(axes, run, view)
    for kind, handle, words in _draw_forces(axes, run, view):
        handles.append(handle)
        names.append(f"{kind}s, {words}")
    for name, colour in zip(run.traced, _colours(len(run.traced)), strict=True):
        track = view.path(name)
        handles.append(draw_curve(axes, track[:, 0], track[:, 1], colour, zorder=4))
        names.append(f"path of {typeset(name)}")
    shown = _evenly(len(handles), MOST_LEGEND_LINES)
    _legend(axes, [handles[i] for i in shown], [names[i] for i in shown])
    axes.update_datalim(view.box)
    axes.margins(0.1)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"{view.axes[0]} (m)")
    axes.set_ylabel(f"{view.axes[1]} (m)")
    if view.note:
        axes.set_title(view.note, loc="left", fontsize=8, color=QUIET)
    return None


def _draw_mechanism_at_ends(axes: Axes, run: Run, view: PlaneView) -> tuple[list[Any], list[str]]:
    handles = [_draw_links(axes, run, view, 0, "#9ca3af", "-")]
    names = [f"at the start, {run.t[0]:.4g} s"]
    if len(run.t) > 1:
        handles.append(_draw_links(axes, run, view, -1, "#4b5563", (0, (3, 1.6))))
        names.append(f"at the end, {run.t[-1]:.4g} s")
    muscles = [strut for strut in run.picture.struts if strut.kind == "muscle"]
    for strut in muscles:
        drawn = [
            _draw_muscle(axes, run, view, strut, row, colour)
            for row, colour in ((0, RESTING), (-1, ACTIVE))[: len(run.t)]
        ]
    if muscles:
        handles.append(tuple(drawn))
        names.append("muscles, thick if active")
    for guide in run.guides:
        ends = np.stack([view.path(name)[0] for name in guide.ends])
        axes.plot(*ends.T, color="#d1d5db", linewidth=2.5, zorder=1, solid_capstyle="butt")
        for row, colour in ((0, "#9ca3af"), (-1, "#4b5563"))[: len(run.t)]:
            if guide.is_block:
                axes.add_patch(_block(view, guide, row, colour))
    for name in run.ground:
        x, y = view.path(name)[-1]
        axes.plot(x, y, marker=_pivot(), markersize=24, color=QUIET, fillstyle="none", zorder=2)
    return handles, names


def _draw_links(axes: Axes, run: Run, view: PlaneView, row: int, colour: str, dash: Any) -> Any:
    """The skeleton at one instant, or the bare points where a scene has no skeleton."""
    style: dict[str, Any] = {"color": colour, "linestyle": dash, "linewidth": 1.6, "zorder": 2.5}
    style |= {"marker": "o", "markersize": 4.5, "markerfacecolor": "white"}
    polylines = [names for _, names in run.picture.skeleton] or [(name,) for name in view.names]
    lines = []
    for names in polylines:
        corners = np.array([view.path(name)[row] for name in names])
        marked = [place for place, name in enumerate(names) if is_joint(name)]
        lines += axes.plot(corners[:, 0], corners[:, 1], markevery=marked, **style)
    return lines[0]


def _draw_forces(axes: Axes, run: Run, view: PlaneView) -> Iterator[tuple[str, Any, str]]:
    """The forces that are asked for, at both ends of the run: kind, handle, the scale in words."""
    rows = [0, len(run.t) - 1][: len(run.t)]
    known = forces_of(replace(run, t=run.t[rows], y=run.y[rows]), run.forces)
    for kind, colour in ((REACTION, "#7c3aed"), (LOAD, "#0f8a8a")):
        several = [force for force in known if force.kind == kind]
        largest = max((np.linalg.norm(x.newtons, axis=-1).max() for x in several), default=0.0)
        if not largest > 0.0:
            continue
        scale = round_down(LONG * view.size / largest)  # m per N
        for force in several:
            for row, pale in ((0, 0.45), (-1, 1.0))[: len(run.t)]:
                foot, way = view.of(force.at[row]), scale * view.of(force.newtons[row])
                look = {"arrowstyle": "-|>", "color": colour, "alpha": pale, "lw": 1.5}
                look |= {"shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 9.0}
                axes.annotate("", tuple(foot + way), tuple(foot), arrowprops=look, zorder=5)
                axes.update_datalim([foot + way])
        length = round_down(LONG * view.size / 2)
        handle = axes.plot([], [], color=colour, marker=">", markersize=5.0)[0]
        yield kind, handle, f"{length:g} m is {length / scale:g} N"


def _draw_muscle(
    axes: Axes, run: Run, view: PlaneView, strut: Strut, row: int, colour: str
) -> Any:  # fmt: skip
    """The path of a muscle at one instant."""
    values = run.activation(strut)
    width = THIN + THICKER * (0.0 if values is None else float(values[row]))
    path = np.stack([view.path(name)[row] for name in strut.points])
    style: dict[str, Any] = {"color": colour, "linewidth": width, "zorder": 2.4}
    ends = [place for place, name in enumerate(strut.points) if is_joint(name)]
    return axes.plot(*path.T, marker="o", markersize=3.0, markevery=ends, **style)[0]


def _block(view: PlaneView, guide: Guide, row: int, colour: str) -> Any:
    """A sliding body at one instant, along its guide."""
    from matplotlib.patches import Rectangle

    first, last = (view.path(name)[row] for name in guide.ends)
    angle, (x, y) = np.degrees(np.arctan2(*(last - first)[::-1])), view.path(guide.at)[row]
    length, width = 0.06 * view.size, 0.04 * view.size
    return Rectangle(
        (x - length / 2, y - width / 2), length, width, angle=angle, rotation_point="center",
        facecolor="white", edgecolor=colour, linewidth=1.6, zorder=3,
    )  # fmt: skip


@cache
def _pivot() -> Any:
    """The textbook sign of a pivot on ground: a triangle on a hatched line, its apex at 0, 0."""
    from matplotlib.path import Path as Outline

    strokes = [[(0, 0), (-0.42, -0.62), (0.42, -0.62), (0, 0)], [(-0.7, -0.62), (0.7, -0.62)]]
    strokes += [[(x, -0.62), (x - 0.25, -0.92)] for x in (-0.4, -0.1, 0.2, 0.5)]
    codes = [Outline.MOVETO if i == 0 else Outline.LINETO for s in strokes for i in range(len(s))]
    return Outline([corner for stroke in strokes for corner in stroke], codes)


# --- everything ------------------------------------------------------------------------------


def draw_overview(area: SubplotSpec, run: Run) -> None:
    grid, whole = area.subgridspec(2, 3), cast("Any", area.get_gridspec())
    figure = whole.figure
    closes = has_closure(run)
    parts: dict[str, tuple[Callable[[SubplotSpec, Run], None], Any]] = {
        "Paths": (draw_paths, grid[0, 0]),
        "Coordinates": (draw_coordinates, grid[0, 1]),
        "Speeds": (draw_speeds, grid[0, 2]),
        "Energy": (partial(draw_energy, columns=2), grid[1, :2] if closes else grid[1, :]),
        **({"Closure": (draw_closure, grid[1, 2])} if closes else {}),
    }
    for name, (draw, cell) in parts.items():
        drawn = len(figure.axes)
        draw(cell, run)
        axes = figure.axes[drawn]
        note = axes.get_title(loc="left")
        title = f"{name}: {note}" if note else name
        axes.set_title(title, loc="left", fontsize=10, color="#222222")
    heading = clean_text(run.system.title or run.system.name, 100)
    status = run.solution.status
    outcome = clean_text(getattr(status, "headline", str(status)), 180)
    figure.suptitle(f"{plain(heading)}\n{plain(outcome)}", fontsize=11)
