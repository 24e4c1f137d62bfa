"""A solid in a picture in space: a simple shape or the surface of a mesh."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sympy import Expr, sympify
from sympy.physics.mechanics import Point, ReferenceFrame

from mechc_codegen.errors import MechanismError

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Solid:
    """A shape that goes with a point and turns with a frame; it has no mass.

    Made by :meth:`ball`, :meth:`box`, :meth:`cylinder`, :meth:`wheel` and :meth:`from_mesh`.

    Attributes
    ----------
    kind
        ``"ball"``, ``"box"``, ``"cylinder"``, ``"wheel"`` or ``"mesh"``.
    label
        Its name in the picture.
    at
        The point at its middle, or at the origin of the file.
    frame
        The frame that it turns with; None for a ball.
    sizes
        In m: numbers, or expressions of parameters; of a mesh m per unit of the file, along its
        axes, negative where it is mirrored.
    axis
        ``"x"``, ``"y"`` or ``"z"`` of ``frame``: that of a cylinder or a wheel.
    path
        The file of a mesh, which is read when the solid is drawn.
    triangles
        Of a mesh without a file: the corners, nine numbers in single precision for each triangle.

    Raises
    ------
    MechanismError
        If the point, the frame, the axis or a size is none.
    """

    kind: str
    label: str
    at: Point
    frame: ReferenceFrame | None
    sizes: tuple[Expr, ...]
    axis: str = "z"
    path: str = ""
    triangles: bytes = field(default=b"", repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.at, Point):
            raise MechanismError(f"solid {self.label}: {self.at!r} is not a Point")
        if not isinstance(self.frame, ReferenceFrame) and self.kind != "ball":
            raise MechanismError(f"solid {self.label}: {self.frame!r} is not a ReferenceFrame")
        if self.axis not in AXES:
            raise MechanismError(f"solid {self.label}: its axis is x, y or z, not {self.axis!r}")
        object.__setattr__(self, "sizes", tuple(self._size(size) for size in self.sizes))

    def _size(self, given: Any) -> Expr:
        size = None if isinstance(given, str) else sympify(given)
        wrong = isinstance(size, Expr) and (size.is_zero if self.kind == "mesh" else
                                            size.is_positive is False)  # fmt: skip
        if not isinstance(size, Expr) or wrong or size.has(float("nan")):
            raise MechanismError(f"solid {self.label}: {given!r} is not a length")
        return size

    @classmethod
    def ball(cls, label: str, at: Point, radius: Any) -> Solid:
        """A ball; radius in m."""
        return cls("ball", label, at, None, (radius,))

    @classmethod
    def box(cls, label: str, at: Point, frame: ReferenceFrame, sides: Any) -> Solid:
        """A box with these three sides in m along the axes of ``frame``."""
        three = tuple(sides)
        if len(three) != 3:
            raise MechanismError(f"solid {label}: a box has three sides, not {len(three)}")
        return cls("box", label, at, frame, three)

    @classmethod
    def cylinder(
        cls, label: str, at: Point, frame: ReferenceFrame, radius: Any, length: Any, axis: str = "z"
    ) -> Solid:
        """A cylinder or disc; radius and length in m."""
        return cls("cylinder", label, at, frame, (radius, length), axis)

    @classmethod
    def wheel(
        cls, label: str, at: Point, frame: ReferenceFrame, radius: Any, axis: str = "z"
    ) -> Solid:
        """A wheel with tyre and spokes; radius in m."""
        return cls("wheel", label, at, frame, (radius,), axis)

    @classmethod
    def from_mesh(
        cls, label: str, at: Point, frame: ReferenceFrame, path: str | Path, scale: Any = 1.0
    ) -> Solid:
        """The surface in an STL, OBJ or COLLADA (.dae) file, in ``frame``, its origin in ``at``.

        ``scale``: m per unit of the file, 0.001 if it is in mm; COLLADA has its unit in the file.
        """
        return cls("mesh", label, at, frame, (scale,), path=str(path))
