"""Why each joint that closes a loop is cut, in words.

Input: a spanning tree, and the joints of its loops.  Output: the name of each cut, and its reason:
the first of the rules of ``spanning.py`` in which it comes after all others of its loop.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mechc_codegen.robots.spanning import SpanningTree

RULES = (  # one for each place of the order by which the tree grows
    "it holds a distance, which leads to no link",
    "cut= names it",
    "the file says that it closes a loop",
    "the others of its loop are fixed",
    "a motor, spring, damper, stop or mimic needs the coordinate of each of the others",
    "it has more coordinates than each other of its loop",
    "of the joints of its loop, alike in all this, it is farthest from the root, closes the loop "
    "best, or is last in the file",
)


def cut_reasons(tree: SpanningTree, loops: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """The reasons by the names of cuts; ``loops``: names of the other joints of their loops."""
    found = {}
    for cut in tree.cuts:
        others = [tree.orders[name] for name in loops.get(cut.name, ()) if name in tree.orders]
        most = max(others, default=(False,) * len(RULES))
        own = tree.orders.get(cut.name)
        pairs = zip(own or (), most, strict=False)
        place = next((i for i, (one, other) in enumerate(pairs) if one > other), -1)
        found[cut.name] = RULES[place] if own else (
            "motors, springs, dampers, stops or mimics need the coordinate of every joint of its "
            f"loop, so a link is cut in two, {cut.parent} and {cut.child}"
        )  # fmt: skip
    return found
