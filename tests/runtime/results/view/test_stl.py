"""STL files: both forms are read, and nothing else."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from mechc.errors import MechcError
from mechc.results.view import stl

CORNERS = np.array([[[0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 0, 0], [0, 2, 0], [0, 0, 3.5]]])


def binary(corners: np.ndarray, count: int | None = None) -> bytes:
    rows = [struct.pack("<12fH", 0, 0, 1, *c.ravel(), 0) for c in corners]
    return (
        b"solid that is binary".ljust(80) + struct.pack("<I", count or len(rows)) + b"".join(rows)
    )


def text(corners: np.ndarray) -> bytes:
    lines = ["solid part"]
    for triangle in corners:
        lines += ["facet normal 0 0 1", "outer loop"]
        lines += [f"vertex {x:g} {y:g} {z:e}" for x, y, z in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid part"]).encode()


@pytest.mark.parametrize("written", [binary(CORNERS), text(CORNERS)], ids=["binary", "text"])
def test_both_forms_are_read(tmp_path: Path, written: bytes) -> None:
    (tmp_path / "part.stl").write_bytes(written)
    np.testing.assert_allclose(stl.read_stl(str(tmp_path / "part.stl")), CORNERS)


@pytest.mark.parametrize(
    "damaged",
    [
        b"",
        b"solid",
        binary(CORNERS, 7),
        binary(CORNERS)[:-1],
        binary(CORNERS * np.nan),
        text(CORNERS).replace(b"3.5", b"x"),
        text(CORNERS)[:-60],
        text(CORNERS)[:-33],
        b"solid vertex vertex vertex",
    ],
)
def test_what_is_damaged_is_refused(tmp_path: Path, damaged: bytes) -> None:
    (tmp_path / "part.stl").write_bytes(damaged)
    with pytest.raises(MechcError, match="no triangles of STL"):
        stl.read_stl(str(tmp_path / "part.stl"))


def test_a_missing_file_a_link_and_too_many_triangles_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(MechcError, match="no file"):
        stl.read_stl(str(tmp_path / "none.stl"))
    (tmp_path / "part.stl").write_bytes(binary(CORNERS))
    (tmp_path / "link.stl").symlink_to(tmp_path / "part.stl")
    with pytest.raises(MechcError):
        stl.read_stl(str(tmp_path / "link.stl"))
    monkeypatch.setattr(stl, "MOST_TRIANGLES", 1)
    with pytest.raises(MechcError, match="1 at most"):
        stl.read_stl(str(tmp_path / "part.stl"))
