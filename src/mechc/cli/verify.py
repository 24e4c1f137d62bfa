"""``mechc verify``: check that a saved solution or batch is undamaged."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechc.results.files import verify
from mechc.results.untrusted import printable

DAMAGED = 1


def verify_command(chosen: argparse.Namespace) -> int:
    """Check a file or folder: 0 if complete and undamaged, 1 if a batch is not, 2 by an error."""
    path = Path(chosen.path)
    if not path.is_dir():
        verify(path)
        print(f"{printable(str(path))}: sound")
        return 0
    from mechc.batch.stored.store import examine

    found = examine(path)
    for why in found.damage:
        print(printable(why))
    told = [f"{len(found.damage)} damaged"] if found.damage else []
    told += [f"{found.missing} not computed yet"] if found.missing else []
    print(f"{printable(str(path))}: {found.chunks} chunks, {', '.join(told) or 'all sound'}")
    if told:
        print("repeat the call that made it to compute them")
    return DAMAGED if told else 0
