"""Scenes that were wrong once are right; with the fault put in again they are not."""

from dataclasses import replace

import pytest
from mechc_codegen.emit.expressions import ATOM
from mechc_codegen.emit.taylor.series import SeriesWriter

from benchmarks.drawn.case import judge_scene

from .kept import KEPT, SUM_OF_PARAMETERS


@pytest.mark.parametrize("name", KEPT)
def test_a_scene_that_was_wrong_is_right(name):
    scene, doors = KEPT[name]
    found = judge_scene(scene, (0, 0), 10, doors)
    assert not found.faults
    assert found.scenes == 10
    assert found.compared


def test_a_factor_without_its_parentheses_is_found(monkeypatch, tmp_path):
    monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path))

    constant = SeriesWriter.constant

    def bare(writer, value):
        return replace(constant(writer, value), binds=ATOM)

    monkeypatch.setattr(SeriesWriter, "constant", bare)
    text, ranges = SUM_OF_PARAMETERS.text.replace("A", "C"), {"C": (2.5, 4.0), "B": (1.5, 2.5)}
    renamed = replace(SUM_OF_PARAMETERS, text=text, ranges=ranges)  # none that is compiled already
    found = judge_scene(renamed, (0, 1), 2, ["batch auto"])
    assert [fault.split(":")[0] for fault in found.faults] == ["batch auto"]
