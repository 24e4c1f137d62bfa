"""The compiled closer: constraints, evaluated by Python, whose solutions are known by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mechc.native._closing import Closings, Closure, measure

from mechc.assembly.closer import spread
from tests.support.linkages import dyads
from tests.support.linkages.python_scene import PythonScene


class Constraints(PythonScene):
    """Gaps of the coordinates and their gradient."""

    def __init__(self, gap, gradient, coordinates=1, rows=1):
        self.gap, self.gradient = gap, gradient
        super().__init__(coordinates, rows)

    def evaluate(self, name, q, u):
        if name == "constraints":
            return self.gap(q)
        gradient = self.gradient(q).reshape(len(q), self.rows, self.coordinates)
        return np.einsum("nij,nj->ni", gradient, u) if name == "velocity_constraints" else gradient


def search(constraints, *, angular=True, guess=None, starts=40, length=1.0, **options):
    size = constraints.coordinates
    start = np.linspace(-1, 1, starts * size).reshape(size, starts).T.copy()
    start += 0.3 * np.sin(np.arange(start.size)).reshape(start.shape)
    fixed = np.zeros((1, size)) if guess is None else np.array([guess], dtype=float)
    found = Closings(
        Closure(constraints.scene, kind=np.full(size, angular, np.uint8)), 0.0,
        np.arange(size, dtype=np.intc),
        np.clip(start, -1, 1), fixed, np.zeros((1, 1)), np.array([length]), 100,
        guessed=None if guess is None else np.ones(size, np.uint8), **options,
    )  # fmt: skip
    found.work()
    return found


def configurations(found):
    return found.found[0, : found.many[0]]


def waves(count):
    return Constraints(lambda q: np.sin(count * q), lambda q: count * np.cos(count * q))


def test_every_solution_is_found_once_and_in_order():
    found = configurations(search(waves(3), all=True))
    np.testing.assert_allclose(found[:, 0], np.pi * np.array([-2, -1, 0, 1, 2, 3]) / 3, atol=1e-15)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(st.floats(-9.0, 9.0))
def test_the_nearest_to_a_guess_is_taken_in_its_turn(guess):
    step = np.pi / 5
    if abs((guess / step) % 1 - 0.5) < 1e-3:
        return  # as near to two
    nearest = configurations(search(waves(5), guess=[guess]))[0, 0]
    assert nearest == pytest.approx(step * round(guess / step), abs=1e-14)


def test_a_guess_on_a_crest_finds_what_is_nearest():
    """There the first step leads far off; others start from around the guess then."""
    nearest = configurations(search(waves(5), guess=[np.pi / 10 - 1e-3]))[0, 0]
    assert abs(nearest) < 1e-14


@pytest.mark.parametrize("apart", [1e-2, 1e-4, 2e-6])
def test_solutions_close_together_are_told_apart(apart):
    near = Constraints(lambda q: q**2 - apart**2 / 4, lambda q: 2 * q)
    found = configurations(search(near, angular=False))
    np.testing.assert_allclose(found[:, 0], [-apart / 2, apart / 2], rtol=1e-6)


def test_a_double_solution_is_found_to_half_the_digits():
    found = configurations(search(Constraints(lambda q: q**2, lambda q: 2 * q)))
    assert len(found) == 1
    assert abs(found[0, 0]) < 2e-7


def test_the_least_gap_is_told_where_nothing_closes():
    """Ends of two bars of 1 m about the origin, and a point 3 m off: 1 m is missing."""
    bars = Constraints(
        lambda q: np.stack([np.cos(q).sum(axis=1) - 3, np.sin(q).sum(axis=1)], axis=1),
        lambda q: np.stack([-np.sin(q), np.cos(q)], axis=1), 2, 2,
    )  # fmt: skip
    found = search(bars)
    assert found.many[0] == 0
    assert found.miss[0] == pytest.approx(1.0, abs=1e-12)


def test_rows_that_depend_on_each_other_close_too():
    both = Constraints(
        lambda q: np.hstack([np.sin(q), 2 * np.sin(q)]),
        lambda q: np.hstack([np.cos(q), 2 * np.cos(q)]), 1, 2,
    )  # fmt: skip
    np.testing.assert_allclose(configurations(search(both))[:, 0], [0, np.pi], atol=1e-15)


def test_a_gap_that_is_no_number_ends_the_search():
    found = search(Constraints(lambda q: np.full_like(q, np.nan), np.ones_like))
    assert found.many[0] == 0


@pytest.mark.parametrize("rank", [1, 2, 3, 4])
@pytest.mark.parametrize("rows", [1, 4, 6])
def test_speeds_are_the_nearest_that_keep_the_constraints(rank, rows):
    """Against NumPy's pseudo-inverse; the rows depend on each other, some speeds are given."""
    draw = np.random.default_rng(10 * rank + rows)
    rank = min(rank, rows)
    jacobian = draw.normal(size=(rows, rank)) @ draw.normal(size=(rank, 5))
    lines = Constraints(
        lambda q: np.zeros((len(q), rows)), lambda q: np.tile(jacobian, (len(q), 1, 1)), 5, rows
    )
    y = np.hstack([np.zeros((3, 5)), draw.normal(size=(3, 5))])
    free = np.array([0, 1, 2, 4], np.intc)
    found, left, row, size, conditioning = Closure(lines.scene).keep_speeds(
        0.0, y, np.zeros((1, 1)), free, 1e-9
    )
    inverse = np.linalg.pinv(jacobian[:, free], rcond=1e-9)
    expected = y.copy()
    expected[:, 5 + free] -= y[:, 5:] @ jacobian.T @ inverse.T
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    residual = found[:, 5:] @ jacobian.T
    np.testing.assert_allclose(size, np.abs(residual).max(axis=1), atol=1e-13)
    relative = np.abs(jacobian).max() * np.maximum(1, np.abs(found[:, 5:]).max(axis=1))
    np.testing.assert_allclose(left, size / relative, rtol=1e-12)
    np.testing.assert_allclose(np.abs(residual)[np.arange(3), row], size, atol=1e-13)
    singular = np.linalg.svd(jacobian, compute_uv=False)
    least = singular[-1] / singular[0] if rows <= 5 else 0.0
    np.testing.assert_allclose(conditioning, least, atol=1e-14)


def closed_natural(linkage, squared, factors, **options):
    """Places found (n, joints, 2) of a linkage in natural coordinates."""
    rows = dyads.Rows(linkage, squared, factors)
    size = rows.coordinates
    found = Closings(
        Closure(rows.scene), 0.0, np.arange(size, dtype=np.intc), spread(size), np.zeros((1, size)),
        np.zeros((1, 1)), np.ones(1), 100, **options,
    )  # fmt: skip
    found.work()
    return configurations(found).reshape(-1, size // 2, 2)


def assert_same_places(found, expected, within):
    """Each place once, in any order."""
    assert len(found) == len(expected)
    away = np.abs(found[:, None] - expected[None]).max(axis=(2, 3))
    assert away.min(axis=0).max() < within
    assert sorted(away.argmin(axis=1)) == list(range(len(expected)))


SHAPES = [dyads.four_bar, dyads.watt, dyads.klann, dyads.jansen]


@pytest.mark.parametrize(("shape", "unit"), [*zip(SHAPES, (1e-3, 1e3, 1e-3, 1e3), strict=True)])
def test_squares_of_distances_close_as_circles_intersect(shape, unit):
    draw = np.random.default_rng(len(shape.__name__))
    linkage = shape(draw.uniform(0, 2 * np.pi)).scaled(unit)
    assert linkage.clearance() > 1e-3
    factors = 10.0 ** draw.uniform(-6, 6, len(linkage.rods))
    found = closed_natural(linkage, np.ones(len(factors), bool), factors)
    assert_same_places(found, linkage.assemblies(), 1e-9 * linkage.rods[0][2])


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("shape", SHAPES[:2], ids=lambda shape: shape.__name__)
@pytest.mark.parametrize("crank", [0.3, 1.9, 4.4])
def test_distances_and_their_squares_in_any_unit_close_alike(shape, crank):
    """Some rows squared, some not; lengths from 1e-3 to 1e3, rows times 1e-6 to 1e6."""
    linkage, draw = shape(crank), np.random.default_rng(5)
    expected = linkage.assemblies()
    for unit, most in ((1.0, 0.0), (1e-3, 6.0), (1e3, 6.0)):
        squared = draw.random(len(linkage.rods)) < 0.5
        factors = 10.0 ** draw.uniform(-most, most, len(squared))
        found = closed_natural(linkage.scaled(unit), squared, factors, all=True)
        assert_same_places(found / unit, expected, 1e-9)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_the_length_is_the_extent_of_the_linkage_in_any_unit(unit):
    linkage = dyads.klann(1.0).scaled(unit)
    rods = np.ones(len(linkage.rods))
    rows = dyads.Rows(linkage, rods > 0, 1e6 * rods)
    free, nothing = np.arange(rows.coordinates, dtype=np.intc), np.zeros(rows.coordinates)
    (length,), (sizes,) = measure(
        Closure(rows.scene), 0.0, free, nothing, np.zeros((1, 1)), np.ones(1)
    )
    extent = np.abs(linkage.assemblies()).max()
    assert extent < length < 3 * extent
    assert (sizes > 1e6 * extent * np.min([rod[2] for rod in linkage.rods])).all()


def test_rows_without_a_length_keep_the_one_given():
    """x = y: no constant tells how far to search."""
    line = Constraints(
        lambda q: q[:, :1] - q[:, 1:], lambda q: np.tile([1.0, -1.0], (len(q), 1)), 2, 1
    )
    free = np.arange(2, dtype=np.intc)
    hints = np.array([7.0, 3.0])
    lengths, sizes = measure(Closure(line.scene), 0.0, free, np.zeros(2), np.zeros((2, 1)), hints)
    assert lengths.tolist() == hints.tolist()
    assert sizes[:, 0] == pytest.approx(2 * hints)
