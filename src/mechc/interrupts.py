"""Ctrl-C where what is half done is broken: processes being started, packages being imported.

Importing this module imports NumPy to its end: a process can load its compiled modules once.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType


@contextmanager
def interrupts_deferred() -> Iterator[None]:
    """Defer what Ctrl-C does to the end of the block.

    A process that is half started when the interrupt is raised has no object that could end it.
    Python handles signals in the main thread alone, so that others have nothing to defer.
    """
    handler = signal.getsignal(signal.SIGINT)
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not (callable(handler) and in_main_thread):
        yield
        return
    arrived: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: arrived.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if arrived:
            signal.raise_signal(signal.SIGINT)


_IN_RINGS = ("sympy", "mpmath")  # packages whose modules import each other in rings


class _WholeImports(MetaPathFinder):
    """Finds packages that are imported as a whole, or not at all.

    Where an interrupt ends an import, Python forgets the modules that are not complete, but not
    those that hold parts of them: imported again, there would be two classes of one name.
    """

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = PathFinder.find_spec(name, path, target) if name in _IN_RINGS else None
        if spec is None or spec.loader is None:
            return spec
        execute = spec.loader.exec_module

        def execute_or_forget(module: ModuleType) -> None:
            try:
                execute(module)
            except BaseException:
                for each in [key for key in sys.modules if key.partition(".")[0] == name]:
                    del sys.modules[each]
                raise

        spec.loader.exec_module = execute_or_forget  # type: ignore[method-assign]
        return spec


def import_as_a_whole() -> None:
    """From now on, an interrupted import of SymPy leaves nothing of it, and may be repeated."""
    sys.meta_path.insert(0, _WholeImports())


with interrupts_deferred():
    import numpy as numpy  # and only then what Ctrl-C does
