"""The law that tests of the first run compile nothing, but those that are of the compiler.

A scene runs by its tape, so a test needs no compiler for what it tests; those marked ``compiles``
do, and have a cache of their own, on disk and in the process: no other test is served by what they
leave in it, so the law does not depend on the order of tests.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from mechc.compilation import build, toolchain

LAW = (
    "a test of the first run compiles nothing: scenes run by their tapes.  A test of the compiler, "
    "or of what is compiled, is marked pytest.mark.compiles (docs/contributing.md)"
)
FREE = "compiles", "slow", "thorough"
FOLDER = "MECHC_CACHE_DIR"


class CompilerIsOff:
    """A plugin of pytest, of each process that runs tests."""

    def __init__(self) -> None:
        self._folder, self._free = "", False
        self._systems: tuple[dict[str, Any], dict[str, Any]] = {}, {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._free = any(map(item.get_closest_marker, FREE))
        self._choose()
        return (yield)

    def begin(self, patch: pytest.MonkeyPatch, folder: Path) -> None:
        """Until the patch is undone; ``folder``: of what is derived and compiled."""
        compile_shared: Callable[..., None] = toolchain.compile_shared

        def compiled(*given: Any) -> None:
            if not self._free:
                pytest.fail(LAW)
            compile_shared(*given)

        patch.setattr(toolchain, "compile_shared", compiled)
        patch.setenv(FOLDER, str(folder))
        patch.setattr(build, "_compiled", {})
        self._folder = str(folder)
        self._choose()

    def _choose(self) -> None:
        if self._folder:
            os.environ[FOLDER] = self._folder + "-by-a-compiler" * self._free
            build._compiled = self._systems[self._free]
