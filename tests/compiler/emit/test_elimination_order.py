"""The order in which rows of cuts are eliminated."""

from types import SimpleNamespace

import pytest
from mechc_codegen.derive.equations import Tree
from mechc_codegen.emit.elimination_order import plan_rows
from mechc_codegen.emit.units.instruction_sets import WIDER, with_fitting_lanes

CHAIN = tuple(range(-1, 9))


def chain(links, *cuts, planar=True):
    return Tree(CHAIN[:links], tuple((k,) for k in range(links)), planar, cuts)


def test_every_row_has_one_pivot():
    """Two loops on a chain of seven: four rows, the last of each loop's links first."""
    tree = chain(7, (2, -1), (2, -1), (6, -1), (6, -1))
    plan = plan_rows(tree)
    pivots = [k for k, place in enumerate(plan.pivot) if place >= 0]
    assert len(pivots) == 4
    assert pivots == [1, 2, 5, 6]


def test_rows_are_passed_to_places_of_their_own():
    tree = chain(5, (4, -1), (4, -1), (1, -1))
    plan = plan_rows(tree)
    assert plan.first == (0, 0, 1, 1, 2, 4)
    ends = set(plan.cut_place)
    assert len(ends) == 3
    for link, parent in enumerate(tree.parents):
        if parent >= 0 and plan.first[link + 1] - plan.first[link] > 1:
            assert plan.first[parent] <= plan.passed_to[link] < plan.first[parent + 1]


def test_factors_are_kept_for_each_row_that_waits():
    plan = plan_rows(chain(6, (5, -1), (5, -1)))
    widths = [b - a for a, b in zip(plan.first_factor, plan.first_factor[1:], strict=False)]
    assert widths == [0, 0, 0, 0, 0, 1]


@pytest.mark.parametrize("cuts", [
    [(6, 2), (6, 2)],  # between two links that move
    [(1, -1), (1, -1), (1, -1), (1, -1)],  # more rows than speeds
    [],
])  # fmt: skip
def test_other_trees_are_left_to_the_dense_solution(cuts):
    assert plan_rows(chain(7, *cuts)) is None


def test_a_link_of_several_speeds_eliminates_as_many_rows():
    tree = Tree((-1, 0), ((0,), (1, 2, 3)), False, ((1, -1),) * 3)
    plan = plan_rows(tree)
    assert plan.pivot == (-1, 2, 1, 0)
    assert plan.first == (0, 0, 3)


@pytest.mark.parametrize(("speeds", "rows", "lanes"), [
    (11, 10, 8), (81, 80, 8), (161, 160, 2), (161, 0, 8), (400, 2, 2),
])  # fmt: skip
def test_scenes_of_very_many_speeds_have_fewer_lanes(speeds, rows, lanes):
    """Rows that are solved together need factors of all lanes on the stack."""
    symbols = SimpleNamespace(u=(None,) * speeds)
    equations = SimpleNamespace(holonomic=rows, nonholonomic=0, symbols=symbols)
    assert with_fitting_lanes(WIDER[-1], equations).lanes == lanes
