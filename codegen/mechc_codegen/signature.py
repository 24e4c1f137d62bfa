"""The name of a binary whose scene is named before it is derived.

Derivation is a function of what was read and of the compiler's own files, so these stand in for
the texts that would come out of it.
"""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Iterator
from pathlib import Path

FOLDER = Path(__file__).parent
DECIDING = (".py", ".h", ".in")


def compiler_signature(digest: str, compiler: str, environment: str) -> str:
    """Hash of all that decides a binary."""
    whole = hashlib.sha256()
    for part in (digest, compiler, environment, platform.machine()):
        whole.update(f"{len(part)}:{part}".encode())
    for path in sorted(_deciding(str(FOLDER))):
        content = Path(path).read_bytes()
        whole.update(f"{path.removeprefix(str(FOLDER))} {len(content)}:".encode() + content)
    return whole.hexdigest()


def _deciding(folder: str) -> Iterator[str]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_dir():
                yield from _deciding(entry.path)
            elif entry.name.endswith(DECIDING):
                yield entry.path
