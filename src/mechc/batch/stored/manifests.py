"""Manifests: each certifies a chunk of a streamed batch, and is written after its data."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from mechc.batch.layout import Layout, check_chunk, chunk_files, digest, stored_digest
from mechc.errors import MechcError
from mechc.files import sync
from mechc.results.durable import write_text
from mechc.results.untrusted import read_json
from mechc.system.parameters import Array

_LARGEST = 2**20  # bytes


def path_of(notes: Path, first: int) -> Path:
    """The manifest of the chunk that begins with the member ``first``."""
    return notes / f"chunk-{first:012d}.json"


def write(notes: Path, data: Path, first: int, found: Mapping[str, Array],
          stored: Mapping[str, Layout]) -> None:  # fmt: skip
    """Write the manifest of a chunk whose arrays ``found`` have been written below ``data``.

    They are synced to the disk before the manifest is written.
    """
    for name, layout in stored.items():
        array = data / name
        there = [file for file in chunk_files(array, layout, first) if file.exists()]
        folders = {parent for file in there for parent in file.parents if array in parent.parents}
        for path in (*there, *folders, array):  # and every folder between them
            sync(path)
    sync(data)
    last = first + len(found["t"])
    hashes = {name: digest(found[name]) for name in stored}
    write_text(path_of(notes, first), json.dumps({"members": [first, last], "sha256": hashes}))


def damage(
    notes: Path, data: Path, stored: Mapping[str, Layout], first: int, last: int
) -> str | None:
    """The damage of a chunk that has a manifest; None if there is none."""
    try:
        told = read_json(path_of(notes, first), _LARGEST)
    except MechcError as error:
        return str(error)
    hashes = told.get("sha256")
    if told.get("members") != [first, last] or not isinstance(hashes, dict):
        return f"{path_of(notes, first)} is damaged: it is not the manifest of this chunk"
    for name, layout in stored.items():
        try:
            check_chunk(data / name, layout, first)
            sound = stored_digest(data / name, layout, first, last) == hashes.get(name)
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
    """Remove the manifest of a chunk, and its outcome: its members count as not run."""
    path_of(notes, first).unlink(missing_ok=True)
    sync(notes)
    for file in chunk_files(data / "status", stored["status"], first):
        with suppress(FileNotFoundError, NotADirectoryError):
            file.unlink()
