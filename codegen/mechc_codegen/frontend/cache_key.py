"""The cache key of a binary, known before its scene is derived.

Derivation is a function of the scene's digest and of the compiler's own files, so these replace the
generated texts in the key.
"""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Iterator
from pathlib import Path

import sympy

FOLDER = Path(__file__).parents[1]
DECIDING = (".py", ".h", ".in")


def compiler_signature(digest: str, compiler: str, environment: str, files: str) -> str:
    """Hash of all that decides a binary; ``files`` is :func:`files_digest`."""
    whole = hashlib.sha256()
    for part in (digest, compiler, environment, files, platform.machine(), sympy.__version__):
        whole.update(f"{len(part)}:{part}".encode())
    return whole.hexdigest()


def files_stamp() -> str:
    """A hash that changes when any of the compiler's own files is changed or replaced.

    Sizes, times and inode numbers, the time of the last change to the inode among them, which
    no program can set back: found many times faster than contents are read.
    """
    stamp = hashlib.sha256()
    for entry in sorted(_deciding(str(FOLDER)), key=lambda entry: entry.path):
        status = entry.stat()
        identity = (status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)
        stamp.update(f"{entry.path} {identity}\n".encode())
    return stamp.hexdigest()


def files_digest() -> str:
    """Hash of the contents of the compiler's own files."""
    whole = hashlib.sha256()
    for path in sorted(entry.path for entry in _deciding(str(FOLDER))):
        content = Path(path).read_bytes()
        whole.update(f"{path.removeprefix(str(FOLDER))} {len(content)}:".encode() + content)
    return whole.hexdigest()


def _deciding(folder: str) -> Iterator[os.DirEntry[str]]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_dir():
                yield from _deciding(entry.path)
            elif entry.name.endswith(DECIDING):
                yield entry
