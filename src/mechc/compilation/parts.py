"""The parts of a scene's unit, each a shared object that is compiled when it is first needed.

Rates and outputs are compiled first, in a fraction of the time of the integrators.  What most runs
begin with is compiled in the background meanwhile, and calls that need it wait.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mechc.compilation import cache, entries
from mechc.compilation.from_scene import Seconds
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.native._driver import PARTS, Scene, part_of, texts_of
from mechc.progress import Notice

FIRST, WHOLE = "first", "whole"


class Pending:
    """An object that is made in the background; a request for it waits.

    If it was not begun at once, it is made when requested.  In a forked process, which has no such
    thread, it is made again; so it is at the next request after a failure.
    """

    def __init__(self, make: Callable[[], Any], *, at_once: bool = True) -> None:
        self._make, self._process = make, os.getpid()
        self._object: Any = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="mechc compiler", daemon=True)
        self._running = at_once
        if at_once:
            self._thread.start()

    def _run(self) -> None:
        try:
            self._object = self._make()
        except BaseException as error:
            self._error = error

    def if_made(self) -> Any:
        """The object, or None."""
        return self._object

    def result(self) -> Any:
        """The object; an error of its making is raised here."""
        if self._running and self._process == os.getpid():
            self._thread.join()
            self._running, error = False, self._error
            self._error = None
            if error is not None:
                raise error
        if self._object is None:
            self._object = self._make()
        return self._object


class Parts:
    """The maker of the parts of one scene for a :class:`mechc.native._driver.Scene`.

    ``seconds`` of every part compiled here are recorded.
    """

    def __init__(self, key: str, seconds: Seconds) -> None:
        self.key, self.seconds = key, seconds
        self.build: Any = None  # where it was derived in this process
        self._texts: Callable[[], str] | None = None
        self._pending: dict[str, Pending] = {}
        self._kept: dict[str, Any] = {}  # what was found of earlier processes, or None
        self._lock = threading.Lock()

    def scene(self, first: Any) -> Scene:
        """The scene of a first unit."""
        self._texts = lambda: texts_of(first)
        return Scene(first, None, self)

    def begin(self, name: str) -> Pending:
        """Make a part in the background, where that was not begun before."""
        if name not in self._pending:
            import_compiler()
        with self._lock:
            if name not in self._pending:
                self._pending[name] = Pending(
                    lambda: entries.load_or_make(
                        cache.part_key(self.key, name), self._maker(name), part_of
                    )
                )
            return self._pending[name]

    def parts(self, bits: int) -> list[Any]:
        """The capsules of these parts; those that are missing are compiled side by side."""
        names = [name for name, bit in PARTS.items() if bits & bit]
        kept = {name: self._load_part(name) for name in names}
        begun = {name: self.begin(name) for name in names if kept[name] is None}
        if begun:
            with Notice(f"compiling the integrator ({', '.join(begun)}) ..."):
                kept |= {name: part.result() for name, part in begun.items()}
        return [kept[name] for name in names]

    def if_made(self, bit: int) -> Any:
        """The capsule of a part; None until it is made, in the background, or if that fails."""
        (name,) = (name for name, each in PARTS.items() if each == bit)
        return self._load_part(name) or self.begin(name).if_made()

    def made(self, bits: int, begin: bool) -> bool:
        """Whether these parts are made, by an earlier process too; with ``begin`` those that are
        missing are made in the background."""
        asked = [name for name, bit in PARTS.items() if bits & bit]
        for name in asked:
            if name not in self._kept:
                self._kept[name] = self._load_part(name)
        missing = [name for name in asked if self._kept[name] is None]
        if begin:
            missing = [name for name in missing if self.begin(name).if_made() is None]
        return all(self._is_made(name) for name in missing)

    def _is_made(self, name: str) -> bool:
        pending = self._pending.get(name)
        return pending is not None and pending.if_made() is not None

    def whole(self) -> Any:
        """The capsule of the model with all parts of its unit."""
        return entries.load_or_make(self.key, self._maker(WHOLE))

    def _load_part(self, name: str) -> Any:
        if name in self._pending:
            return None
        return entries.load(cache.part_key(self.key, name), part_of)

    def _maker(self, name: str) -> Callable[[Path], None]:
        def make(folder: Path) -> None:
            started = time.perf_counter()
            if name == WHOLE:
                entries.make_whole(self._built(), folder)
            else:
                entries.make_part(self._built(), name, folder)
            self.seconds[name] = time.perf_counter() - started

        return make

    def _built(self) -> Any:
        """The texts that parts are compiled from; a first unit holds them."""
        if self.build is None:
            assert self._texts is not None
            from mechc_codegen.extension.build import Build

            self.build = Build.from_json(self._texts())
        return self.build


@one_at_a_time
def import_compiler() -> None:
    """Import the compiler before threads compile side by side: see ``one_at_a_time.py``."""
    import mechc_codegen.extension.build
    import mechc_codegen.extension.flags  # noqa: F401
