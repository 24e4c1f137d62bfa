"""The block-triangular form of the constraint Jacobian.

Input: the entries of each row that are not zero for all states.  Output: blocks of rows, each with
the speeds that it settles once those of the blocks before it are known (planar linkages: Assur
groups).  Invariant: a row has no entry in a block after its own.  A block has as many speeds as
rows, or one more: then it leaves one direction free.  A single row may leave two.

The finest blocks come first: of all sets of rows that settle their new speeds the smallest, and
where there are none, of all that leave one speed open.  Configuration rows come before those of
speeds alone, which follow the motion that those leave: a wheel's slip says little of its height.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from mechc_codegen.derive.equations import Equations, Output
from mechc_codegen.emit.layout import FunctionLayout

MOST_ROWS = 2  # of a block
MOST_FREE = 3  # directions, as in dynamics/motion.h


@dataclass(frozen=True)
class Block:
    """A block of rows, and the speeds that it determines."""

    rows: tuple[int, ...]
    speeds: tuple[int, ...]

    @property
    def free(self) -> int:
        """The number of directions that the block leaves free."""
        return len(self.speeds) - len(self.rows)


@dataclass(frozen=True)
class BlockForm:
    """Blocks in the order of their elimination, with the entries of J and M that are not zero."""

    blocks: tuple[Block, ...]
    jacobian: tuple[frozenset[int], ...]
    mass: tuple[frozenset[int], ...]
    of_speeds: int = 0  # of the rows: those, the last, that constrain speeds alone

    @property
    def free(self) -> int:
        return sum(block.free for block in self.blocks)


def scene_blocks(
    equations: Equations, divided: FunctionLayout, outputs: Mapping[str, Output]
) -> BlockForm | None:
    """The block form; None if rows are solved in another way or blocks are not small."""
    speeds = len(equations.symbols.u)
    rows = equations.holonomic + equations.nonholonomic
    closed_form = speeds == rows + 1 and speeds <= 3  # dynamics/loops/one_freedom.h
    if equations.tree or not rows or closed_form or not 0 <= speeds - rows <= MOST_FREE:
        return None
    named = {target: name for name, target in divided.configuration.items()}
    entries = _pattern(outputs[named["jacobian"]], speeds)
    blocks = find_blocks(entries, speeds, equations.nonholonomic)
    if blocks is None:
        return None
    mass = _pattern(outputs[named["mass"]], speeds)
    return BlockForm(blocks, entries, mass, equations.nonholonomic)


def orthogonal_operations(rows: int, speeds: int) -> dict[str, int]:
    """Number of operations to solve all rows by orthogonal factors."""
    pairs, free = rows * (rows - 1) // 2, speeds - rows
    sweeps = pairs * (6 * speeds + 2 * speeds + 4)  # and rows are exchanged
    return {
        "factors": 2 * rows * speeds + sweeps + free * (5 * rows + 2 * speeds) * speeds,
        "solution": 4 * pairs + rows * speeds + 3 * free * speeds,
        "conditioning": 2 * rows,
    }


def _pattern(output: Output, width: int) -> tuple[frozenset[int], ...]:
    rows = range(0, len(output.elements), width)
    return tuple(
        frozenset(k for k in range(width) if output.elements[first + k] != 0) for first in rows
    )


def find_blocks(
    rows: Sequence[frozenset[int]], speeds: int, of_speeds: int = 0
) -> tuple[Block, ...] | None:
    """Blocks that contain every row and every speed once; None if there are none, as where no
    speed changes some row."""
    if not all(rows):
        return None
    return _ordered_blocks(rows, speeds, len(rows) - of_speeds) or _ordered_blocks(rows, speeds, 0)


def _ordered_blocks(
    rows: Sequence[frozenset[int]], speeds: int, first: int
) -> tuple[Block, ...] | None:
    """The finest blocks, with the ``first`` rows before the others."""
    left, known, blocks = list(range(len(rows))), frozenset[int](), list[Block]()
    while left:
        block = _next_block(rows, [row for row in left if row < first] or left, known)
        if block is None:
            return None
        blocks.append(block)
        known |= frozenset(block.speeds)
        left = [row for row in left if row not in block.rows]
    blocks += [Block((), (speed,)) for speed in range(speeds) if speed not in known]
    return tuple(blocks)


def _next_block(
    rows: Sequence[frozenset[int]], left: Sequence[int], known: frozenset[int]
) -> Block | None:
    for free, most in ((0, MOST_ROWS), (1, MOST_ROWS), (2, 1)):
        for size in range(1, most + 1):
            few = [row for row in left if len(rows[row] - known) <= size + free]
            for chosen in combinations(few, size):
                new = frozenset[int]().union(*(rows[row] for row in chosen)) - known
                if len(new) == size + free:
                    return Block(chosen, tuple(sorted(new)))
    return None
