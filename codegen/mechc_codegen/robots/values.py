"""The values of a robot's description: numbers, or symbols where these are wanted.

Each symbol is a parameter whose default is the number in the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from math import inf
from typing import Any

from sympy import Symbol

from mechc_codegen.description.mechanism import Parameter, Quantity
from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.robot import Number, Robot, RobotJoint, RobotLink

OF_LINKS = ("mass", "centre", "inertia")
ACTING = {  # on coordinates of joints: how the names of the parameters begin, and words on them
    "damping": ("d", "damping of {}"),
    "friction": ("f", "dry friction of {}"),
    "stiffness": ("k", "stiffness of {}"),
    "armature": ("a", "inertia of the rotor of {}"),
}
OF_JOINTS = ("origin", "orientation", *ACTING, "limits")
_INERTIA = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")


class RobotValues:
    """The values that a file gives of links and joints, as numbers or parameters."""

    def __init__(self, robot: Robot, symbolic: Iterable[Any]) -> None:
        self.parameters: list[Parameter] = []
        self._pairs_to_replace = _pairs_to_replace(robot, symbolic)

    def mass(self, link: RobotLink) -> Any:
        return self._value("mass", link.name, "m", link.mass, "kg", "mass of {}", lower=0.0)

    def centre(self, link: RobotLink) -> list[Any]:
        return self._along_axes("centre", link.name, "c", link.centre.xyz, "mass centre of {}")

    def inertia(self, link: RobotLink) -> list[list[Any]]:
        """The inertia about the mass centre, in the axes of the file."""
        xx, xy, xz, yy, yz, zz = (
            self._value("inertia", link.name, entry, x, "kg m^2", f"inertia {entry[1:]} of {{}}")
            for entry, x in zip(_INERTIA, link.inertia, strict=True)
        )
        return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]

    def origin(self, joint: RobotJoint) -> list[Any]:
        what = "place of {} on its parent"
        return self._along_axes("origin", joint.name, "o", joint.origin.xyz, what)

    def orientation(self, joint: RobotJoint) -> list[Any]:
        return [
            self._value("orientation", joint.name, angle, x, "rad", f"{angle} of {{}}")
            for angle, x in zip(("roll", "pitch", "yaw"), joint.origin.rpy, strict=True)
        ]

    def acting(self, kind: str, joint: RobotJoint, unit: str) -> Any:
        """The damping, friction, stiffness or armature of a joint."""
        letter, what = ACTING[kind]
        return self._value(kind, joint.name, letter, getattr(joint, kind), unit, what, lower=0.0)

    def limit(self, joint: RobotJoint, which: str, unit: str) -> Any:
        """A bound of a joint; None where the file has none."""
        given = joint.limits.get(which)
        if given is None:
            return None
        return self._value("limits", joint.name, which, given, unit, f"limit {which} of {{}}")

    def _along_axes(
        self, kind: str, name: str, letter: str, numbers: Iterable[Number], what: str
    ) -> list[Any]:
        return [
            self._value(kind, name, f"{letter}{axis}", x, "m", f"{what} along {axis}")
            for axis, x in zip("xyz", numbers, strict=True)
        ]

    def _value(
        self, kind: str, name: str, letter: str, number: Number, unit: str, what: str,
        lower: float = -inf,
    ) -> Any:  # fmt: skip
        if (name, kind) not in self._pairs_to_replace:
            return number
        symbol = Symbol(f"{letter}_{name}")
        quantity = Quantity(unit, what.format(name), lower=lower, closed=lower > -inf)
        parameter = Parameter(symbol, float(number), quantity)
        if parameter not in self.parameters:  # halves of one link have one mass
            self.parameters.append(parameter)
        return symbol


def _pairs_to_replace(robot: Robot, symbolic: Iterable[Any]) -> set[tuple[str, str]]:
    """Pairs of a name and a kind."""
    named = {
        **{(link, kind): None for link in robot.links for kind in OF_LINKS},
        **{(joint.name, kind): None for joint in robot.joints for kind in OF_JOINTS},
    }
    found: set[tuple[str, str]] = set()
    for given in [symbolic] if isinstance(symbolic, str) else symbolic:
        kinds = {pair for pair in named if given in (pair, pair[1])}
        if not kinds:
            _refuse(robot, given, named)
        found |= kinds
    return found


def _refuse(robot: Robot, given: Any, named: Mapping[tuple[str, str], None]) -> None:
    names = list(dict.fromkeys(name for name, _ in named))
    known = ", ".join((*OF_LINKS, *OF_JOINTS))
    near = get_close_matches(str(given[0]) if isinstance(given, tuple) else str(given), names)
    hint = f"; near are {', '.join(map(repr, near))}" if near else ""
    raise MechanismError(
        f"{robot.name}: symbolic={given!r} is neither a kind of value ({known}) nor a pair of a "
        f"link or joint and a kind that it has{hint}"
    )
