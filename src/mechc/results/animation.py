"""A motion in the plane as one small page, without three.js."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mechc.errors import ValueOutOfBoundsError
from mechc.files import path_of
from mechc.results.player.motion import frames, motion_data
from mechc.results.player.page import Page, player_page, template
from mechc.results.sampling import plane_view
from mechc.simulation.trajectory import Trajectory

X, Y = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]


class Animation(Page):
    """A page that plays a motion in the plane; a notebook displays it."""

    def page(self, data: Mapping[str, Any]) -> str:
        """The page of such data, ASCII only."""
        return player_page(data, [template("player", "plane.js")])

    def save(self, path: str | Path) -> Path:
        """Write the page to a file, its folder made if missing; returns the path."""
        target = path_of(path)
        if target.suffix.lower() not in (".html", ".htm"):
            raise ValueOutOfBoundsError(
                f"the animation is a page: save it as .html, not as {target.name!r}; "
                "sol.view().save(...) draws .png, .gif and .mp4, sol.plot() returns a figure"
            )
        return self._write(target)


def animate(sol: Trajectory, *, fps: float = 60.0, forces: Any = False) -> Animation:
    """The motion as an `Animation`: show it in a notebook, or `.save(path)` it.

    Raises
    ------
    ValueOutOfBoundsError
        If ``fps``, frames per second of simulated time, is not a positive number, or all
        ``forces`` are asked for and there are none.
    UnknownNameError
        If there is no force of a name among ``forces``.
    """
    run = frames(sol, fps, forces=forces)
    wanted = {name for _, line in run.picture.skeleton for name in line}
    wanted |= {*run.ground, *run.traced}  # by links, pivots and paths; all if a scene names none
    wanted |= {name for guide in run.guides for name in (guide.at, *guide.ends)}
    wanted |= {name for strut in run.picture.struts for name in strut.points}
    names = [name for name in run.point_names if name in wanted or not wanted]
    data = motion_data(run, names, fps, plane_view(run))
    return Animation(data | {"right": X, "up": Y, "flat": True})
