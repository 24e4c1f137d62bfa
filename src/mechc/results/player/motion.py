"""A run as the data that the player reads: frames of its points, links, curves, marks.

Input: a Solution or a Run.  Output: plain values for JSON, numbers of frames as base64.
Invariant: every text is one printable line of bounded length.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.results.player.following import followed
from mechc.results.player.forces import LOAD, REACTION, forces_of, usual_size
from mechc.results.player.page import base64_floats
from mechc.results.player.plots import curves
from mechc.results.sampling import PlaneView, Run, clean_text, pretty_name
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array, one_double
from mechc.system.picture import Strut

MOST_FRAMES: Final = 3000
FEWEST_FRAMES: Final = 240
MOST_POSITIONS: Final = 120_000  # frames times points
MOST_PATH: Final = 24_000  # times of paths, times points
SAG_OF_PATH: Final = 0.005  # of the largest extent of a path
BESIDE: Final = 0.002  # of the mechanism's size: a pixel of a picture
TURN: Final = 0.5  # rad of a solid between two frames
ROUNDING: Final = 1e-9
MOST_MARKS: Final = 400
MOST_LETTERS: Final = 60
SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0)  # of the motion over the clock's


# --- frames ----------------------------------------------------------------------------------


def frames(
    sol: Trajectory, fps: float, *, in_space: bool = False, forces: Any = False
) -> Run:  # fmt: skip
    """The run at equal steps, up to its first state that is not finite.

    There are at least 240 frames, ``fps`` a second and as many as steps of the integrator, and
    twice as many until what the page draws between two of them is the motion; fewer of long runs
    and of many points.

    Raises :class:`ValueOutOfBoundsError` if ``fps`` is not a positive number.
    """
    fps = one_double(fps, "fps")
    if not 0.0 < fps < math.inf:
        raise ValueOutOfBoundsError(
            f"fps must be a positive number of frames per second, not {fps!r}"
        )
    first, last = sorted(sol.span)
    if first == last:
        y = np.asarray(sol.y[:1], dtype=float)
        return _finite(Run(sol, np.array([first]), y, in_space, forces))
    points = len(Run(sol, sol.t, sol.y, in_space).picture.point_names)
    most = min(MOST_FRAMES, max(FEWEST_FRAMES, MOST_POSITIONS // max(1, points)))
    steps = max((last - first) * fps, float(sol.stats["steps"]), FEWEST_FRAMES - 1.0)
    count = math.ceil(min(steps, most - 1.0) - 1e-6) + 1
    while True:
        t = np.linspace(first, last, 2 * count - 1)  # frames and what lies between them
        fine = _finite(Run(sol, t, np.asarray(sol(t), dtype=float), in_space, forces))
        if count >= most or _fills_in(fine):
            return replace(fine, t=fine.t[::2], y=fine.y[::2])
        count = min(most, 2 * count - 1)


def _finite(run: Run) -> Run:
    """The run up to its first state that is not finite; the first is kept in any case."""
    bad = ~np.isfinite(run.y).all(axis=1)
    kept = max(1, int(np.argmax(bad))) if bad.any() else len(run.t)
    return replace(run, t=run.t[:kept], y=np.nan_to_num(run.y[:kept]))


def _fills_in(fine: Run) -> bool:
    """Whether the page finds every second row of a run from the others, to what can be seen."""
    x = np.nan_to_num(fine.positions[: len(fine.t) - 1 + len(fine.t) % 2])
    if len(x) < 3 or not x.size:
        return True
    rounding = ROUNDING * float(np.abs(x).max())
    sizes = (np.ptp(x, axis=axis).max() for axis in (1, 0))  # at one time, of all
    size = next((float(size) for size in sizes if size > rounding), np.inf)
    frames, rates = x[::2], np.gradient(x[::2], axis=0)  # the page's cubics have these rates
    drawn = (frames[:-1] + frames[1:]) / 2 + (rates[:-1] - rates[1:]) / 8
    if np.abs(drawn - x[1::2]).max() > BESIDE * size:
        return False
    if not fine.in_space or fine.picture.placed is None or not fine.picture.solids:
        return True
    turned = np.nan_to_num(fine.picture.placed(fine.y, fine.params, fine.t)[1])
    traces = np.einsum("fsij,fsij->fs", turned[1:], turned[:-1])
    return bool((traces >= 1.0 + 2.0 * np.cos(TURN / 2)).all())  # 1 + 2 cos of the angle


# --- data ------------------------------------------------------------------------------------


def motion_data(
    run: Run, names: Sequence[str], fps: float, view: PlaneView | None = None
) -> dict[str, Any]:
    """The data of a motion, without the directions in which it is seen.

    Drawn are the points of these names, in space or in a plane's ``view``; ``fps`` frames a second
    were asked for.
    """
    number = {name: k for k, name in enumerate(names)}
    positions = _positions(run, names, view)
    # relative to the middle of the box of the motion single precision is finest
    flat = positions.reshape(-1, positions.shape[-1])
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2 if len(flat) else np.zeros(flat.shape[-1])
    span = float(run.t[-1] - run.t[0])
    step = span / (len(run.t) - 1) if len(run.t) > 1 else 0.0
    told = [] if view is None else [view.note]
    if step * one_double(fps, "fps") > 1.001:  # the limit of frames made it longer than requested
        told.append(f"one frame every {1e3 * step:.3g} ms")
    if not getattr(run.solution.status, "ok", True):
        told.append(clean_text(str(run.solution.status), 240))
    return {
        "title": clean_text(run.system.title or run.system.name, 100),
        "notes": [note for note in told if note],
        "start": float(run.t[0]),
        "step": step,
        "frames": len(run.t),
        "points": [pretty_name(name) for name in names],
        "origin": middle.tolist(),
        "tracks": base64_floats(positions - middle),
        "links": [
            {"label": clean_text(label), "points": [number[name] for name in line]}
            for label, line in run.picture.skeleton
        ],
        "guides": [
            {
                "label": clean_text(guide.label),
                "points": [number[name] for name in (*guide.ends, guide.at)],
                "block": guide.is_block,
            }
            for guide in run.guides
        ],
        "struts": [_strut(run, strut, number) for strut in run.picture.struts],
        "ground": [number[name] for name in run.ground],
        "traced": [number[name] for name in run.traced],
        "paths": paths(run, middle, view),
        **force_data(run, middle, view),
        "marks": marks(run),
        **curves(run),
        **speed_choices(span),
    }


def paths(run: Run, middle: Array, view: PlaneView | None) -> dict[str, Any]:
    """The paths of the traced points, relative to ``middle``, at times of their own.

    They are closer where a path bends, as far as MOST_PATH allows, so that the page's cubics
    through them are the motion to what can be seen.
    """
    names = run.traced

    def values(part: Run) -> Array:
        return _positions(part, names, view).reshape(len(part.t), -1)

    def sags(found: Array) -> Array:
        return np.full(found.shape[1], SAG_OF_PATH * float(np.ptp(found, axis=0).max(initial=0.0)))

    most = MOST_PATH // max(1, len(names))
    t, found = followed(run, values, sags, most) if names else (run.t[:1], np.zeros((1, 0)))
    shown = found.reshape(len(t), len(names), len(middle)) - middle
    return {"times": base64_floats(t - run.t[0]), "points": base64_floats(shown)}


def force_data(run: Run, middle: Array, view: PlaneView | None) -> dict[str, Any]:
    """Reactions (``arrows``) and ``loads`` in every frame, and which are shown at first."""
    known = forces_of(run, run.forces)
    kinds = {"arrows": REACTION, "loads": LOAD}
    found: dict[str, Any] = {}
    for key, kind in kinds.items():
        several = [force for force in known if force.kind == kind]
        usual = usual_size(several)
        found[key] = [
            {
                "label": force.label,
                "at": base64_floats((force.at if view is None else view.of(force.at)) - middle),
                "force": base64_floats(force.newtons if view is None else view.of(force.newtons)),
                "usual": usual,
            }
            for force in several
        ]
    found["forces"] = ["arrows"] if run.forces is None else [key for key in kinds if found[key]]
    return found


def _positions(run: Run, names: Sequence[str], view: PlaneView | None) -> Array:
    """The points of these names along a run, (n, points, 2 or 3) m; 0 for what is not finite."""
    points = run.positions[:, [run.point_names.index(name) for name in names]]
    return np.nan_to_num(points if view is None else view.of(points))


def _strut(run: Run, strut: Strut, number: Mapping[str, int]) -> dict[str, Any]:
    """A spring, a damper, or a muscle with its activation in every frame, 0 where unknown."""
    points = [number[name] for name in strut.points]
    found: dict[str, Any] = {"kind": strut.kind, "label": clean_text(strut.label), "points": points}
    if strut.kind == "muscle":
        values = run.activation(strut)
        found["activation"] = base64_floats(np.zeros(len(run.t)) if values is None else values)
    return found


def speed_choices(span: float) -> dict[str, Any]:
    """The choice of speeds, with slower ones for very short runs."""
    speeds = list(SPEEDS)
    while 0.0 < span < 3.0 * speeds[0] and speeds[0] > 1e-6:
        speeds.insert(0, float(f"{speeds[0] / 10.0:.6g}"))
    slow_enough = [speed for speed in speeds if speed <= 1.0 and span >= 1.0 * speed]
    usual = slow_enough[-1] if slow_enough else speeds[0]
    return {"speeds": speeds, "speed": usual if span > 0.0 else 1.0}


# --- marks -----------------------------------------------------------------------------------


def marks(run: Run) -> list[dict[str, Any]]:
    """Change points and events within the run, by time."""
    found = [{"t": t, "kind": "change", "label": "change point"} for t in run.change_times]
    for title, record in zip(run.solution.event_titles, run.solution.events, strict=True):
        found += [
            {"t": float(t), "kind": "event", "label": clean_text(title, MOST_LETTERS)}
            for t in record.t
            if np.isfinite(t)
        ]
    return sorted(found[:MOST_MARKS], key=lambda mark: float(mark["t"]))
