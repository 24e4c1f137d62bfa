"""The compiler that makes a binary, and the processor that it is for."""

from __future__ import annotations

import platform
from typing import Any

from mechc.compilation import toolchain


def environment() -> tuple[str, str]:
    """The key of both: the compiler, if there is one, and this version of mechc with the
    processor."""
    from mechc import __version__

    command = toolchain.find_compiler()
    return toolchain.identity(command) if command else "", f"{__version__} {processor()}"


def processor() -> str:
    """Model and features of the processor: a binary made for one may crash on another."""
    from mechc_codegen.emit.units.instruction_sets import cpu_info

    found = cpu_info()
    wanted = [found[key] for key in ("model name", "flags", "Features") if key in found]
    return " ".join([platform.machine(), *wanted])


def native() -> Any:
    """Flags for this processor's instruction set; the binary stays in the user's cache."""
    from mechc_codegen.emit.units.instruction_sets import InstructionSet, sets_of_this_processor

    widest = sets_of_this_processor()[-1]
    wide = [flag for flag in widest.flags if flag.startswith("-mprefer-vector-width")]
    flags = ("-march=native", *wide) if widest.flags else ()
    return InstructionSet("native", widest.lanes, flags)
