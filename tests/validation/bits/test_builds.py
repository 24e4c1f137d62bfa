"""A motion has the same bits whoever compiled it, and how."""

from __future__ import annotations

import pytest

from benchmarks.suite.states import CLANG, WIDER, of_builds


@pytest.mark.slow(cases=2)
@pytest.mark.parametrize(
    ("name", "others"),
    [("four_bar", ("-O0", "8 lanes", WIDER)), ("pendulum", ("-O0", CLANG, WIDER))],
)
def test_no_bit_depends_on_compiler_optimisation_and_lanes(name, others, flags_of_users):
    """Last states by every method; ``mechc bench states --builds --digests`` compares the rest."""
    builds = dict(of_builds([name], ("-O3", *others)))
    usual = builds.pop("-O3")
    assert len(usual) == 6
    assert builds
    for build, states in builds.items():
        assert states == usual, build
