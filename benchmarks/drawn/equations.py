"""The equations of a scene as SymPy has formed them: ``matrix`` y' = ``forcing``.

With constraints, the equations of the open tree are formed by SymPy, and the rows of the
constraints, once differentiated, are set below them; nothing is eliminated.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import sympy as sm
import sympy.physics.mechanics as me
from sympy.physics.mechanics import dynamicsymbols

t = dynamicsymbols._t


@dataclass(frozen=True)
class Equations:
    """``matrix`` (n + m, n + m) of n states and m multipliers; ``closing`` is zero."""

    states: list[Any]
    matrix: sm.Matrix
    forcing: sm.Matrix
    closing: list[Any] = field(default_factory=list)


def equations(names: dict[str, Any]) -> Equations:
    """Those of the names of a scene's text."""
    formed = names.get("formed")
    if isinstance(formed, me.System):
        return of_kane(formed.eom_method, names.get("position", ()), ())
    if isinstance(formed, me.LagrangesMethod):
        states = [*formed.q, *formed.u]
        closing = [*getattr(formed, "_hol_coneqs", []), *formed.coneqs]
        return Equations(states, formed.mass_matrix_full, formed.forcing_full, closing)
    if isinstance(formed, me.KanesMethod):
        return of_kane(formed, names.get("position", ()), names.get("velocity", ()))
    q, u, M = names["q"], names["u"], names["M"]
    mass = sm.eye(len(u)) if M is None else sm.Matrix(M)
    rates = dict(zip((x.diff(t) for x in q), names["rates"], strict=True))
    matrix = sm.diag(sm.eye(len(q)), mass)
    forcing = sm.Matrix([*rates.values(), *names["F"]])
    own = rates if not any(x.is_Derivative for x in u) else {}
    return closed(Equations([*q, *u], matrix, forcing), len(q), own,
                  names.get("position", ()), names.get("velocity", ()))  # fmt: skip


def of_kane(formed: me.KanesMethod, position: Any, velocity: Any) -> Equations:
    """SymPy's own matrices; with constraints those of the open tree, and the constraints."""
    q, u = [*formed.q], [*formed.u]
    if not position and not velocity:
        return Equations([*q, *u], formed.mass_matrix_full, formed.forcing_full)
    tree = formed if not len(formed._udep) else _without_constraints(formed)
    open_ones = Equations([*q, *u], tree.mass_matrix_full, tree.forcing_full)
    return closed(open_ones, len(q), tree.kindiffdict(), position, velocity)


def _without_constraints(formed: me.KanesMethod) -> me.KanesMethod:
    """The open tree."""
    kinematics = formed._k_kqdot_implicit * formed.q.diff(t) + formed._k_ku_implicit * formed.u
    kinematics += formed._f_k_implicit
    tree = me.KanesMethod(formed._inertial, [*formed.q], [*formed.u], list(kinematics))
    tree.kanes_equations(formed.bodies, formed.loads)
    return tree


def closed(
    of: Equations, count: int, rates: dict[Any, Any], position: Any, velocity: Any
) -> Equations:
    """With constraints: ``rates`` are those of the coordinates, of which there are ``count``."""
    if not position and not velocity:
        return of
    u = of.states[count:]
    rows = sm.Matrix([*(sm.sympify(g).diff(t) for g in position), *velocity]).xreplace(rates)
    J = rows.jacobian(u)
    accelerations = {x.diff(t): 0 for x in u}
    gamma = -rows.diff(t).xreplace(accelerations).xreplace(rates)
    m, n = len(rows), len(of.states)
    above = of.matrix.row_join(sm.zeros(count, m).col_join(J.T))
    below = sm.zeros(m, count).row_join(J).row_join(sm.zeros(m, m))
    assert above.shape == (n, n + m)
    closing = [*position, *rows]
    return Equations(of.states, above.col_join(below), of.forcing.col_join(gamma), closing)
