"""The small moving picture of a scene in the gallery's index: a GIF drawn from its Solution.

Sphinx-Gallery calls `scrape` after each block of a script.  The first Solution that a script makes
is drawn; on the page of the scene itself `sol.animate()` plays.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

import mechc
from mechc.results.sampling import PlaneView, Run, plane_view, sample

FRAMES, SECONDS = 48, 4.0
SIZE, DPI = (3.2, 2.4), 75
SLANT = 0.5 * np.array([0.7, 0.45])
LINK, PATH, PIVOT = "#1f6feb", "#c4c9d4", "#6b7280"


def scrape(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Write the picture once a block has made a Solution; nothing is added to the page."""
    paths = block_vars["image_path_iterator"]
    made = [v for v in block_vars["example_globals"].values() if isinstance(v, mechc.Solution)]
    if made and not len(paths):
        write(made[0], str(next(paths)).replace(".png", ".gif"))
    return ""


def write(sol: mechc.Solution, path: str) -> None:
    """The motion as a GIF that repeats."""
    view, run = seen(sol)
    images = [frame(run, view, k) for k in range(FRAMES)]
    duration = int(1000 * SECONDS / FRAMES)
    images[0].save(path, save_all=True, append_images=images[1:], duration=duration, loop=0)


def seen(sol: mechc.Solution) -> tuple[PlaneView, Run]:
    """What is drawn at the frames' times, evenly over the run."""
    fine = sample(sol, FRAMES)
    rows = np.linspace(0, len(fine.t) - 1, FRAMES).round().astype(int)
    run = Run(sol, fine.t[rows], fine.y[rows])
    view = plane_view(run)
    spatial = view.projected
    return (Oblique(view.points, view.names, view.axes, spatial) if spatial else view), run


class Oblique(PlaneView):
    """Spatial points with the third axis drawn aslant at half its length."""

    def of(self, vectors: np.ndarray) -> np.ndarray:
        depth = next(k for k, axis in enumerate("xyz") if axis not in "".join(self.axes))
        return super().of(vectors) + vectors[..., depth, None] * SLANT


def window(view: PlaneView, k: int) -> tuple[np.ndarray, np.ndarray]:
    """What is seen: the whole run, or what is near the mechanism where it travels far."""
    low, high = np.nanmin(view.positions, axis=1), np.nanmax(view.positions, axis=1)
    own = (high - low).max()
    if view.size < 2.5 * own:
        return view.box
    middle = (low[k] + high[k]) / 2
    return middle - 0.8 * own, middle + 0.8 * own


def frame(run: Run, view: PlaneView, k: int) -> Image.Image:
    """One instant: the paths, the links, the pivots."""
    figure = Figure(figsize=SIZE, dpi=DPI)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    for name in run.traced:
        axes.plot(*view.path(name)[: k + 1].T, color=PATH, linewidth=1)
    lines = [names for _, names in run.picture.skeleton] or [(name,) for name in view.names]
    for names in lines:
        corners = np.array([view.path(name)[k] for name in names])
        marker = "o" if len(corners) <= 4 else ""
        axes.plot(*corners.T, color=LINK, linewidth=2.5, marker=marker, markersize=4)
    for name in run.ground:
        axes.plot(*view.path(name)[k], marker="^", markersize=7, color=PIVOT)
    (left, bottom), (right, top) = window(view, k)
    half = 0.58 * max(top - bottom, (right - left) * SIZE[1] / SIZE[0])
    wide = half * SIZE[0] / SIZE[1]
    axes.set_xlim((left + right) / 2 - wide, (left + right) / 2 + wide)
    axes.set_ylim((bottom + top) / 2 - half, (bottom + top) / 2 + half)
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png")
    return Image.open(drawn).convert("RGB")
