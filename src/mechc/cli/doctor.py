"""``mechc doctor``: checks of what mechc needs on this machine, with advice."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, metadata, version
from pathlib import Path

from packaging.requirements import Requirement

import mechc
from mechc.compilation import cache, entries, toolchain
from mechc.compilation.library.catalogue import COMPILED_AT_INSTALL
from mechc.errors import MechcError, install_command

Check = tuple[str, bool, str]


def examine() -> list[Check]:
    """(name, whether it is right, what was found) for everything that mechc needs."""
    checks = [("python", sys.version_info >= (3, 11), sys.version.split()[0])]
    checks += [_package(name) for name in _packages_of("")]
    checks += [_extra(name) for name in metadata("mechc").get_all("Provides-Extra", ())]
    for name in COMPILED_AT_INSTALL:
        model = mechc.load(name)
        words = f"compiled, {model.instruction_set}, {model.system.scene.lanes} lanes"
        checks.append((name, True, words))
    units = ", ".join(_units()) or "none for this processor: each is compiled at its first use"
    checks.append(("units", True, units))
    stored = _attempt("cache", lambda: f"{cache.check()}, {len(cache.scenes())} compiled scenes")
    return [*checks, _attempt("C compiler", _compiler), stored]


def _packages_of(extra: str) -> list[str]:
    """Packages that an extra needs on this machine; of the empty name those of mechc itself."""
    names = list[str]()
    for text in metadata("mechc").get_all("Requires-Dist", ()):
        wanted = Requirement(text)
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": extra}):
            continue
        if extra and (wanted.marker is None or wanted.marker.evaluate({"extra": ""})):
            continue
        names += (
            [name for each in sorted(wanted.extras) for name in _packages_of(each)]
            if wanted.name == "mechc"
            else [wanted.name]
        )
    return list(dict.fromkeys(names))


def _extra(extra: str) -> Check:
    """An extra, which mechc does without, and which of its packages are missing."""
    missing = [name for name in _packages_of(extra) if not _package(name)[1]]
    told = f"not installed: {', '.join(missing)}; {install_command(extra)}"
    return (f"extra {extra}", True, told if missing else ", ".join(_packages_of(extra)))


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


def _units() -> list[str]:
    """The installed units that run tapes on this processor."""
    return [path.name.partition(".")[0] for path in entries.installed_units()]


def _compiler() -> str:
    """Compile and link a small file; where nothing can, say what works."""
    if toolchain.find_compiler() is None and _units():
        return (
            "none: motions run by tapes, 1.5 to 9 times as slow, batches more; long chains, "
            f"exports and more need one: {install_command('compiler')}"
        )
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
