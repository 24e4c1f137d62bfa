"""The tree of a model -> links and joints.

The joints of one body follow each other: between them are links without mass.  A coordinate is that
of MuJoCo, ``ref`` included: the joint's frame is turned or moved back by it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from mechc_codegen.description.joints.kinds import kinds_by
from mechc_codegen.mjcf.names import PartNames
from mechc_codegen.mjcf.poses import exact, place_at, triple
from mechc_codegen.mjcf.read import CompiledFile
from mechc_codegen.robots.geometry import IDENTITY, Place, about, pose_of
from mechc_codegen.robots.robot import Number, Pose, RobotJoint, RobotLink, Visual, unused_name

_KINDS = kinds_by("mjcf")
_SHAPES = {"SPHERE": "ball", "CAPSULE": "cylinder", "CYLINDER": "cylinder", "BOX": "box",
           "MESH": "mesh"}  # fmt: skip
_SHOWN = 3  # groups of geoms that MuJoCo's viewer shows, 0 to 2; the others are for collisions


def links_of(
    file: CompiledFile, names: PartNames, joints: Iterable[RobotJoint]
) -> Iterator[RobotLink]:
    """The bodies, the world first, and the links without mass between joints of one body."""
    model = file.model
    for k, name in enumerate(names.bodies):
        xx, yy, zz = triple(model.body_inertia[k])
        centre = pose_of(place_at(model.body_ipos[k], model.body_iquat[k]))
        first = int(model.body_geomadr[k])
        visuals = tuple(
            shape
            for number in range(int(model.body_geomnum[k]))
            for shape in _shapes(file, first + number, f"{name} {number}" if number else name)
        )
        mass = exact(float(model.body_mass[k])) if k else 0
        yield RobotLink(name, mass, centre, (xx, 0, 0, yy, 0, zz), visuals)
    yield from (RobotLink(each) for joint in joints if (each := joint.child) not in names.bodies)


def joints_of(file: CompiledFile, names: PartNames) -> Iterator[RobotJoint]:
    """The joints of each body, in their order; a body without any is fixed to its parent."""
    model = file.model
    for body in range(1, model.nbody):
        carrier = names.bodies[int(model.body_parentid[body])]
        place = place_at(model.body_pos[body], model.body_quat[body])
        first = int(model.body_jntadr[body])
        numbers = range(first, first + int(model.body_jntnum[body]))
        if not numbers:
            own = unused_name(f"{names.bodies[body]} fixed", (*names.joints, *names.equalities))
            yield RobotJoint(own, "fixed", carrier, names.bodies[body], pose_of(place))
        for number in numbers:
            between = unused_name(f"{names.joints[number]} carrier", names.bodies)
            child = names.bodies[body] if number == numbers[-1] else between
            yield _joint(file, names, number, (carrier, child), place)
            carrier, place = child, Place()


def _joint(
    file: CompiledFile, names: PartNames, number: int, sides: tuple[str, str], place: Place
) -> RobotJoint:
    model = file.model
    dof = int(model.jnt_dofadr[number])
    kind = file.code("mjtJoint", model.jnt_type[number])
    axis = triple(model.jnt_axis[number])
    anchor = Place(IDENTITY, triple(model.jnt_pos[number]))
    start = exact(float(model.qpos0[int(model.jnt_qposadr[number])]))
    if kind == "HINGE":
        place = place.then(Place(about(axis, -start), anchor.origin))
    elif kind == "SLIDE":
        place = place.then(Place(IDENTITY, [-start * x for x in axis]))
    elif kind == "BALL":
        place = place.then(anchor)
    else:  # the position of a free body is that in the world, whatever its place in the file
        place = Place()
    single = bool(_KINDS[kind].unit)
    spring = single and not file.disables("SPRING")
    limits = _limits(file, number) if single else {}
    return RobotJoint(
        names.joints[number],
        "revolute" if kind == "HINGE" and "lower" in limits else _KINDS[kind].name,
        *sides,
        pose_of(place),
        axis if single else (1, 0, 0),
        limits,
        damping=0 if file.disables("DAMPER") else exact(float(model.dof_damping[dof])),
        friction=0 if file.disables("FRICTIONLOSS", "CONSTRAINT")
        else exact(float(model.dof_frictionloss[dof])),
        child_origin=pose_of(anchor) if kind in ("HINGE", "BALL") else Pose(),
        stiffness=exact(float(model.jnt_stiffness[number])) if spring else 0,
        rest=exact(float(model.qpos_spring[int(model.jnt_qposadr[number])])) if spring else 0,
        armature=exact(float(model.dof_armature[dof])),
    )  # fmt: skip


def _limits(file: CompiledFile, number: int) -> dict[str, Number]:
    model, limits = file.model, dict[str, Number]()
    if model.jnt_limited[number] and not file.disables("LIMIT", "CONSTRAINT"):
        lower, upper = model.jnt_range[number].tolist()
        limits |= {"lower": exact(lower), "upper": exact(upper)}
    if model.jnt_actfrclimited[number]:
        lower, upper = model.jnt_actfrcrange[number].tolist()
        if lower == -upper:
            limits["effort"] = exact(upper)
    return limits


def _shapes(file: CompiledFile, geom: int, default: str) -> Iterator[Visual]:
    """The shape of a geom; a capsule is a cylinder and two balls."""
    model = file.model
    kind = file.code("mjtGeom", model.geom_type[geom])
    if kind not in _SHAPES or model.geom_group[geom] >= _SHOWN:
        return
    label = file.names["geom"][geom] or default
    place = place_at(model.geom_pos[geom], model.geom_quat[geom])
    radius, half, third = model.geom_size[geom].tolist()
    sizes: tuple[Number, ...] = (radius, 2 * half)
    if kind == "SPHERE":
        sizes = (radius,)
    elif kind == "BOX":
        sizes = (2 * radius, 2 * half, 2 * third)
    elif kind == "CAPSULE":
        for end in (-half, half):
            at = place.then(Place(IDENTITY, (0, 0, end)))
            yield Visual("ball", f"{label} end", (radius,), pose_of(at))
    elif kind == "MESH":
        sizes = (1, 1, 1)
    triangles = _triangles(file, geom) if kind == "MESH" else b""
    yield Visual(_SHAPES[kind], label, sizes, pose_of(place), triangles=triangles)


def _triangles(file: CompiledFile, geom: int) -> bytes:
    """The corners of the triangles of a geom's mesh, in the frame of the geom."""
    model, mesh = file.model, int(file.model.geom_dataid[geom])
    first, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
    faces = model.mesh_face[face : face + int(model.mesh_facenum[mesh])]
    return bytes(model.mesh_vert[first + faces].astype("<f4").tobytes())
