"""``mechc open``: the picture in space of a saved motion."""

from __future__ import annotations

import argparse
import os
import sys
import webbrowser
from pathlib import Path
from typing import Any

from mechc.cli.arguments import output_path, saved_in
from mechc.errors import MechcError
from mechc.open import open_saved, open_view
from mechc.results.solution import Solution


def open_command(chosen: argparse.Namespace) -> int:
    """Writes the page, picture or film, and opens a page that was not asked for by name."""
    path = saved_in(Path(chosen.path))
    if path.is_dir():
        raise MechcError(f"{path} is a batch: mechc.open reads it in Python")
    target = output_path(chosen, chosen.view, path.with_suffix(".html").name)
    saved = _view_of(path).save(target)
    print(saved.resolve())
    if not chosen.view:
        open_in_browser(saved)
    return 0


def _view_of(path: Path) -> Any:
    """The picture of the motion simulated again, or that in the file where no model is found."""
    try:
        found = open_saved(path)
    except MechcError as missing:
        try:
            return open_view(path)
        except MechcError:
            raise missing from None
    assert isinstance(found, Solution)
    return found.view()


def open_in_browser(path: Path) -> None:
    """Open a page in the browser of a desktop; elsewhere the path is printed."""
    desktop = sys.platform == "darwin" or "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
    if desktop:
        webbrowser.open(path.resolve().as_uri())
