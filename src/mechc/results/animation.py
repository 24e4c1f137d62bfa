"""A motion as one self-contained HTML page that plays in a browser.

Input: a Solution.  Output: HTML text, a file, or an object that a notebook displays.
Invariant: the page loads nothing from elsewhere, and user text is in it only as
escaped JSON (shown through textContent) and an escaped title.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any, Final

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.results.sampling import (
    PlaneView,
    Run,
    SolutionLike,
    clean_text,
    covered,
    is_joint,
    plane_view,
    pretty_name,
    sample,
    shown_unit,
)
from mechc.system.parameters import Array

MOST_FRAMES: Final = 3000
MOST_READOUTS: Final = 12
RESOLUTION: Final = 1e-5  # of the mechanism's size


@dataclass(frozen=True)
class Animation:
    """A page that plays a motion; a notebook displays it."""

    html: str

    def __repr__(self) -> str:
        return f"<mechc animation, {len(self.html) / 1024:.0f} KiB of HTML: save(path) writes it>"

    def save(self, path: str | Path) -> Path:
        """Write the page to a file, its folder made if missing; returns the path."""
        target = Path(path)
        if target.suffix.lower() not in (".html", ".htm"):
            raise ValueOutOfBoundsError(
                f"the animation is a page: save it as .html, not as {target.name!r}"
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(self.html, encoding="utf-8", newline="\n")
        return target

    def _repr_html_(self) -> str:
        # Sandboxed: the page needs scripts, but no access to the notebook around it.
        return (
            '<iframe sandbox="allow-scripts" title="Animation" width="100%" height="560" '
            f'style="border:0" srcdoc="{html.escape(self.html, quote=True)}"></iframe>'
        )


def animate(sol: SolutionLike, *, fps: float = 60.0) -> Animation:
    """The motion as an `Animation`: show it in a notebook, or `.save(path)` it."""
    return Animation(animation_html(sol, fps=fps))


def write_animation(sol: SolutionLike, path: str | Path, *, fps: float = 60.0) -> Path:
    """Write the page to `path`, its folder made if missing; returns the path."""
    return animate(sol, fps=fps).save(path)


def animation_html(sol: SolutionLike, *, fps: float = 60.0) -> str:
    """The page as text, ASCII only.

    `fps` is frames per second of simulated time, at most 3000 frames in all; the page interpolates
    between frames, and opens at a given time with `#t=1.5` after its address.
    Raises ValueOutOfBoundsError if `fps` is not a positive number.
    """
    run = sample(sol, _frame_count(sol, fps))
    template = _template("animation.html")
    return Template(template).substitute(
        title=attribute_text(clean_text(sol.model.title or sol.model.name, 100)),
        style=page_style(),
        script_hash=_script_hash(template),
        motion=json_for_script(_motion(run, fps)),
    )


def _frame_count(sol: SolutionLike, fps: float) -> int:
    if not (math.isfinite(fps) and fps > 0.0):
        raise ValueOutOfBoundsError(
            f"fps must be a positive number of frames per second, not {fps!r}"
        )
    first, last = covered(sol)
    span = abs(last - first)
    return max(2, math.ceil(min(span * fps, MOST_FRAMES - 1.0) - 1e-6) + 1)


# --- data of the page ------------------------------------------------------------------------


def _motion(run: Run, fps: float) -> dict[str, Any]:
    run = while_finite(run)
    view = plane_view(run)
    drawn = _drawn_points(run)
    low, high = _box(view, drawn)
    grain = RESOLUTION * (float((high - low).max()) or 1.0)
    span = float(run.t[-1] - run.t[0])
    step = span / (len(run.t) - 1) if len(run.t) > 1 else 0.0
    return {
        "title": clean_text(run.model.title or run.model.name, 100),
        "notes": [note for note in (view.note, step_note(step, fps), status_note(run)) if note],
        "start": float(run.t[0]),
        "step": step,
        "frames": len(run.t),
        "grain": grain,
        "low": low.tolist(),
        "high": high.tolist(),
        "names": [pretty_name(name) for name in drawn],
        "tracks": [_track(view.path(name), low, grain) for name in drawn],
        "links": [[drawn.index(name) for name in names] for _, names in run.picture.skeleton],
        "labels": [clean_text(label) for label, _ in run.picture.skeleton],
        "plain": [k for k, name in enumerate(drawn) if not is_joint(name)],
        "ground": [drawn.index(name) for name in run.ground],
        "traced": [drawn.index(name) for name in run.traced],
        "readouts": _readouts(run),
        "untold": max(0, len(run.model.coordinates) - MOST_READOUTS),
        "changes": list(run.change_times),
        **speed_choices(span),
    }


def while_finite(run: Run) -> Run:
    """The run up to the first state that is not finite; its first frame is always kept."""
    bad = ~np.isfinite(run.y).all(axis=1)
    count = max(1, int(np.argmax(bad))) if bad.any() else len(run.t)
    return replace(run, t=run.t[:count], y=np.nan_to_num(run.y[:count]))


def _drawn_points(run: Run) -> list[str]:
    """The points that links, pivots and paths need, or all if a scene names none."""
    shown = run.picture
    wanted = [name for _, names in shown.skeleton for name in names]
    wanted += [*run.ground, *run.traced]
    return [name for name in shown.point_names if name in set(wanted)] or list(shown.point_names)


def _box(view: PlaneView, drawn: Sequence[str]) -> tuple[Array, Array]:
    if not drawn:
        return np.zeros(2), np.zeros(2)
    positions = np.concatenate([view.path(name) for name in drawn])
    return positions.min(axis=0), positions.max(axis=0)


def _track(path: Array, low: Array, grain: float) -> list[list[int]]:
    """One point's x and y over the frames, in units of the resolution from the box's corner."""
    cells = np.rint((path - low) / grain).astype(np.int64)
    return [cells[:, 0].tolist(), cells[:, 1].tolist()]


def _readouts(run: Run) -> list[dict[str, Any]]:
    readouts = []
    for column, name in enumerate(run.model.coordinates[:MOST_READOUTS]):
        unit = shown_unit(run.model, name)
        values = unit.factor * run.y[:, column]
        digits = 1 if unit.quantity == "angle" else _digits(values)
        scaled = np.rint(values * 10.0**digits)
        readouts.append(
            {
                "name": pretty_name(name),
                "unit": unit.label,
                "digits": digits,
                "values": [int(value) for value in scaled],
            }
        )
    return readouts


def _digits(values: Array) -> int:
    """Decimals for about four digits of the largest value."""
    largest = float(np.abs(values).max(initial=0.0))
    return int(np.clip(3 - math.floor(math.log10(largest)), 0, 9)) if largest > 0.0 else 3


def speed_choices(span: float) -> dict[str, Any]:
    """The choice of speeds, with slower ones for very short runs."""
    speeds = [0.1, 0.25, 0.5, 1.0, 2.0]
    while 0.0 < span < 3.0 * speeds[0] and speeds[0] > 1e-6:
        speeds.insert(0, float(f"{speeds[0] / 10.0:.6g}"))
    slow_enough = [speed for speed in speeds if speed <= 1.0 and span >= 1.0 * speed]
    usual = slow_enough[-1] if slow_enough else speeds[0]
    return {"speeds": speeds, "speed": usual if span > 0.0 else 1.0}


def step_note(step: float, fps: float) -> str:
    """A note if the limit of frames made the step longer than requested."""
    return f"one frame every {1e3 * step:.3g} ms" if step * fps > 1.001 else ""


def status_note(run: Run) -> str:
    failed = not getattr(run.solution.status, "ok", True)
    return clean_text(str(run.solution.status), 240) if failed else ""


# --- escaping --------------------------------------------------------------------------------


def json_for_script(value: Any) -> str:
    """JSON that is safe inside <script>: no markup character and nothing beyond ASCII."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def attribute_text(text: str) -> str:
    return html.escape(text, quote=True).encode("ascii", "xmlcharrefreplace").decode("ascii")


def page_style() -> str:
    """The look of text and controls that every page with a motion shares."""
    return _template("page.css")


def _template(name: str) -> str:
    return resources.files("mechc.results").joinpath("templates", name).read_text("utf-8")


def _script_hash(template: str) -> str:
    """The content policy names the page's one script by its hash, so that no other runs."""
    return content_hash(template.split("<script>", 1)[1].split("</script>", 1)[0])


def content_hash(text: str) -> str:
    """A script or style as a content policy names it."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return "sha256-" + base64.b64encode(digest).decode("ascii")
