"""A URDF file -> Mechanism: :func:`from_urdf`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.bounds import WARN, take_bounds
from mechc_codegen.robots.files.read_urdf import path_of, read_robot
from mechc_codegen.robots.mechanism import mechanism_of
from mechc_codegen.robots.meshes import take_meshes
from mechc_codegen.robots.robot import Robot, RobotMotor


def from_urdf(
    path: str | Path,
    symbolic: Iterable[Any] = (),
    *,
    driven: Iterable[str] | str = (),
    cut: Iterable[str] | str = (),
    floating: bool = False,
    limits: str = WARN,
    friction: str = WARN,
    effort: str = WARN,
    meshes: str | Path | None = None,
    name: str | None = None,
) -> Mechanism:
    """The robot in a URDF file, as a mechanism to compile.

    Coordinates ``q_JOINT`` and speeds ``u_JOINT`` of revolute, continuous and prismatic joints, in
    rad and m; a floating joint has those of :class:`mechc.FreeJoint`; a planar one ``x_JOINT,
    y_JOINT, q_JOINT`` and their rates ``vx_JOINT, vy_JOINT, u_JOINT``, x and y across its axis.  A
    joint that mimics another has none of its own, its position is an expression of the other's.
    Links are those of the file, fixed to each other where a joint is fixed; the root is the ground.

    Links may form loops.  A spanning tree of the joints has coordinates, those that close loops are
    cuts (:class:`mechc.Cut`), which ``mechanism.cuts`` names: first the joints of ``loop_joint``,
    then those with most freedoms; those that keep the tree short and the loops well conditioned.

    Parameters
    ----------
    path
        A URDF file.  It is untrusted: no entity is expanded and no other file is opened but meshes
        when they are drawn.
    symbolic
        What becomes parameters with the file's numbers for defaults; everything else is compiled
        in.  Kinds of values, for all links and joints: ``"mass"`` (``m_LINK``), ``"centre"``
        (``cx_LINK``, ...), ``"inertia"`` (``Ixx_LINK``, ..., about the mass centre), ``"origin"``
        of joints (``ox_JOINT``, ...), ``"orientation"`` (``roll_JOINT``, ``pitch_``, ``yaw_``),
        ``"damping"`` (``d_JOINT``), ``"friction"`` (``f_JOINT``), ``"stiffness"`` (``k_JOINT``),
        ``"armature"`` (``a_JOINT``), ``"limits"`` (``lower_JOINT``, ``upper_``, ``velocity_``,
        ``effort_``); or pairs of a name and a kind, ``("forearm", "mass")``.
    driven
        Names of joints, or ``"all"`` with one coordinate: each has an input ``tau_JOINT``, the
        torque (N m) or force (N) of its motor, which is given with a run.
    cut
        Names of joints that close loops; mechc chooses for the loops that they leave.
    floating
        The root moves freely: a floating joint ``base`` joins it to the ground.
    limits, friction, effort
        ``limits="stop"``: joints stop at their position limits, without a rebound, in every run of
        the model; ``friction="dry"``: they have dry friction, as of :class:`mechc.DryFriction`;
        ``effort="saturate"``: motors of ``driven`` have at most the effort, and what their inputs
        are beyond that has no effect.  By default, ``"warn"``, a warning says what the file has of
        each; ``"ignore"`` leaves it.
    meshes
        The folder of the meshes of ``<visual>``, by default that of the file: those in it or below
        are drawn, ``package://NAME/...`` among them.  ``"ignore"`` draws none.
    name
        Name of the mechanism; by default the robot's.

    Returns
    -------
    Mechanism
        Its ``limits`` have the bounds of the joints.  Weight has the parameter ``g``, along -z of
        the root.

    Raises
    ------
    MechanismError
        If the file is no URDF or contradicts itself, or ``cut`` names a joint that closes no loop;
        the message names the link or the joint.

    Warns
    -----
    SkippedPartWarning
        Of what the file has and the mechanism does not; its ``skipped`` has all.
    """
    path = path_of(path)
    robot = read_robot(path)
    robot = replace(robot, name=name or robot.name, motors=driven_motors(robot, driven))
    robot = take_meshes(take_bounds(robot, limits, friction, effort), path, meshes)
    return mechanism_of(robot, symbolic, cut=cut, floating=floating)


def driven_motors(robot: Robot, driven: Iterable[str] | str) -> tuple[RobotMotor, ...]:
    """The motors of joints that are to be driven; raises :class:`MechanismError` for others."""
    own = {j.name: j for j in robot.joints if j.row.unit and j.mimic is None}
    if driven == "all":
        names = [name for name, joint in own.items() if joint.leads_on]
    else:
        names = [driven] if isinstance(driven, str) else [*driven]
    for each in sorted({*names} - own.keys()):
        raise MechanismError(
            f"{robot.name}: driven={each!r} is no joint with a coordinate of its own; these are "
            f"{', '.join(map(repr, sorted(own)))}"
        )
    return tuple(RobotMotor(f"tau_{each}", each) for each in own if each in names)
