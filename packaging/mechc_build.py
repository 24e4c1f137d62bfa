"""The build backend: that of setuptools, and a C compiler from the package index if there is none.

A program of pip calls its functions (PEP 517, PEP 660); ``setup.py`` builds with what was brought.
"""

from __future__ import annotations

import os
import runpy
import sysconfig
from pathlib import Path
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import (
    build_editable,
    build_sdist,
    build_wheel,
    get_requires_for_build_sdist,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

COMPILER = Path(__file__).resolve().with_name("mechc_compiler.py")
PACKAGED = "ziglang>=0.13"  # as in the extra `compiler`


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """What setuptools asks for, and a compiler if none is found."""
    return [*build_meta.get_requires_for_build_wheel(config_settings), *compiler_required()]


def get_requires_for_build_editable(config_settings: Any = None) -> list[str]:
    """As for a wheel."""
    return [*build_meta.get_requires_for_build_editable(config_settings), *compiler_required()]


def compiler_required() -> list[str]:
    """The package of a C compiler, unless ``$CC`` is set or the machine has one that will do."""
    chosen = os.environ.get("CC", "").strip()
    if chosen or runpy.run_path(str(COMPILER))["installed"](sysconfig.get_platform()):
        return []
    return [PACKAGED]
