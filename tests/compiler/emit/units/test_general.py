"""Which scenes the general unit serves, and by which of its kinds."""

import subprocess

import pytest
from mechc_codegen import build_scene, shipped_mechanism
from mechc_codegen.emit.units import general
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.extension.flags import (
    GENERAL_FLAGS,
    IN_PLACE_OF_SCENE,
    IN_PLACE_OF_SERIES,
    RUNTIME,
    STRICT,
)
from mechc_codegen.library.catalogue import SHIPPED

from mechc.compilation import toolchain
from tests.support import scenes
from tests.support.compilers.compilation import checking


def kind(mechanism) -> dict[str, int]:
    found = build_scene(mechanism).kind
    pairs = (flag.removeprefix("-DMECHC_KIND_").split("=") for flag in found)
    return {name: int(value) for name, value in pairs}


@pytest.mark.parametrize(
    ("mechanism", "wanted"),
    [
        ("four_bar", {"LOOPS": 1, "IDENTITY": 1, "ONE_FREEDOM": 3, "BLOCKS": 0}),
        ("andrews", {"LOOPS": 1, "ONE_FREEDOM": 0, "BLOCKS": 1}),
        ("bicycle", {"ROWS": 1, "LOOPS": 1, "IDENTITY": 1}),
        ("planar_chain", {"ROWS": 0, "LOOPS": 0, "REDUCED": 0}),
    ],
)
def test_a_kind_is_what_constants_of_the_unit_are(mechanism, wanted):
    assert wanted.items() <= kind(shipped_mechanism(mechanism)).items()


def test_speeds_that_are_no_rates_are_another_kind():
    assert kind(scenes.swing(guided=True))["IDENTITY"] == 0


def test_a_tree_that_is_walked_has_a_unit_of_its_own():
    assert not build_scene(SHIPPED["planar_chain"].build(links=20)).kind


@pytest.mark.parametrize("bound", ["NQ", "NP", "NK", "TURNS"])
def test_a_scene_beyond_a_bound_has_a_unit_of_its_own(monkeypatch, bound):
    assert kind(shipped_mechanism("four_bar"))
    bounds = {**general._bounds(), bound: 2}
    monkeypatch.setattr(general, "_bounds", lambda: bounds)
    assert not kind(shipped_mechanism("four_bar"))


@pytest.mark.parametrize("scene", ["pendulum", "four_bar", "andrews", "heavy_top", "swing"])
def test_its_sources_compile_without_warnings(tmp_path, scene):
    mechanism = scenes.swing(guided=True) if scene == "swing" else shipped_mechanism(scene)
    build = build_scene(mechanism, (BASELINE,))
    sources = {
        "general.c": general.general_source(BASELINE.lanes),
        "tapes.c": general.tapes_source(BASELINE.lanes, "baseline"),
    }
    if "-DMECHC_KIND_SERIES=1" in build.tape_kind:
        sources["series.c"] = general.series_source(BASELINE.lanes)
    compiler, places = toolchain.compiler(), (IN_PLACE_OF_SERIES, IN_PLACE_OF_SCENE, RUNTIME)
    for name, text in sources.items():
        (tmp_path / name).write_text(text, "utf-8")
        command = [*compiler, *GENERAL_FLAGS, *STRICT, *build.kind, *build.tape_kind]
        command += [f"-I{place}" for place in places]
        command += checking(compiler, tmp_path / f"{name}.o")
        done = subprocess.run(
            [*command, str(tmp_path / name)], capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr) == (0, ""), name
