"""An SDFormat file -> Mechanism: :func:`from_sdf`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.bounds import WARN, take_bounds
from mechc_codegen.robots.files.from_urdf import driven_motors
from mechc_codegen.robots.files.read_sdf import read_sdf
from mechc_codegen.robots.files.read_urdf import path_of
from mechc_codegen.robots.mechanism import mechanism_of
from mechc_codegen.robots.meshes import take_meshes


def from_sdf(
    path: str | Path,
    symbolic: Iterable[Any] = (),
    *,
    driven: Iterable[str] | str = (),
    cut: Iterable[str] | str = (),
    floating: bool = True,
    limits: str = WARN,
    friction: str = WARN,
    effort: str = WARN,
    meshes: str | Path | None = None,
    name: str | None = None,
) -> Mechanism:
    """The model, or the world with its models, in an SDFormat file, as a mechanism to compile.

    The world is the ground.  Links that no joint joins with it move freely, as SDFormat has it: the
    first of each such group by a joint of its own name, from where the file has it.  Joints may
    form loops, as for :func:`mechc.from_urdf`.  In a world, and in models within a model, names are
    ``MODEL::LINK`` and ``MODEL::JOINT``.

    Parameters
    ----------
    path
        An SDFormat file.  It is untrusted: no entity is expanded and no other file is opened but
        meshes when they are drawn.
    symbolic, driven, cut, limits, friction, effort, meshes, name
        As for :func:`mechc.from_urdf`.
    floating
        ``False`` fixes those first links to the world.

    Returns
    -------
    Mechanism
        Its ``limits`` have the bounds of the joints.  Weight has the parameter ``g``, whose default
        and direction are those of the world, 9.8 m/s^2 along -z where the file says none.

    Raises
    ------
    MechanismError
        If the file is no SDFormat or contradicts itself, or ``cut`` names a joint that closes no
        loop; the message names the link or the joint.

    Warns
    -----
    SkippedPartWarning
        Of what the file has and the mechanism does not; its ``skipped`` has all.
    """
    path = path_of(path)
    robot = read_sdf(path, floating)
    if all(joint.kind == "fixed" for joint in robot.joints):
        advice = "" if floating else "; floating=True frees those that no joint joins with it"
        raise MechanismError(
            f"{robot.name}: nothing moves, all links are static or fixed to the world{advice}"
        )
    robot = replace(robot, name=name or robot.name, motors=driven_motors(robot, driven))
    robot = take_meshes(take_bounds(robot, limits, friction, effort), path, meshes)
    return mechanism_of(robot, symbolic, cut=cut)
