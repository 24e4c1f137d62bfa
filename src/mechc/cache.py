"""A folder of compiled scenes that only its owner can write, safe between processes.

An entry is a folder named by the hash of all that decides the binary; it holds the shared object
and its checksum.  It is written aside and moved in place under a lock, verified on every load,
and made again when damaged.
"""

from __future__ import annotations

import fcntl
import grp
import hashlib
import os
import pwd
import re
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mechc.errors import CacheError

SHARED_OBJECT, CHECKSUM = "scene.so", "scene.sha256"
_FIRST, _NOTE = ".first", ".note"
_KEY = re.compile(r"[0-9a-f]{64}")


def cache_folder() -> Path:
    """``$MECHC_CACHE_DIR``, else ``mechc`` in the user's cache folder."""
    if chosen := os.environ.get("MECHC_CACHE_DIR"):
        return _resolved(Path(chosen))
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return _resolved(Path(base) / "mechc")


def _resolved(folder: Path) -> Path:
    """With ``~`` expanded and symbolic links followed: what is there in the end is judged."""
    try:
        return folder.expanduser().resolve()
    except (RuntimeError, OSError) as error:
        raise CacheError(f"the cache folder {folder} cannot be found: {error}") from None


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


def find(key: str) -> Path | None:
    """The shared object of an entry that is there and sound.

    Raises
    ------
    CacheError
        If the cache folder cannot be used safely; the message says why.
    """
    target = _safe_folder(cache_folder()) / key
    return target / SHARED_OBJECT if _sound(target) else None


def remembered(what: str, stamp: str, make: Callable[[], str]) -> str:
    """``make()``, a hash, or what it gave when the stamp was last the same.

    A note that cannot be read or written is no matter: it only saves time.
    """
    note = _safe_folder(cache_folder()) / f"{what}{_NOTE}"
    with suppress(OSError, UnicodeDecodeError):
        known, _, value = note.read_text("ascii").partition(" ")
        if known == stamp and is_key(value):
            return value
    value = make()
    with suppress(OSError):
        _write_aside(note, f"{stamp} {value}")
    return value


def _write_aside(path: Path, text: str) -> None:
    """Write a file that others may read meanwhile: they find the old one or the new one."""
    with tempfile.NamedTemporaryFile(
        "w", dir=path.parent, prefix=f".new-{path.name}-", delete=False
    ) as file:
        file.write(text)
    os.replace(file.name, path)


def is_key(text: object) -> bool:
    """Whether a text can be the name of an entry."""
    return isinstance(text, str) and _KEY.fullmatch(text) is not None


def entries() -> list[Path]:
    """Folders of all entries, and of nothing else that may lie beside them."""
    root = cache_folder()
    found = root.iterdir() if root.is_dir() else ()
    return sorted(p for p in found if _KEY.fullmatch(p.name) and p.is_dir())


def first_key(key: str) -> str:
    """The key beside an entry under which its first unit lies."""
    return f"{key}{_FIRST}"


def clear() -> int:
    """Remove every entry, and first units of entries; how many entries there were."""
    found = entries()
    root = cache_folder()
    firsts = [p for p in root.glob(f"*{_FIRST}") if _KEY.fullmatch(p.stem) and p.is_dir()]
    if found or firsts:
        _refuse_foreign(root)
    for folder in (*found, *firsts):
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
    _refuse_open_parents(root)
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
    _refuse_open_parents(root)
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


def _refuse_open_parents(folder: Path) -> None:
    """Who can write a folder above can put another one in place, unless it is sticky."""
    for parent in folder.parents:
        if not parent.exists():
            continue
        status = parent.stat()
        by_group = status.st_mode & stat.S_IWGRP and not _private_group(status.st_gid)
        writable = by_group or status.st_mode & stat.S_IWOTH
        if writable and not status.st_mode & stat.S_ISVTX:
            raise CacheError(
                f"{parent}, above the cache folder {folder}, can be written by others, who could "
                "put code of theirs there: chmod go-w it, or set MECHC_CACHE_DIR"
            )
        if status.st_uid not in (0, os.getuid()):
            raise CacheError(
                f"{parent}, above the cache folder {folder}, belongs to another user; set "
                "MECHC_CACHE_DIR to a folder of yours"
            )


def _private_group(group: int) -> bool:
    """Whether it is the user's own group, as many systems make one for every user."""
    try:
        told, user = grp.getgrgid(group), pwd.getpwuid(os.getuid())
    except KeyError:
        return False
    return told.gr_name == user.pw_name and set(told.gr_mem) <= {user.pw_name}


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
