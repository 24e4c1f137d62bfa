"""Four-bars in a row whose ground pivots are parameters: moved a little, each misses its own change
point."""

from __future__ import annotations

from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Integer, symbols
from sympy.physics.mechanics import PinJoint, RigidBody, dynamicsymbols

from ..references.linkage_curve import PlanarLinkage
from .closed_loops import FREE_FALL, rod


def window_row(count: int) -> Mechanism:
    """Cranks and couplers of 1 m and 1 kg, ground pivots at 0, g_1, g_2, ..."""
    ground = RigidBody("ground")
    rods = [rod(f"rod_{k}", Integer(1)) for k in range(2 * count + 1)]
    near, far = [-r.x / 2 for r in rods], [r.x / 2 for r in rods]
    joints: list[PinJoint | Cut] = []
    for k, on in enumerate(hung(count)):
        parent, place = (rods[on], far[on]) if k else (ground, None)
        joints.append(
            PinJoint(
                f"pin_{k}", parent, rods[k], *dynamicsymbols(f"q_{k} u_{k}"), place, near[k],
                joint_axis=parent.z,
            )
        )  # fmt: skip
    for k in range(1, count + 1):
        place = symbols(f"g_{k}") * ground.x
        joints.append(
            Cut.pin(f"g_{k}", ground, rods[2 * k], place, far[2 * k], joint_axis=ground.z)
        )
    return from_joints(
        "window_row", joints, gravity=-FREE_FALL * ground.y,
        parameters={f"g_{k}": float(k) for k in range(1, count + 1)}, ground=ground,
    )  # fmt: skip


def hung(count: int) -> list[int]:
    """By rod: the rod on whose end it hangs.  Couplers hang on couplers: 1, 3, 5, ..."""
    return [k - 2 if k > 2 and k % 2 else k - 1 for k in range(2 * count + 1)]


def exact_row(grounds: list[float]) -> PlanarLinkage:
    """The same, for its exact motion."""
    count = len(grounds)
    ends = [2 * k for k in range(1, count + 1)]
    ones = [1.0] * (2 * count + 1)
    return PlanarLinkage(hung(count), ones, ones, ends, [(g, 0.0) for g in grounds])
