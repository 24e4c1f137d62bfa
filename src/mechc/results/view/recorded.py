"""The picture in space of a motion as bytes of its file, for where its model is not known.

Input: a Solution, or bytes of a file that anybody may have written.  Output: bytes, or the data
of a page.  Invariant: what is read has the fields that the page's script reads and no others, of
their kinds and sizes; texts are printable and bounded.
"""

from __future__ import annotations

import base64
import binascii
import json
import math
import zlib
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from mechc.errors import MechcError
from mechc.results.player.motion import MOST_FRAMES
from mechc.results.untrusted import json_object
from mechc.results.view.page import view_data
from mechc.simulation.trajectory import Trajectory

MOST_BYTES: Final = 64 * 2**20  # of the data, unpacked, and of their values besides
MOST_ENTRIES: Final = 5000
LONGEST: Final = 1000  # characters
LATER: Final = (
    "times",
    "guides",
    "paths",
    "forces",
)  # which pictures of earlier versions do not have
_KINDS: Final = ("ball", "box", "disc", "wheel", "mesh", "mass")

Check = Callable[[Any], bool]


def packed_view(sol: Trajectory) -> bytes:
    """The data of its page in space, compressed."""
    return zlib.compress(json.dumps(view_data(sol), allow_nan=False).encode(), 6)


def unpacked_view(content: bytes, max_bytes: float = MOST_BYTES) -> dict[str, Any]:
    """The data of a page, of at most ``max_bytes`` and 64 MiB.

    Raises :class:`MechcError` if the bytes are anything else.
    """
    reader = zlib.decompressobj()
    most = max(1, int(min(max_bytes, MOST_BYTES)))
    try:
        text = reader.decompress(content, most)
    except zlib.error as error:
        raise MechcError(f"the picture saved with it is damaged: {error}") from None
    if reader.unconsumed_tail or not reader.eof:
        raise MechcError(f"the picture saved with it has more than {most} bytes, or no end")
    data = json_object(text, "the picture saved with it", most)
    frames, points, solids = (_size(data, key) for key in ("frames", "points", "solids"))
    if not (1 <= frames <= MOST_FRAMES):
        raise MechcError("the picture saved with it is damaged: frames")
    times = _numbers(data["times"]) if "times" in data else frames
    fields = _fields(frames, points, solids, times) | {"paths": _paths(_size(data, "traced"))}
    for key in sorted(fields.keys() | data.keys(), key=str):
        if key in LATER and key not in data:
            continue
        if key not in data or key not in fields or not fields[key](data[key]):
            raise MechcError(f"the picture saved with it is damaged: {key[:40]!r}")
    return data


def _size(data: Mapping[str, Any], key: str) -> int:
    """A number of things, or how many a list has; 0 for anything else, which is then refused."""
    value = data.get(key)
    if isinstance(value, list):
        return len(value)
    return value if isinstance(value, int) and not isinstance(value, bool) else 0


def _numbers(values: Any) -> int:
    """How many numbers in single precision a text in base64 holds; 0 for anything else."""
    return (len(values) * 3 // 4 - values.count("=")) // 4 if isinstance(values, str) else 0


def _fields(frames: int, points: int, solids: int, times: int) -> dict[str, Check]:
    """A check of each field of the data."""
    point = _whole(points)
    line = _record({"label": _text, "points": _list(point)})
    guide = _record({"label": _text, "points": _list(point, 3), "block": _truth})
    ends = {"kind": _one_of("spring", "damper"), "label": _text, "points": _list(point, 2)}
    path = {"kind": _one_of("muscle"), "label": _text, "points": _list(point)}
    path["activation"] = _floats(frames)
    arrow = _record(
        {"label": _text, "at": _floats(3 * frames), "force": _floats(3 * frames), "usual": _number}
    )
    curve = _record({"name": _text, "values": _floats(times), "dash": _list(_number)})
    return {
        "title": _text,
        "notes": _list(_text),
        "start": _number,
        "step": _number,
        "frames": _whole(MOST_FRAMES + 1),
        "points": _list(_text),
        "origin": _list(_number, 3),
        "tracks": _floats(3 * frames * points),
        "links": _list(line),
        "guides": _list(guide),
        "ground": _list(point),
        "traced": _list(point),
        "right": _list(_number, 3),
        "up": _list(_number, 3),
        "flat": _truth,
        "solids": _list(_solid),
        "placed": _floats(7 * frames * solids),
        "struts": _list(_either(_record(ends), _record(path))),
        "arrows": _list(arrow),
        "loads": _list(arrow),
        "forces": _list(_one_of("arrows", "loads")),
        "marks": _list(_record({"t": _number, "kind": _one_of("change", "event"), "label": _text})),
        "times": _floats(times),
        "panels": _list(
            _record({"title": _text, "unit": _text, "lines": _list(curve), "untold": _number})
        ),
        "speeds": _list(_number),
        "speed": _number,
    }


def _paths(traced: int) -> Check:
    """A check of the paths of so many points, at times of their own."""

    def are_paths(value: Any) -> bool:
        count = _numbers(value.get("times")) if isinstance(value, dict) else 0
        fields = {"times": _floats(count), "points": _floats(3 * count * traced)}
        return count > 0 and _record(fields)(value)

    return are_paths


def _solid(value: Any) -> bool:
    if not isinstance(value, dict):
        return False
    fields: dict[str, Check] = {
        "kind": _one_of(*_KINDS), "label": _text, "name": _text, "sizes": _list(_number),
    }  # fmt: skip
    if "inferred" in value:
        fields["inferred"] = lambda told: told is True
    if value.get("kind") == "mesh":
        fields["triangles"] = _floats(None)
    return _record(fields)(value)


# -- kinds of values --------------------------------------------------------------------------


def _text(value: Any) -> bool:
    return isinstance(value, str) and len(value) <= LONGEST and (not value or value.isprintable())


def _truth(value: Any) -> bool:
    return isinstance(value, bool)


def _number(value: Any) -> bool:
    known = isinstance(value, (int, float)) and not isinstance(value, bool)
    return known and math.isfinite(value)


def _whole(below: int) -> Check:
    return lambda x: isinstance(x, int) and not isinstance(x, bool) and 0 <= x < below


def _one_of(*words: str) -> Check:
    return lambda value: isinstance(value, str) and value in words


def _either(one: Check, other: Check) -> Check:
    return lambda value: one(value) or other(value)


def _list(check: Check, length: int | None = None) -> Check:
    def is_list(values: Any) -> bool:
        fits = isinstance(values, list) and len(values) <= MOST_ENTRIES
        return fits and length in (None, len(values)) and all(map(check, values))

    return is_list


def _record(fields: Mapping[str, Check]) -> Check:
    def is_record(value: Any) -> bool:
        same = isinstance(value, dict) and value.keys() == fields.keys()
        return same and all(check(value[key]) for key, check in fields.items())

    return is_record


def _floats(count: int | None) -> Check:
    """Finite numbers in single precision as base64; of triangles nine for each."""

    def are_floats(value: Any) -> bool:
        if not isinstance(value, str):
            return False
        try:
            content = base64.b64decode(value.encode("ascii"), validate=True)
        except (UnicodeEncodeError, binascii.Error):
            return False
        fits = len(content) % 36 == 0 if count is None else len(content) == 4 * count
        return fits and bool(np.isfinite(np.frombuffer(content, "<f4")).all())

    return are_floats
