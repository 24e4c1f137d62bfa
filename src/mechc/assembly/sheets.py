"""Collapsed sheets: configurations at which a mechanism is folded onto itself.

All along such a sheet rows of the constraints depend on each other that are independent elsewhere
(two joints of a rhombus in one point), and it has more freedoms.  A change point has the rank of
the configurations around it, which is how the two are told apart.
"""

from __future__ import annotations

import warnings

import numpy as np

from mechc.assembly.directions import at_rest
from mechc.assembly.tangent_branches import GENERIC, generic_rank
from mechc.errors import CollapsedSheetWarning
from mechc.system.parameters import Array
from mechc.system.system import System

FOLDED = (
    "a collapsed sheet, where the mechanism is folded onto itself and rows of its constraints "
    "depend on each other that are independent elsewhere"
)


def first_regular(system: System, found: Array, p: Array, t: float, elsewhere: int) -> Array:
    """The first of the configurations found (n, nq) that is on no collapsed sheet, as (1, nq).

    ``elsewhere``: the rank of the constraints at other configurations.  The first of all where
    there is none, with a :class:`CollapsedSheetWarning`.
    """
    ranks = ranks_at(system, found, p, t)
    most = max(elsewhere, highest(system, ranks))
    for q, rank in zip(found, ranks, strict=True):
        if rank >= most or _rank_around(system, q, p, t) >= most:
            return np.asarray(q[None])
    _warn(
        f"the configuration found lies on {FOLDED}; no other was found with the coordinates given: "
        "give a guess near another, or other coordinates"
    )
    return found[:1]


def without_collapsed(system: System, found: Array, p: Array, t: float, elsewhere: int) -> Array:
    """The configurations (n, nq) that are on no collapsed sheet; all of them where there is none.

    A :class:`CollapsedSheetWarning` says how many were left out.
    """
    ranks = ranks_at(system, found, p, t)
    most = max(elsewhere, highest(system, ranks))
    regular = ranks >= most
    for i in np.flatnonzero(~regular):
        regular[i] = _rank_around(system, found[i], p, t) >= most
    if regular.all():
        return found
    told = "they are left out" if regular.any() else "there are no others"
    _warn(f"{(~regular).sum()} of the {len(found)} configurations found lie on {FOLDED}; {told}")
    return np.asarray(found[regular]) if regular.any() else found


def highest(system: System, ranks: Array) -> int:
    """The highest rank that leaves a freedom: overconstrained linkages may be rigid elsewhere."""
    mobile = ranks[ranks < len(system.speeds)]
    return int(mobile.max(initial=0))


def ranks_at(system: System, q: Array, p: Array, t: float, least: float = GENERIC) -> Array:
    """The rank of the constraint Jacobian at configurations q (n, nq), parameters p (np,), (n, np).

    ``least``: of the largest singular value; smaller ones count as 0.
    """
    jacobian = system.constraint_jacobian(at_rest(system, q), p, t)
    singular = np.linalg.svd(jacobian, compute_uv=False)
    return np.asarray((singular > least * singular[:, :1]).sum(axis=1))


def _rank_around(system: System, q: Array, p: Array, t: float) -> int:
    return generic_rank(system, at_rest(system, q[None])[0], p, t)


def _warn(words: str) -> None:
    warnings.warn(words, CollapsedSheetWarning, stacklevel=7)  # of the caller of a model
