"""The sources of one scene, and all that decides its binary.

Input: emitted texts.  Output: files to compile, with the flags of each.  Invariant: everything that
decides the binary is in :class:`Build` or in :func:`signature`.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

from mechc_codegen.emit.units.instruction_sets import InstructionSet
from mechc_codegen.extension.flags import FLAGS, runtime_headers


@dataclass(frozen=True)
class Build:
    """The texts of one scene, and per source file the compiler flags beyond ``FLAGS``.

    ``kind``: that of the unit that runs its ``tape``, in so many ``lanes``; empty: none does.
    """

    name: str
    texts: Mapping[str, str]
    flags: Mapping[str, tuple[str, ...]]
    seconds: Mapping[str, float] = field(default_factory=dict)  # that each stage took
    kind: str = ""
    lanes: int = 0
    tape: bytes = b""

    @property
    def widest_flags(self) -> tuple[str, ...]:
        """Flags of the widest instruction set, which first units are compiled for."""
        return max(self.flags.values(), key=len)

    @property
    def units(self) -> dict[str, tuple[str, ...]]:
        """The sources of its units, one for each instruction set, with their flags."""
        return {name: flags for name, flags in self.flags.items() if name != "scene_model.c"}

    @property
    def unit(self) -> str:
        """The name of the widest instruction set."""
        return max(self.units, key=lambda name: len(self.units[name]))[len("scene_") : -len(".c")]

    @property
    def sources(self) -> tuple[str, ...]:
        return tuple(self.flags)

    def as_json(self) -> str:
        """All data that its sources are compiled from, for :meth:`from_json`."""
        texts = {name: text for name, text in self.texts.items() if name.endswith((".c", ".h"))}
        return json.dumps({"name": self.name, "texts": texts, "flags": dict(self.flags)})

    @classmethod
    def from_json(cls, text: str) -> Build:
        """The build that :meth:`as_json` wrote."""
        data = json.loads(text)
        flags = {name: tuple(each) for name, each in data["flags"].items()}
        return cls(data["name"], data["texts"], flags)

    def write(self, folder: Path) -> None:
        """Write the texts; an unchanged file keeps its time stamp."""
        write_texts(folder, self.texts)


def write_texts(folder: Path, texts: Mapping[str, str]) -> None:
    """Write texts by their names into a folder; an unchanged file keeps its time stamp."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        path = folder / name
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")


def extension(
    name: str,
    texts: Mapping[str, str],
    sets: Sequence[InstructionSet],
    seconds: Mapping[str, float],
    kind: str,
    tape: bytes,
) -> Build:
    """Emitted C with the Cython wrapper and the flags of each instruction set."""
    wrapper = files("mechc_codegen.emit") / "templates" / "scene.pyx.in"
    flags = {f"scene_{each.name}.c": each.flags for each in sets} | {"scene_model.c": ()}
    return Build(
        name,
        {**texts, "scene.pyx": wrapper.read_text("utf-8")},
        flags,
        seconds,
        kind,
        sets[-1].lanes,
        tape,
    )


def unit_signature(sources: Mapping[str, str], flags: Sequence[str]) -> str:
    """A hash of everything that determines what the unit of a kind does, whoever compiles it."""
    return digest([*_headers(), *sources.values(), " ".join(flags)])


def signature(build: Build, compiler: str, python: str) -> str:
    """A hash of everything that determines a binary."""
    parts = [*(f"{name}\n{text}" for name, text in sorted(build.texts.items()))]
    parts += [f"{name} {flags}" for name, flags in sorted(build.flags.items())]
    parts += [build.kind, *_headers()]
    parts += [" ".join(FLAGS), build.tape.hex(), compiler, python, platform.machine()]
    return digest(parts)


@lru_cache  # of the program as it began
def _headers() -> list[str]:
    return [Path(header).read_text("utf-8") for header in runtime_headers()]


def digest(parts: Iterable[str]) -> str:
    """A hash of texts."""
    made = hashlib.sha256()
    for part in parts:
        made.update(f"{len(part)}:".encode() + part.encode())
    return made.hexdigest()
