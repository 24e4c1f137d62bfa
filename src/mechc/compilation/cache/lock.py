"""One process at a time, by a lock that ends with the process that holds it."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mechc.files import MAKE, in_forked_child, lock, unlock

_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL}
_open: set[int] = set()


def _close_in_child() -> None:
    """A forked process shares the locks of its parent; it closes them, so that they end with it."""
    for descriptor in _open:
        with suppress(OSError):
            os.close(descriptor)
    _open.clear()


in_forked_child(_close_in_child)


@contextmanager
def locked(path: Path) -> Iterator[bool]:
    """Waits until nobody else holds the lock of this file; False where there are no locks.

    Some network file systems have none.  There, two processes may do the same work at once.
    """
    while True:
        descriptor = os.open(path, MAKE, 0o600)
        _open.add(descriptor)
        try:
            held = _lock(descriptor, wait=True)
            if not _names(path, descriptor):
                continue  # it was removed, and another process may hold the new one
            yield held
            return
        finally:
            _release(descriptor)


@contextmanager
def locked_if_free(path: Path) -> Iterator[bool]:
    """Holds the lock of this file if nobody else does at the moment; whether it does."""
    descriptor = os.open(path, MAKE, 0o600)
    _open.add(descriptor)
    try:
        yield _lock(descriptor, wait=False) and _names(path, descriptor)
    finally:
        _release(descriptor)


def _lock(descriptor: int, *, wait: bool) -> bool:
    try:
        lock(descriptor, wait=wait)
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
            unlock(descriptor)
        os.close(descriptor)


def _names(path: Path, descriptor: int) -> bool:
    """Whether the path is still the open file; it may have been removed."""
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
