"""The order in which the rows of cuts are eliminated.

Input: a tree with its cuts.  Output: tables by which the runtime eliminates the rows link by link
(``dynamics/loops/rows.h``).  Invariant: each row is passed from the cut link towards the ground
until a speed is its pivot; no link has more rows than possible motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from mechc_codegen.derive.equations import Tree


@dataclass(frozen=True)
class RowPlan:
    """The places of rows at every link: those passed on by its children, then its own.

    ``first``: of each link the first place, and one more for the end.  ``cut_place``: of each cut
    where its row begins.  ``passed_to``: of each link the parent's place for the first row that it
    does not eliminate.  ``pivot``: of each column the place of the row that its speed eliminates,
    -1 if none.  ``first_factor``: of each column the first of the numbers kept for the rows after
    it.
    """

    first: tuple[int, ...]
    cut_place: tuple[int, ...]
    passed_to: tuple[int, ...]
    pivot: tuple[int, ...]
    first_factor: tuple[int, ...]


def plan_rows(tree: Tree) -> RowPlan | None:
    """The plan, or None if a row acts on two moving links, too many rows meet in one link, or fewer
    than its speeds, or a speed moves several links."""
    if not tree.rows or tree.shared or not all(map(_acts_on_one, tree.rows)):
        return None
    rows, left = _counts(tree)
    if any(0 < count < len(own) for count, own in zip(rows, tree.columns, strict=True)):
        return None  # which speeds eliminate them well changes along the motion
    most = 3 if tree.planar else 6
    grounded = [left[k] for k, parent in enumerate(tree.parents) if parent < 0]
    if max(left) > most or any(grounded):
        return None
    first = tuple(accumulate(rows, initial=0))
    cut_place, passed_to = _places(tree, first, left)
    pivot, factors = list[int](), list[int]()
    for link, columns in enumerate(tree.columns):
        # the last column takes the first row
        for k in reversed(range(len(columns))):
            place = first[link] + k
            pivot.append(place if place < first[link + 1] else -1)
            factors.append(max(first[link + 1] - place - 1, 0))
    first_factor = tuple(accumulate(factors, initial=0))
    return RowPlan(first, cut_place, passed_to, tuple(pivot), first_factor)


def _acts_on_one(row: Sequence[tuple[int, int]]) -> bool:
    """Whether a row acts on one moving link and the ground."""
    return len(row) == 1 and min(row[0]) < 0 <= max(row[0])


def walks_moving_cuts(tree: Tree) -> bool:
    """Whether rows that have no plan take fewer operations by articulated bodies, a pass over the
    links for each (``dynamics/loops/cuts.h``), than by the orthogonal factors of all."""
    rows, speeds = len(tree.rows), sum(map(len, tree.columns))
    if not rows or rows >= speeds or tree.shared:
        return False
    size = 3 if tree.planar else 6
    links = len(tree.parents)
    bodies = links * (4 * size**2) + speeds * 2 * size**2
    passes = rows * (links * 8 * size + speeds * 8 * size)
    together = speeds**3 // 6 + rows * speeds**2 // 2 + 4 * rows**2 * speeds + speeds**2 * size
    return bodies + passes + rows**3 < together


def _counts(tree: Tree) -> tuple[list[int], list[int]]:
    """The number of rows at each link, and the number that it passes on."""
    rows = [0] * len(tree.parents)
    left = list(rows)
    for (ends,) in tree.rows:
        rows[max(ends)] += 1
    for link in reversed(range(len(tree.parents))):
        left[link] = max(rows[link] - len(tree.columns[link]), 0)
        if tree.parents[link] >= 0:
            rows[tree.parents[link]] += left[link]
    return rows, left


def _places(
    tree: Tree, first: tuple[int, ...], left: list[int]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    free = list(first[:-1])

    def reserve(link: int, count: int) -> int:
        free[link] += count
        return free[link] - count

    passed_to = tuple(
        reserve(parent, left[link]) if parent >= 0 else 0
        for link, parent in enumerate(tree.parents)
    )
    return tuple(reserve(max(ends), 1) for (ends,) in tree.rows), passed_to
