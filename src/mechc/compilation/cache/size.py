"""Keeps the cache within a size: the least recently used entries are removed first."""

from __future__ import annotations

import os
import shutil
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from mechc.errors import CacheError
from mechc.files import file_lock, unlink_open

LARGEST = 2**30  # bytes, by default
_LATELY = 3600.0  # s between two records of uses
_ABANDONED = 24 * 3600.0  # s: older unfinished files are left from a killed process


class StoredEntry(NamedTuple):
    """An entry: when it was last used (s since 1970), its bytes, its folder."""

    used: float
    size: int
    folder: Path


def most_bytes() -> int:
    """``$MECHC_CACHE_SIZE`` in MiB, else 1 GiB.

    Raises :class:`CacheError` if it is no number.
    """
    told = os.environ.get("MECHC_CACHE_SIZE", "").strip()
    if not told:
        return LARGEST
    if not told.isascii() or not told.isdigit() or len(told) > 12:
        raise CacheError(f"MECHC_CACHE_SIZE = {told!r} must be a whole number of MiB")
    return int(told) * 2**20


def note_use(folder: Path, seal: str) -> None:
    """Record the use of an entry: it is the last to be removed."""
    with suppress(OSError):
        if time.time() - (folder / seal).stat().st_mtime > _LATELY:
            os.utime(folder / seal)


def keep_within(root: Path, keys: list[str], seal: str, kept: str, of_all: str) -> None:
    """Remove entries until the cache has its allowed size, but not the entry ``kept``, nor those
    that were used lately and whose names end by ``of_all``: what was kept may need one.

    ``keys``: names of all entries and locks; locks without an entry are removed too.  Entries that
    another process is making or loading are not touched.
    """
    found: list[StoredEntry] = []
    for key in keys:
        with suppress(OSError):
            size = sum(file.lstat().st_size for file in (root / key).iterdir())
            found.append(StoredEntry((root / key / seal).stat().st_mtime, size, root / key))
    found.sort()
    size, most = sum(entry.size for entry in found), most_bytes()
    lately = time.time() - 2.0 * _LATELY
    for used, own, folder in found:
        needed = folder.name == kept or (folder.suffix == of_all and used > lately)
        if size > most and not needed and _remove(root, folder.name):
            size -= own
    with_entry = {entry.folder.name for entry in found}
    for key in {*keys} - with_entry - {kept}:
        _remove(root, key, unless_entry=True)  # another process may have made it by now


def _remove(root: Path, key: str, unless_entry: bool = False) -> bool:
    """Remove an entry, its lock and its temporary files, unless a process is using it."""
    lock = root / f"{key}.lock"
    try:
        with file_lock(lock, wait=False) as free:
            if not free or (unless_entry and (root / key).exists()):
                return False
            shutil.rmtree(root / key, ignore_errors=True)
            for unfinished in root.glob(f".new-{key}-*"):
                if time.time() - unfinished.stat().st_mtime > _ABANDONED:
                    shutil.rmtree(unfinished, ignore_errors=True)
            unlink_open(lock)
    except OSError:
        return False
    return not (root / key).exists()
