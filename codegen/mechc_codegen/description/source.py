"""Data read from an object of ``sympy.physics.mechanics``, for its conversion.

Input of the conversion to a mechanism and of the cache key; nothing is derived yet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sympy import Expr
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody

from mechc_codegen.description.terms import Load, printed_name

if TYPE_CHECKING:
    from mechc_codegen.description.drawing import Muscle
    from mechc_codegen.description.given_equations import GivenEquations
    from mechc_codegen.description.joints.tree import Joint


MOST_NAMED = 3  # bodies, in a title


@dataclass(frozen=True, eq=False, repr=False)  # quicker to import, at every start
class Source:
    """A SymPy mechanics object, read.

    Attributes
    ----------
    kinematics
        Expressions of q, q', u and t that are zero; linear in q' and in u.
    configuration, motion
        Constraints on the configuration; constraints on the speeds.  Where ``mixed``, the
        latter contain the rates of the former besides the nonholonomic ones, without labels.
    lagrangian
        L, if the equations are Lagrange's; loads then are those that are not in L.
    equations
        Terms of M and F, if they are given.
    drawn
        Bodies whose energies are in L, for pictures only.
    origin
        A point fixed in ``frame``, where the object names one.
    joints
        The object's joints; the ground is one of their bodies.
    muscles
        Those among its actuators, for pictures only.
    """

    kind: str
    frame: ReferenceFrame
    q: tuple[AppliedUndef, ...]
    u: tuple[AppliedUndef, ...]
    kinematics: tuple[Expr, ...]
    bodies: tuple[RigidBody | Particle, ...] = ()
    loads: tuple[Load, ...] = ()
    configuration: tuple[Expr, ...] = ()
    motion: tuple[Expr, ...] = ()
    mixed: bool = False
    auxiliary: tuple[AppliedUndef, ...] = ()
    lagrangian: Expr | None = None
    equations: GivenEquations | None = None
    origin: Point | None = None
    joints: tuple[Joint, ...] = ()
    drawn: tuple[RigidBody | Particle, ...] = ()
    muscles: tuple[Muscle, ...] = ()

    @property
    def title(self) -> str:
        """For people: its bodies, or its coordinates where there are none."""
        names = dict.fromkeys(str(body.name) for body in (*self.bodies, *self.drawn))
        several = [*names] or [printed_name(q) for q in self.q]
        more = len(several) - MOST_NAMED
        if more > 1:
            several = [*several[:MOST_NAMED], f"{more} more"]
        return " and ".join(filter(None, (", ".join(several[:-1]), *several[-1:])))


Key = Any  # a printed name, or the symbol itself


@dataclass(frozen=True)
class ConversionSettings:
    """The user's options besides the object; keys are printed names or the symbols themselves.

    Attributes
    ----------
    defaults, units
        Of parameters; units also of coordinates and speeds.
    inputs
        Specified functions of time -> expressions of t, q, u and parameters; None: at run time.
    states
        Functions of time with differential equations -> their rates.
    configuration_constraints
        Added to those of the object; an empty sequence declares that there are no others.
    reactions
        Loads that act on auxiliary speeds only, to be found.
    parameters
        Parameters besides those of the equations.
    """

    name: str | None = None
    defaults: Mapping[Key, Any] = field(default_factory=dict)
    units: Mapping[Key, str] = field(default_factory=dict)
    inputs: Mapping[Key, Any] = field(default_factory=dict)
    configuration_constraints: Sequence[Any] | None = None
    states: Mapping[Key, Any] = field(default_factory=dict)
    reactions: Sequence[Key] = ()
    parameters: Sequence[Key] = ()
