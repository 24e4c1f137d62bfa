"""An MJCF file -> CompiledFile: the model that the package ``mujoco`` compiles from it.

MuJoCo resolves defaults, includes, frames and units, and computes the inertia of shapes.  It opens
the files that the file names.  It runs in a process of its own, with limits: a file on which it
fails ends that process alone, and only numbers and names come back.  It takes numbers that are not
finite, which are refused here.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any
from warnings import warn

from mechc_codegen.errors import MechanismError
from mechc_codegen.mjcf.compiled_model import ANSWER
from mechc_codegen.robots.files.known_parts import texts_in
from mechc_codegen.robots.files.read_urdf import parse

MEMORY, TIME = 2**32, 120  # bytes and seconds that MuJoCo has for a file
_FINITE = {  # arrays of finite numbers, by the first part of their names
    "body": "pos quat ipos iquat inertia mass",
    "jnt": "pos axis range stiffness actfrcrange",
    "dof": "damping armature frictionloss",
    "eq": "data",
    "site": "pos quat",
    "geom": "pos quat size",
    "actuator": "gainprm biasprm gear damping armature",
}
_OTHERS = {
    "body": "geomadr geomnum gravcomp jntadr jntnum mocapid parentid",
    "jnt": "actfrclimited bodyid dofadr limited qposadr springyield stiffnesspoly type",
    "dof": "dampingpoly",
    "eq": "active0 obj1id obj2id objtype type",
    "site": "bodyid",
    "geom": "conaffinity contype dataid group type",
    "actuator": "biastype ctrladr ctrllimited ctrlrange dampingpoly delay dyntype forcelimited "
    "forcerange gaintype group outadr plugin trnid trntype",
    "mesh": "face faceadr facenum vert vertadr",
    "tendon": "armature damping frictionloss limited stiffness",
    "flex": "rigid",
}
_COUNTS = ("nactuator", "nbody", "neq", "njnt", "npair", "nplugin", "ntendon")
_OPTIONS = ("density", "disableactuator", "disableflags", "gravity", "viscosity")
_NAMED = {"body": "body", "joint": "jnt", "equality": "eq", "actuator": "actuator",
          "tendon": "tendon", "geom": "geom"}  # fmt: skip
_CODES = ("Joint", "Eq", "Obj", "Geom", "Trn", "Dyn", "Gain", "Bias", "DisableBit")


@dataclass(frozen=True)
class CompiledFile:
    """A file's name, and of MuJoCo's model its name, its arrays and the names of its parts.

    ``texts``: those in the file, which MuJoCo passes over.
    """

    name: str
    title: str
    model: Any
    names: dict[str, list[str]]
    codes: dict[str, dict[str, str]]
    texts: tuple[str, ...]

    def code(self, kind: str, number: Any) -> str:
        """The name of a number of MuJoCo: ``code("mjtJoint", 3)`` is ``"HINGE"``."""
        return self.codes[kind][str(int(number))].split("_", 1)[1]

    def disables(self, *flags: str) -> bool:
        """Whether the file disables any of these: ``"SPRING"``, ..."""
        bits = (
            int(bit)
            for bit, name in self.codes["mjtDisableBit"].items()
            if name.partition("_")[2] in flags
        )
        return any(int(self.model.opt.disableflags) & bit for bit in bits)


def read_model(path: Path) -> CompiledFile:
    """The compiled model of a file.

    Raises
    ------
    MechanismError
        If MuJoCo is not installed or cannot be used, if it refuses the file or fails on it, with
        its words, or if a number is not finite.
    """
    if find_spec("mujoco") is None:
        raise MechanismError(
            f"{path.name!r}: MJCF is read by the package mujoco, which is not installed: "
            "pip install '.[mjcf]' in the clone of mechc"
        )
    root = parse(path)
    if root.tag == "robot":
        raise MechanismError(f"{path.name!r} is a URDF: read it by mechc.from_urdf")
    if root.tag != "mujoco":
        raise MechanismError(f"{path.name!r}: the outermost element is <{root.tag}>, not <mujoco>")
    arrays, told = _compile(path)
    for words in told["warnings"]:
        warn(f"{path.name!r}: MuJoCo warns: {words}", stacklevel=3)
    for how in {"refuses", "fails on"} & told.keys():
        words = " ".join(told[how].split())
        raise MechanismError(f"{path.name!r}: MuJoCo {how} the file: {words}")
    model = SimpleNamespace(opt=SimpleNamespace())
    for name, array in arrays.items():
        setattr(model.opt if name.startswith("opt.") else model, name.rpartition(".")[2], array)
    _refuse_infinite(model, path)
    texts = (text for each in root.iter() for text in texts_in(each))
    return CompiledFile(
        path.name, told["name"], model, told["names"], told["codes"], tuple(dict.fromkeys(texts))
    )


def _compile(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """The arrays of the model that MuJoCo makes, and what it says besides.

    It writes its log into the current folder, which is a temporary one.
    """
    tables = (_FINITE, _OTHERS)
    wanted = [f"{kind}_{x}" for table in tables for kind, x in _pairs(table)]
    wanted += ["qpos0", "qpos_spring", *_COUNTS, *(f"opt.{name}" for name in _OPTIONS)]
    asked = {
        "path": str(path.absolute()), "memory": MEMORY, "time": TIME, "named": _NAMED,
        "codes": [f"mjt{kind}" for kind in _CODES], "wanted": wanted,
    }  # fmt: skip
    numpy: Any = import_module("numpy")
    with TemporaryDirectory(prefix="mechc-", ignore_cleanup_errors=True) as folder:
        answer = _run(path, json.dumps(asked).encode(), Path(folder))
        with numpy.load(answer, allow_pickle=False) as archive:
            arrays = dict(archive)
    told = json.loads(arrays.pop("told").tobytes())
    if "unusable" in told:
        raise MechanismError(
            f"{path.name!r}: MJCF is read by the package mujoco, which is installed but cannot be "
            f"imported: {told['unusable']}"
        )
    return arrays, told


def _run(path: Path, asked: bytes, folder: Path) -> Path:
    """The answer of the program that compiles the file, which ends with this call."""
    program = Path(__file__).with_name("compiled_model.py")
    places = os.pathsep.join(filter(None, sys.path))
    # No window is opened, and a linear algebra of many threads would take its part of the memory.
    own = {"PYTHONPATH": places, "MUJOCO_GL": "disable", "OPENBLAS_NUM_THREADS": "1"}
    log = folder / "stderr"  # not a pipe: it may be long, and only its end is told
    with log.open("wb") as errors, subprocess.Popen(
        [sys.executable, "-P", str(program)], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
        stderr=errors, cwd=folder, env={**os.environ, **own}, process_group=0,
    ) as process:  # fmt: skip
        try:
            process.communicate(asked, timeout=TIME)
        except subprocess.TimeoutExpired:
            raise MechanismError(
                f"{path.name!r}: MuJoCo does not compile the file within {TIME} s"
            ) from None
        finally:
            process.kill()
    answer = folder / ANSWER
    if process.returncode or not answer.is_file():
        with log.open("rb") as told:
            told.seek(max(0, log.stat().st_size - 300))
            last = " ".join(told.read().decode(errors="replace").split())
        raise MechanismError(
            f"{path.name!r}: MuJoCo fails on the file: its process {_ending(process.returncode)}, "
            f"with {MEMORY >> 30} GiB of memory and {TIME} s at most. {last}".rstrip()
        )
    return answer


def _ending(code: int) -> str:
    return f"was ended by the signal {-code}" if code < 0 else f"ended with the code {code}"


def _pairs(table: dict[str, str]) -> list[tuple[str, str]]:
    return [(kind, name) for kind, names in table.items() for name in names.split()]


def _refuse_infinite(model: Any, path: Path) -> None:
    arrays = {f"{kind}_{name}": getattr(model, f"{kind}_{name}") for kind, name in _pairs(_FINITE)}
    values = {"gravity": model.opt.gravity, "qpos0": model.qpos0, "springref": model.qpos_spring}
    for name, array in {**values, **arrays}.items():
        for index, row in enumerate(array.tolist()):
            numbers = row if isinstance(row, list) else [row]
            if not all(map(isfinite, numbers)):
                raise MechanismError(
                    f"{path.name!r}: {name}[{index}] of MuJoCo's model is {row}, not finite; "
                    "correct it in the file"
                )
