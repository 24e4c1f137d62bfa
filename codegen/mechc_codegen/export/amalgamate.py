"""C with includes -> one text, in which each header of the runtime or scene stands once."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

_INCLUDE = re.compile(r'#include "([\w./]+)"')
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
            named = included[1]
            own = f"{Path(header).parent}/{named}"  # beside the including header
            found = named if named in generated or (runtime / named).exists() else own
            if found not in done:
                yield from lines(found)

    return "\n".join(lines(name)) + "\n"
