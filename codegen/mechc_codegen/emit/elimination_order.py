"""Which link takes up which row of the cuts.

Input: a tree with its cuts.  Output: tables by which the runtime eliminates the rows link by link
(``loop_rows.h``).  Invariant: each row is handed from the link that is cut towards the ground until
a speed takes it up; at no link are more rows at hand than motions they could prescribe.
"""

from __future__ import annotations

from dataclasses import dataclass

from mechc_codegen.derive.equations import Tree


@dataclass(frozen=True)
class RowPlan:
    """Every link has a range of places for rows: those that its children hand on, then its own.

    ``first``: of each link the first place, and one more for the end.  ``cut_place``: of each cut
    where its row begins.  ``handed_to``: of each link the parent's place for the first row that it
    does not take up.  ``taken``: of each column the place of the row that its speed takes up, -1 if
    none.  ``first_factor``: of each column the first of the numbers kept for the rows after it.
    """

    first: tuple[int, ...]
    cut_place: tuple[int, ...]
    handed_to: tuple[int, ...]
    taken: tuple[int, ...]
    first_factor: tuple[int, ...]


def plan_rows(tree: Tree) -> RowPlan | None:
    """The plan, or None where a cut joins two moving links or more rows come together than fit."""
    if not tree.cuts or not all(min(ends) < 0 <= max(ends) for ends in tree.cuts):
        return None
    at_hand, left = _counts(tree)
    most = 3 if tree.planar else 6
    grounded = [left[k] for k, parent in enumerate(tree.parents) if parent < 0]
    if max(left) > most or any(grounded):
        return None
    first = _running(at_hand)
    cut_place, handed_to = _places(tree, first, left)
    taken, factors = list[int](), list[int]()
    for link, columns in enumerate(tree.columns):
        # the last column takes the first row
        for k in reversed(range(len(columns))):
            place = first[link] + k
            taken.append(place if place < first[link + 1] else -1)
            factors.append(max(first[link + 1] - place - 1, 0))
    return RowPlan(first, cut_place, handed_to, tuple(taken), _running(factors))


def _counts(tree: Tree) -> tuple[list[int], list[int]]:
    """Rows at hand at each link, and rows that it hands on."""
    at_hand = [0] * len(tree.parents)
    left = list(at_hand)
    for ends in tree.cuts:
        at_hand[max(ends)] += 1
    for link in reversed(range(len(tree.parents))):
        left[link] = max(at_hand[link] - len(tree.columns[link]), 0)
        if tree.parents[link] >= 0:
            at_hand[tree.parents[link]] += left[link]
    return at_hand, left


def _places(
    tree: Tree, first: tuple[int, ...], left: list[int]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    free = list(first[:-1])

    def reserve(link: int, count: int) -> int:
        free[link] += count
        return free[link] - count

    handed_to = tuple(
        reserve(parent, left[link]) if parent >= 0 else 0
        for link, parent in enumerate(tree.parents)
    )
    return tuple(reserve(max(ends), 1) for ends in tree.cuts), handed_to


def _running(counts: list[int]) -> tuple[int, ...]:
    sums = [0]
    for count in counts:
        sums.append(sums[-1] + count)
    return tuple(sums)
