"""KanesMethod -> Source.

Its mass matrix is never read: with dependent speeds it is reduced by a symbolic inverse that is
0/0 at the dead points of the choice of dependent speeds.  Bodies, loads and constraints are.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from sympy import Add, Expr
from sympy.physics.mechanics import KanesMethod, dynamicsymbols

from mechc_codegen.description.source import Source
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.loads import plain_loads


def read_kane(method: KanesMethod, form: str | None = None) -> Source:
    """Read a KanesMethod, whose equations need not be formed if ``form`` is given.

    Raises
    ------
    MechanismError
        If ``kanes_equations`` was not called, so that bodies or loads may be missing.
    """
    formed = method._fr is not None and method._frstar is not None
    if not formed and (form is None or not method.bodies):
        raise MechanismError(
            "the equations of this KanesMethod are not formed: call "
            "kanes_equations(bodies, loads) first, which sets the bodies and loads; or make it "
            "with KanesMethod(..., bodies=bodies, forcelist=loads), and compile it with form='kane'"
        )
    return Source(
        kind="KanesMethod",
        frame=method._inertial,
        q=tuple(method.q),
        u=tuple(method.u),
        kinematics=_kinematics(method),
        bodies=tuple(method.bodies),
        loads=plain_loads(method.forcelist or ()),
        configuration=tuple(method._f_h),
        motion=_affine(method._k_nh, method.u, method._f_nh),
        mixed=True,
        auxiliary=tuple(method._uaux),
    )


def _kinematics(method: Any) -> tuple[Expr, ...]:
    """The implicit form: the explicit one comes from a symbolic inverse and may contain 0/0."""
    rates = [q.diff(dynamicsymbols._t) for q in method.q]
    speeds = _affine(method._k_ku_implicit, method.u, method._f_k_implicit)
    return tuple(
        a + b for a, b in zip(_affine(method._k_kqdot_implicit, rates, ()), speeds, strict=True)
    )


def _affine(matrix: Any, vector: Any, rest: Iterable[Expr]) -> tuple[Expr, ...]:
    """Rows of ``matrix vector + rest``; products with zero are not formed."""
    terms = [[constant] for constant in rest] or [[] for _ in range(matrix.rows)]
    entries = list(vector)
    for (i, k), factor in matrix.todok().items():
        terms[i].append(factor * entries[k])
    return tuple(Add(*row) for row in terms)
