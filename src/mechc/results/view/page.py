"""A motion in space as one self-contained page.

Input: a Solution.  Output: HTML text, a file, or an object that a notebook displays.
Invariant: the page loads nothing from elsewhere; its policy names its two scripts and its style by
their hashes, so that nothing else runs; user text is in it only as escaped JSON and an escaped
title.
"""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from functools import cached_property
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any, Final

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.results.animation import (
    attribute_text,
    content_hash,
    json_for_script,
    page_style,
    speed_choices,
    status_note,
    step_note,
    while_finite,
)
from mechc.results.sampling import Run, SolutionLike, clean_text, covered
from mechc.results.view.arrows import arrows, load_arrows
from mechc.results.view.motion import marks, points_data
from mechc.results.view.pictures import WRITERS, drawn, picture_order
from mechc.results.view.plots import panels
from mechc.results.view.solids import solids_data
from mechc.results.view.three_js import three_js
from mechc.system.parameters import Array
from mechc.system.picture import Picture

MOST_FRAMES: Final = 1500
FEWEST_FRAMES: Final = 240
MOST_POSITIONS: Final = 120_000  # frames times points
SCRIPTS: Final = (
    *("data", "theme", "solids", "camera", "stage", "body", "arrows", "trails", "plots"),
    *("player", "panel", "live", "export", "main"),
)


class View:
    """A page that shows a motion in space; a notebook displays it.

    Attributes
    ----------
    data
        What the page's script reads.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        self.data = data

    @cached_property
    def html(self) -> str:
        """The page."""
        return page(self.data)

    def __repr__(self) -> str:
        return f"<mechc view, {len(self.html) / 1024:.0f} KiB of HTML: save(path) writes it>"

    def save(
        self,
        path: str | Path,
        *,
        t: float | None = None,
        fps: float = 25.0,
        speed: float = 1.0,
        size: tuple[int, int] = (960, 640),
        camera: str | None = None,
        theme: str = "light",
    ) -> Path:
        """Write the page as .html, a picture as .png, a film as .gif or .mp4; returns the path.

        The folder is made if missing.  Pictures are drawn by a browser of the Chromium family that
        is installed; an MP4 is encoded by ffmpeg.

        Parameters
        ----------
        t
            Of a picture: its time in s, by default the start.
        fps, speed
            Of a film: pictures a second, 900 at most in all, and simulated seconds a second.
        size
            Width and height in dots.
        camera
            ``"front"``, ``"back"``, ``"top"``, ``"side"`` or ``"isometric"``; by default front for
            a motion in a plane, else isometric.
        theme
            ``"light"`` or ``"dark"``.

        Raises
        ------
        ValueOutOfBoundsError
            For another kind of file, and for a time, size or speed that cannot be.
        MissingPackageError
            If there is no browser, or no encoder for an MP4.
        """
        target = Path(path)
        kind = target.suffix.lower().lstrip(".")
        if kind not in ("html", "htm", *WRITERS):
            raise ValueOutOfBoundsError(
                f"a view is saved as .html, .png, .gif or .mp4, not as {target.name!r}"
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        if kind in WRITERS:
            order = picture_order(
                self.data, kind, t=t, fps=fps, speed=speed, size=size, camera=camera, theme=theme
            )
            asked = {**self.data, "export": order, "theme": theme}
            WRITERS[kind](drawn(page(asked)), target, fps)
        else:
            target.write_text(self.html, encoding="utf-8", newline="\n")
        return target

    def _repr_html_(self) -> str:
        # Sandboxed: the page needs scripts, but no access to the notebook around it.
        return (
            '<iframe sandbox="allow-scripts allow-downloads" allow="fullscreen" title="View" '
            'width="100%" height="640" style="border:0" '
            f'srcdoc="{html.escape(self.html, quote=True)}"></iframe>'
        )


def view(sol: SolutionLike, *, fps: float = 60.0) -> View:
    """The motion as a `View`: show it in a notebook, or ``.save(path)`` it."""
    three_js()  # is missing now, not when the page is displayed
    return View(view_data(sol, fps=fps))


def recorded(data: Mapping[str, Any]) -> View:
    """The motion of data that were made before, with its picture as it was then."""
    three_js()
    return View(dict(data))


class SpaceRun(Run):
    """A run whose picture is that in space, with solids."""

    @cached_property
    def picture(self) -> Picture:
        """What is drawn of the model."""
        found: Picture = getattr(self.model, "picture_in_space", self.model.picture)
        return found


# --- data ------------------------------------------------------------------------------------


def view_data(sol: SolutionLike, *, fps: float = 60.0) -> dict[str, Any]:
    """What the page's script reads.

    Raises
    ------
    ValueOutOfBoundsError
        If ``fps`` is not a positive number.
    """
    run = while_finite(_frames(sol, fps))
    span = float(run.t[-1] - run.t[0])
    step = span / (len(run.t) - 1) if len(run.t) > 1 else 0.0
    placed = points_data(run, _finite_positions(run))
    return {
        "title": clean_text(run.model.title or run.model.name, 100),
        "notes": [note for note in (step_note(step, fps), status_note(run)) if note],
        "start": float(run.t[0]),
        "step": step,
        "frames": len(run.t),
        **placed,
        **solids_data(run, np.array(placed["origin"])),
        "arrows": arrows(run, np.array(placed["origin"])),
        "loads": load_arrows(run, np.array(placed["origin"])),
        "marks": marks(run),
        "panels": panels(run),
        **speed_choices(span),
    }


def _frames(sol: SolutionLike, fps: float) -> Run:
    """The run at equal steps: ``fps`` a second, fewer of long runs and many points."""
    if not (math.isfinite(fps) and fps > 0.0):
        raise ValueOutOfBoundsError(
            f"fps must be a positive number of frames per second, not {fps!r}"
        )
    first, last = sorted(covered(sol))
    if first == last:
        return SpaceRun(sol, np.array([first]), np.asarray(sol.y[:1], dtype=float))
    points = len(SpaceRun(sol, sol.t, sol.y).picture.point_names)
    most = min(MOST_FRAMES, max(FEWEST_FRAMES, MOST_POSITIONS // max(1, points)))
    count = max(2, math.ceil(min((last - first) * fps, most - 1.0) - 1e-6) + 1)
    t = np.linspace(first, last, count)
    return SpaceRun(sol, t, np.asarray(sol(t), dtype=float))


def _finite_positions(run: Run) -> Array:
    return np.nan_to_num(run.positions)


# --- the page --------------------------------------------------------------------------------


def page(data: dict[str, Any]) -> str:
    """The page with its scripts, style and data."""
    library, script, style = three_js(), page_script(), page_style() + _template("page.css")
    return Template(_template("page.html")).substitute(
        title=attribute_text(data["title"]),
        style=style,
        library=library,
        script=script,
        style_hash=content_hash(style),
        library_hash=content_hash(library),
        script_hash=content_hash(script),
        motion=json_for_script(data),
    )


def page_script() -> str:
    """The page's own script: its parts in order, in one scope of their own."""
    parts = "\n".join(_template(f"{name}.js") for name in SCRIPTS)
    return f'(function () {{\n"use strict";\n{parts}}}());\n'


def _template(name: str) -> str:
    found = resources.files("mechc.results.view").joinpath("templates", name)
    return found.read_text("utf-8")
