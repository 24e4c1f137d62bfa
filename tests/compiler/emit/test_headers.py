"""Every header of the runtime compiles by itself, and none includes what leads back to it."""

import re
import subprocess
from collections import defaultdict
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import pytest
from mechc_codegen import build_scene, shipped_mechanism
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.emit.units.general import kind_flags
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.extension.flags import GENERAL_INCLUDES, RUNTIME, STRICT, part_flags

from benchmarks.problems.window_row import window_row
from mechc.compilation import toolchain
from tests.support import ROOT
from tests.support.compilers.compilation import checking

HEADERS = sorted(path.relative_to(RUNTIME).as_posix() for path in RUNTIME.rglob("*.h"))
GENERIC = [
    name for name in HEADERS if '\n#include "simd/real.h"\n' in (RUNTIME / name).read_text("utf-8")
]
BINDINGS = ("simd/bind_scalar.h", "simd/bind_vector.h")
# Each may use those before it.
LAYERS = (
    "abi", "simd", "dynamics", "singularities", "run", "series", "stepping", "lockstep", "methods",
    "variational", "adjoint", "unit", "general", "tape", "fmu",
)  # fmt: skip
ALSO = {"fmu": {"hybrid"}}  # of those compiled apart
ALL = "run/zeros.h"  # knows no scene
# Compiled into the runtime, and into units that are exported, not into scenes.
APART = {
    "batch": {"abi", "batch", "hybrid", "record"},
    "closing": {"abi", "closing"},
    "hybrid": {"abi", "closing", "hybrid", "record", "simd", "tape"},
    "record": {"abi", "record"},
}
COMPILER = toolchain.find_compiler() or ["cc"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene")
    build_scene(shipped_mechanism("four_bar"), (BASELINE,)).write(folder)
    return folder


# Of headers compiled by themselves and of those compiled apart, functions are left unused.
ALONE = ("-Wno-unused-const-variable", "-Wno-unused-function", "-DMECHC_UNIT=baseline")


def compiled(source: str, scene: Path, *flags: str) -> str:
    """What the compiler says of a text that includes headers."""
    command = [*COMPILER, "-std=gnu11", *STRICT, f"-DMECHC_LANES={BASELINE.lanes}"]
    command += flags or ALONE
    command += [f"-I{RUNTIME}", f"-I{scene}", *checking(COMPILER, scene / "header.o"), "-xc", "-"]
    done = subprocess.run(command, input=source, capture_output=True, text=True, check=False)
    assert (done.returncode == 0) == (done.stderr == ""), done.stderr[:2000]
    return done.stderr


def including(*headers: str) -> str:
    return "".join(f'#include "{name}"\n' for name in headers)


@pytest.mark.parametrize("header", HEADERS)
def test_a_header_compiles_by_itself_and_again(header: str, scene: Path) -> None:
    """A generic one for each binding besides."""
    bound = BINDINGS * 2 if header in GENERIC else ()
    texts = [header, header, *(text for binding in bound for text in (binding, header))]
    end = ("simd/unbind.h",) if header in GENERIC else ()
    flags = ALONE
    if header.startswith("tape/"):  # for the unit of a kind
        flags += ("-DMECHC_SERIES_FEW=0", "-DMECHC_SERIES_MOMENTA=0", *kind_flags("open"))
        flags += tuple(f"-I{folder}" for folder in GENERAL_INCLUDES)
    assert compiled(including(*texts, *end), scene, *flags) == ""


@pytest.mark.slow
def test_parts_compile_together(tmp_path: Path) -> None:
    """Any two in one unit, of a tree with loops and sensitivities."""
    request = OutputRequest(frozenset({"energy", "multipliers", "sensitivities"}))
    build_scene(window_row(3), (BASELINE,), request).write(tmp_path)
    parts = re.findall(r"X\((\w+)\)", (RUNTIME / "abi" / "parts.h").read_text("utf-8"))
    assert len(parts) == 9
    for pair in combinations(parts, 2):
        chosen = "|".join(part_flags(part)[0].partition("=")[2] for part in pair)
        flags = (f"-DMECHC_UNIT_PARTS=({chosen})", "-DMECHC_UNIT=baseline")
        assert compiled(including("unit/unit.h"), tmp_path, *flags) == "", pair


def test_a_macro_has_one_meaning() -> None:
    """Those that two headers define are taken away again by them, or by ``simd/unbind.h``."""
    texts = {name: (RUNTIME / name).read_text("utf-8") for name in HEADERS}
    defined = defaultdict(set)
    for name, text in texts.items():
        undefined = set(re.findall(r"#\s*undef (\w+)", text + texts["simd/unbind.h"]))
        undefined |= set(re.findall(r"#ifndef (MECHC_\w+)\n#define \1\b", text))  # by default
        for macro in {*re.findall(r"#\s*define (\w+)", text)} - undefined:
            defined[macro].add(name)
    either = {"fmu/names2.h", "fmu/names3.h"}  # a unit includes one of them
    either |= {name for name in HEADERS if "/in_place_of_scene/" in name}
    assert {m: names for m, names in defined.items() if len(names - either) > 1} == {}


def test_what_is_missing_shows(scene: Path) -> None:
    """The compiler's words reach the tests above."""
    assert "mechc_missing" in compiled(including("run/rates.h") + "mechc_missing x;\n", scene)
    assert "run/none.h" in compiled(including("run/none.h"), scene)


def test_folders_include_those_of_lower_layers() -> None:
    for name in HEADERS:
        folder = Path(name).parts[0]
        allowed = APART.get(folder) or {*LAYERS[: LAYERS.index(folder) + 1], *ALSO.get(folder, ())}
        text = (RUNTIME / name).read_text("utf-8").replace(ALL, "")
        included = set(re.findall(r'#include "(\w+)/', text))
        assert included <= allowed, f"{name} includes {included - allowed}"


TYPE = r"(?:double|int|char|real|rmask|ptrdiff_t|mechc_\w+|FN\(\w+\))"
DIMENSIONS = r"(?:\[[^\]]*\])+"


def _dimensions(text: str) -> Iterator[str]:
    """The dimensions of the arrays that a header declares, but for tables with values."""
    for line in re.sub(r"/\*.*?\*/|= {.*?}", "", text, flags=re.S).splitlines():
        if not line.lstrip().startswith(("static const", "typedef")):
            yield from re.findall(rf"\b{TYPE} \*?\w+({DIMENSIONS})", line)
            if re.match(rf" *(?:const |long )?{TYPE} .*;", line):  # others in the same line
                yield from re.findall(rf", \*?\w+({DIMENSIONS})(?=[,; ])", line)


def test_arrays_are_as_large_as_bounds() -> None:
    """``dynamics/bounds.h``: counts say how many of their elements are in use."""
    texts = {name: (RUNTIME / name).read_text("utf-8") for name in HEADERS}
    bounds = {b for text in texts.values() for b in re.findall(r"#define (MECHC_\w+)_MAX ", text)}
    found = [(name, dimension) for name, text in texts.items() for dimension in _dimensions(text)]
    assert len([d for _, d in found if "_MAX" in d]) > 500
    assert [(n, d) for n, d in found if bounds & {*re.findall(r"MECHC_\w+", d)}] == []


# What happens in a motion is found and applied in one place.
DRIVER = {
    r"(->|\.)start\(": {"hybrid/driver.h"},  # of a run, by the table of a unit
    r"\bmechc_watch_step\(": {"hybrid/driver.h", "hybrid/events/search.h"},
    # In model exchange an importer finds the zeros.
    r"\bmechc_watch_reset\(": {"hybrid/driver.h", "hybrid/events/resets.h", "fmu/events.h"},
    r"\bmechc_contacts_change\(": {"hybrid/driver.h", "hybrid/contact/contacts.h"},
}


@pytest.mark.parametrize("call", DRIVER)
def test_one_driver_begins_runs_and_applies_events(call: str) -> None:
    texts = {name: (RUNTIME / name).read_text("utf-8") for name in HEADERS}
    native = ROOT / "src" / "mechc" / "native"
    texts |= {path.name: path.read_text("utf-8") for path in native.glob("*.pyx")}
    assert {name for name, text in texts.items() if re.search(call, text)} == DRIVER[call]


def test_a_unit_of_outputs_has_all_data_that_no_later_part_brings():
    """A joined unit begins with it: what is missing there would be zero for ever."""
    texts = {name: (RUNTIME / name).read_text("utf-8")
             for name in ("abi/model.h", "abi/join_parts.h", "unit/outputs_only.h")}  # fmt: skip
    fields = texts["abi/model.h"].rpartition("mechc_unit;")[0].rpartition("typedef struct {")[2]
    data = set(re.findall(r"^    [a-z_ ]+ \*?(?:const \*)?(\w+);", fields, re.M))
    brought = set(re.findall(r"MECHC_TAKE\((\w+)\);", texts["abi/join_parts.h"])) | {"methods"}
    assert "identity_kinematics" in data - brought
    assert data - brought <= set(re.findall(r"^    \.(\w+) =", texts["unit/outputs_only.h"], re.M))
