"""Run as a program of its own: an MJCF file -> arrays of the model that MuJoCo compiles from it.

It reads a JSON object from the standard input: the file, the names of what is wanted, and limits.
It writes an archive of NumPy's arrays into the current folder, in which ``told`` is a JSON object:
names, codes, errors.
"""

from __future__ import annotations

import json
import sys
from contextlib import suppress
from importlib import import_module
from typing import Any

ANSWER = "answer.npz"


def main() -> None:
    numpy: Any = import_module("numpy")
    told, arrays = _answer(json.load(sys.stdin), numpy)
    arrays["told"] = numpy.frombuffer(json.dumps(told).encode(), numpy.uint8)
    numpy.savez(ANSWER, **arrays)


def _answer(asked: dict[str, Any], numpy: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    try:
        mujoco: Any = import_module("mujoco")
    except Exception as error:  # a damaged package may raise any
        return {"unusable": f"{type(error).__name__}: {error}"}, {}
    _limit(asked["memory"], asked["time"])
    told: dict[str, Any] = {"warnings": []}
    mujoco.set_mju_user_warning(told["warnings"].append)
    try:
        model = mujoco.MjModel.from_xml_path(asked["path"])
        told["names"] = {
            kind: [getattr(model, kind)(k).name for k in range(getattr(model, f"n{short}"))]
            for kind, short in asked["named"].items()
        }
        told["name"] = bytes(model.names).split(b"\0", 1)[0].decode()
        wanted = {name: _value(model, name) for name in asked["wanted"]}
        arrays = {name: numpy.array(value) for name, value in wanted.items()}
    except ValueError as error:
        return {**told, "refuses": str(error)}, {}
    except Exception as error:
        return {**told, "fails on": str(error) or type(error).__name__}, {}
    told["codes"] = {
        kind: {str(int(each)): name for name, each in getattr(mujoco, kind).__members__.items()}
        for kind in asked["codes"]
    }
    return told, arrays


def _value(model: Any, name: str) -> Any:
    for each in name.split("."):
        model = getattr(model, each)
    return model


def _limit(memory: int, time: int) -> None:
    """Limit what this process takes, where the operating system can."""
    with suppress(ImportError, OSError, ValueError):
        resource: Any = import_module("resource")
        sizes = ((kind, memory) for kind in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE))
        for kind, most in (*sizes, (resource.RLIMIT_CPU, time)):
            hard = resource.getrlimit(kind)[1]
            most = most if hard == resource.RLIM_INFINITY else min(most, hard)
            resource.setrlimit(kind, (most, hard))


if __name__ == "__main__":
    main()
