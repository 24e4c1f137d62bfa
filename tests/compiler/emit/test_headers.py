"""Every header of the runtime compiles by itself, and none includes what leads back to it."""

import re
import subprocess
from pathlib import Path

import pytest
from mechc_codegen import build_scene, shipped_mechanism
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.extension.flags import RUNTIME, STRICT

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
    "variational", "adjoint", "unit", "fmu",
)  # fmt: skip
ALSO = {"fmu": {"hybrid"}}  # of those compiled apart
# Compiled into the runtime, and into units that are exported, not into scenes.
APART = {
    "batch": {"abi", "batch", "hybrid", "record"},
    "closing": {"abi", "closing"},
    "hybrid": {"abi", "closing", "hybrid", "record"},
    "record": {"abi", "record"},
}
COMPILER = toolchain.find_compiler() or ["cc"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene")
    build_scene(shipped_mechanism("four_bar"), (BASELINE,)).write(folder)
    return folder


def compiled(source: str, scene: Path) -> str:
    """What the compiler says of a text that includes headers."""
    command = [*COMPILER, "-std=gnu11", *STRICT, "-Wno-unused-const-variable"]
    command += ["-Wno-unused-function"]  # of those that are compiled apart
    command += [f"-DMECHC_LANES={BASELINE.lanes}", "-DMECHC_UNIT=baseline"]
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
    assert compiled(including(*texts, *end), scene) == ""


def test_what_is_missing_shows(scene: Path) -> None:
    """The compiler's words reach the tests above."""
    assert "mechc_missing" in compiled(including("run/rates.h") + "mechc_missing x;\n", scene)
    assert "run/none.h" in compiled(including("run/none.h"), scene)


def test_folders_include_those_of_lower_layers() -> None:
    for name in HEADERS:
        folder = Path(name).parts[0]
        allowed = APART.get(folder) or {*LAYERS[: LAYERS.index(folder) + 1], *ALSO.get(folder, ())}
        text = (RUNTIME / name).read_text("utf-8")
        included = set(re.findall(r'#include "(\w+)/', text))
        assert included <= allowed, f"{name} includes {included - allowed}"


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
