"""Pictures of a finished run.

Input: a Solution.  Output: a matplotlib Figure, or PNG and SVG files.
Invariant: matplotlib is imported only when a picture is drawn, pyplot never, and no global
setting is changed after a call; the same run gives the same file, byte for byte.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from mechc.errors import MissingPackageError
from mechc.results import panels
from mechc.results.sampling import Run, SolutionLike, sample

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
"""The files that `save_all` writes: name -> drawing function, width and height in inches."""


# --- the pictures ----------------------------------------------------------------------------


def coordinates(sol: SolutionLike, *, samples: int = SAMPLES) -> Figure:
    """The coordinates against time, one panel per unit; angles in degrees, not wrapped."""
    return _picture("coordinates", sample(sol, samples, jumps=True))


def speeds(sol: SolutionLike, *, samples: int = SAMPLES) -> Figure:
    """The speeds against time, one panel per unit; angular speeds in degrees per second."""
    return _picture("speeds", sample(sol, samples, jumps=True))


def paths(sol: SolutionLike, *, samples: int = SAMPLES) -> Figure:
    """Paths of the traced points in metres, the mechanism drawn at the start and at the end.

    A spatial mechanism is projected on the two axes of largest extent, with a note in the picture.
    """
    return _picture("paths", sample(sol, samples, jumps=True))


def energy(sol: SolutionLike, *, samples: int = SAMPLES) -> Figure:
    """Kinetic, potential and total energy in joules, and the change of the total."""
    return _picture("energy", sample(sol, samples, jumps=True))


def closure(sol: SolutionLike, *, samples: int = SAMPLES) -> Figure:
    """Largest position (m) and velocity (m/s) residual of the constraints, on a log scale."""
    return _picture("closure", sample(sol, samples, jumps=True))


def overview(sol: SolutionLike, *, samples: int = SAMPLES) -> Figure:
    """An overview of the motion in one figure, which `Solution.plot()` returns."""
    return _picture("overview", sample(sol, samples, jumps=True))


def save_all(
    sol: SolutionLike,
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
        figure = _lay_out(_picture(name, run))
        for extension in formats:
            written.append(target / f"{name}.{extension}")
            _save(figure, written[-1], dpi)
    return written


def _lay_out(figure: Figure) -> Figure:
    """Lay out once and round, since the last bits of the layout's solver differ between runs."""
    with _matplotlib().rc_context(STYLE):
        figure.draw_without_rendering()
        figure.set_layout_engine(None)  # a placeholder engine would draw twice on every save
    for axes in figure.axes:
        left, bottom, width, height = np.round(axes.get_position(original=True).bounds, 4)
        axes.set_position((left, bottom, width, height))
    for text in figure.texts:
        x, y = np.round(text.get_position(), 4)
        text.set_position((x, y))
    return figure


def _save(figure: Figure, path: Path, dpi: float) -> None:
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(path.suffix[1:])
    with _matplotlib().rc_context(STYLE):
        figure.savefig(path, dpi=dpi, metadata=metadata)


# --- matplotlib ------------------------------------------------------------------------------


def _matplotlib() -> Any:
    try:
        import matplotlib
    except ImportError as error:
        raise MissingPackageError(
            "matplotlib is not installed: pip install matplotlib (or run with --json)"
        ) from error
    return matplotlib


@cache
def _figure_class() -> type[Figure]:
    """A Figure that a notebook displays without pyplot."""
    from io import BytesIO

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    class Picture(Figure):
        def __init__(self, *args: Any, **kwargs: Any) -> None:
            super().__init__(*args, **kwargs)
            FigureCanvasAgg(self)

        def _repr_png_(self) -> bytes:
            buffer = BytesIO()
            with _matplotlib().rc_context(STYLE):
                self.savefig(buffer, format="png", dpi=110)
            return buffer.getvalue()

    return Picture


def _picture(name: str, run: Run) -> Figure:
    draw, size = PICTURES[name]
    with _matplotlib().rc_context(STYLE):
        figure = _figure_class()(figsize=size, layout="constrained")
        draw(figure.add_gridspec(1, 1)[0], run)
    return figure
