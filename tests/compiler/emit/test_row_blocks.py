"""The block-triangular form of constraint rows."""

import pytest
from mechc_codegen.emit.row_blocks import Block, find_blocks


def rows(*groups):
    return [frozenset(group) for group in groups]


def test_three_pairs_of_rows_settle_two_angles_each():
    """Andrews' squeezing mechanism, its pairs in any order."""
    through = [(0, 1, 2), (0, 1, 3, 4), (0, 1, 5, 6)]
    entries = rows(*[through[k] for k in (2, 1, 2, 0, 1, 0)])
    assert find_blocks(entries, 7) == (
        Block((3, 5), (0, 1, 2)), Block((0, 2), (5, 6)), Block((1, 4), (3, 4)),
    )  # fmt: skip


def test_rows_that_settle_their_speeds_come_before_those_that_leave_one_open():
    entries = rows((0, 1, 2), (0, 1, 2), (3, 4), (3,))
    assert find_blocks(entries, 5) == (
        Block((3,), (3,)), Block((2,), (4,)), Block((0, 1), (0, 1, 2)),
    )  # fmt: skip


def test_speeds_without_a_row_are_free():
    assert find_blocks(rows((1, 2), (1, 2)), 4)[1:] == (Block((), (0,)), Block((), (3,)))


def test_a_wheel_on_the_ground_is_settled_before_its_slip():
    """Whipple's bicycle: the front wheel's height is the only row of coordinates, and leaves two of
    roll, steer and pitch open.  The slips know nothing of which of these the height may settle."""
    slip = [(1, 3, 4, 6), (3, 4), (2, 3, 4, 5, 6, 7), (0, 2, 3, 4, 5, 6, 7)]
    assert find_blocks(rows((0, 2, 6), *slip), 8, of_speeds=4) == (
        Block((0,), (0, 2, 6)), Block((2,), (3, 4)), Block((1,), (1,)), Block((3, 4), (5, 7)),
    )  # fmt: skip


@pytest.mark.parametrize("entries", [
    rows((0, 1, 2, 3), (0, 1, 2, 3)),  # a five-bar leaves two speeds open at once
    rows((0, 1, 2, 3), (0, 1, 2, 3), (0, 1, 2, 3)),  # a loop in space
    rows((0,), (0,)),  # more rows than speeds
    rows((0, 1), ()),  # no speed changes the second
])  # fmt: skip
def test_larger_blocks_are_solved_together(entries):
    assert find_blocks(entries, 4) is None


@pytest.mark.parametrize("seed", range(20))
def test_no_row_has_entries_in_later_blocks(seed):
    """Random forms, their rows and speeds in another order."""
    import random

    draw = random.Random(seed)
    known, entries = [], []
    for _ in range(draw.randint(2, 5)):
        size, free = draw.randint(1, 2), draw.randint(0, 1)
        new = list(range(len(known), len(known) + size + free))
        for _ in range(size):
            entries.append({*new, *draw.sample(known, draw.randint(0, len(known)))})
        known += new
    places = draw.sample(known, len(known))
    draw.shuffle(entries)
    entries = [frozenset(places[k] for k in row) for row in entries]
    blocks = find_blocks(entries, len(known))
    assert blocks is not None
    assert sorted(k for block in blocks for k in block.rows) == list(range(len(entries)))
    assert sorted(k for block in blocks for k in block.speeds) == sorted(known)
    settled = set()
    for block in blocks:
        settled |= set(block.speeds)
        assert all(entries[row] <= settled for row in block.rows)
