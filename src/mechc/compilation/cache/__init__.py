"""Compiled scenes in a folder that only its owner can write, safe between processes.

An entry is a folder named by the hash of all that decides the binary; it contains the shared object
and a seal, the hash of that name and of the content.  It is written elsewhere and moved into place
under a lock, verified on every load, and made again when damaged.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from mechc.compilation.cache.security import (
    UnwritableError,
    folder_of_process,
    is_chosen,
    private_folder,
    refuse_foreign,
    refuse_open_parents,
    refuse_unsafe,
    unwritable,
    writable,
)
from mechc.compilation.cache.security import cache_folder as cache_folder
from mechc.compilation.cache.size import keep_within, note_use
from mechc.errors import CacheError, CompilerError
from mechc.files import READ, file_lock, owned_by_another, unlink_open, writable_by_others

SHARED_OBJECT, SEAL = "scene.so", "scene.seal"
_PART, _NOTE = r"\.[a-z0-9]+", ".note"
_OF_ALL = ".general"  # what serves many scenes
_KEY = re.compile(r"[0-9a-f]{64}")
_OF_SCENE = re.compile(rf"([0-9a-f]{{64}})(?:{_PART})?")
_OURS = re.compile(rf"(?:\.new-)?([0-9a-f]{{64}}(?:(?!\.lock){_PART})?)(?:\.lock|-.*)?")
_FULL = (errno.ENOSPC, errno.EDQUOT)


def entry(key: str, make: Callable[[Path], None]) -> Path:
    """The shared object of an entry, made by ``make(folder)`` if it is missing or damaged.

    Where the default cache folder cannot be written, in a folder that is removed with the process,
    with a :class:`CacheWarning`; a folder that ``$MECHC_CACHE_DIR`` names must be usable.

    Raises :class:`CacheError` if the cache folder cannot be used safely; the message says why.
    """
    try:
        return _entry(writable(cache_folder()), key, make)
    except UnwritableError as error:
        if is_chosen():
            raise CacheError(str(error)) from None
        return _entry(folder_of_process(error), key, make)


def find(key: str) -> Path | None:
    """The shared object of an undamaged entry, in the cache or what this process has instead of it;
    nothing is written.

    Raises :class:`CacheError` if the cache folder cannot be used safely; the message says why.
    """
    for root in filter(None, (cache_folder(), private_folder())):
        with suppress(OSError):
            refuse_unsafe(root)
            if _sound(root / key):
                note_use(root / key, SEAL)
                return root / key / SHARED_OBJECT
    return None


@contextmanager
def copied(key: str, shared: Path) -> Iterator[Path]:
    """A copy of a shared object, the entry of this key or an installed one, removed afterwards."""
    with ExitStack() as made:
        try:
            own = _copy(shared, made, prefix=f".new-{key}-", dir=writable(cache_folder()))
        except (OSError, UnwritableError):
            own = _copy(shared, made, prefix="mechc-")
        yield own


def _copy(shared: Path, made: ExitStack, **where: Any) -> Path:
    folder = tempfile.mkdtemp(**where)
    made.callback(shutil.rmtree, folder, ignore_errors=True)
    return Path(shutil.copy(shared, folder))


def identity(shared: Path) -> tuple[int, int] | None:
    """A mark that tells this shared object from one that replaced it; None if it was removed."""
    try:
        status = shared.stat()
    except OSError:
        return None
    return status.st_ino, status.st_mtime_ns


def discard(key: str, known: tuple[int, int] | None) -> None:
    """Remove an entry that cannot be used here, if it is still the one of this identity."""
    root = cache_folder()
    with suppress(OSError), file_lock(root / f"{key}.lock"):
        if known is not None and identity(root / key / SHARED_OBJECT) == known:
            shutil.rmtree(root / key, ignore_errors=True)


def cached_hash(what: str, stamp: str, make: Callable[[], str]) -> str:
    """The hash ``make()``, or its stored result for the same stamp.

    A note that cannot be read or written is ignored: it only saves time.
    """
    root = cache_folder()
    note = root / f"{what}{_NOTE}"
    with suppress(OSError, UnicodeDecodeError):
        refuse_unsafe(root)
        known, _, value = _content(note).decode("ascii").partition(" ")
        if known == stamp and is_key(value):
            return value
    value = make()
    with suppress(OSError, UnwritableError):
        _write_aside(writable(root), note, f"{stamp} {value}")
    return value


def unit_key(signature: str) -> str:
    """The name of the entry of the unit with this signature, which serves many scenes."""
    return f"{signature}{_OF_ALL}"


def is_unit_key(text: str) -> bool:
    """Whether a text can be the name of an entry that serves many scenes."""
    return text.endswith(_OF_ALL) and is_key(text.removesuffix(_OF_ALL))


def is_key(text: object) -> bool:
    """Whether a text can be the name of an entry."""
    return isinstance(text, str) and _KEY.fullmatch(text) is not None


def scenes() -> dict[str, list[Path]]:
    """The folders of each scene of which anything is compiled, by its key."""
    root, found = cache_folder(), dict[str, list[Path]]()
    for path in sorted(root.iterdir() if root.is_dir() else ()):
        match = None if path.suffix == _OF_ALL else _OF_SCENE.fullmatch(path.name)
        if match and path.is_dir():
            found.setdefault(match[1], []).append(path)
    return found


def part_key(key: str, part: str) -> str:
    """The key of the entry of a part of a scene."""
    return f"{key}.{part}"


def clear() -> int:
    """Remove all entries, their locks and temporary files; the number of entries.

    Waits for entries that another process is making.
    """
    found, root = scenes(), cache_folder()
    keys = _keys(root)
    if keys:
        refuse_foreign(root)
    for key in keys:
        lock = root / f"{key}.lock"
        with file_lock(lock):
            for folder in (root / key, *root.glob(f".new-{key}-*")):
                shutil.rmtree(folder, ignore_errors=True)
            unlink_open(lock)
    (root / f"compiler{_NOTE}").unlink(missing_ok=True)
    return len(found)


def _keys(root: Path) -> list[str]:
    """Names of entries, of their locks, and of their temporary files."""
    ours = [_OURS.fullmatch(path.name) for path in (root.iterdir() if root.is_dir() else ())]
    return sorted({match[1] for match in ours if match})


def check() -> Path:
    """The cache folder; raises :class:`CacheError` if it exists and cannot be used safely."""
    root = cache_folder()
    existing = next(path for path in (root, *root.absolute().parents) if path.exists())
    if existing == root:
        refuse_foreign(root)
    refuse_open_parents(root)
    if not os.access(existing, os.W_OK):
        raise CacheError(f"{root} cannot be written; set MECHC_CACHE_DIR to a folder that you own")
    return root


def _entry(root: Path, key: str, make: Callable[[Path], None]) -> Path:
    target, made = root / key, False
    try:
        with file_lock(root / f"{key}.lock") as alone:
            if not _sound(target):
                _replace(root, target, make, alone)
                made = True
        if made:
            keep_within(root, _keys(root), SEAL, key, _OF_ALL)
    except OSError as error:
        raise unwritable(root, error) from None
    except CompilerError as error:
        full = next((n for n in _FULL if os.strerror(n) in str(error)), None)
        if full is None:
            raise
        raise unwritable(root, OSError(full, os.strerror(full))) from error
    return target / SHARED_OBJECT


def _replace(root: Path, target: Path, make: Callable[[Path], None], alone: bool) -> None:
    for left_behind in root.glob(f".new-{target.name}-*") if alone else ():  # by a killed process
        shutil.rmtree(left_behind, ignore_errors=True)
    aside = Path(tempfile.mkdtemp(prefix=f".new-{target.name}-", dir=root))
    try:
        make(aside)
        shared, seal = aside / SHARED_OBJECT, aside / SEAL
        seal.write_text(_seal(target.name, shared.read_bytes()))
        for file in (shared, seal):
            file.chmod(0o600)  # whatever the umask
        if target.exists():
            shutil.rmtree(target)
        try:
            aside.rename(target)
        except OSError:
            if not _sound(target):  # without locks another process may have been first
                raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _sound(folder: Path) -> bool:
    """Whether an entry is complete, the user's, and has the right seal."""
    try:
        refuse_foreign(folder)
        seal = _content(folder / SEAL)
        return seal == _seal(folder.name, _content(folder / SHARED_OBJECT)).encode()
    except OSError:
        return False


def _seal(name: str, content: bytes) -> str:
    """The hash includes the entry's name: a copy under another name is not valid."""
    return hashlib.sha256(f"{name}\n".encode() + content).hexdigest()


def _content(path: Path) -> bytes:
    """A file that the user owns and nobody else can write; links are refused."""
    with open(os.open(path, READ), "rb") as file:
        status = os.fstat(file.fileno())
        foreign = owned_by_another(status) or writable_by_others(status)
        if not stat.S_ISREG(status.st_mode) or foreign:
            raise PermissionError(errno.EPERM, "not a file of the user's alone", str(path))
        return file.read()


def _write_aside(root: Path, path: Path, text: str) -> None:
    """Write a file that others may read at the same time: they read the old one or the new one."""
    descriptor, aside = tempfile.mkstemp(prefix=f".new-{path.name}-", dir=root)
    try:
        with open(descriptor, "w") as file:
            file.write(text)
        os.replace(aside, path)
    finally:
        Path(aside).unlink(missing_ok=True)
