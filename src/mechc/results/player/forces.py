"""Forces of a motion, as arrows of its pictures: reactions of joints, and loads.

Input: a Run, and which forces are asked for.  Output: each force along the run, and where it acts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from mechc.results.sampling import Run, clean_text
from mechc.system.names import names_of
from mechc.system.parameters import Array

USUAL: Final = 90.0  # percentile of all forces, which has the usual length
ROUND: Final = (5.0, 2.0)
ROUNDING: Final = 1e-12
REACTION, LOAD = "reaction", "load"


@dataclass(frozen=True)
class Force:
    """A force along a run.

    Attributes
    ----------
    kind
        ``"reaction"``: by the parent of a joint on its child; ``"load"``.
    name
        By which it is asked for: of the joint, or of the point.
    at, newtons
        Where it acts, (n, 3) m, and its components, (n, 3) N, along the inertial axes.
    """

    kind: str
    name: str
    label: str
    at: Array
    newtons: Array


def forces_of(run: Run, asked: Any) -> list[Force]:
    """The forces that are asked for.

    ``asked``: True for all, names of joints and of points with loads, or None for those that need
    nothing compiled.

    Raises
    ------
    UnknownNameError
        For a name of no force that can be drawn.
    ValueOutOfBoundsError
        If all are asked for and there are none.
    """
    if asked is False:
        return []
    known = [*_reactions(run, asked is not None), *_loads(run)]
    if asked is None:
        return known
    if asked is True:
        if not known:
            raise ValueOutOfBoundsError(
                f"{run.system.name} has no force to draw: reactions are those of joints, as of "
                "mechc.from_joints, and loads those at points that follow from the state"
            )
        return known
    names = names_of(asked)
    for name in names:
        if name not in [force.name for force in known]:
            raise UnknownNameError(
                "joint or point with a force to draw", name, {force.name: None for force in known}
            )
    return [force for force in known if force.name in names]


def _reactions(run: Run, compiles: bool) -> Iterator[Force]:
    """Those of the joints; ``compiles``: where the model was compiled without."""
    shown, names = run.system.picture_in_space, list(run.system.joint_names)
    if not names or names != list(shown.joints) or shown.acting is None:
        return
    if not (compiles or "reaction_forces" in run.system.scene.outputs):
        return
    forces = run.solution.output_along("reaction_forces", run.t, run.y)
    points = run.evaluate(shown.acting)
    for k, name in enumerate(names):
        yield _force(REACTION, name, f"reaction in {name}", points[:, k], forces[:, k])


def _loads(run: Run) -> Iterator[Force]:
    """Those among the loads; those by inputs that are given with a run are not known."""
    shown = run.system.picture_in_space
    if not shown.loads or shown.pushing is None:
        return
    points, forces = shown.pushing(run.y, run.params, run.t)
    for k, name in enumerate(shown.loads):
        yield _force(LOAD, name, f"force on {name}", points[:, k], forces[:, k])


def _force(kind: str, name: str, label: str, at: Array, newtons: Array) -> Force:
    known = np.nan_to_num(newtons, posinf=0.0, neginf=0.0)
    return Force(kind, name, clean_text(label), np.nan_to_num(at), known)


def usual_size(forces: Sequence[Force]) -> float:
    """The size, in N, that nine tenths of these forces do not exceed along the run."""
    sizes = [np.linalg.norm(force.newtons, axis=-1) for force in forces]
    return float(np.percentile(sizes, USUAL)) if sizes else 0.0


def round_down(value: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not larger than a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    leads = [lead * power for lead in ROUND]
    return next((lead for lead in leads if lead <= value * (1 + ROUNDING)), power)
