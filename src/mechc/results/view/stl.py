"""The triangles of an STL file, binary or text; files of users are untrusted.

Source of the format: 3D Systems, StereoLithography Interface Specification (1989).
"""

from __future__ import annotations

import re
from array import array
from pathlib import Path
from typing import Final

import numpy as np

from mechc.errors import MechcError
from mechc.results.untrusted import printable, read_regular
from mechc.system.parameters import Array

MOST_TRIANGLES: Final = 500_000
HEADER: Final = 84  # bytes of a binary file before its triangles
RECORD: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])
LARGEST: Final = 2**26  # bytes
VERTEX: Final = re.compile(rb"(?<!\S)vertex(?!\S)(?:\s++(\S++)\s++(\S++)\s++(\S++)(?=\s))?")


def read_stl(path: str) -> Array:
    """Corners of the triangles, (triangles, 3, 3) in the units of the file.

    Raises :class:`MechcError` if the file is missing, too large, or no STL file.
    """
    try:
        content = read_regular(Path(path), LARGEST)
    except FileNotFoundError:
        raise MechcError(f"there is no file {printable(path)}") from None
    count = int.from_bytes(content[80:HEADER], "little")
    corners: Array | None
    if len(content) >= HEADER and len(content) == HEADER + count * RECORD.itemsize:
        corners = np.frombuffer(content, RECORD, offset=HEADER)["corners"].astype(float)
    else:
        corners = _text(content)
    if corners is None or not len(corners) or not np.isfinite(corners).all():
        raise MechcError(f"{printable(path)} is damaged: it has no triangles of STL")
    if len(corners) > MOST_TRIANGLES:
        raise MechcError(
            f"{printable(path)} has {len(corners)} triangles, {MOST_TRIANGLES} at most are drawn"
        )
    return corners


def _text(content: bytes) -> Array | None:
    if content.split(maxsplit=1)[:1] != [b"solid"]:
        return None
    numbers = array("d")  # vertex by vertex: all words at once take many times the file
    try:
        for vertex in VERTEX.finditer(content):
            numbers.extend(map(float, vertex.groups()))
    except (TypeError, ValueError):  # fewer than three words follow, or they are no numbers
        return None
    return np.array(numbers).reshape(-1, 3, 3) if len(numbers) % 9 == 0 else None
