"""Names of the parts of a model: those of the file, and others where it has none."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from mechc_codegen.mjcf.read import CompiledFile
from mechc_codegen.robots.robot import unused_name


@dataclass(frozen=True)
class PartNames:
    """Names by MuJoCo's numbers.  No joint has that of an equality constraint."""

    bodies: list[str]
    joints: list[str]
    equalities: list[str]
    actuators: list[str]


def names_of(file: CompiledFile) -> PartNames:
    """The names of a file.

    A joint without one is called after its body, another part by its kind and number.
    """
    model = file.model
    bodies = _with_numbers("body", [*file.names["body"]])
    joints = [*file.names["joint"]]
    for k, name in enumerate(joints):
        body = int(model.jnt_bodyid[k])
        number = k - int(model.body_jntadr[body])
        default = bodies[body] if model.body_jntnum[body] == 1 else f"{bodies[body]}_{number}"
        joints[k] = name or unused_name(default, joints)
    equalities = file.names["equality"]
    others = [*joints, *equalities]
    own = [unused_name(name, others) if name in joints else name for name in equalities]
    own = _with_numbers("equality", own, joints)
    return PartNames(bodies, joints, own, _with_numbers("actuator", [*file.names["actuator"]]))


def _with_numbers(kind: str, names: list[str], taken: Collection[str] = ()) -> list[str]:
    for number, name in enumerate(names):
        names[number] = name or unused_name(f"{kind}{number}", [*names, *taken])
    return names
