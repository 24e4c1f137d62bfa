"""The compiler and the processor that a binary is made by and for."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Any

from mechc.compilation import toolchain

CPU_INFO = Path("/proc/cpuinfo")


def environment() -> tuple[str, str]:
    """What names both: the compiler, and this version of mechc with the processor."""
    from mechc import __version__

    return toolchain.identity(toolchain.compiler()), f"{__version__} {processor()}"


def processor() -> str:
    """What distinguishes processors: a binary made for one may crash on another."""
    found = _cpu_info()
    wanted = [found[key] for key in ("model name", "flags", "Features") if key in found]
    return " ".join([platform.machine(), *wanted])


def native() -> Any:
    """This processor's own instruction set; the binary stays in the user's cache."""
    from mechc_codegen.emit.instruction_sets import BASELINE, WIDER, InstructionSet

    features = set(_cpu_info().get("flags", "").split())
    usable = [s for s in WIDER if {f[2:] for f in s.flags if "=" not in f} <= features]
    if not usable:
        return InstructionSet("native", BASELINE.lanes, ())
    widest = usable[-1]
    wide = [flag for flag in widest.flags if flag.startswith("-mprefer-vector-width")]
    return InstructionSet("native", widest.lanes, ("-march=native", *wide))


def _cpu_info() -> dict[str, str]:
    """Lines of the first of the processors, which are alike, by what they tell."""
    found: dict[str, str] = {}
    if CPU_INFO.exists():
        with CPU_INFO.open() as lines:
            for line in iter(lines.readline, ""):
                if not line.strip():
                    break
                found[line.split(":")[0].strip()] = line
    return found
