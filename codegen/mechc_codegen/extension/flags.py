"""Compiler flags of scenes, and the C headers that they include."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

# -ffast-math would let a loaded extension flush denormals for the whole process.
# gcc's vectorisers gather the scalar code's numbers into vectors, which takes twice the time; where
# vectors pay, the code is written in lanes.
FLAGS = (
    "-std=gnu11",
    "-O3",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-ffp-contract=off",
    "-fno-builtin-pow",  # which is a product for some exponents, not for all compilers
    "-fno-tree-vectorize",
    "-fvisibility=hidden",
)
# Quick to compile rather than quick to run: it serves until the whole is compiled.
OUTPUTS_ONLY_FLAGS = ("-std=gnu11", "-O1", *FLAGS[2:], "-DMECHC_SHARED")
# Its model is that of a tape, which takes most of the time: half of the code, in half of the time.
GENERAL_FLAGS = (*OUTPUTS_ONLY_FLAGS[:-1], "-DMECHC_SMALL")
SHARED = ("-DMECHC_SHARED",)  # the model is found by name
STRICT = ("-Wall", "-Wextra", "-Werror")  # for our tests; a user's compiler may warn of more
RUNTIME = Path(str(files("mechc_codegen"))) / "runtime"
# Of the unit of a kind: folders of headers, in place of those of a scene.
GENERAL_INCLUDES = (
    str(RUNTIME / "tape" / "in_place_of_series"),
    str(RUNTIME / "general" / "in_place_of_scene"),
    str(RUNTIME),
)


def part_flags(part: str) -> tuple[str, ...]:
    """Flags of a part of a unit that is a shared object of its own: see runtime/abi/parts.h."""
    return (f"-DMECHC_UNIT_PARTS=MECHC_PART_{part.upper()}",)


def unit_key_flag(signature: str) -> str:
    """The flag by which the unit of a kind holds its name."""
    return f'-DMECHC_UNIT_KEY="{signature}"'


def runtime_headers() -> list[str]:
    """All headers that generated code includes; a build depends on them."""
    return sorted(str(path) for path in RUNTIME.rglob("*.h"))
