"""Forces as arrows: reactions of joints, of a model that was compiled with them, and loads.

Input: a Run.  Output: plain values for JSON, a force in N and its point for each frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from mechc.results.player.page import base64_floats
from mechc.results.sampling import Run, clean_text
from mechc.system.parameters import Array

USUAL: Final = 90.0  # percentile of all forces that has the usual length: peaks are cut


def arrows(run: Run, middle: Array) -> list[dict[str, Any]]:
    """The forces by which the parents of joints act on their children."""
    shown, names = run.picture, list(run.system.joint_names)
    if not names or names != list(shown.joints) or shown.acting is None:
        return []
    if "reaction_forces" not in run.system.scene.outputs:
        return []
    forces = run.solution.output_along("reaction_forces", run.t, run.y)
    points = run.evaluate(shown.acting) - middle
    return _drawn([f"reaction in {name}" for name in names], points, forces)


def load_arrows(run: Run, middle: Array) -> list[dict[str, Any]]:
    """The forces among the loads; those by inputs that are given with a run are not known."""
    shown = run.picture
    if not shown.loads or shown.pushing is None:
        return []
    points, forces = shown.pushing(run.y, run.params, run.t)
    return _drawn(shown.loads, points - middle, forces)


def _drawn(labels: Sequence[str], points: Array, forces: Array) -> list[dict[str, Any]]:
    """Arrows that are as long as usual where they are as large as most of them."""
    if not np.isfinite(points).all():
        return []
    forces = np.nan_to_num(forces, posinf=0.0, neginf=0.0)
    usual = float(np.percentile(np.linalg.norm(forces, axis=-1), USUAL))
    return [
        {
            "label": clean_text(label),
            "at": base64_floats(points[:, k]),
            "force": base64_floats(forces[:, k]),
            "usual": usual,
        }
        for k, label in enumerate(labels)
    ]
