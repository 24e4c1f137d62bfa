"""A comparison in a separate process, repeated without a peer that crashed or hung."""

from __future__ import annotations

import json
import tempfile
import time
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from ..timing.cases import Effort
from .compare import ITSELF, Request, write_comparison


def compare_apart(
    name: str, peers: tuple[str, ...], tolerances: tuple[float, ...], effort: Effort, *,
    quick: bool, patience: float,
) -> dict[str, Any]:  # fmt: skip
    """The entry of a problem; a peer that ends the process, or is at work too long, is named in it.

    Parameters
    ----------
    patience
        Seconds that one peer may be at work without another one's turn.

    Raises
    ------
    RuntimeError
        If mechc itself is what failed.
    """
    crashed: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        request = Request(
            name, peers, tolerances, quick, effort, place / "working", place / "result"
        )
        while True:
            left = tuple(peer for peer in peers if peer not in crashed)
            # A cache of its own, so that mechc derives and compiles before it is measured.
            cache = None if quick else place / f"cache {len(crashed)}"
            ended = _ended(replace(request, peers=left, cache=cache), patience)
            if not ended:
                entry: dict[str, Any] = json.loads(request.result.read_text())
                entry["skipped"] |= crashed
                return entry
            guilty = request.working.read_text() if request.working.exists() else ITSELF
            if guilty == ITSELF:
                raise RuntimeError(f"{name}: mechc {ended}")
            print(f"{name}: {guilty} {ended}", flush=True)
            crashed[guilty] = ended


def _ended(request: Request, patience: float) -> str:
    """Why the process ended before its time; empty if it did its work."""
    request.working.unlink(missing_ok=True)
    process = get_context("spawn").Process(target=write_comparison, args=(request,))
    process.start()
    try:
        while process.is_alive():
            process.join(0.05)
            working = request.working
            if working.exists() and time.time() - working.stat().st_mtime > patience:
                return f"did not finish within {patience:g} s"
    finally:
        process.kill()
        process.join()
    code = process.exitcode or 0
    return "" if code == 0 else f"crashed ({'signal' if code < 0 else 'exit code'} {abs(code)})"
