"""``mechc doctor``: checks of what mechc needs on this machine, with advice."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import mechc
from mechc.compilation import cache, toolchain
from mechc.compilation.library.catalogue import COMPILED_AT_INSTALL
from mechc.errors import MechcError

Check = tuple[str, bool, str]
PACKAGES = (
    *("numpy", "scipy", "sympy", "cython", "matplotlib", "xarray", "jinja2", "latex2mathml"),
    "filelock",
)
OPTIONAL = ("nbclient", "ipykernel")


def examine() -> list[Check]:
    """(name, whether it is right, what was found) for everything that mechc needs."""
    checks = [("python", sys.version_info >= (3, 11), sys.version.split()[0])]
    checks += [_package(name) for name in PACKAGES]
    for name in OPTIONAL:
        _, there, found = _package(name)
        words = found if there else "not installed; for notebooks"
        checks.append((f"{name} (optional)", True, words))
    for name in COMPILED_AT_INSTALL:
        model = mechc.load(name)
        words = f"compiled, {model.instruction_set}, {model.system.scene.lanes} lanes"
        checks.append((name, True, words))
    stored = _attempt("cache", lambda: f"{cache.check()}, {len(cache.scenes())} compiled scenes")
    return [*checks, _attempt("C compiler", _compiler), stored]


def _package(name: str) -> Check:
    try:
        return (name, True, version(name))
    except PackageNotFoundError:
        return (name, False, f"not installed: pip install {name}")


def _attempt(what: str, check: Callable[[], str]) -> Check:
    try:
        return (what, True, check())
    except (MechcError, OSError) as error:
        return (what, False, str(error))


def _compiler() -> str:
    """Compile and link a small file."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "probe.c").write_text("double probe(double x) { return x * x; }\n")
        toolchain.link(toolchain.compile_all(folder, [("probe.c", ())], ()), folder / "probe.so")
    return toolchain.version(tuple(toolchain.compiler()))


def written(checks: list[Check]) -> str:
    """One line per check."""
    width = max(len(what) for what, _, _ in checks)
    return "\n".join(
        f"{'ok ' if well else 'BAD'}  {what.ljust(width)}  {found}" for what, well, found in checks
    )
