"""Couplings of two joints: gears, belts, rack and pinion, cams.

Each adds one constraint between the coordinates of two joints.  The forces that hold it act between
the two bodies, where teeth, strands or a contact are, so that joint reactions are complete.  With
M u' + J^T lambda = F the force on a coordinate is -lambda dg/dq; force and torque on the child per
unit of lambda follow from the moments that both wheels need.
"""

from __future__ import annotations

from typing import Any, Self

from sympy import Expr, sqrt, sympify
from sympy.physics.mechanics import PinJoint, Point, PrismaticJoint, RigidBody
from sympy.physics.vector import Vector

from mechc_codegen.description.constraints import Constraint
from mechc_codegen.description.drawing import Drawing, Link
from mechc_codegen.description.joints.couplings import CoupledPair
from mechc_codegen.errors import MechanismError
from mechc_codegen.joints import outlines
from mechc_codegen.joints.wheels import Slide, Wheel, between, check_across

FOLLOWERS = ("roller", "flat")


class Coupling(CoupledPair):
    """A coupling of two joints; it is given to :func:`mechc.from_joints` among the joints.

    Made by :meth:`gear`, :meth:`belt`, :meth:`rack_and_pinion` and :meth:`cam`.  Angles and ways
    are those of the joints, all zero at once.  The constraint holds both ways: what pushes only, as
    a cam without a groove, would lift off where the sign of the multiplier changes.
    """

    @classmethod
    def gear(
        cls, name: str, first: PinJoint | RigidBody, second: PinJoint, radii: tuple[Any, Any], *,
        internal: bool = False, carrier: PinJoint | None = None,
    ) -> Self:  # fmt: skip
        """Two spur gears with parallel axes, r_1 phi_1 + r_2 phi_2 = 0.

        Parameters
        ----------
        first, second
            The pins that the wheels turn in; with a ``carrier`` the first may be the body that the
            carrier turns on, which then is a gear about the carrier's axis (a fixed ring or sun).
        radii
            Of the pitch circles, in m, or the numbers of teeth: only their ratio enters, the size
            follows from the distance of the axes.
        internal
            The teeth of one are on its inside: r_1 phi_1 - r_2 phi_2 = 0.
        carrier
            The pin of the arm of a planetary gear: angles count relative to its child.

        The teeth exert a tangential force at the pitch point, where its reaction is given; the
        radial force of inclined flanks does no work and is not included.

        Raises
        ------
        MechanismError
            If axes are not parallel or coincide, or the pins are not on one carrier.
        """
        wheels = between(name, first, second, carrier)
        one, other = _factors(radii, internal)
        n, across = wheels[0].axis, wheels.distance
        size = (one + other) / across.dot(across)
        whole = (one + other) / sqrt(across.dot(across))
        pitch = wheels[0].centre.locatenew(f"{name}_pitch", one / (one + other) * across)
        gap = one * wheels[0].angle + other * wheels[1].angle
        first_rim = outlines.rim(name, wheels[0], one / whole)
        rims = (*first_rim, *outlines.rim(name, wheels[1], other / whole))
        return cls._joining(name, wheels, pitch, gap, rims, size * n.cross(across))

    @classmethod
    def belt(
        cls, name: str, first: PinJoint, second: PinJoint, radii: tuple[Any, Any], *,
        crossed: bool = False, carrier: PinJoint | None = None,
    ) -> Self:  # fmt: skip
        """A belt or chain that does not slip or stretch, r_1 phi_1 = r_2 phi_2.

        Parameters as in :meth:`gear`; ``radii`` in m.  ``crossed``: the pulleys turn against each
        other.  The strands' tensions are the pretension plus and minus half of the multiplier; the
        pretension's own pull on the axles is not included: give it as a load.  The reaction is
        given at the centre of the second pulley.
        """
        wheels = between(name, first, second, carrier)
        one, other = _factors(radii, not crossed)
        n, across = wheels[0].axis, wheels.distance
        size = (one + other) / across.dot(across)
        gap = one * wheels[0].angle + other * wheels[1].angle
        rims = (*outlines.rim(name, wheels[0], one), *outlines.rim(name, wheels[1], other))
        links = (*rims, *outlines.strands(name, wheels, one, other))
        force, at = size * n.cross(across), wheels[1].centre
        return cls._joining(name, wheels, at, gap, links, force, -other * n)

    @classmethod
    def rack_and_pinion(
        cls, name: str, pinion: PinJoint, rack: PrismaticJoint, radius: Any, *,
        reverse: bool = False,
    ) -> Self:  # fmt: skip
        """A rack that a pinion moves, s = r phi; both on one parent.

        With d along the slide and n along the pin, the rack touches at r d x n from the pin;
        ``reverse``: on the other side, s = -r phi.  The force acts along d there.

        Raises
        ------
        MechanismError
            If the slide is not across the axis, or pin and slide have different parents.
        """
        wheel, slide = Wheel.of(name, pinion), Slide.of(name, rack)
        check_across(name, wheel, slide)
        radius = -sympify(radius) if reverse else sympify(radius)
        touch = wheel.centre.locatenew(f"{name}_pitch", radius * slide.direction.cross(wheel.axis))
        gap = slide.way - radius * wheel.angle
        rack_line = outlines.rack(name, slide, touch, radius)
        links = (*outlines.rim(name, wheel, radius), *rack_line)
        return cls._joining(name, (wheel, slide), touch, gap, links, -slide.direction)

    @classmethod
    def cam(
        cls, name: str, cam: PinJoint, follower: PrismaticJoint, lift: Any, *, shape: str = "roller"
    ) -> Self:
        """A disc cam and a follower that slides across its axis, s = lift(phi).

        Parameters
        ----------
        lift
            The follower's way in m, an expression of the cam's coordinate: twice differentiable, as
            accelerations contain its second derivative (a :class:`mechc.Table` may be periodic).
        shape
            ``"roller"``, the lift is that of the centre of a roller without mass, or of a point, at
            the slide's child point, which may be beside the cam's axis; ``"flat"``, a plane across
            the slide.  It decides the force between them, not the motion.

        Without friction the force is along the normal of the contact.  Cam and slide have one
        parent.  The reaction is given at the slide's child point.
        """
        if shape not in FOLLOWERS:
            raise MechanismError(f"the coupling {name}: shape is one of {FOLLOWERS}, not {shape!r}")
        wheel, slide = Wheel.of(name, cam), Slide.of(name, follower)
        check_across(name, wheel, slide)
        given, lift = lift, sympify(lift)
        if not lift.has(wheel.angle):
            raise MechanismError(
                f"the coupling {name}: lift is an expression of the cam's coordinate "
                f"{wheel.angle}, not {given!r}"
            )
        d, n = slide.direction, wheel.axis
        place = slide.start.pos_from(wheel.centre) + slide.way * d
        beside = n.cross(d)
        turned = lift.diff(wheel.angle) + place.dot(beside)
        force, torque = -d, -turned * n
        if shape == "roller":
            force, torque = -d - turned / place.dot(d) * beside, 0 * n
        links = outlines.profile(name, wheel, slide, lift, shape == "flat")
        sides, gap = (wheel, slide), slide.way - lift
        return cls._joining(name, sides, slide.point, gap, links, force, torque)

    @classmethod
    def _joining(
        cls, name: str, sides: Any, point: Point, gap: Expr, links: tuple[Link, ...],
        force: Vector, torque: Vector | None = None,
    ) -> Self:  # fmt: skip
        """The coupling of a wheel with a wheel or slide, whose reaction is given at ``point``."""
        return cls(
            name,
            sides[0].body,
            sides[1].body,
            sides[0].centre,
            point,
            constraint=Constraint(name, gap, "m"),
            force=force,
            torque=Vector(0) if torque is None else torque,
            drawing=Drawing(links=links),
        )


def _factors(radii: tuple[Any, Any], internal: bool) -> tuple[Expr, Expr]:
    one, other = map(sympify, radii)
    return one, -other if internal else other
