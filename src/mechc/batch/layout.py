"""The layout of a batch's arrays in a Zarr group of format 3, and checks of a folder's layout.

Numbers are stored as in memory, without compression: no decoder reads untrusted or damaged data,
and a file is as large as its chunk.  The folder's metadata of an array are compared with those that
follow from the request before Zarr reads them.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from mechc.batch.spec import Recipe
from mechc.errors import MechcError
from mechc.files import READ
from mechc.native._codes import COUNTERS
from mechc.results.untrusted import printable, read_json
from mechc.system.system import System

METADATA = "zarr.json"
_LARGEST_METADATA = 2**20  # bytes
_KINDS = {"float64": np.float64, "int64": np.int64, "int16": np.int16}
_EVERY_CHUNK = {"array.write_empty_chunks": True}  # else one that holds blanks would be no file
_LARGEST_BLOCK = 2**20  # bytes


@dataclass(frozen=True)
class Layout:
    """Shape, type, members a chunk, and names of the dimensions of one stored array."""

    shape: tuple[int, ...]
    kind: str
    members: int
    dimensions: tuple[str, ...]

    @property
    def chunk(self) -> tuple[int, ...]:
        """Shape of a chunk: all of the other dimensions, which may be empty."""
        return (max(self.members, 1), *(max(n, 1) for n in self.shape[1:]))

    @property
    def blank(self) -> float:
        """The value where nothing was computed."""
        return math.nan if self.kind == "float64" else 0

    @property
    def chunk_bytes(self) -> int:
        """Size of the file of a chunk."""
        return math.prod(self.chunk) * np.dtype(_KINDS[self.kind]).itemsize


def layouts(
    recipe: Recipe, width: int, tails: Mapping[str, tuple[int, ...]], size: int
) -> dict[str, Layout]:
    """Name of every array that the request makes -> its layout.

    ``width``: components of a state; ``tails``: output -> its shape at one state; ``size``:
    members a chunk.
    """
    times = len(recipe.t_eval)
    found: dict[str, tuple[tuple[int, ...], str]] = {
        "y0": ((width,), "float64"), "y": ((width,), "float64"), "t": ((), "float64"),
        **dict.fromkeys(COUNTERS, ((), "int64")),
        "least_singular": ((), "float64"), "critical_gap": ((), "float64"),
    }  # fmt: skip
    if recipe.states is None:
        found["miss"] = (), "float64"
    found |= {f"reduction_{i}": ((), "float64") for i in range(len(recipe.reductions))}
    if recipe.keep_states:
        found["y_eval"] = (times, width), "float64"
    for i, name in enumerate(recipe.outputs):
        found[f"output_{i}"] = (times, *tails[name]), "float64"
    if recipe.events is not None:
        events = (len(recipe.events.directions),)
        found |= {"event_counts": (events, "int64"), "event_latest": (events, "float64")}
        found["lowered_impacts"] = (), "int64"
    if recipe.sensitivities:
        columns = (width, len(recipe.sensitivities))
        found |= dict.fromkeys(("sensitivity_final", "sensitivity_max"), (columns, "float64"))
        found |= {"sensitivity": ((times, *columns), "float64")} if times else {}
    found["status"] = (), "int16"  # the last to be written
    members = min(size, recipe.count)
    return {
        name: Layout((recipe.count, *rest), kind, members, dimensions(name, 1 + len(rest)))
        for name, (rest, kind) in found.items()
    }


def output_shapes(system: System, recipe: Recipe) -> dict[str, tuple[int, ...]]:
    """Output -> its shape at one state, of the outputs requested."""
    shapes = system.data["shapes"]
    widths = system.scene.outputs
    return {name: tuple(shapes.get(name, (widths[name],))) for name in recipe.outputs}


def dimensions(name: str, rank: int) -> tuple[str, ...]:
    """Names of the dimensions of an array."""
    if name in ("y", "y0"):
        return ("member", "state")
    if name == "y_eval":
        return ("member", "time", "state")
    if name.startswith("sensitivity"):
        return ("member", *(("time",) if rank == 4 else ()), "state", "by")
    if name in ("event_counts", "event_latest"):
        return ("member", "event")
    if name.startswith("output_"):
        return ("member", "time", *(f"{name}_{i}" for i in range(rank - 2)))
    return ("member",)


def create(zarr: Any, path: Path, layout: Layout, attributes: Mapping[str, str]) -> Any:
    """A new array, in place of an existing one."""
    with zarr.config.set(_EVERY_CHUNK):
        return zarr.create_array(
            str(path),
            shape=layout.shape,
            chunks=layout.chunk,
            dtype=_KINDS[layout.kind],
            fill_value=layout.blank,
            filters=None,
            compressors=None,
            dimension_names=layout.dimensions,
            attributes=dict(attributes),
            zarr_format=3,
            overwrite=True,
        )


def check_chunk(path: Path, layout: Layout, first: int) -> None:
    """Raise :class:`MechcError`, which names the file, for a chunk of another size, or none."""
    for file in chunk_files(path, layout, first):
        try:
            status = file.lstat()
        except (FileNotFoundError, NotADirectoryError):
            raise MechcError(f"{file} is damaged: it is missing") from None
        if not stat.S_ISREG(status.st_mode) or status.st_size != layout.chunk_bytes:
            raise MechcError(f"{file} is damaged: it is not a file of {layout.chunk_bytes} bytes")


def chunk_files(path: Path, layout: Layout, first: int) -> list[Path]:
    """The file of the chunk that begins with the member ``first``."""
    counts = [-(-n // size) for n, size in zip(layout.shape[1:], layout.chunk[1:], strict=True)]
    row = str(first // layout.members)
    return [path.joinpath("c", row, *map(str, at)) for at in product(*map(range, counts))]


def open_array(zarr: Any, path: Path, layout: Layout, mode: str = "r") -> Any:
    """An array whose metadata are those of the layout, of which no data is read yet.

    Raises :class:`MechcError`, which names what differs.
    """
    try:
        held = read_json(path / METADATA, _LARGEST_METADATA)
    except FileNotFoundError:
        raise MechcError(f"{path} is damaged: it has no {METADATA}") from None
    described = {"storage_transformers": [], **held}
    described.pop("attributes", None)
    wanted = {
        "zarr_format": 3,
        "node_type": "array",
        "shape": list(layout.shape),
        "data_type": layout.kind,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(layout.chunk)}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": "NaN" if layout.kind == "float64" else 0,
        "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}],
        "dimension_names": list(layout.dimensions),
        "storage_transformers": [],
    }
    for key in sorted({*described, *wanted}):
        if json.dumps(described.get(key)) != json.dumps(wanted.get(key)):  # 1.0 is not 1
            raise MechcError(
                f"{path / METADATA} is damaged: {printable(key)} is not that of the request"
            )
    try:
        with zarr.config.set(_EVERY_CHUNK):
            return zarr.open_array(str(path), mode=mode, zarr_format=3)
    except OSError as error:
        raise MechcError(f"{path} cannot be read: {error.strerror or error}") from None


def stored_hash(path: Path, layout: Layout, first: int, last: int) -> Any:
    """The sha256 of members ``first`` to ``last`` - 1, read from their checked file in blocks."""
    found = hashlib.sha256()
    for name in chunk_files(path, layout, first):
        left = layout.chunk_bytes // layout.chunk[0] * (last - first)
        with open(os.open(name, READ), "rb") as file:
            while block := file.read(min(left, _LARGEST_BLOCK)):
                found.update(block)
                left -= len(block)
    return found
