"""Cut joints, which close loops, described like the joints of ``sympy.physics.mechanics``.

SymPy's joints orient the child relative to the parent, but in a loop both are placed already.  A
cut orients nothing: its constraints make directions of its two sides coincide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

from sympy import Expr, S, sqrt
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols
from sympy.physics.mechanics.joint import Joint as SymPyJoint
from sympy.physics.vector import Vector

from mechc_codegen.description.constraints import Closure
from mechc_codegen.description.joints.kinds import KINDS, JointKind
from mechc_codegen.description.joints.tree import Body, Joint
from mechc_codegen.description.placement import cross
from mechc_codegen.description.quantity import Quantity, in_si
from mechc_codegen.description.terms import as_expression, vector_along
from mechc_codegen.errors import MechanismError

Components = tuple[Expr, Expr, Expr]
UNITS: tuple[Components, ...] = (
    (S.One, S.Zero, S.Zero),
    (S.Zero, S.One, S.Zero),
    (S.Zero, S.Zero, S.One),
)


@dataclass(frozen=True, eq=False)
class Cut(Joint):
    """A joint that closes a loop: its points and axes are constrained, not placed by the tree.

    Made by :meth:`pin`, :meth:`prismatic`, :meth:`cylindrical`, :meth:`planar`, :meth:`spherical`,
    :meth:`universal` and :meth:`weld`, which take the arguments of the joints of these names in
    ``sympy.physics.mechanics``, without coordinates and speeds; and by :meth:`rod`.

    Constraints may follow from others: redundant ones get the multipliers of least norm.  Those
    that always hold, such as those across the plane of a planar mechanism, are omitted.

    Attributes
    ----------
    axes
        The directions along which the points coincide; None: all axes of the inertial frame.
    perpendicular
        Pairs of axes, of child and parent, that stay perpendicular.
    aligned
        Pairs of axes, of child and parent, that point the same way where the joint is closed.
        These hold no motion: they tell its configurations from those turned by half.
    labels
        Names of the constraints; by default the joint's name and their axes.
    length
        That of a rod between the two points, m; None: it is none.
    """

    axes: tuple[Vector, ...] | None = None
    perpendicular: tuple[tuple[Vector, Vector], ...] = ()
    aligned: tuple[tuple[Vector, Vector], ...] = ()
    labels: tuple[str, ...] = ()
    length: Expr | None = None

    @property
    def is_cut(self) -> bool:
        return True

    def closure(self, frame: ReferenceFrame) -> Closure:
        """All its constraints, in the inertial frame given."""
        axes = (frame.x, frame.y, frame.z) if self.axes is None else self.axes
        return Closure(
            self.name,
            self.child_point,
            self.parent_point,
            axes,
            perpendicular=self.perpendicular,
            aligned=self.aligned,
            labels=self.labels,
            length=self.length,
        )

    @classmethod
    def _of(cls, name: str, sides: _Sides, joint_axis: Vector | None = None) -> Self:
        """The cut of this kind of joint, which holds what the freedoms leave."""
        kind, axis = KINDS[name], sides.axis(joint_axis)
        held = [x for k, x in enumerate((axis, *across(axis))) if k not in kind.axes("m")]
        along = None if len(held) == 3 else tuple(map(sides.on_parent, held))
        return cls(*sides.described, axes=along, **sides.directions(kind, axis))

    @classmethod
    def pin(
        cls, name: str, parent: Body | None, child: Body | None, *args: Any,
        joint_axis: Vector | None = None, **places: Any,
    ) -> Self:  # fmt: skip
        """A cut revolute joint: three positions and two directions held.

        Parameters
        ----------
        parent, child
            Bodies; None is the ground, whose point and interframe must then be given.
        parent_point, child_point
            Points, or vectors from the mass centres; the mass centres by default.
        parent_interframe, child_interframe
            Frames fixed to the bodies, or vectors that their x axes point along; the bodies' own
            frames by default.
        joint_axis
            The axis in the parent's interframe, its x by default; the child's interframe has it
            in the same components.

        Raises
        ------
        MechanismError
            If a point or frame is missing or not fixed to its body.
        """
        return cls._of("revolute", _Sides(name, parent, child, *args, **places), joint_axis)

    @classmethod
    def spherical(
        cls, name: str, parent: Body | None, child: Body | None, *args: Any, **places: Any
    ) -> Self:
        """A cut ball joint: three positions held; parameters as in :meth:`pin`."""
        return cls._of("ball", _Sides(name, parent, child, *args, **places))

    @classmethod
    def universal(
        cls, name: str, parent: Body | None, child: Body | None, *args: Any, **places: Any
    ) -> Self:
        """A cut universal joint: three positions held, and one direction.

        One axis of its cross is the x axis of the parent's interframe, the other the y axis of the
        child's, as of :class:`mechc.UniversalJoint`; parameters as in :meth:`pin`.
        """
        return cls._of("universal", _Sides(name, parent, child, *args, **places))

    @classmethod
    def weld(
        cls, name: str, parent: Body | None, child: Body | None, *args: Any, **places: Any
    ) -> Self:
        """A cut weld: three positions and three directions held; parameters as in :meth:`pin`."""
        return cls._of("fixed", _Sides(name, parent, child, *args, **places))

    @classmethod
    def prismatic(
        cls, name: str, parent: Body | None, child: Body | None, *args: Any,
        joint_axis: Vector | None = None, **places: Any,
    ) -> Self:  # fmt: skip
        """A cut slide along an axis: two positions and three directions held; see :meth:`pin`."""
        return cls._of("prismatic", _Sides(name, parent, child, *args, **places), joint_axis)

    @classmethod
    def cylindrical(
        cls, name: str, parent: Body | None, child: Body | None, *args: Any,
        joint_axis: Vector | None = None, **places: Any,
    ) -> Self:  # fmt: skip
        """A cut slide that turns: two positions and two directions held; see :meth:`pin`."""
        return cls._of("cylindrical", _Sides(name, parent, child, *args, **places), joint_axis)

    @classmethod
    def planar(
        cls, name: str, parent: Body | None, child: Body | None, *args: Any, **places: Any
    ) -> Self:
        """A cut contact of planes across the interframes' x: one position and two directions held.

        Parameters as in :meth:`pin`.
        """
        return cls._of("planar", _Sides(name, parent, child, *args, **places))

    @classmethod
    def rod(
        cls, name: str, parent: Body | None, child: Body | None, length: Any, *args: Any,
        **places: Any,
    ) -> Self:  # fmt: skip
        """A rod without mass, with a ball at each end: it holds the distance of two points.

        One constraint, called ``name``, whose multiplier is the axial force in N, tension positive.

        Parameters
        ----------
        parent, child
            Bodies; None is the ground, whose point must then be given.
        length
            From one point to the other, m: a positive number, a symbol, an expression of
            parameters, or a text with its unit, ``"30 mm"``.
        parent_point, child_point
            The rod's ends: points, or vectors from the mass centres; the mass centres by default.

        Raises
        ------
        MechanismError
            For a length that is not positive or not constant, and for a point that is missing.
        """
        sides = _Sides(name, parent, child, *args, **places)
        return cls(*sides.described, axes=(), length=_rod_length(name, length))


class _Sides:
    """Points and local frames on both sides of a cut joint, which has the same axes on both."""

    def __init__(
        self,
        name: str,
        parent: Body | None,
        child: Body | None,
        parent_point: Point | Vector | None = None,
        child_point: Point | Vector | None = None,
        parent_interframe: ReferenceFrame | Vector | None = None,
        child_interframe: ReferenceFrame | Vector | None = None,
    ) -> None:
        self.name = name
        self.frames = (
            self._interframe(parent, parent_interframe, "parent"),
            self._interframe(child, child_interframe, "child"),
        )
        points = (
            self._point(parent, parent_point, "parent"),
            self._point(child, child_point, "child"),
        )
        self.described = (name, parent, child, *points, *self.frames)

    def directions(self, kind: JointKind, axis: Components) -> dict[str, Any]:
        """The pairs of axes that leave the turns of a kind of joint."""
        turns = kind.axes("rad")
        if len(turns) == 2:
            second, first = self.on_child(UNITS[turns[1]]), self.on_parent(UNITS[turns[0]])
            return {"perpendicular": ((second, first),)}
        if kind.turns_freely:
            return {}
        return self._parallel(axis) if turns else self._all_parallel()

    def axis(self, given: Vector | None) -> Components:
        """The components of the joint's axis along the parent's interframe."""
        if given is None:
            return UNITS[0]
        frame = self._frame_of(0)
        try:
            x, y, z = given.to_matrix(frame)
        except ValueError as error:
            raise MechanismError(f"the joint {self.name}: {error}") from None
        if any(c.atoms(AppliedUndef) for c in (x, y, z)):
            raise MechanismError(
                f"the joint {self.name}: the axis {given} is not fixed in {frame.name}, the "
                "interframe of the parent"
            )
        if x == y == z == 0:
            raise MechanismError(f"the joint {self.name}: its axis is the zero vector")
        return x, y, z

    def on_parent(self, components: Components) -> Vector:
        return vector_along(components, self._frame_of(0))

    def on_child(self, components: Components) -> Vector:
        return vector_along(components, self._frame_of(1))

    def _parallel(self, axis: Components) -> dict[str, Any]:
        """The pairs of axes that keep the axis of the child along that of the parent."""
        square = sum(c**2 for c in axis)
        x, y, z = (c / square for c in axis)
        others = [self.on_parent(other) for other in across(axis)]
        return {
            "perpendicular": tuple((self.on_child(axis), other) for other in others),
            "aligned": ((self.on_child(axis), self.on_parent((x, y, z))),),
        }

    def _all_parallel(self) -> dict[str, Any]:
        """The pairs of axes that keep all axes of the child along those of the parent.

        Perpendicular axes also have three half turns, and two thirds of a turn that exchange all
        axes; of all these only the right one has two axes along those of the parent.
        """
        child, parent = ([on(unit) for unit in UNITS] for on in (self.on_child, self.on_parent))
        return {
            "perpendicular": tuple((child[k], parent[(k + 1) % 3]) for k in range(3)),
            "aligned": tuple((child[k], parent[k]) for k in range(2)),
        }

    def _frame_of(self, side: int) -> ReferenceFrame:
        frame = self.frames[side]
        if frame is None:
            what = ("parent", "child")[side]
            raise MechanismError(
                f"the joint {self.name} constrains directions: give {what}_interframe, the {what} "
                "has no frame"
            )
        return frame

    def _interframe(
        self, body: Body | None, given: ReferenceFrame | Vector | None, side: str
    ) -> ReferenceFrame | None:
        own = getattr(body, "frame", None)
        if given is None:
            return own
        if isinstance(given, Vector):
            if own is None:
                raise MechanismError(
                    f"the joint {self.name}: give {side}_interframe as a frame; without a frame of "
                    "the body its orientation about the x axis is not known"
                )
            name = f"{self.name}_{_name(body)}_int_frame"
            return SymPyJoint._create_aligned_interframe(own, given, frame_name=name)
        if own is not None and given is not own and given.ang_vel_in(own) != 0:
            raise MechanismError(
                f"the joint {self.name}: {side}_interframe {given.name} is not fixed to "
                f"{_name(body)}"
            )
        return given

    def _point(self, body: Body | None, given: Point | Vector | None, side: str) -> Point:
        if isinstance(given, Point):
            return given
        if body is None:
            raise MechanismError(
                f"the joint {self.name}: the {side} is the ground, so {side}_point must be a Point"
            )
        if given is None:
            return body.masscenter
        return body.masscenter.locatenew(f"{self.name}_{body.name}_joint", given)


def _rod_length(name: str, given: Any) -> Expr:
    """The length of a rod, m."""
    try:
        length = as_expression(in_si(given, "its length", Quantity("m", "")), "length")
    except MechanismError as error:
        raise MechanismError(f"the rod {name}: {error}") from None
    moving = length.atoms(AppliedUndef) | (length.free_symbols & {dynamicsymbols._t})
    if moving:
        raise MechanismError(
            f"the rod {name}: its length {length} contains {min(moving, key=str)}, which varies "
            "with time; a length is a number or an expression of parameters"
        )
    if length.is_number and not (length.is_real and length.is_finite and length.is_positive):
        raise MechanismError(
            f"the rod {name}: its length is positive, not {given}; for points that coincide write "
            "mechc.Cut.spherical, or mechc.Cut.pin"
        )
    if length.is_nonpositive:
        raise MechanismError(
            f"the rod {name}: its length is positive, but {length} is declared not to be"
        )
    return length


def _name(body: Body | None) -> str:
    return "ground" if body is None else str(body.name)


def across(axis: Components) -> tuple[Components, Components]:
    """Two unit vectors perpendicular to an axis and to each other."""
    still = [k for k in range(3) if axis[k] == 0]
    if len(still) == 2:
        return UNITS[still[0]], UNITS[still[1]]
    first = UNITS[still[0]] if still else _unit(cross(axis, UNITS[0]))
    return first, _unit(cross(axis, first))


def _unit(vector: Sequence[Expr]) -> Components:
    length = sqrt(sum(c**2 for c in vector))
    x, y, z = (c / length for c in vector)
    return x, y, z
