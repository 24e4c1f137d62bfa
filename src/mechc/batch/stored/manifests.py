"""Manifests: each certifies the first members of a chunk of a streamed batch.

It is written after their data, and again when more members of the chunk are there.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from mechc.batch.layout import Layout, check_chunk, chunk_files, stored_hash
from mechc.errors import MechcError
from mechc.files import sync, write_text
from mechc.results.untrusted import read_json

_LARGEST = 2**20  # bytes


def path_of(notes: Path, first: int) -> Path:
    """The manifest of the chunk that begins with the member ``first``."""
    return notes / f"chunk-{first:012d}.json"


def end_of(notes: Path, first: int, last: int) -> int:
    """The last member + 1 that the manifest of a chunk certifies; ``first`` where there is none.

    Raises as :func:`_read`.
    """
    try:
        return _read(notes, first, last)[0]
    except (FileNotFoundError, NotADirectoryError):
        return first


def _read(notes: Path, first: int, last: int) -> tuple[int, dict[str, Any]]:
    """The last member + 1 that a manifest certifies, and the sha256 of each array.

    Raises :class:`MechcError` if it is not one of this chunk, OSError if it cannot be read.
    """
    match read_json(path_of(notes, first), _LARGEST):
        case {"members": [begin, int(end)], "sha256": dict(digests)}:
            if begin == first < end <= last:
                return end, digests
    raise MechcError(f"{path_of(notes, first)} is damaged: it is not the manifest of this chunk")


def hashes_of(
    notes: Path, data: Path, stored: Mapping[str, Layout], first: int, end: int
) -> dict[str, Any]:
    """Hashes of the members ``first`` to ``end`` - 1, by array, to which more can be added."""
    if end == first:
        return {name: hashlib.sha256() for name in stored}
    return {name: stored_hash(data / name, each, first, end) for name, each in stored.items()}


def write(notes: Path, data: Path, first: int, end: int, hashes: Mapping[str, Any],
          stored: Mapping[str, Layout]) -> None:  # fmt: skip
    """Write the manifest of a chunk whose members ``first`` to ``end`` - 1 are below ``data``.

    They are synced to the disk before the manifest is written.
    """
    for name, layout in stored.items():
        array = data / name
        there = [file for file in chunk_files(array, layout, first) if file.exists()]
        folders = {parent for file in there for parent in file.parents if array in parent.parents}
        for path in (*there, *folders, array):  # and every folder between them
            sync(path)
    sync(data)
    digests = {name: hashes[name].hexdigest() for name in stored}
    write_text(path_of(notes, first), json.dumps({"members": [first, end], "sha256": digests}))


def damage(
    notes: Path, data: Path, stored: Mapping[str, Layout], first: int, last: int
) -> str | None:
    """The damage of a chunk that has a manifest; None if there is none."""
    try:
        last, digests = _read(notes, first, last)
    except MechcError as error:
        return str(error)
    for name, layout in stored.items():
        try:
            check_chunk(data / name, layout, first)
            found = stored_hash(data / name, layout, first, last).hexdigest()
            sound = found == digests.get(name)
        except (MechcError, OSError) as error:
            return f"{error} (members {first} to {last - 1})"
        if not sound:
            return f"{data / name} is damaged: members {first} to {last - 1} have another sha256"
    return None


def damaged_chunks(
    notes: Path, data: Path, stored: Mapping[str, Layout], ranges: Sequence[tuple[int, int]]
) -> Iterator[tuple[int, int, str]]:
    """Chunks that do not agree with their manifest: first, last + 1, what is wrong."""
    for first, last in ranges:
        if path_of(notes, first).exists():
            why = damage(notes, data, stored, first, last)
            if why is not None:
                yield first, last, why


def discard(notes: Path, data: Path, stored: Mapping[str, Layout], first: int) -> None:
    """Remove the manifest of a chunk, and its data: its members count as not run."""
    path_of(notes, first).unlink(missing_ok=True)
    sync(notes)
    for name, layout in stored.items():
        for file in chunk_files(data / name, layout, first):
            with suppress(FileNotFoundError, NotADirectoryError):
                file.unlink()
