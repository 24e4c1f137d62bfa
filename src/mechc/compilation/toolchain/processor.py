"""The compiler that makes a binary, and the processor that it is for."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Any

from mechc.compilation import toolchain

CPU_INFO = Path("/proc/cpuinfo")


def environment() -> tuple[str, str]:
    """The key of both: the compiler, and this version of mechc with the processor."""
    from mechc import __version__

    return toolchain.identity(toolchain.compiler()), f"{__version__} {processor()}"


def processor() -> str:
    """Model and features of the processor: a binary made for one may crash on another."""
    found = _cpu_info()
    wanted = [found[key] for key in ("model name", "flags", "Features") if key in found]
    return " ".join([platform.machine(), *wanted])


def native() -> Any:
    """Flags for this processor's instruction set; the binary stays in the user's cache."""
    from mechc_codegen.emit.units.instruction_sets import BASELINE, WIDER, InstructionSet

    features = set(_cpu_info().get("flags", "").split())
    usable = [s for s in WIDER if {f[2:] for f in s.flags if "=" not in f} <= features]
    if not usable:
        return InstructionSet("native", BASELINE.lanes, ())
    widest = usable[-1]
    wide = [flag for flag in widest.flags if flag.startswith("-mprefer-vector-width")]
    return InstructionSet("native", widest.lanes, ("-march=native", *wide))


def _cpu_info() -> dict[str, str]:
    """Fields of the first processor; the others are equal."""
    found: dict[str, str] = {}
    if CPU_INFO.exists():
        with CPU_INFO.open() as lines:
            for line in iter(lines.readline, ""):
                if not line.strip():
                    break
                found[line.split(":")[0].strip()] = line
    return found
