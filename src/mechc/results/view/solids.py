"""The solids of a run as the data of a page.

Input: a Run whose picture has solids.  Output: shapes with their sizes, and for each frame where
they are and how they are turned.  A body of which only the inertia is known is shown as the uniform
body with the same inertia: a disc or cylinder, a ball, or a box.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from mechc.results.player.page import base64_floats
from mechc.results.sampling import Run, clean_text, pretty_name
from mechc.results.view.meshes import surfaces
from mechc.system.parameters import Array
from mechc.system.picture import Solid

ALIKE: Final = 1e-6  # of the largest moment: two moments that are one
THIN: Final = 1e-3  # least thickness over the largest size
TURNED: Final = {
    "x": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    "y": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "z": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
}  # matrices that turn y to the axis


def solids_data(run: Run, middle: Array) -> dict[str, Any]:
    """The solids, relative to ``middle``."""
    shown = run.picture
    meshes = iter(surfaces([solid for solid in shown.solids if solid.kind == "mesh"]))
    made = [_shape(solid, run.solution.params, meshes) for solid in shown.solids]
    kept = [k for k, shape in enumerate(made) if shape is not None]
    if not kept or shown.placed is None:
        return {"solids": [], "placed": ""}
    where, turned = shown.placed(run.y, run.params, run.t)
    shapes = [shape for shape in made if shape is not None]
    turns = turned[:, kept] @ np.stack([turn for _, turn in shapes])
    rows = np.concatenate([where[:, kept] - middle, _quaternions(turns)], axis=-1)
    solids = [shape for shape, _ in shapes]
    return {"solids": solids, "placed": base64_floats(np.nan_to_num(rows))}


def _shape(solid: Solid, p: Array, meshes: Iterator[Array]) -> tuple[dict[str, Any], Array] | None:
    """Kind and sizes on the page, and how the page's shape is turned in the solid's frame.

    ``meshes``: the triangles of the meshes, in their order.
    """
    sizes, turn = solid.sizes(p), np.eye(3)
    more: dict[str, Any] = {"label": pretty_name(solid.label), "name": clean_text(solid.label)}
    kind = solid.kind
    if kind == "inertia":
        found = body_of_inertia(sizes)
        if found is None:
            return None
        kind, sizes, turn = found
        more["inferred"] = True
    elif kind in ("cylinder", "wheel"):
        kind, turn = ("disc" if kind == "cylinder" else "wheel"), np.array(TURNED[solid.axis])
    elif kind == "mesh":
        more["triangles"] = base64_floats(sizes * next(meshes))
    if not np.isfinite(sizes).all():
        return None
    return {"kind": kind, "sizes": [float(x) for x in np.atleast_1d(sizes)], **more}, turn


def body_of_inertia(moments: Array) -> tuple[str, Array, Array] | None:
    """The uniform body with these central moments xx, yy, zz, xy, xz, yz per mass, m^2.

    Returns
    -------
    kind, sizes, turn
        ``"disc"`` (radius, length, its axis along y), ``"ball"`` (radius) or ``"box"`` (three
        sides), and the matrix that turns its axes to those of the moments; None if there is no
        body that has them, as where only the moment about the normal of a plane is given.
    """
    xx, yy, zz, xy, xz, yz = moments
    found, axes = np.linalg.eigh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    spread = found.sum() / 2 - found  # mean squares of the distances along the axes
    largest = float(found[-1])
    if not (np.isfinite(found).all() and largest > 0.0) or spread.min() < -ALIKE * largest:
        return None
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1.0
    spread = np.maximum(spread, 0.0)
    if np.ptp(found) <= ALIKE * largest:
        return "ball", np.array([np.sqrt(5.0 * spread.mean())]), axes
    for axis, (j, k) in enumerate(((1, 2), (0, 2), (0, 1))):
        if abs(found[j] - found[k]) <= ALIKE * largest:
            sizes = np.sqrt([4.0 * spread[[j, k]].mean(), 12.0 * spread[axis]])
            return "disc", _not_flat(sizes), axes @ np.array(TURNED["xyz"[axis]])
    return "box", _not_flat(np.sqrt(12.0 * spread)), axes


def _not_flat(sizes: Array) -> Array:
    return np.maximum(sizes, THIN * float(sizes.max()))


def _quaternions(turns: Array) -> Array:
    """x, y, z, w of matrices (frames, solids, 3, 3), without a change of sign between frames."""
    from scipy.spatial.transform import Rotation

    whole = Rotation.from_matrix(np.nan_to_num(turns).reshape(-1, 3, 3)).as_quat()
    found = whole.reshape(*turns.shape[:2], 4)
    same = np.sign((found[1:] * found[:-1]).sum(axis=-1))
    found[1:] *= np.cumprod(np.where(same == 0, 1.0, same), axis=0)[..., None]
    return np.asarray(found)
