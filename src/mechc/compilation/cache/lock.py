"""One process at a time, by a lock that ends with the process that holds it."""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL}
_open: set[int] = set()


def _close_in_child() -> None:
    """A forked process shares the locks of its parent; it closes them, so that they end with it."""
    for descriptor in _open:
        with suppress(OSError):
            os.close(descriptor)
    _open.clear()


os.register_at_fork(after_in_child=_close_in_child)


@contextmanager
def locked(path: Path) -> Iterator[bool]:
    """Waits until nobody else holds the lock of this file; False where there are no locks.

    Some network file systems have none.  There, two processes may do the same work at once.
    """
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        _open.add(descriptor)
        try:
            held = _lock(descriptor)
            if not _names(path, descriptor):
                continue  # it was removed, and another process may hold the new one
            yield held
            return
        finally:
            _release(descriptor)


@contextmanager
def locked_if_free(path: Path) -> Iterator[bool]:
    """Holds the lock of this file if nobody else does at the moment; whether it does."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    _open.add(descriptor)
    try:
        yield _lock(descriptor, fcntl.LOCK_NB) and _names(path, descriptor)
    finally:
        _release(descriptor)


def _lock(descriptor: int, how: int = 0) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | how)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno in _NO_LOCKS:
            return False
        raise
    return True


def _release(descriptor: int) -> None:
    """Release the lock explicitly: a forked process may still have the file open."""
    if descriptor in _open:
        _open.discard(descriptor)
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_UN)
        os.close(descriptor)


def _names(path: Path, descriptor: int) -> bool:
    """Whether the path is still the open file; it may have been removed."""
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
