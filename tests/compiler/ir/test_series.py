"""Which programs have recurrences of Taylor coefficients, and of what."""

from collections import Counter

import pytest
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.description.request import DEFAULT_REQUEST
from mechc_codegen.library.planar.four_bar import four_bar
from mechc_codegen.library.spatial.heavy_top import heavy_top
from sympy import Abs, asin, sin, sqrt
from sympy.physics.mechanics import dynamicsymbols

from tests.support.scenes import bead_with

q, u = dynamicsymbols("q u")


def series_of(mechanism):
    return optimised_scene(mechanism, DEFAULT_REQUEST, Stopwatch()).functions.program.series


@pytest.mark.parametrize("load", [Abs(q), asin(q / 2), q**q], ids=str)
def test_other_operations_have_none(load):
    assert series_of(bead_with(load)) is None


def test_neither_have_loops():
    assert series_of(four_bar()) is None


def test_a_root_a_power_and_a_sine():
    series = series_of(bead_with(sqrt(1 + q**2) * sin(u) + (2 + u**2) ** 0.3))
    kinds = Counter(series.operations[n].kind for n in series.needed_operations)
    assert kinds["root"] == kinds["sine"] == kinds["cosine"] == kinds["power"] == 1
    assert kinds["product"] == 3  # two squares, and the root by the sine


def test_a_product_with_an_inverse_is_a_quotient():
    """Of the heavy top up/cos(theta), which the program writes as up times 1/cos(theta)."""
    series = series_of(heavy_top())
    (number,) = (n for n in series.needed_operations if series.operations[n].kind == "quotient")
    above, below = (series.operations[n] for n in series.operations[number].args)
    assert above.kind == "sum"
    assert below.kind == "cosine"
