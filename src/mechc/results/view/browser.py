"""A browser without a window that draws a page and gives back what is then in it.

Input: the text of a page.  Output: its document as text.  The browser has a profile of its own that
is removed, and the page's policy forbids it the network.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Final

from mechc.errors import MechcError, MissingPackageError

NAMES: Final = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"),
    *("microsoft-edge", "msedge"),
)
MOST_SECONDS: Final = 900.0
FLAGS: Final = (
    *("--headless", "--dump-dom", "--disable-extensions", "--no-first-run", "--mute-audio"),
    *("--use-angle=swiftshader", "--ignore-gpu-blocklist", "--hide-scrollbars"),
)


def browser() -> str:
    """The path of a browser of the Chromium family.

    Raises :class:`MissingPackageError` if there is none on PATH.
    """
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        raise MissingPackageError(
            "pictures of a view are drawn by Chromium, Chrome or Edge: install one, or save the "
            "view as .html"
        )
    return found


def document_of(page: str) -> str:
    """The document after the page's scripts have run.

    Raises :class:`MechcError` if the browser fails or takes more than fifteen minutes.
    """
    program = browser()
    with tempfile.TemporaryDirectory(prefix="mechc_view_", ignore_cleanup_errors=True) as folder:
        file = Path(folder, "view.html")
        file.write_text(page, encoding="utf-8")
        root = hasattr(os, "geteuid") and os.geteuid() == 0  # the sandbox then refuses to start
        command = [program, *FLAGS, *["--no-sandbox"] * root, f"--user-data-dir={folder}/profile"]
        try:
            done = subprocess.run(
                [*command, file.as_uri()], capture_output=True, timeout=MOST_SECONDS, check=True
            )
        except (subprocess.SubprocessError, OSError) as error:
            raise MechcError(f"{program} did not draw the view: {error}") from None
    return done.stdout.decode("utf-8", "replace")
