"""The table of joint kinds: a row says all that is specific to one kind.

Files of robots and the classes of SymPy name joints by it; coordinates, speeds and the motion of
the child follow from its row, and what a cut holds is what the freedoms leave.
"""

from __future__ import annotations

from typing import NamedTuple


class Freedom(NamedTuple):
    """A turn about an axis of the joint (``rad``) or a slide along it (``m``), by one coordinate.

    ``axis``: 0 is the joint's own, 1 and 2 are across it; of a joint without an axis x, y and z.
    ``coordinate`` and ``speed``, its rate: how their names begin.
    """

    unit: str
    axis: int = 0
    coordinate: str = "q"
    speed: str = "u"


class JointKind(NamedTuple):
    """A kind of joint, called ``name`` by :class:`RobotJoint`.

    ``freedoms``: in the order of the coordinates; each turn follows the one before.  ``has_axis``:
    whether a robot gives the axis.  ``turns_freely``: whether a quaternion turns the child besides.
    ``cut``: the method of :class:`mechc.Cut`.  ``classes``: those of SymPy and mechc.  ``loops``:
    the names in those elements of URDF that close loops.
    """

    name: str
    freedoms: tuple[Freedom, ...] = ()
    has_axis: bool = False
    turns_freely: bool = False
    cut: str = ""
    classes: str = ""
    urdf: str = ""
    sdf: str = ""
    loops: str = ""
    mjcf: str = ""

    @property
    def unit(self) -> str:
        """The unit of the one coordinate; empty where there is none or several."""
        single = len(self.freedoms) == 1 and not self.turns_freely
        return self.freedoms[0].unit if single else ""

    def axes(self, unit: str) -> list[int]:
        """The axes of the turns (``rad``) or the slides (``m``)."""
        return [each.axis for each in self.freedoms if each.unit == unit]

    def states(self) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
        """How the names of the coordinates and of the speeds begin, each with its unit."""
        q = [(each.coordinate, each.unit) for each in self.freedoms]
        u = [(each.speed, f"{each.unit}/s") for each in self.freedoms]
        if self.turns_freely:
            q += [(f"q{k}", "1") for k in range(4)]
            u += [(f"w{axis}", "rad/s") for axis in "xyz"]
        return q, u


def _slide(letter: str, axis: int) -> Freedom:
    return Freedom("m", axis, letter, f"v{letter}")


TURN = Freedom("rad")
CROSS = (Freedom("rad", 0, "qx", "ux"), Freedom("rad", 1, "qy", "uy"))
KINDS = {
    row.name: row
    for row in (
        JointKind("revolute", (TURN,), has_axis=True, cut="pin", classes="PinJoint",
                  urdf="revolute", sdf="revolute"),
        JointKind("continuous", (TURN,), has_axis=True, cut="pin",  # revolute without limits
                  urdf="continuous", sdf="continuous", loops="revolute continuous", mjcf="HINGE"),
        JointKind("prismatic", (Freedom("m"),), has_axis=True, cut="prismatic",
                  classes="PrismaticJoint", urdf="prismatic", sdf="prismatic", loops="prismatic",
                  mjcf="SLIDE"),
        JointKind("fixed", cut="weld", classes="WeldJoint", urdf="fixed", sdf="fixed",
                  loops="fixed"),
        JointKind("floating", (_slide("x", 0), _slide("y", 1), _slide("z", 2)), turns_freely=True,
                  classes="FreeJoint", urdf="floating", mjcf="FREE"),
        JointKind("planar", (_slide("x", 1), _slide("y", 2), TURN), has_axis=True, cut="planar",
                  classes="PlanarJoint", urdf="planar"),
        JointKind("cylindrical", (TURN, _slide("x", 0)), has_axis=True, cut="cylindrical",
                  classes="CylindricalJoint", loops="cylindrical"),
        JointKind("ball", turns_freely=True, cut="spherical", classes="SphericalJoint BallJoint",
                  sdf="ball", loops="spherical ball", mjcf="BALL"),
        JointKind("universal", CROSS, cut="universal",  # x of the parent's frame, y of the child's
                  classes="UniversalJoint", sdf="universal revolute2", loops="universal"),
        JointKind("distance", turns_freely=True, cut="rod"),  # of the origins of both frames
    )
}  # fmt: skip


def kinds_by(column: str) -> dict[str, JointKind]:
    """The names in a column of the table, and their rows."""
    return {name: row for row in KINDS.values() for name in getattr(row, column).split()}
