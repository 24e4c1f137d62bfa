"""A model in an MJCF file -> Mechanism: :func:`from_mjcf`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.terms import printed_name
from mechc_codegen.errors import MechanismError
from mechc_codegen.mjcf.actuators import Actuators
from mechc_codegen.mjcf.bodies import joints_of, links_of
from mechc_codegen.mjcf.equalities import with_equalities
from mechc_codegen.mjcf.names import PartNames, names_of
from mechc_codegen.mjcf.poses import triple
from mechc_codegen.mjcf.read import CompiledFile, read_model
from mechc_codegen.mjcf.skipped import refuse_no_mechanism, skipped_parts
from mechc_codegen.robots.bounds import WARN, take_bounds
from mechc_codegen.robots.files.read_urdf import path_of
from mechc_codegen.robots.mechanism import mechanism_of
from mechc_codegen.robots.meshes import take_meshes
from mechc_codegen.robots.robot import Robot, RobotMotor

_UNNAMED = "MuJoCo Model"  # what MuJoCo calls a file that names no model
_COORDINATES = {"FREE": (*"xyz", "q0", "q1", "q2", "q3"), "BALL": ("q0", "q1", "q2", "q3")}


def from_mjcf(
    path: str | Path,
    symbolic: Iterable[Any] = (),
    *,
    driven: Iterable[str] | str = (),
    cut: Iterable[str] | str = (),
    limits: str = WARN,
    friction: str = WARN,
    effort: str = WARN,
    meshes: str | None = None,
    name: str | None = None,
) -> Mechanism:
    """The model in an MJCF file, the XML format of MuJoCo, as a mechanism to compile.

    Coordinates ``q_JOINT`` and speeds ``u_JOINT`` of hinges and slides, in rad and m, are those of
    MuJoCo; a ball joint has those of :class:`mechc.BallJoint`, a free one those of
    :class:`mechc.FreeJoint`, which MuJoCo has too.  A joint without a name is called after its
    body.  An equality of joints is exact: the first has no coordinate, its position is a polynomial
    of the second's.  ``connect`` and ``weld`` are cuts that close loops.

    Parameters
    ----------
    path
        An MJCF file, which the package ``mujoco`` reads, with the files that it names.
    symbolic
        What becomes parameters, as for :func:`mechc.from_urdf`.  The inertia is along the principal
        axes that MuJoCo finds.
    driven
        Names of actuators, or ``"all"``: each has an input ``ctrl_ACTUATOR``, its control, which is
        given with a run; the control of the others is zero.  A name of a joint is that of an input
        ``tau_JOINT``, a torque (N m) or force (N) on it.
    cut
        Names of joints and equalities that close loops, as for :func:`mechc.from_urdf`.
    limits, friction, effort
        Ranges of joints, ``frictionloss``, and bounds of controls and forces of the actuators that
        ``driven`` names, as for :func:`mechc.from_urdf`.
    meshes
        ``"ignore"`` draws no meshes; by default those of the geoms that MuJoCo shows are drawn.
    name
        Name of the mechanism; by default that of the model, or of the file.

    Returns
    -------
    Mechanism
        It starts where the file has it (``qpos0``).  Its ``limits`` have the ranges of the joints.
        What the file has and the mechanism does not, such as contacts, is in ``skipped``.  Weight
        has the parameter ``g``, whose default and direction are those of the file.

    Raises
    ------
    MechanismError
        If ``mujoco`` is not installed, refuses the file or fails on it, or the file has parts that
        no rigid mechanism has; the message names them.

    Warns
    -----
    SkippedPartWarning
        Of what the file has and the mechanism does not; its ``skipped`` has all.
    """
    path = path_of(path)
    file = read_model(path)
    names = names_of(file)
    robot = robot_of(file, names, driven)
    robot = replace(robot, name=name or (path.stem if file.title == _UNNAMED else file.title))
    robot = take_meshes(take_bounds(robot, limits, friction, effort), path, meshes)
    mechanism = mechanism_of(robot, symbolic, cut=cut)
    known = {printed_name(coordinate) for coordinate in mechanism.q}
    start = {each: x for each, x in _start(file, names).items() if each in known}
    return replace(mechanism, start={**mechanism.start, **start})


def robot_of(file: CompiledFile, names: PartNames, driven: Iterable[str] | str = ()) -> Robot:
    """The links, joints and motors in a compiled file.

    Raises
    ------
    MechanismError
        If it has parts that no rigid mechanism has, or ``driven`` names no actuator and no joint.
    """
    refuse_no_mechanism(file)
    joints = with_equalities(file, names, joints_of(file, names))
    actuators = Actuators(file, names, joints)
    links = links_of(file, names, joints)
    return Robot(
        file.title,
        {link.name: link for link in links},
        tuple(actuators.joints.values()),
        root=names.bodies[0],
        motors=tuple(_motors_of(file, actuators, driven)),
        skipped=(*skipped_parts(file, names), *actuators.skipped),
        gravity=(0, 0, 0) if file.disables("GRAVITY") else triple(file.model.opt.gravity),
    )


def _motors_of(
    file: CompiledFile, actuators: Actuators, driven: Iterable[str] | str
) -> Iterable[RobotMotor]:
    single = [j.name for j in actuators.joints.values() if j.row.unit and not j.mimic]
    joints = {each: RobotMotor(f"tau_{each}", each) for each in single}
    known = joints | actuators.motors
    if driven == "all":
        return actuators.motors.values()
    wanted = [driven] if isinstance(driven, str) else list(driven)
    for each in wanted:
        if each not in known:
            near = get_close_matches(each, known) or sorted(known)[:8]
            raise MechanismError(
                f"{file.name!r}: driven={each!r} is neither an actuator that is taken nor a joint "
                f"with a coordinate of its own; near are {', '.join(map(repr, near))}"
            )
    return [known[each] for each in dict.fromkeys(wanted)]


def _start(file: CompiledFile, names: PartNames) -> dict[str, float]:
    """The coordinates in the configuration of the file."""
    start: dict[str, float] = {}
    for number, name in enumerate(names.joints):
        kind = file.code("mjtJoint", file.model.jnt_type[number])
        first = int(file.model.jnt_qposadr[number])
        own = _COORDINATES.get(kind, ("q",))
        numbers = file.model.qpos0[first : first + len(own)].tolist()
        start |= {f"{each}_{name}": x for each, x in zip(own, numbers, strict=True)}
    return start
