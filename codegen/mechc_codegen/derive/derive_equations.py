"""Stage 1: Mechanism -> Equations, by the form of Kane's method that is faster for it."""

from __future__ import annotations

from mechc_codegen.derive.equations import Equations
from mechc_codegen.derive.kane import derive
from mechc_codegen.derive.tree.frames import NotATreeError
from mechc_codegen.derive.tree.recursion import derive_tree
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.request import DEFAULT_REQUEST, OutputRequest

LEAST_TREE = 7  # fewer speeds: straight-line code for M and F is faster (docs/growth.md)
LEAST_WRITTEN = 5  # speeds, and links in a row: fewer have fewer operations by partial velocities


def derive_equations(mechanism: Mechanism, request: OutputRequest = DEFAULT_REQUEST) -> Equations:
    """Derive link by link where there are many links and the description allows it.

    Fewer in a row, in space, are derived link by link too, and M and F then written out.
    """
    speeds = len(mechanism.speeds)
    if speeds >= LEAST_WRITTEN:
        least_written = LEAST_WRITTEN if speeds < LEAST_TREE else None
        try:
            return derive_tree(mechanism, request, least_written=least_written)
        except NotATreeError:
            pass
    return derive(mechanism, request)
