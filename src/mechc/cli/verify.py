"""``mechc verify``: whether what was saved is as it was written."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechc.results.files import verify

DAMAGED = 1


def verify_command(chosen: argparse.Namespace) -> int:
    """0 if all is there and sound, 1 if a batch is damaged or not finished, 2 by an error."""
    path = Path(chosen.path)
    if not path.is_dir():
        verify(path)
        print(f"{path}: sound")
        return 0
    from mechc.batch.store import examine

    found = examine(path)
    for why in found.damage:
        print(why)
    told = [f"{len(found.damage)} damaged"] if found.damage else []
    told += [f"{found.missing} not computed yet"] if found.missing else []
    print(f"{path}: {found.chunks} chunks, {', '.join(told) or 'all sound'}")
    if told:
        print("the call that made it, made again, computes them")
    return DAMAGED if told else 0
