"""The text of three.js, which draws the scene: shipped by the package jupyter-threejs-sage."""

from __future__ import annotations

from importlib import resources
from typing import Final

from mechc.errors import MissingPackageError, install_command, package

PACKAGE: Final = "jupyter_threejs_sage"
BUILD: Final = "static/r130/three.min.js"


def three_js() -> str:
    """The script, with its licence at the top, which defines ``THREE`` and its orbit controls.

    Raises :class:`MissingPackageError` if the package is not installed.
    """
    advice = f"a view in space is drawn by three.js: {install_command('view')}"
    try:
        return resources.files(package(PACKAGE, advice)).joinpath(BUILD).read_text("utf-8")
    except FileNotFoundError:
        raise MissingPackageError(advice) from None
