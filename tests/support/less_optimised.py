"""Scenes of tests that are about equations, compiled in half the time.

Whether a mechanism is derived and integrated right shows at any level of optimisation; the flags
that users get compile the scenes of all other tests, and of these with ``--thorough``.
"""

from __future__ import annotations

import pytest
from mechc_codegen.extension import build, flags

from mechc.compilation import toolchain

LESS = tuple("-O1" if flag == "-O3" else flag for flag in flags.FLAGS)


def compile_less_optimised(patch: pytest.MonkeyPatch) -> None:
    """Until the patch is undone; under keys of their own in the cache, by the compiler's name."""
    patch.setenv("CC", " ".join((*toolchain.compiler(), "-DMECHC_LESS_OPTIMISED")))
    for module in (flags, build):
        patch.setattr(module, "FLAGS", LESS)
