"""A folder of compiled scenes that only its owner can write, safe between processes.

An entry is a folder named by the hash of all that decides the binary; it holds the shared object
and its checksum.  It is written aside and moved in place under a lock, verified on every load,
and made again when damaged.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from mechc.errors import CacheError

SHARED_OBJECT, CHECKSUM = "scene.so", "scene.sha256"
_KEY = re.compile(r"[0-9a-f]{64}")


def cache_folder() -> Path:
    """``$MECHC_CACHE_DIR``, else ``mechc`` in the user's cache folder."""
    if chosen := os.environ.get("MECHC_CACHE_DIR"):
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(base).expanduser() / "mechc"


def entry(key: str, make: Callable[[Path], None]) -> Path:
    """The shared object of an entry, made by ``make(folder)`` if it is not there and sound.

    Raises
    ------
    CacheError
        If the cache folder cannot be used safely; the message says why.
    """
    root = _safe_folder(cache_folder())
    target = root / key
    with _locked(root / f"{key}.lock"):
        if not _sound(target):
            _replace(root, target, make)
    return target / SHARED_OBJECT


def is_key(text: object) -> bool:
    """Whether a text can be the name of an entry."""
    return isinstance(text, str) and _KEY.fullmatch(text) is not None


def entries() -> list[Path]:
    """Folders of all entries, and of nothing else that may lie beside them."""
    root = cache_folder()
    found = root.iterdir() if root.is_dir() else ()
    return sorted(p for p in found if _KEY.fullmatch(p.name) and p.is_dir())


def clear() -> int:
    """Remove every entry; how many there were."""
    found = entries()
    if found:
        _refuse_foreign(cache_folder())
    for folder in found:
        lock = folder.with_name(f"{folder.name}.lock")
        with _locked(lock):
            shutil.rmtree(folder, ignore_errors=True)
            lock.unlink()
    return len(found)


def check() -> Path:
    """The cache folder; raises :class:`CacheError` if it is there and cannot be used safely."""
    root = cache_folder()
    existing = next(path for path in (root, *root.absolute().parents) if path.exists())
    if existing == root:
        _refuse_foreign(root)
    if not os.access(existing, os.W_OK):
        raise CacheError(f"{root} cannot be written; set MECHC_CACHE_DIR to a folder of yours")
    return root


def _replace(root: Path, target: Path, make: Callable[[Path], None]) -> None:
    for left_behind in root.glob(f".new-{target.name}-*"):  # by a process that was killed
        shutil.rmtree(left_behind)
    aside = Path(tempfile.mkdtemp(prefix=f".new-{target.name}-", dir=root))
    try:
        make(aside)
        (aside / CHECKSUM).write_text(_checksum(aside / SHARED_OBJECT))
        if target.exists():
            shutil.rmtree(target)
        aside.rename(target)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _sound(folder: Path) -> bool:
    """Whether the entry is whole and ours."""
    try:
        _refuse_foreign(folder)
        return (folder / CHECKSUM).read_text() == _checksum(folder / SHARED_OBJECT)
    except (OSError, UnicodeDecodeError):
        return False


def _checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _safe_folder(root: Path) -> Path:
    try:
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise CacheError(
            f"the cache folder {root} cannot be made ({error.strerror}); set MECHC_CACHE_DIR to "
            "a folder of yours"
        ) from None
    _refuse_foreign(root)
    if not os.access(root, os.W_OK):
        raise CacheError(
            f"the cache folder {root} is read-only; set MECHC_CACHE_DIR to a folder of yours"
        )
    return root


def _refuse_foreign(folder: Path) -> None:
    """Compiled code is loaded from here, so nobody else may be able to write it."""
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode):
        raise CacheError(f"{folder} is not a folder; remove it or set MECHC_CACHE_DIR")
    if status.st_uid != os.getuid():
        raise CacheError(f"{folder} belongs to another user; set MECHC_CACHE_DIR to one of yours")
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise CacheError(f"{folder} can be written by others: chmod 700 it, or set MECHC_CACHE_DIR")


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """One process at a time; the lock goes with the process that holds it."""
    while True:
        with path.open("w") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            if _names(path, file.fileno()):
                yield
                return


def _names(path: Path, descriptor: int) -> bool:
    """Whether the path still is the open file; :func:`clear` may have removed it meanwhile."""
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
