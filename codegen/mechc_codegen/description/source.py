"""What was read from an object of ``sympy.physics.mechanics``: the data of its conversion.

Input of the conversion to a mechanism and of the cache key; nothing is derived yet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sympy import Expr
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody

from mechc_codegen.description.terms import Load

if TYPE_CHECKING:
    from mechc_codegen.description.joints import Joint


@dataclass(frozen=True, eq=False, repr=False)  # quicker to import, at every start
class Source:
    """A SymPy mechanics object, read.

    Attributes
    ----------
    kinematics
        Expressions of q, q', u and t that vanish; linear in q' and in u.
    configuration, motion
        Constraints on the configuration; constraints on the speeds.  Where ``mixed``, the
        latter hold the rates of the former besides the nonholonomic ones, unlabelled.
    lagrangian
        L, where the equations are Lagrange's; loads then are those that L leaves out.
    origin
        A point fixed in ``frame``, where the object names one.
    joints
        Those that the object keeps; the ground is a body of theirs like any other.
    potentials
        Potential energies that the object itself vouches for, each with the index of the load
        that has it.
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
    origin: Point | None = None
    joints: tuple[Joint, ...] = ()


Key = Any  # a printed name, or the symbol itself


@dataclass(frozen=True)
class ConversionSettings:
    """What the user says besides the object; keys are printed names or the symbols themselves.

    Attributes
    ----------
    defaults, units
        Of parameters; units also of coordinates and speeds.
    inputs
        Specified functions of time -> expressions of t, q, u and parameters; None leaves one open.
    states
        Functions of time with rates of their own -> these rates.
    configuration_constraints
        Added to those of the object; an empty sequence says that there are none besides.
    """

    name: str | None = None
    defaults: Mapping[Key, Any] = field(default_factory=dict)
    units: Mapping[Key, str] = field(default_factory=dict)
    inputs: Mapping[Key, Any] = field(default_factory=dict)
    configuration_constraints: Sequence[Any] | None = None
    states: Mapping[Key, Any] = field(default_factory=dict)
