"""Pictures and films of a view: PNG, GIF and MP4.

Input: the data of a page.  Output: a file.  A browser draws the page's own scene, so that a film
shows what the page shows.
"""

from __future__ import annotations

import base64
import io
import math
import re
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from mechc.errors import MechcError, ValueOutOfBoundsError, install_command, package
from mechc.results.view.browser import document_of

CAMERAS: Final = ("front", "back", "top", "side", "isometric")
THEMES: Final = ("light", "dark")
MOST_PICTURES: Final = 900
SIDES: Final = (64, 4096)


def picture_order(
    data: Mapping[str, Any], kind: str, *, t: float | None, fps: float, speed: float,
    size: tuple[int, int], camera: str | None, theme: str,
) -> dict[str, Any]:  # fmt: skip
    """An order to the page for pictures: sizes, camera, and times from the start of the run.

    Raises :class:`ValueOutOfBoundsError` for a size, camera, theme, time, speed or number of
    pictures that cannot be.
    """
    width, height = (_whole(side) for side in size)
    _refuse(camera, (None, *CAMERAS), "camera")
    _refuse(theme, THEMES, "theme")
    span = data["step"] * (data["frames"] - 1)
    if kind != "png":
        times = film_times(span, fps, speed)
    else:
        times = [0.0 if t is None else t - data["start"]]
        if not 0.0 <= times[0] <= span:
            raise ValueOutOfBoundsError(f"the run has no time {t} s")
    return {
        "width": width, "height": height, "camera": camera, "times": times, "speed": speed,
        "theme": theme,
    }  # fmt: skip


def _whole(side: Any) -> int:
    number = int(side)
    if number != side or not SIDES[0] <= number <= SIDES[1]:
        raise ValueOutOfBoundsError(
            f"a picture has sides of {SIDES[0]} to {SIDES[1]} dots, not {side}"
        )
    return number


def _refuse(given: Any, known: Sequence[Any], what: str) -> None:
    if given not in known:
        names = ", ".join(str(name) for name in known if name is not None)
        raise ValueOutOfBoundsError(f"there is no {what} {given!r}: {names}")


def film_times(span: float, fps: float, speed: float) -> list[float]:
    """Times of the pictures of a film, from the start of the run."""
    if not (math.isfinite(fps) and fps > 0.0 and math.isfinite(speed) and speed > 0.0):
        raise ValueOutOfBoundsError(f"fps and speed are positive, not {fps!r} and {speed!r}")
    count = math.floor(min(span * fps / speed, 1e9) + 1e-9) + 1
    if count > MOST_PICTURES:
        raise ValueOutOfBoundsError(
            f"a film has {MOST_PICTURES} pictures at most, not {count}: lower fps, raise speed, or "
            "simulate a shorter time"
        )
    return [min(span, k * speed / fps) for k in range(count)]


def pictures_of(page: str) -> list[bytes]:
    """The pictures, as PNG, of a page that was asked for some.

    Raises :class:`MechcError` if the browser drew none.
    """
    found = re.search(r'<pre id="pictures">([^<]*)</pre>', document_of(page))
    if found is None:
        raise MechcError("the browser drew nothing: it may be too old for WebGL")
    return [base64.b64decode(text) for text in found[1].split()]


# --- files -----------------------------------------------------------------------------------


def write_png(pictures: Sequence[bytes], path: Path, fps: float) -> None:
    """The first picture."""
    path.write_bytes(pictures[0])


def write_gif(pictures: Sequence[bytes], path: Path, fps: float) -> None:
    """A film that repeats; times between pictures are whole hundredths of a second."""
    from PIL import Image

    frames = [Image.open(io.BytesIO(picture)).convert("RGB") for picture in pictures]
    first = frames[0].quantize(200)
    rest = [frame.quantize(palette=first, dither=Image.Dither.NONE) for frame in frames[1:]]
    pause = max(20, 10 * round(100.0 / fps))
    first.save(path, save_all=True, append_images=rest, duration=pause, loop=0, optimize=False)


def write_mp4(pictures: Sequence[bytes], path: Path, fps: float) -> None:
    """A film in H.264, which all players know.

    Raises :class:`MissingPackageError` if there is neither ffmpeg on PATH nor the package
    imageio-ffmpeg; :class:`MechcError` if the encoder fails.
    """
    even = "crop=trunc(iw/2)*2:trunc(ih/2)*2"
    command = [
        _encoder(), "-y", "-loglevel", "error", "-f", "image2pipe", "-framerate", f"{fps:g}",
        "-i", "-", "-vf", even, "-c:v", "libx264", "-pix_fmt", "yuv420p",
        "-movflags", "+faststart", "-f", "mp4", str(path.resolve()),
    ]  # fmt: skip
    done = subprocess.run(command, input=b"".join(pictures), capture_output=True, check=False)
    if done.returncode != 0:
        raise MechcError(f"ffmpeg failed: {done.stderr.decode('utf-8', 'replace')[-400:]}")


def _encoder() -> str:
    found = shutil.which("ffmpeg")
    if found is not None:
        return found
    advice = f"an MP4 is encoded by ffmpeg: install it, or {install_command('video')}"
    return str(package("imageio_ffmpeg", advice).get_ffmpeg_exe())


WRITERS: Final[Mapping[str, Callable[[Sequence[bytes], Path, float], None]]] = {
    "png": write_png,
    "gif": write_gif,
    "mp4": write_mp4,
}
