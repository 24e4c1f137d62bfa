"""Which scenes the general unit serves, and by which of its kinds."""

import subprocess

import pytest
from mechc_codegen import build_scene, shipped_mechanism
from mechc_codegen.emit.units import general
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.extension.flags import GENERAL_FLAGS, GENERAL_INCLUDES, STRICT
from mechc_codegen.library.catalogue import SHIPPED

from benchmarks.problems.window_row import window_row
from mechc.compilation import toolchain
from tests.support.compilers.compilation import checking


def kind(mechanism) -> str:
    return build_scene(mechanism).kind


@pytest.mark.parametrize(
    ("mechanism", "wanted"),
    [
        ("four_bar", "one_freedom"),
        ("andrews", "loops"),
        pytest.param("bicycle", "loops", marks=pytest.mark.slow),
        ("planar_chain", "open"),
        ("heavy_top", "open"),
    ],
)
def test_a_kind_is_what_arrays_of_the_unit_are(mechanism, wanted):
    assert kind(shipped_mechanism(mechanism)) == wanted


@pytest.mark.slow
def test_trees_that_are_walked_have_kinds_of_their_own():
    assert kind(SHIPPED["planar_chain"].build(links=20)) == "walked"
    assert kind(window_row(4)) == "walked_loops"


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("bound", ["NQ", "NP", "NK", "TURNS"])
def test_a_scene_beyond_a_bound_has_a_unit_of_its_own(monkeypatch, bound):
    assert kind(shipped_mechanism("four_bar"))
    bounds = {**general._bounds(walked=False), bound: 2}
    monkeypatch.setattr(general, "_bounds", lambda *, walked: bounds)
    assert not kind(shipped_mechanism("four_bar"))


@pytest.mark.parametrize("name", general.KINDS)
def test_its_sources_compile_without_warnings(tmp_path, name):
    compile_strictly(tmp_path, name, checking(toolchain.compiler(), tmp_path / "checked.o"))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["open", "one_freedom", "walked", "walked_loops"])
def test_nor_are_there_any_where_they_are_optimised(tmp_path, name):
    compile_strictly(tmp_path, name, ["-c", "-o", str(tmp_path / "compiled.o")])


def compile_strictly(folder, name, how):
    for source, text in general.unit_sources(name, BASELINE.lanes, "baseline").items():
        (folder / source).write_text(text, "utf-8")
        command = [*toolchain.compiler(), *GENERAL_FLAGS, *STRICT, *general.kind_flags(name)]
        command += [f"-I{place}" for place in GENERAL_INCLUDES]
        done = subprocess.run(
            [*command, *how, str(folder / source)], capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr) == (0, ""), source
