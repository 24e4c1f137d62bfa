"""The second way to the derivatives of ``data/sensitivities.json``: other equations, differentiated
by dual numbers and solved by Gauss's collocation (gauss.py).

The pendulum is a point in x and y with its rod's force; the regular four-bar, the bicycle and
Andrews' mechanism have the equations that SymPy's KanesMethod forms of the open tree, with
multipliers; the four-bar with a change point its tangent form, around the change point through
complex times; the stiff masses have the divided differences of their modes (Daleckii and Krein);
the struck pendulum moves each strike's time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mpmath
from mechc_codegen.library.planar.andrews import andrews
from mechc_codegen.library.planar.four_bar import four_bar
from mechc_codegen.library.spatial.bicycle import bicycle, values
from mpmath import mpc, mpf

from ...formulations.described import described
from ...formulations.equations import Equations, derive
from ...problems.bicycle import COORDINATES, NAMES, SPEEDS
from ..arithmetic import DIGITS, Vector, number, numbers
from ..motions import rates_of_tree
from ..tangent import TangentBar
from .dual_numbers import FUNCTIONS, Dual, cos, of_mpmath_dual, quick, sin, solved
from .gauss import Equations as Rates
from .gauss import along
from .struck import struck_in_dual_numbers

Given = Mapping[str, Any]
REAL = mpf(10) ** -24  # imaginary parts that are errors of integration
Second = Callable[[Given, float], Vector]  # the end as dual numbers


def seeds(given: Given, by: Sequence[str]) -> dict[str, Dual]:
    """What is given, exactly, with derivatives by these names."""
    return {
        name: Dual(mpf(value), [mpf(int(name == each)) for each in by])
        for name, value in given.items()
    }


# -- equations of the open tree -------------------------------------------------------------------


def of_tree(
    equations: Equations, parameters: Mapping[str, Any], held: Mapping[int, Any], guess: Vector,
    t: float, longest: str,
) -> Vector:  # fmt: skip
    """The end of a motion; of its start the places in ``held`` are given, the others follow."""
    width = len(equations.state)
    names = [p.name for p in equations.parameters]
    one = next(x for x in [*held.values(), *parameters.values()] if isinstance(x, Dual))
    own = [parameters[name] for name in names]
    values = [x if isinstance(x, Dual) else Dual(mpf(x), [mpf(0)] * len(one.slopes)) for x in own]
    free = [k for k in range(width) if k not in held]
    closing = equations.constraints().function(FUNCTIONS)

    def residual(unknown: Vector, given: Vector) -> Vector:
        state = dict(zip(free, unknown, strict=True)) | dict(zip(held, given, strict=False))
        return closing(*(state[k] for k in range(width)), *given[len(held) :])

    given = [*held.values(), *values]
    plain = [x.value for x in given]
    start = guess
    if free:
        found = mpmath.findroot(
            lambda *x: residual(list(x), plain), [guess[k] for k in free],
            tol=mpf(10) ** (10 - 2 * DIGITS),
        )  # fmt: skip
        start = solved(residual, list(found), given)
    state = dict(zip(free, start, strict=False)) | dict(held)
    start = [state[k] for k in range(width)]
    return along(rates_of_tree(equations), values, start, mpf(t), longest)


def regular_four_bar(given: Given, t: float) -> Vector:
    mechanism = four_bar()
    lengths = {f"l_{k}": mpf(k + 1) for k in range(3)} | {"l_3": given["l_3"]}
    masses = {"m_0": mpf(1), "m_1": given["m_1"], "m_2": mpf(3)}
    inertias = {f"I_{k}": masses[f"m_{k}"] * (lengths[f"l_{k}"] ** 2 / 12) for k in range(3)}
    parameters = lengths | masses | inertias | {"g": given["g"]}
    guess = [mpf(x) for x in (0, "0.7", "-0.9", 0, 0, 0)]
    held = {0: given["theta_0"], 3: given["omega_0"]}
    return of_tree(derive(mechanism, {}), parameters, held, guess, t, "0.045")


def rolling_bicycle(given: Given, t: float) -> Vector:
    equations = derive(described(bicycle(), values()), {})
    none = [mpf(0)] * len(given["roll"].slopes)
    known = COORDINATES | SPEEDS
    held = {NAMES.index(name): Dual(mpf(x), none) for name, x in known.items()}
    held |= {NAMES.index(name): x for name, x in given.items()}
    guess = [mpf(0)] * len(equations.state)
    guess[7] = mpmath.pi / 10
    return of_tree(equations, values(), held, guess, t, "0.05")


def squeezer(given: Given, t: float) -> Vector:
    mechanism = andrews()
    parameters = {p.symbol.name: mpf(p.default) for p in mechanism.parameters}
    parameters |= {name: given[name] for name in given if name in parameters}
    guess = [mpf(x) for x in ("-0.0617", 0, "0.4553", "0.2227", "0.4874", "-0.2227", "1.2305")]
    none = [mpf(0)] * len(given["Theta"].slopes)
    held = {1: given["Theta"], 7: Dual(mpf(0), none)}
    return of_tree(derive(mechanism, {}), parameters, held, [*guess, *[mpf(0)] * 7], t, "0.0005")


# -- forms of their own ---------------------------------------------------------------------------


def pendulum(given: Given, t: float) -> Vector:
    """x'' = -k x, y'' = -k y - g with k = (x'^2 + y'^2 - g y) / l^2; y upwards from the pivot."""
    l, g, q, u = given["l_0"], given["g"], given["theta_0"], given["omega_0"]

    def equations(given: Vector) -> Rates:
        l, g = given

        def rates(state: Vector) -> Vector:
            x, y, vx, vy = state
            k = (vx * vx + vy * vy - g * y) / (l * l)
            return [vx, vy, -(k * x), -(k * y) - g]

        return rates

    start = [l * sin(q), -(l * cos(q)), l * cos(q) * u, l * sin(q) * u]
    x, y, vx, vy = along(equations, [l, g], start, mpf(t), "0.1")
    turn = (x * vy - y * vx) / (l * l)
    angle = mpmath.atan2(x.value, -y.value)
    slopes = [(x.value * dy - y.value * dx) / l.value**2
              for dx, dy in zip(x.slopes, y.slopes, strict=True)]  # fmt: skip
    return [Dual(angle, slopes), turn]


LENGTHS = (1, 2, 3, 4)
# Of complex times: around the passages of the change point at 0.775 and 1.508 s.
PATH = tuple(mpc(*map(mpf, at)) for at in (("0.55", "0"), ("0.775", "0.15"), ("1.0", "0"),
             ("1.28", "0"), ("1.508", "0.15"), ("1.73", "0")))  # fmt: skip


def change_point_four_bar(given: Given, t: float) -> Vector:
    lengths = [mpf(x) for x in LENGTHS]
    count = len(given["g"].slopes)

    def closure(q: Vector, given: Vector) -> Vector:
        angles = [given[0], *q]
        sums = [sum(f(a) * l for a, l in zip(angles, lengths, strict=False)) for f in (cos, sin)]
        return [sums[0] - lengths[3], sums[1]]

    theta = given["theta_0"]
    found = mpmath.findroot(
        lambda *x: closure(list(x), [theta.value]), (mpf("0.5"), mpf("-0.7")),
        tol=mpf(10) ** (10 - 2 * DIGITS),
    )  # fmt: skip
    q = [theta, *solved(closure, list(found), [theta])]
    y, now = [*q, Dual(mpf(0), [mpf(0)] * count)], mpf(0)
    by = [given["m_1"], given["g"]]
    for corner in (*PATH, mpf(t)):
        y, now = along(lambda p: _bar(*p).rates, by, y, corner - now, "0.013"), corner
    state = _bar(*map(quick, by)).state([quick(x) for x in y])
    end = [_real(of_mpmath_dual(x)) for x in state]
    return [*(_without_turns(x) for x in end[:3]), *end[3:]]


def _bar(m_1: Any, g: Any) -> TangentBar:
    masses = [number(1), m_1, number(3)]
    return TangentBar(numbers(LENGTHS), masses, g, number=lambda x: x, sin=sin, cos=cos)


def _without_turns(angle: Dual) -> Dual:
    return angle - 2 * mpmath.pi * mpmath.nint(angle.value / (2 * mpmath.pi))


def _real(x: Dual) -> Dual:
    """A number at a real time, whose imaginary part is rounding."""
    left = max(abs(mpmath.im(each)) for each in (x.value, *x.slopes))
    if left > REAL * max(1, *map(abs, x.slopes)):
        raise ArithmeticError(f"an imaginary part of {mpmath.nstr(left, 3)} is left")
    return Dual(mpmath.re(x.value), [mpmath.re(d) for d in x.slopes])


def stiff_masses(given: Given, t: float) -> Vector:
    """exp(A t) y0 in the modes of A; (exp A t)' there is A' times divided differences."""
    m, k = [given["m_0"], mpf(2)], [given["k_0"], given["k_1"]]
    c, count = given["c"], len(given["c"].slopes)
    none = Dual(mpf(0), [mpf(0)] * count)
    one = none + 1
    rows = [
        [none, none, one, none], [none, none, none, one],
        [-(k[0] + k[1]) / m[0], k[1] / m[0], -c / m[0], c / m[0]],
        [k[1] / m[1], -k[1] / m[1], c / m[1], -c / m[1]],
    ]  # fmt: skip
    start = [given["x_0"], given["x_1"], given["v_0"], none]
    A = mpmath.matrix([[x.value for x in row] for row in rows])
    y0 = mpmath.matrix([x.value for x in start])
    modes, V = mpmath.eig(A)
    W = V**-1
    end = V * _scaled([mpmath.exp(x * t) for x in modes], W * y0)
    columns = []
    for d in range(count):
        slope = W * mpmath.matrix([[x.slopes[d] for x in row] for row in rows]) * V
        for i in range(4):
            for j in range(4):
                slope[i, j] *= _divided(modes[i], modes[j], t)
        own = V * _scaled([mpmath.exp(x * t) for x in modes],
                          W * mpmath.matrix([x.slopes[d] for x in start]))  # fmt: skip
        columns.append(V * slope * W * y0 + own)
    return [_real(Dual(end[i], [column[i] for column in columns])) for i in range(4)]


def _scaled(factors: Vector, vector: Any) -> Any:
    return mpmath.matrix([f * x for f, x in zip(factors, vector, strict=True)])


def _divided(a: Any, b: Any, t: float) -> Any:
    """The divided difference of exp(x t)."""
    return t * mpmath.exp(a * t) if a == b else (mpmath.exp(a * t) - mpmath.exp(b * t)) / (a - b)


SECOND: dict[str, Second] = {
    "pendulum": pendulum, "four_bar_regular": regular_four_bar,
    "four_bar_change_point": change_point_four_bar, "bicycle": rolling_bicycle,
    "stiff_masses": stiff_masses, "andrews": squeezer, "struck_pendulum": struck_in_dual_numbers,
}  # fmt: skip
