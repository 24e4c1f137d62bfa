"""Untrusted files: bounded in size, plain data only, without control characters."""

from __future__ import annotations

import io
import json
import math
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import MechcError
from mechc.files import READ
from mechc.system.parameters import Array

if TYPE_CHECKING:
    import zipfile

LARGEST_TEXT = 64 * 2**20  # bytes of a JSON file: names and numbers
LARGEST_JSON = 2**30  # bytes of memory for the values of a JSON text
_VALUE = 100  # bytes of memory for what follows a sign of JSON, at most
LARGEST_COUNT = 40  # of links and similar: more takes long to derive
LONGEST_OPTION = 200  # characters
_LONGEST_HEADER = 10_000
_LONGEST_TEXT = 1000  # characters of a file that a message repeats


def read_regular(path: Path, most: int) -> bytes:
    """The content of a file of at most ``most`` bytes, not of a link, a pipe or a device.

    Raises :class:`MechcError` if it is something else, larger, or cannot be read;
    ``FileNotFoundError`` if there is none.
    """
    try:
        descriptor = os.open(path, READ)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise MechcError(f"{path} cannot be read: {error.strerror}") from None
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise MechcError(f"{path} is damaged: it is not a file")
        if status.st_size > most:
            raise MechcError(f"{path} is damaged: {status.st_size} bytes, {most} at most")
        with open(descriptor, "rb", closefd=False) as file:
            return file.read(status.st_size)  # room is made for as many bytes as are asked for
    except OSError as error:
        raise MechcError(f"{path} cannot be read: {error.strerror}") from None
    finally:
        os.close(descriptor)


class ReadOnce(io.BytesIO):
    """A content for a reader, which gets each of its bytes once.

    What a reader keeps is then no larger than the content, whatever sizes and places are in it.
    ``again``: bytes that it may look at besides.
    """

    def __init__(self, content: bytes, again: int = 1024) -> None:
        super().__init__(content)
        self._left = len(content) + again

    def read(self, size: int | None = -1, /) -> bytes:
        """As of a file; raises :class:`MechcError` for more in all than there is."""
        found = super().read(size)
        self._left -= len(found)
        if self._left < 0:
            raise MechcError("its parts overlap: they are larger than the file")
        return found


def refuse_links(folder: Path) -> None:
    """Refuse a folder in which something is a link: what is read and written there stays there.

    Raises :class:`MechcError`, which names the link.
    """
    pending = [str(folder)]
    while pending:
        with os.scandir(pending.pop()) as found:
            for entry in found:
                if entry.is_symlink():
                    raise MechcError(f"{printable(entry.path)} is a link: remove it")
                if entry.is_dir(follow_symlinks=False):
                    pending.append(entry.path)


def read_json(path: Path, most: int = LARGEST_TEXT) -> dict[str, Any]:
    """A JSON object of names to values.

    Raises :class:`MechcError` if it is anything else; the message names the file;
    ``FileNotFoundError`` if there is none.
    """
    return json_object(read_regular(path, most), str(path))


def json_object(content: bytes | str, where: str, most: float = LARGEST_JSON) -> dict[str, Any]:
    """The JSON object in a text; ``where`` is for the message.

    Raises :class:`MechcError` if it is not text, not JSON, nested too deeply, not an object, has a
    whole number beyond the largest double, or if its values would take more than ``most`` bytes of
    memory, which those of empty lists do by forty times their text.
    """
    try:
        text = content if isinstance(content, str) else content.decode()
        size = _VALUE * sum(map(text.count, ",:[{"))
        if size > most:
            raise ValueError(f"its values take up to {size} bytes, {most:.0f} are allowed")
        found = json.loads(text, parse_int=_whole_number)
    except (AttributeError, ArithmeticError, ValueError, RecursionError) as error:
        raise MechcError(f"{where} is damaged: {printable(str(error))}") from None
    if not isinstance(found, dict):
        raise MechcError(f"{where} is damaged: it is not a JSON object")
    return found


def _whole_number(text: str) -> int:
    """A whole number within the range of doubles; raises :class:`OverflowError` beyond it."""
    value = int(text)
    float(value)
    return value


def read_arrays(path: Path) -> dict[str, Array]:
    """The arrays of doubles in an uncompressed ``.npz``, no larger in memory than the file.

    Raises :class:`MechcError` if it contains anything else: compressed members may have any size,
    objects are code; ``FileNotFoundError`` if there is none.
    """
    import zipfile  # half of what importing this module would take

    if not stat.S_ISREG(path.lstat().st_mode):
        raise MechcError(f"{path} is damaged: it is not a file")
    try:
        with zipfile.ZipFile(path) as held:
            members, most = held.infolist(), path.stat().st_size
            if sum(member.file_size for member in members) > most:  # compressed, or overlapping
                raise ValueError("it is compressed: its members are larger than the file")
            return {m.filename.removesuffix(".npy"): _array(held, m) for m in members}
    except OSError as error:
        raise MechcError(f"{path} cannot be read: {error.strerror or error}") from None
    except (zipfile.BadZipFile, ValueError, EOFError, NotImplementedError, RuntimeError) as error:
        raise MechcError(f"{path} is damaged: {printable(str(error))}") from None


def _array(held: zipfile.ZipFile, member: zipfile.ZipInfo) -> Array:
    from zipfile import ZIP_STORED

    if member.compress_type != ZIP_STORED:
        raise ValueError(f"{member.filename!r} is compressed")
    with held.open(member) as file:
        shape, in_columns, kind = _header(file)
        content = file.read()
    if kind != np.dtype(np.float64) or math.prod(shape) * 8 != len(content):
        raise ValueError(f"{member.filename!r} has no doubles of its shape")
    values = np.frombuffer(content).reshape(shape, order="F" if in_columns else "C")
    return np.array(values, order="C")


def _header(file: Any) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether columns come first, and type of an array in NumPy's format."""
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    version = np.lib.format.read_magic(file)
    if version not in readers:
        raise ValueError(f"an array in the format {version}")
    found: tuple[tuple[int, ...], bool, np.dtype[Any]] = readers[version](
        file, max_header_size=_LONGEST_HEADER
    )
    if any(size < 0 for size in found[0]):
        raise ValueError(f"an array of the shape {found[0]}")
    return found


def short(text: str) -> str:
    """A printable text of bounded length."""
    return printable(text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]}...")


def printable(text: str) -> str:
    """A text with control and invisible characters written as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def text_of(value: Any, what: str) -> str:
    """A printable text; raises :class:`MechcError` for anything else."""
    if not isinstance(value, str):
        raise MechcError(f"{what} is not text")
    return printable(value)


def names_of(values: Any, what: str) -> tuple[str, ...]:
    """A tuple of texts, unchanged; raises :class:`MechcError` for anything else."""
    if not isinstance(values, (list, tuple)) or not all(isinstance(v, str) for v in values):
        raise MechcError(f"{what} are not names")
    return tuple(values)


def mapping_of(value: Any, what: str) -> Mapping[str, Any]:
    """A JSON object; raises :class:`MechcError` for anything else."""
    if not isinstance(value, dict):
        raise MechcError(f"{what} is not an object of names and values")
    return value


def checked_options(options: Any) -> dict[str, Any]:
    """Options of a shipped mechanism in a file, limited so that deriving it takes seconds.

    Raises :class:`MechcError` if one is too large or of an unknown kind; it says how to open the
    file anyway.
    """
    return {name: _option(name, value) for name, value in mapping_of(options, "options").items()}


def _option(name: str, value: Any) -> Any:
    if name == "fix":
        return {key: float(number) for key, number in mapping_of(value, name).items()}
    if name == "outputs":
        return list(names_of(value, name))
    small = isinstance(value, (bool, int, float)) and abs(value) <= LARGEST_COUNT
    if not small and not (isinstance(value, str) and len(value) <= LONGEST_OPTION):
        raise MechcError(
            f"its option {printable(name)} = {printable(str(value)[:40])} is not derived for "
            "a file, which is untrusted: load the mechanism yourself and pass it, "
            "mechc.open(path, mechc.load(...))"
        )
    return value
