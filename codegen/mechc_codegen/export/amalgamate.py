"""C with includes -> one text that contains each header of the runtime or scene once."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

_INCLUDE = re.compile(r'#include "([\w./]+)"')
_EVERY_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include "([\w./]+)"', re.MULTILINE)
_REBINDING = "simd/unbind.h"  # of names that stay bound to one double in an exported file


def amalgamate(name: str, generated: Mapping[str, str], runtime: Path) -> str:
    """The header ``name`` with all that it includes, for one double.

    Headers are taken from ``generated`` (name -> text) or from the folder ``runtime``; those of the
    system stay as they are.
    """
    done = {_REBINDING}

    def lines(header: str) -> Iterator[str]:
        done.add(header)
        text = generated[header] if header in generated else (runtime / header).read_text("utf-8")
        for line in text.splitlines():
            included = _INCLUDE.match(line)
            if included is None:
                if line != "#pragma once":
                    yield line
                continue
            found = _meant(included[1], header, generated, runtime)
            if found not in done:
                yield from lines(found)

    return "\n".join(lines(name)) + "\n"


def included_headers(name: str, generated: Mapping[str, str], runtime: Path) -> list[str]:
    """The headers of the folder ``runtime`` that ``name`` includes, directly or not."""
    found, left = set[str](), [name]
    while left:
        header = left.pop()
        text = generated[header] if header in generated else (runtime / header).read_text("utf-8")
        named = {_meant(n, header, generated, runtime) for n in _EVERY_INCLUDE.findall(text)}
        left += sorted(named - found)
        found |= named
    return sorted(found - {*generated})


def _meant(named: str, header: str, generated: Mapping[str, str], runtime: Path) -> str:
    """The path of an included header: from the root, or beside the one that includes it."""
    if named in generated or (runtime / named).exists():
        return named
    return (Path(header).parent / named).as_posix()
