"""Andrews' squeezing mechanism by its published equations: Hairer & Wanner (1996), Solving ODEs II,
section VII.7: M(q) q'' = f(q, q') - G^T lambda, g(q) = 0, seven angles, six constraints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mpmath
import sympy
from mechc_codegen.library.planar.andrews import ANGLES, INERTIAS, LENGTHS, MASSES, PIVOTS
from mpmath import mpf
from sympy import Expr, Matrix, Symbol, cos, sin, sqrt, zeros

from ...formulations.program import program
from ..arithmetic import DIGITS, FUNCTIONS, Vector, numbers, solution
from ..extrapolation import by_extrapolation
from ..motions import refuse_rounded_numbers

NAMES = (*LENGTHS, *PIVOTS, *(f"m_{k}" for k in range(1, 8)), *(f"I_{k}" for k in range(1, 8)))
NUMBERS = (*LENGTHS.values(), *PIVOTS.values(), *MASSES, *INERTIAS)
DEFAULTS = dict(zip(NAMES, NUMBERS, strict=True)) | {"T": 0.033, "c": 4530.0, "l_0": 0.07785}
GUESS = ("-0.0617", "0", "0.4553", "0.2227", "0.4874", "-0.2227", "1.2305")
Q, V = (sympy.symbols([f"{name}{rate}" for name in ANGLES]) for rate in ("", "_dot"))
P = {name: Symbol(name) for name in DEFAULTS}


def mass_matrix() -> Matrix:
    s, (_, Theta, _, Phi, _, Omega, _) = P, Q
    m, I = ([s[f"{x}_{k}"] if k else None for k in range(8)] for x in "mI")
    at, to = s["e"] - s["ea"], s["zf"] - s["fa"]
    M = zeros(7, 7)
    M[0, 0] = (m[1] * s["ra"] ** 2 + m[2] * (s["rr"] ** 2 - 2 * s["da"] * s["rr"] * cos(Theta)
               + s["da"] ** 2) + I[1] + I[2])  # fmt: skip
    M[0, 1] = M[1, 0] = m[2] * (s["da"] ** 2 - s["da"] * s["rr"] * cos(Theta)) + I[2]
    M[1, 1] = m[2] * s["da"] ** 2 + I[2]
    M[2, 2] = m[3] * (s["sa"] ** 2 + s["sb"] ** 2) + I[3]
    M[3, 3] = m[4] * at**2 + I[4]
    M[3, 4] = M[4, 3] = m[4] * (at**2 + s["zt"] * at * sin(Phi)) + I[4]
    M[4, 4] = (m[4] * (s["zt"] ** 2 + 2 * s["zt"] * at * sin(Phi) + at**2)
               + m[5] * (s["ta"] ** 2 + s["tb"] ** 2) + I[4] + I[5])  # fmt: skip
    M[5, 5] = m[6] * to**2 + I[6]
    M[5, 6] = M[6, 5] = m[6] * (to**2 - s["u"] * to * sin(Omega)) + I[6]
    M[6, 6] = (m[6] * (to**2 - 2 * s["u"] * to * sin(Omega) + s["u"] ** 2)
               + m[7] * (s["ua"] ** 2 + s["ub"] ** 2) + I[6] + I[7])  # fmt: skip
    return M


def forces() -> Matrix:
    s, (_, Theta, gamma, Phi, _, Omega, _) = P, Q
    beta_, Theta_, _, Phi_, delta_, Omega_, epsilon_ = V
    m2, m4, m6, at, to = s["m_2"], s["m_4"], s["m_6"], s["e"] - s["ea"], s["zf"] - s["fa"]
    x = s["sd"] * cos(gamma) + s["sc"] * sin(gamma) + s["xb"] - s["xc"]
    y = s["sd"] * sin(gamma) - s["sc"] * cos(gamma) + s["yb"] - s["yc"]
    length = sqrt(x**2 + y**2)
    pull = -s["c"] * (length - s["l_0"]) / length
    return Matrix([
        s["T"] - m2 * s["da"] * s["rr"] * Theta_ * (Theta_ + 2 * beta_) * sin(Theta),
        m2 * s["da"] * s["rr"] * beta_**2 * sin(Theta),
        pull * x * (s["sc"] * cos(gamma) - s["sd"] * sin(gamma))
        + pull * y * (s["sd"] * cos(gamma) + s["sc"] * sin(gamma)),
        m4 * s["zt"] * at * delta_**2 * cos(Phi),
        -m4 * s["zt"] * at * Phi_ * (Phi_ + 2 * delta_) * cos(Phi),
        -m6 * s["u"] * to * epsilon_**2 * cos(Omega),
        m6 * s["u"] * to * Omega_ * (Omega_ + 2 * epsilon_) * cos(Omega),
    ])  # fmt: skip


def constraints() -> Matrix:
    s, (beta, Theta, gamma, Phi, delta, Omega, epsilon) = P, Q
    x = s["rr"] * cos(beta) - s["d"] * cos(beta + Theta)
    y = s["rr"] * sin(beta) - s["d"] * sin(beta + Theta)
    return Matrix([
        x - s["ss"] * sin(gamma) - s["xb"],
        y + s["ss"] * cos(gamma) - s["yb"],
        x - s["e"] * sin(Phi + delta) - s["zt"] * cos(delta) - s["xa"],
        y + s["e"] * cos(Phi + delta) - s["zt"] * sin(delta) - s["ya"],
        x - s["zf"] * cos(Omega + epsilon) - s["u"] * sin(epsilon) - s["xa"],
        y - s["zf"] * sin(Omega + epsilon) + s["u"] * cos(epsilon) - s["ya"],
    ])  # fmt: skip


def squeezed() -> Callable[[Mapping[str, Any], float], Vector]:
    """The end (14,) of the motion from rest with the angle Theta and parameters by name."""
    g = constraints()
    G = g.jacobian(Q)
    bend = (G * Matrix(V)).jacobian(Q) * Matrix(V)
    arguments = [*Q, *V, *P.values()]
    terms = _function(arguments, _rows(G, bend))
    closing = _function(arguments, [*g])

    def end(given: Mapping[str, Any], t: float) -> Vector:
        p = [mpf(given.get(name, value)) for name, value in DEFAULTS.items()]
        still = [mpf(0)] * 7

        def gap(*others: Any) -> Vector:
            q = [others[0], given["Theta"], *others[1:]]
            return closing(*q, *still, *p)  # type: ignore[no-any-return]

        guess = [mpf(x) for k, x in enumerate(GUESS) if k != 1]
        beta, *others = mpmath.findroot(gap, guess, tol=mpf(10) ** (10 - 2 * DIGITS))
        start, own = numbers([beta, given["Theta"], *others, *still]), numbers(p)
        return by_extrapolation(lambda y: _rates(terms(*y, *own), y), start, (t,), "0.001")[-1]

    return end


def _rows(G: Matrix, bend: Matrix) -> list[Expr]:
    """[M G^T f; G 0 -bend], row by row."""
    above = mass_matrix().row_join(G.T).row_join(forces())
    return [*above.col_join(G.row_join(zeros(6, 6)).row_join(-bend))]


def _function(arguments: list[Expr], outputs: list[Any]) -> Callable[..., Any]:
    made = program(arguments, outputs)
    refuse_rounded_numbers(made)
    return made.function(FUNCTIONS)


def _rates(values: Vector, y: Vector) -> Vector:
    return [*y[7:], *solution([values[k : k + 14] for k in range(0, 13 * 14, 14)])[:7]]
