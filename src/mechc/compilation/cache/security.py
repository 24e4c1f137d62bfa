"""The folder of compiled scenes, and checks that nobody else can put code there."""

from __future__ import annotations

import atexit
import os
import shutil
import stat
import tempfile
import warnings
from pathlib import Path

from mechc.errors import CacheError, CacheWarning
from mechc.files import ON_WINDOWS, owned_by_another, writable_by_others

_temporary: dict[int, Path] = {}


class UnwritableError(CacheError):
    """The cache folder is safe, but nothing can be put into it."""


def cache_folder() -> Path:
    """``$MECHC_CACHE_DIR``, else ``mechc`` in the user's cache folder."""
    if chosen := os.environ.get("MECHC_CACHE_DIR"):
        return _resolve(Path(chosen))
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return _resolve(Path(base) / "mechc")


def _resolve(folder: Path) -> Path:
    """The path with ``~`` expanded and symbolic links followed: their target is checked."""
    try:
        return folder.expanduser().resolve()
    except (RuntimeError, OSError) as error:
        raise CacheError(f"the cache folder {folder} cannot be found: {error}") from None


def writable(root: Path) -> Path:
    """The folder, made if it is missing; raises :class:`CacheError` unless it is safe."""
    try:
        _make_private(root)
    except OSError as error:
        raise unwritable(root, error) from None
    refuse_unsafe(root)
    if not os.access(root, os.W_OK):
        raise UnwritableError(
            f"the cache folder {root} is read-only; set MECHC_CACHE_DIR to a folder that you own"
        )
    return root


def _make_private(folder: Path) -> None:
    """Make a folder and its parents for the user only, whatever the umask."""
    if folder.exists() and folder.is_dir():
        return
    if not folder.parent.exists():
        _make_private(folder.parent)
    folder.mkdir(mode=0o700, exist_ok=True)


def unwritable(root: Path, error: OSError) -> UnwritableError:
    """The error of the operating system, with what to do about it."""
    return UnwritableError(
        f"the cache folder {root} cannot be made or written ({error.strerror or error}): make "
        "room or repair it, or set MECHC_CACHE_DIR to a folder that you own"
    )


def is_chosen() -> bool:
    """Whether the user set the folder of compiled scenes."""
    return bool(os.environ.get("MECHC_CACHE_DIR"))


def folder_of_process(why: CacheError) -> Path:
    """A private folder that is removed with this process, with a warning."""
    process = os.getpid()
    if process not in _temporary:
        try:
            _temporary[process] = Path(tempfile.mkdtemp(prefix="mechc-")).resolve()
        except OSError as error:
            raise CacheError(f"{why}; nor is there a temporary folder ({error})") from None
        atexit.register(_remove, _temporary[process], process)
        warnings.warn(
            f"{why}. Until then compiled scenes are kept as long as this process runs.",
            CacheWarning,
            stacklevel=2,
        )
    return refuse_unsafe(_temporary[process])


def private_folder() -> Path | None:
    """The folder of :func:`folder_of_process`, if it was made."""
    return _temporary.get(os.getpid())


def _remove(folder: Path, process: int) -> None:
    if os.getpid() == process:  # not in a process forked from it
        shutil.rmtree(folder, ignore_errors=True)


def refuse_unsafe(root: Path) -> Path:
    """Raise :class:`CacheError` where others could put code."""
    refuse_foreign(root)
    refuse_open_parents(root)
    return root


def refuse_foreign(folder: Path) -> None:
    """Raise where others own or can write a folder that compiled code is loaded from."""
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode):
        raise CacheError(f"{folder} is not a folder; remove it or set MECHC_CACHE_DIR")
    if owned_by_another(status):
        raise CacheError(f"{folder} belongs to another user; set MECHC_CACHE_DIR to one of yours")
    if writable_by_others(status):
        raise CacheError(f"{folder} can be written by others: chmod 700 it, or set MECHC_CACHE_DIR")


def refuse_open_parents(folder: Path) -> None:
    """Raise where others can write a folder above, and so replace this one, unless it is sticky.

    Windows keeps the folders of a user from others by lists of access rights: nothing is checked.
    """
    if ON_WINDOWS:
        return
    for parent in folder.parents:
        if not parent.exists():
            continue
        status = parent.stat()
        by_group = status.st_mode & stat.S_IWGRP and not _private_group(status.st_gid)
        writable = by_group or status.st_mode & stat.S_IWOTH
        if writable and not status.st_mode & stat.S_ISVTX:
            raise CacheError(
                f"{parent}, above the cache folder {folder}, can be written by others, who could "
                "put their code there: chmod go-w it, or set MECHC_CACHE_DIR"
            )
        if status.st_uid != 0 and owned_by_another(status):
            raise CacheError(
                f"{parent}, above the cache folder {folder}, belongs to another user; set "
                "MECHC_CACHE_DIR to a folder that you own"
            )


def _private_group(group: int) -> bool:
    """Whether a group is the user's private one, which many systems make for every user."""
    import grp  # Windows has neither
    import pwd

    try:
        told, user = grp.getgrgid(group), pwd.getpwuid(os.getuid())
    except KeyError:
        return False
    return told.gr_name == user.pw_name and set(told.gr_mem) <= {user.pw_name}
