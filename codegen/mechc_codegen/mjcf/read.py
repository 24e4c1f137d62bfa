"""An MJCF file -> CompiledFile: the model that the package ``mujoco`` compiles from it.

MuJoCo resolves defaults, includes, frames and units, and computes the inertia of shapes.  It opens
the files that the file names.  It takes numbers that are not finite, which are refused here.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from math import isfinite
from pathlib import Path
from typing import Any
from warnings import warn

from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.files.read_urdf import parse

# The arrays that are read, by the first part of their names.
_READ = {
    "body": ("pos", "quat", "ipos", "iquat", "inertia", "mass"),
    "jnt": ("pos", "axis", "range", "stiffness", "actfrcrange"),
    "dof": ("damping", "armature", "frictionloss"),
    "eq": ("data",),
    "site": ("pos", "quat"),
    "geom": ("pos", "quat", "size"),
    "actuator": ("gainprm", "biasprm", "gear", "damping", "armature"),
}


@dataclass(frozen=True)
class CompiledFile:
    """A file's name, its ``mujoco.MjModel``, and the package."""

    name: str
    model: Any
    mujoco: Any

    def code(self, kind: str, number: Any) -> str:
        """The name of a number of MuJoCo: ``code("mjtJoint", 3)`` is ``"HINGE"``."""
        return str(getattr(self.mujoco, kind)(int(number)).name).split("_", 1)[1]

    def disables(self, *flags: str) -> bool:
        """Whether the file disables any of these: ``"SPRING"``, ..."""
        bits = (int(getattr(self.mujoco.mjtDisableBit, f"mjDSBL_{flag}")) for flag in flags)
        return any(int(self.model.opt.disableflags) & bit for bit in bits)


def read_model(path: Path) -> CompiledFile:
    """The compiled model of a file.

    Raises
    ------
    MechanismError
        If MuJoCo is not installed or refuses the file, with its words, or a number is not finite.
    """
    try:
        mujoco: Any = import_module("mujoco")
    except ImportError:
        raise MechanismError(
            f"{path.name!r}: MJCF is read by the package mujoco, which is not installed: "
            "pip install '.[mjcf]' in the clone of mechc"
        ) from None
    root = parse(path)
    if root.tag == "robot":
        raise MechanismError(f"{path.name!r} is a URDF: read it by mechc.from_urdf")
    if root.tag != "mujoco":
        raise MechanismError(f"{path.name!r}: the outermost element is <{root.tag}>, not <mujoco>")
    model = _compile(mujoco, path)
    _refuse_infinite(model, path)
    return CompiledFile(path.name, model, mujoco)


def _compile(mujoco: Any, path: Path) -> Any:
    """MuJoCo alone would write its warnings into a file in the current folder."""
    warnings: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(warnings.append)
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        words = " ".join(str(error).split())
        raise MechanismError(f"{path.name!r}: MuJoCo refuses the file: {words}") from None
    finally:
        mujoco.set_mju_user_warning(before)
    for words in warnings:
        warn(f"{path.name!r}: MuJoCo warns: {words}", stacklevel=4)
    return model


def _refuse_infinite(model: Any, path: Path) -> None:
    arrays = {f"{kind}_{name}": None for kind, names in _READ.items() for name in names}
    values = {"gravity": model.opt.gravity, "qpos0": model.qpos0, "springref": model.qpos_spring}
    for name, array in {**values, **{name: getattr(model, name) for name in arrays}}.items():
        for index, row in enumerate(array.tolist()):
            numbers = row if isinstance(row, list) else [row]
            if not all(map(isfinite, numbers)):
                raise MechanismError(
                    f"{path.name!r}: {name}[{index}] of MuJoCo's model is {row}, not finite; "
                    "correct it in the file"
                )
