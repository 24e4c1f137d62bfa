"""A functional mock-up unit: derived, compiled for this machine, packed."""

from __future__ import annotations

import platform
import sys
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mechc.compilation import toolchain
from mechc.compilation.exports.standalone import ExportRequest
from mechc.errors import MechcError
from mechc.progress import Notice

FIRST_DATE = (1980, 1, 1, 0, 0, 0)  # of files in an archive: the same export has the same bytes
_SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib")}
_MACHINES = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}


# Metadata, names of coordinates, speeds and parameters -> events (title, direction, value, reset),
# contacts.
Events = Callable[
    [Mapping[str, Any], Sequence[str], Sequence[str], Sequence[str]], tuple[Sequence[Any], Any]
]


def write_fmu(asked: ExportRequest, target: Path, events: Events, **options: Any) -> None:
    """Derive, compile and pack; ``options`` as those of the compiler's ``FmuOptions``."""
    from mechc_codegen.compiler import build_fmu
    from mechc_codegen.emit.units.event_functions import EventExpressions
    from mechc_codegen.export.fmu import SOURCE, FmuEvents, FmuOptions
    from mechc_codegen.extension.flags import FLAGS

    from mechc import __version__

    def in_unit(metadata: Mapping[str, Any]) -> FmuEvents:
        kinds = ("coordinates", "speeds", "parameters")
        names = [[each["name"] for each in metadata[kind]] for kind in kinds]
        every, contacts = events(metadata, names[0], names[1], names[2])
        return FmuEvents(
            [e.title for e in every], [e.direction for e in every],
            [EventExpressions(e.value, e.changes) for e in every], *contacts,
        )  # fmt: skip

    chosen = FmuOptions(
        start=asked.start, values=asked.values, tool=f"mechc {__version__}", events=in_unit,
        **options,
    )  # fmt: skip
    with Notice(f"deriving the equations of {chosen.name} ..."):
        texts = build_fmu(asked.mechanism, chosen, asked.request)
    with TemporaryDirectory(prefix="mechc-fmu-") as folder:
        write_sources(texts, Path(folder))
        sources, binary = Path(folder) / "sources", Path(folder) / f"{chosen.name}.binary"
        with Notice(f"compiling the unit {chosen.name} for this machine ..."):
            toolchain.compile_shared(sources, SOURCE, FLAGS, [str(sources)], binary)
        contents = {**texts, binary_path(chosen.name, chosen.version): binary.read_bytes()}
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(contents, key=lambda path: (path != "modelDescription.xml", path)):
            entry = zipfile.ZipInfo(path, FIRST_DATE)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, contents[path], zipfile.ZIP_DEFLATED)


def binary_path(name: str, version: str) -> str:
    """The place of the compiled file for this machine in the archive.

    Raises :class:`MechcError` if FMI has no name for this machine.
    """
    system, suffix = _SYSTEMS.get(sys.platform, ("", ""))
    machine = _MACHINES.get(platform.machine(), "")
    if not system or not machine:
        raise MechcError(f"FMI has no name for {platform.machine()} with {sys.platform}")
    third = f"{machine}-{system}"
    second = f"{system}64" if machine == "x86_64" else third
    return f"binaries/{third if version == '3.0' else second}/{name}{suffix}"


def write_sources(contents: Mapping[str, bytes], folder: Path) -> None:
    """Write files by their paths below a folder."""
    for path, content in contents.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
