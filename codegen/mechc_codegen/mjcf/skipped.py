"""What a file has and its mechanism does not: refused if it is part of the mechanism, else named.

Pictures, sensors, keyframes and settings of MuJoCo's solver have no part in the motion.
"""

from __future__ import annotations

from collections.abc import Iterator

from mechc_codegen.errors import MechanismError
from mechc_codegen.mjcf.names import PartNames
from mechc_codegen.mjcf.read import CompiledFile

_OF_TENDONS = ("stiffness", "damping", "armature", "frictionloss", "limited")


def refuse_no_mechanism(file: CompiledFile) -> None:
    """Refuse bodies that bend, which are more than links, and a file in which nothing moves.

    Raises
    ------
    MechanismError
        If the file has such a body, or no joint.
    """
    if file.model.njnt == 0:
        raise MechanismError(
            f"{file.name!r}: no body has a joint, so that nothing moves; give one a <joint> or a "
            "<freejoint>"
        )
    count = file.model.flex_rigid.tolist().count(False)
    if count:
        raise MechanismError(
            f"{file.name!r} has {count} flexible bodies (flex); mechc takes rigid ones"
        )


def skipped_parts(file: CompiledFile, names: PartNames) -> Iterator[str]:
    """What is not taken, besides actuators."""
    model = file.model
    yield from (f"the text {text!r}, which is not read" for text in file.texts)
    yield from _of_world(file)
    for number, name in enumerate(names.bodies):
        if model.body_gravcomp[number]:
            yield f"the compensation of the weight of {name} ({model.body_gravcomp[number]})"
        if model.body_mocapid[number] >= 0:
            yield f"the motion capture of {name}, which is fixed where the file has it"
    for number, name in enumerate(names.joints):
        yield from (f"{what} of the joint {name}" for what in _of_joint(file, number))
    for number in range(model.ntendon):
        felt = [what for what in _OF_TENDONS if getattr(model, f"tendon_{what}")[number]]
        if felt:
            own = file.names["tendon"][number] or f"tendon{number}"
            yield f"the tendon {own} ({', '.join(felt)})"
    for number, name in enumerate(names.equalities):
        if not model.eq_active0[number]:
            yield f"the equality {name}, which is not active"


def _of_world(file: CompiledFile) -> Iterator[str]:
    model = file.model
    collide = (model.geom_contype | model.geom_conaffinity).any() or model.npair
    if collide and not file.disables("CONTACT", "CONSTRAINT"):
        yield "contacts"
    if model.opt.density or model.opt.viscosity:
        yield f"the medium (density {model.opt.density}, viscosity {model.opt.viscosity})"
    if model.nplugin:
        yield f"{model.nplugin} plugins"
    if file.disables("EQUALITY", "CONSTRAINT") and model.neq:
        yield "its equalities, which the file disables"


def _of_joint(file: CompiledFile, number: int) -> Iterator[str]:
    model = file.model
    kind, dof = file.code("mjtJoint", model.jnt_type[number]), int(model.jnt_dofadr[number])
    several = kind in ("BALL", "FREE")
    stiffness = float(model.jnt_stiffness[number])
    if several and stiffness and not file.disables("SPRING"):
        yield f"the spring ({stiffness})"
    if model.jnt_stiffnesspoly[number].any():
        yield "the higher powers of the spring"
    if model.dof_dampingpoly[dof].any():
        yield "the higher powers of the damping"
    if model.jnt_springyield[number]:
        yield "the yield of the spring"
    if several and model.jnt_limited[number]:
        yield "the range"
    lower, upper = model.jnt_actfrcrange[number].tolist()
    if model.jnt_actfrclimited[number] and (several or lower != -upper):
        yield f"the bounds of the force, {lower} to {upper},"
