"""Pictures of a finished run.

Input: a Solution.  Output: a matplotlib Figure, or PNG and SVG files.
Invariant: matplotlib is imported only when a picture is drawn, pyplot never, and no global
setting is changed after a call; the same run gives the same file, byte for byte.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from mechc.errors import package
from mechc.results import panels
from mechc.results.sampling import Run, curve, sample
from mechc.simulation.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec

SAMPLES: Final = 2000
STYLE: Final[dict[str, Any]] = {
    "font.family": ["DejaVu Sans"],  # comes with matplotlib: the same picture everywhere
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.labelcolor": "#222222",
    "axes.edgecolor": "#9ca3af",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "grid.color": "#e5e7eb",
    "grid.linewidth": 0.6,
    "xtick.color": "#4b5563",
    "ytick.color": "#4b5563",
    "lines.linewidth": 1.4,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.handlelength": 1.4,
    "figure.facecolor": "white",
    "figure.titlesize": 11.0,
    "svg.fonttype": "path",  # subscripts must not depend on the viewer's fonts
    "svg.hashsalt": "mechc",
    "text.usetex": False,
    "mathtext.fontset": "dejavusans",
}


Draw = Callable[["SubplotSpec", Run], None]
PICTURES: Final[dict[str, tuple[Draw, tuple[float, float]]]] = {
    "overview": (panels.draw_overview, (15.0, 8.4)),
    "coordinates": (panels.draw_coordinates, (7.4, 4.2)),
    "speeds": (panels.draw_speeds, (7.4, 4.2)),
    "paths": (panels.draw_paths, (6.4, 5.6)),
    "energy": (panels.draw_energy, (7.4, 5.6)),
    "closure": (panels.draw_closure, (7.4, 3.6)),
}
"""The files that `save_all` writes: name -> drawing function, width and height in inches.

Coordinates and speeds have one panel per unit, angles in degrees, not wrapped.  Paths are those of
the traced points in metres, with the mechanism at the start and at the end; a spatial mechanism is
projected on the two axes of largest extent, with a note.  Energies are in joules, beside the change
of the total.  Closure has the largest position (m) and velocity (m/s) residual on a log scale.
"""


# --- the pictures ----------------------------------------------------------------------------


def picture(
    name: str, sol: Trajectory, *, samples: int = SAMPLES, forces: Any = False
) -> Figure:  # fmt: skip
    """One of :data:`PICTURES`; ``Solution.plot()`` returns ``"overview"``."""
    return _picture(name, replace(sample(sol, samples, jumps=True), forces=forces))


def curves(sol: Trajectory, names: Sequence[str], degrees: bool) -> Figure:
    """Quantities over time, a panel for each unit: see :meth:`mechc.Solution.plot`."""
    run = sample(sol, SAMPLES, jumps=True)
    drawn = {name: curve(run, name, degrees) for name in names}
    panels_count = len({unit for unit, _ in drawn.values()})
    with new_figure((7.4, 1.4 + 2.8 * panels_count)) as figure:
        panels.draw_against_time(figure.add_gridspec(1, 1)[0], run, drawn)
    return figure


def save_all(
    sol: Trajectory,
    folder: str | Path,
    *,
    samples: int = SAMPLES,
    formats: Sequence[str] = ("png", "svg"),
    dpi: float = 150.0,
) -> list[Path]:
    """Write every picture into `folder` (made if missing); returns the paths written.

    File names are fixed: overview.png, overview.svg, coordinates.png, ... closure.svg, the last
    two only if there are constraints.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    run = sample(sol, samples, jumps=True)
    written: list[Path] = []
    closes = panels.has_closure(run)
    for name in (name for name in PICTURES if closes or name != "closure"):
        written += save_figure(_picture(name, run), target, name, formats, dpi)
    return written


def save_figure(
    figure: Figure, folder: Path, name: str, formats: Sequence[str] = ("png", "svg"),
    dpi: float = 150.0,
) -> list[Path]:  # fmt: skip
    """Write a picture in each of the formats; returns the paths written.

    It is laid out once and rounded, since the last bits of the layout's solver differ between runs.
    """
    with _matplotlib().rc_context(STYLE):
        if engine := figure.get_layout_engine():
            engine.execute(figure)
        figure.set_layout_engine(None)  # a placeholder engine would draw twice on every save
    for axes in figure.axes:
        left, bottom, width, height = np.round(axes.get_position(original=True).bounds, 4)
        axes.set_position((left, bottom, width, height))
    for text in figure.texts:
        x, y = np.round(text.get_position(), 4)
        text.set_position((x, y))
    written = [folder / f"{name}.{extension}" for extension in formats]
    for path in written:
        _save(figure, path, dpi)
    return written


def _save(figure: Figure, path: Path, dpi: float) -> None:
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(path.suffix[1:])
    with _matplotlib().rc_context(STYLE):
        figure.savefig(path, dpi=dpi, metadata=metadata)


# --- matplotlib ------------------------------------------------------------------------------


def _matplotlib() -> Any:
    return package(
        "matplotlib", "matplotlib is not installed: pip install matplotlib (or run with --json)"
    )


@cache
def _figure_class() -> type[Figure]:
    """A Figure that a notebook displays without pyplot."""
    from io import BytesIO

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    class NotebookFigure(Figure):
        def __init__(self, *args: Any, **kwargs: Any) -> None:
            super().__init__(*args, **kwargs)
            FigureCanvasAgg(self)

        def _repr_png_(self) -> bytes:
            buffer = BytesIO()
            with _matplotlib().rc_context(STYLE):
                self.savefig(buffer, format="png", dpi=110)
            return buffer.getvalue()

    return NotebookFigure


@contextmanager
def new_figure(size: tuple[float, float]) -> Iterator[Figure]:
    """A figure of a width and height in inches, which is drawn within the block, in this style."""
    with _matplotlib().rc_context(STYLE):
        yield _figure_class()(figsize=size, layout="constrained")


def _picture(name: str, run: Run) -> Figure:
    draw, size = PICTURES[name]
    with new_figure(size) as figure:
        draw(figure.add_gridspec(1, 1)[0], run)
    return figure
