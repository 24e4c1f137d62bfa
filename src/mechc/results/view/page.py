"""A motion in space as one self-contained page, which three.js draws."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.files import path_of
from mechc.progress import Notice
from mechc.results.player.motion import frames, motion_data
from mechc.results.player.page import Page, player_page, template
from mechc.results.view.axes import axes_data
from mechc.results.view.pictures import WRITERS, picture_order, pictures_of
from mechc.results.view.solids import solids_data
from mechc.results.view.three_js import three_js
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import one_double
from mechc.system.units import SECONDS

SCRIPTS: Final = (
    *("solids", "camera", "stage", "body", "arrows", "trails", "views", "export", "renew"),
)


class View(Page):
    """A page that shows a motion in space; a notebook displays it."""

    def page(self, data: Mapping[str, Any]) -> str:
        """The page of such data."""
        return space_page(data)

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
        target = path_of(path)
        kind = target.suffix.lower().lstrip(".")
        if kind not in ("html", "htm", *WRITERS):
            raise ValueOutOfBoundsError(
                f"a view is saved as .html, .png, .gif or .mp4, not as {target.name!r}"
            )
        if kind not in WRITERS:
            return self._write(target)
        fps, speed = one_double(fps, "fps"), one_double(speed, "speed")
        t = None if t is None else one_double(t, "t", SECONDS)
        order = picture_order(
            self.data, kind, t=t, fps=fps, speed=speed, size=size, camera=camera, theme=theme
        )
        with Notice(f"drawing {path} in the browser, pictures: {len(order['times'])} ..."):
            pictures = pictures_of(self.page({**self.data, "export": order, "theme": theme}))
            target.parent.mkdir(parents=True, exist_ok=True)
            WRITERS[kind](pictures, target, fps)
        return target


def view(sol: Trajectory, *, fps: float = 60.0, forces: Any = None) -> View:
    """The motion as a `View`: show it in a notebook, or ``.save(path)`` it."""
    three_js()  # is missing now, not when the page is displayed
    return View(view_data(sol, fps=fps, forces=forces))


def saved_view(data: Mapping[str, Any]) -> View:
    """The motion of data that were made before, with its picture as it was then."""
    three_js()
    return View(data)


def view_data(sol: Trajectory, *, fps: float = 60.0, forces: Any = None) -> dict[str, Any]:
    """The data of a motion in space.

    Raises
    ------
    ValueOutOfBoundsError
        If ``fps`` is not a positive number.
    UnknownNameError
        If there is no force of a name among ``forces``.
    """
    run = frames(sol, fps, in_space=True, forces=forces)
    data = motion_data(run, run.point_names, fps)
    middle = np.array(data["origin"])
    return {
        **data,
        **axes_data(run),
        **solids_data(run, middle),
    }


def space_page(data: Mapping[str, Any]) -> str:
    """The page of a motion in space."""
    scripts = [template("view", f"{name}.js") for name in SCRIPTS]
    return player_page(data, scripts, library=three_js())
