"""``mechc verify``: whether a saved solution or batch is undamaged, and its check made again."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechc.cli.arguments import saved_in
from mechc.errors import MechcError
from mechc.results.files import verify
from mechc.results.untrusted import printable

DAMAGED = 1


def verify_command(chosen: argparse.Namespace) -> int:
    """Check a file or folder: 0 if complete and undamaged, 1 if a batch is not, or if the check of
    a motion that was saved with it finds something now; 2 by an error."""
    path = saved_in(Path(chosen.path))
    if not path.is_dir():
        saved = verify(path)
        print(f"{printable(str(path))}: undamaged")
        return _repeat_check(path, saved) if saved else 0
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


def _repeat_check(path: Path, saved: list[str]) -> int:
    """Print the check that was saved with a motion, and the same made again."""
    from mechc.open import open_saved
    from mechc.results.solution import Solution

    print("the check that was saved with it:", *map(printable, saved), sep="\n")
    try:
        sol = open_saved(path)
        assert isinstance(sol, Solution)
        found = sol.check()
    except MechcError as error:
        print(f"it cannot be made again here: {printable(str(error))}")
        print("result: the file is undamaged; whether its motion is right was not checked now")
        return 0
    print("made again:", found, sep="\n")
    return 0 if found.ok else DAMAGED
