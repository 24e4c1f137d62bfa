"""LagrangesMethod -> Source: L as it was given, with a separate symbol for every speed.

The speeds u = q' are functions named after their coordinates: ``q_dot``.  Multipliers keep the
sign of M u' + J^T lambda = F with J the Jacobian of the constraints as they were given.
"""

from __future__ import annotations

from sympy import Function
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import LagrangesMethod, ReferenceFrame, dynamicsymbols

from mechc_codegen.description.source import Source
from mechc_codegen.description.terms import printed_name
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.loads import plain_loads


def read_lagrange(method: LagrangesMethod, form: str | None = None) -> Source:
    """Read a LagrangesMethod, whose equations need not be formed if ``form`` is given.

    Raises
    ------
    MechanismError
        If ``form_lagranges_equations`` was not called.
    """
    if method.eom is None and form is None:
        raise MechanismError(
            "the equations of this LagrangesMethod are not formed: call "
            "form_lagranges_equations() first, or compile it with form='lagrange'"
        )
    q = tuple(method.q)
    u = tuple(speed_of(coordinate) for coordinate in q)
    holonomic = len(method._hol_coneqs)
    return Source(
        kind="LagrangesMethod",
        frame=method.inertial or ReferenceFrame("N"),
        q=q,
        u=u,
        kinematics=tuple(a.diff(dynamicsymbols._t) - b for a, b in zip(q, u, strict=True)),
        loads=plain_loads(method.forcelist or ()),
        configuration=tuple(method._hol_coneqs),
        motion=tuple(method.coneqs)[holonomic:],
        lagrangian=method._L[0],
        drawn=tuple(method.bodies or ()),
    )


def speed_of(coordinate: AppliedUndef) -> AppliedUndef:
    """The function of time for a coordinate's rate."""
    return Function(f"{printed_name(coordinate)}_dot")(dynamicsymbols._t)
