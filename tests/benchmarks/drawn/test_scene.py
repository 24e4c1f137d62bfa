"""The grammar: a seed is a text, every kind is drawn, and a text runs by itself."""

import re

import numpy as np
import pytest

from benchmarks.drawn.grammar.writer import Writer
from benchmarks.drawn.scene import KINDS, Numbers, drawn, numbers


def test_a_seed_and_a_case_are_one_text():
    assert drawn(3, 5) == drawn(3, 5)
    assert drawn(3, 5).text != drawn(3, 6).text
    assert numbers(drawn(3, 5), (3, 5), 2) == numbers(drawn(3, 5), (3, 5), 2)
    assert numbers(drawn(3, 5), (3, 5), 2) != numbers(drawn(3, 5), (3, 5), 3)


def test_every_kind_is_drawn_and_counted():
    scenes = [drawn(1, case) for case in range(250)]
    assert {scene.kind for scene in scenes} == set(KINDS)
    for scene in scenes:
        assert f"as {scene.kind}" in scene.used
        for name in scene.ranges:
            assert len(re.findall(rf"\b{name}\b", scene.text)) > 2


@pytest.mark.parametrize("stem", ["m", "k"])
def test_values_are_within_their_interval(stem):
    """A sum or product of parameters too, whatever stands beside it."""
    for seed in range(300):
        w = Writer(np.random.default_rng(seed))
        text = w.value(stem, 0.5, 2.0)
        rng = np.random.default_rng([seed, 1])
        known = {name: rng.uniform(*ends) for name, ends in w.ranges.items()}
        found = eval(re.sub(r"sm\.Rational\((.*?), (.*?)\)", r"(\1 / \2)", f"1 * {text}"), known)
        assert 0.4 <= found <= 2.3, text


def test_a_program_of_a_scene_runs_by_itself(capsys):
    scene = next(s for s in (drawn(2, case) for case in range(50)) if s.kind == "equations by hand"
                 and "inputs" not in s.given)  # fmt: skip
    program = scene.program(numbers(scene, (2, 0), 0))
    names = {}
    exec(program + "print(sol.status)", names)
    assert "finished" in capsys.readouterr().out
    assert isinstance(numbers(scene, (2, 0), 0), Numbers)
