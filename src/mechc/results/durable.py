"""Files that are complete or absent: written elsewhere, synced to the disk, moved into place."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from secrets import token_hex

from mechc.errors import MechcError
from mechc.files import held_file, remove_unheld, sync


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
