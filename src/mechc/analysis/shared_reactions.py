"""Reactions that the motion does not determine, since redundant constraints share them."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from mechc.analysis.constraint_rank import redundant_rows
from mechc.errors import AssemblyError, UndeterminedReactionWarning
from mechc.system.parameters import Array
from mechc.system.system import System

ROUNDING = 1e-9  # of the largest reaction
MOST_SETS = 16  # of parameters that are judged: each takes some milliseconds
PARTS = {"reaction_forces": ("force", slice(3)), "reaction_torques": ("torque", slice(3, 6))}


def undetermined_reactions(system: System, p: Array, t: float) -> Any:
    """The components of the joints' forces and torques (joints, 6) that redundant rows add to.

    A redundant constraint may carry any force, which the joints of its loop pass on: which of
    their components, the compiler has found (``description/joints/loops.py``).  Rows that are
    redundant in all configurations are so at all times: the first time that is asked for counts.
    Of many parameter sets (..., np) a component is one that any of them does not determine.
    """
    sets = _that_close_differently(system, p)
    key = sets.tobytes()
    known = system.cache.get("undetermined reactions")
    if known is None or known[0] != key:
        found = np.any([_undetermined(system, each, t) for each in sets], axis=0)
        known = system.cache["undetermined reactions"] = key, found
    return known[1]


def _that_close_differently(system: System, p: Array) -> Array:
    """Of parameter sets (..., np) those (k, np) that differ in what the loops' closing depends on,
    at most ``MOST_SETS`` of them: redundancy is mostly the same for all."""
    rows = p.reshape(math.prod(p.shape[:-1]), p.shape[-1])
    closing = [system.parameters.index(name) for name in system.data["closing"]]
    _, places = np.unique(rows[:, closing], axis=0, return_index=True)
    return np.array(rows[places[:: math.ceil(len(places) / MOST_SETS)]])


def _undetermined(system: System, p: Array, t: float) -> Any:
    found = np.zeros((len(system.joint_names), 6), bool)
    try:
        rows = redundant_rows(system, p, t) if system.constraint_names else ()
    except AssemblyError:  # no loop closes, so which of them depend on others is not known
        rows = ()
    dependent = {name for row in rows for name in (row.name, *row.follows_from)}
    for name, omitted, components in system.data["cut_rows"]:
        if omitted or name in dependent:
            for joint, which in components:
                found[joint] |= which
    return found


def warn_of_undetermined(
    system: System, values: Mapping[str, Array], p: Array, t: Any, stacklevel: int
) -> None:
    """Warn where components (..., joints, 3) that are not determined are not zero.

    ``values``: by the names of the outputs, all others are passed over.
    """
    asked = {name: found for name, found in values.items() if name in PARTS and found.size}
    if not asked or "cut_rows" not in system.data:
        return
    marked = undetermined_reactions(system, p, float(np.ravel(t)[0]))
    joints = dict[str, list[str]]()
    for name, found in asked.items():
        what, places = PARTS[name]
        sizes = np.abs(found).reshape(-1, *found.shape[-2:]).max(axis=0, initial=0.0)
        shared = marked[:, places] & (sizes > ROUNDING * sizes.max(initial=0.0))
        for joint, row in zip(system.joint_names, shared, strict=True):
            axes = " ".join(axis for axis, is_shared in zip("xyz", row, strict=True) if is_shared)
            if axes:
                joints.setdefault(joint, []).append(f"{what} {axes}")
    if joints:
        told = "; ".join(f"{joint}: {', '.join(parts)}" for joint, parts in joints.items())
        warnings.warn(
            f"the motion does not determine all reactions ({told}): constraints that follow from "
            "others share these with the other joints of their loops in any proportion. Here they "
            "are those of the multipliers of least norm, and constraints that always hold carry "
            "nothing. model.redundant_constraints() lists them; joints that hold less leave fewer",
            UndeterminedReactionWarning,
            stacklevel=stacklevel,
        )
