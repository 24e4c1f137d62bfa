"""Files: opened and locked where operating systems differ, and written whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from secrets import token_hex
from typing import Any

from mechc.errors import MechcError, brief

ON_WINDOWS = sys.platform == "win32"
_PRIVATE = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)  # not for child processes
# A file itself, not a link, and without waiting for the other end of a pipe.  Windows has no such
# flags: there pipes have no names in folders, and links need an administrator's right.
_PLAIN = _PRIVATE | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
READ = os.O_RDONLY | _PLAIN
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL}


def path_of(given: Any) -> Path:
    """The path that a caller gives; raises ``TypeError`` for anything but a text or a path."""
    try:
        return Path(given)
    except TypeError:
        raise TypeError(f"a path is a text or a pathlib.Path, not {brief(given)}") from None


@contextmanager
def file_lock(path: Path, *, wait: bool = True) -> Iterator[bool]:
    """Hold the lock of a file, which ends with the process; yields whether it is held.

    It is not held where another has it, unless this waits, nor on network file systems without
    locks: there, two processes may do the same work at once.
    """
    from filelock import FileLock, Timeout

    lock = FileLock(path, poll_interval=0.01, fallback_to_soft=False)
    try:
        lock.acquire(blocking=wait)
    except Timeout:
        pass
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
    try:
        yield lock.is_locked
    finally:
        lock.release()


@contextmanager
def held_file(path: Path) -> Iterator[None]:
    """Hold a new file for as long as it is written, so that :func:`remove_unheld` leaves it."""
    if ON_WINDOWS:  # where a lock would keep others from writing
        yield
        return
    import fcntl

    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | _PLAIN, 0o666)
    try:
        with suppress(OSError):  # network file systems without locks
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(descriptor)


def remove_unheld(path: Path) -> None:
    """Remove a file that was held by a process which has ended."""
    if ON_WINDOWS:
        return
    import fcntl

    with suppress(OSError):
        descriptor = os.open(path, os.O_RDWR | _PLAIN)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()
        finally:
            os.close(descriptor)


def in_forked_child(function: Callable[[], Any]) -> None:
    """Call it in every process that is forked from this one; Windows has none."""
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=function)


def unlink_open(path: Path) -> None:
    """Remove a file that is open here; Windows keeps it."""
    if not ON_WINDOWS:
        path.unlink(missing_ok=True)


def sync(path: Path) -> None:
    """Wait until a file, or the entries of a folder, are on the disk.

    Windows opens no folders, and syncs what is open for writing.
    """
    if ON_WINDOWS and path.is_dir():
        return
    descriptor = os.open(path, (os.O_RDWR if ON_WINDOWS else os.O_RDONLY) | _PRIVATE)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def owned_by_another(status: os.stat_result) -> bool:
    """Whether a file belongs to another user; Windows does not tell that in a file's status."""
    return hasattr(os, "getuid") and status.st_uid != os.getuid()


def writable_by_others(status: os.stat_result) -> bool:
    """Whether others may write a file; Windows has lists of access rights, which this is not."""
    return not ON_WINDOWS and bool(status.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


# -- files that are complete or absent: written elsewhere, synced, moved into place ---------------


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path next to ``path`` to write to; moved into its place on success.

    The content is on the disk before it gets the name, so that neither a full disk nor a loss of
    power leaves an incomplete file.

    Raises :class:`MechcError` if the operating system refuses; it names the file, which is then
    unchanged.
    """
    part = path.with_name(f".{path.name}.{token_hex(8)}.part")  # where nobody can put a link
    try:
        remove_parts(path.parent, escape(path.name))
        with held_file(part):
            yield part
            sync(part)
            part.replace(path)
        sync(path.parent)
    except OSError as error:
        raise MechcError(f"cannot write {path}: {error.strerror or error}") from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def remove_parts(folder: Path, names: str = "*") -> None:
    """Remove what killed processes left of files: what no process is writing."""
    for part in folder.glob(f".{names}.{'[0-9a-f]' * 16}.part"):
        remove_unheld(part)


def write_text(path: Path, text: str) -> None:
    """Write a text file; see :func:`replacing`."""
    with replacing(path) as part:
        part.write_text(text, "utf-8")


@contextmanager
def written_into(folder: Path, advice: str = "") -> Iterator[None]:
    """Turn errors of the operating system into errors that name folder or file, with advice.

    The error of a full disk has no file name.
    """
    try:
        yield
    except OSError as error:
        place = error.filename if isinstance(error.filename, str) else folder
        told = f"cannot write into {place}: {error.strerror or error}{advice}"
        raise MechcError(told) from None
