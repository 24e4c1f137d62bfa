"""Derivatives of motions to 30 digits, in two ways that share nothing with each other or with
the runtime.

First way: each motion is computed in 50 digits (extrapolation.py) from four values beside the one
that it is differentiated by; their central difference of fourth order is off by about 1e-35.  The
pendulum has Lagrange's equation by hand, the regular four-bar its tangent form (tangent.py), the
one with a change point the rational curve of its closure (a coordinate that runs straight through
the crossing), the bicycle Kane's equations with dependent speeds, Andrews' mechanism its published
equations (squeezer.py).  Second way: variational.py.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import mpmath
from mechc_codegen.library.spatial.bicycle import bicycle, values
from mpmath import mpc, mpf

from ...formulations.described import described
from ...formulations.equations import derive
from ...problems.data import reference
from ..arithmetic import (
    DIGITS,
    FUNCTIONS,
    Vector,
    agreed,
    cos,
    number,
    numbers,
    of_mpmath,
    sin,
    texts,
)
from ..extrapolation import Rates, by_extrapolation
from ..motions import bicycle_reduced, bicycle_start
from ..tangent import PAIRS, TangentBar, elbow_up
from .squeezer import squeezed
from .struck import BY, END, GIVEN, TORQUES, struck
from .variational import SECOND, seeds

STEP = mpf(10) ** -9  # of the size of what is given
WRITTEN = 32  # digits
Given = Mapping[str, Any]


@dataclass(frozen=True)
class Family:
    """A motion's end as a function of what is given; the derivatives wanted of it."""

    source: str
    given: Given
    end: Callable[[Given], Vector]
    t: float
    by: tuple[str, ...]


def at(family: Family, given: Given) -> Vector:
    """The end in numbers of mpmath."""
    return [of_mpmath(x) for x in family.end(given)]


def derivative(family: Family, name: str) -> Vector:
    """By the central difference of fourth order."""
    exact = {key: mpf(value) for key, value in family.given.items()}
    step = STEP * (abs(exact[name]) or 1)
    ends = [at(family, exact | {name: exact[name] + k * step}) for k in (-2, -1, 1, 2)]
    return [(a - 8 * b + 8 * c - d) / (12 * step) for a, b, c, d in zip(*ends, strict=True)]


def sensitivities(processes: int = 1) -> dict[str, Any]:
    """Of every family: what is given, the end, its derivatives, as text, and on how many digits
    both ways agree; the least of these."""
    with _workers(processes) as workers:
        parts = {name: _parts(workers, name) for name in reversed(FAMILIES)}  # the longest first
        found: dict[str, Any] = {name: _computed(name, parts[name]) for name in FAMILIES}
    found["digits"] = min(found[name]["digits"] for name in FAMILIES)
    return found


def confirmed(name: str) -> dict[str, Any]:
    """The data as they are written, one family compared with its second way, which is computed
    again; this takes a fraction of what both ways of all do."""
    found: dict[str, Any] = dict(reference("sensitivities"))
    family = found[name]
    written = [[mpf(x) for x in each] for each in (family["end"], *family["by"].values())]
    found[name] = family | {"digits": _agreed(name, written, _part(name, SECOND_WAY))}
    found["digits"] = min(found[each]["digits"] for each in FAMILIES)
    return found


def computed(name: str) -> dict[str, Any]:
    """One family."""
    with _workers(1) as workers:
        return _computed(name, _parts(workers, name))


# -- parts of the work ----------------------------------------------------------------------------

END_ALONE, SECOND_WAY = "the end", "the second way"


class _Here(Executor):
    """No other process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        done: Future[Any] = Future()
        done.set_result(fn(*args, **kwargs))
        return done


def _workers(processes: int) -> Executor:
    return _Here() if processes == 1 else ProcessPoolExecutor(processes)


def _parts(workers: Executor, name: str) -> list[Future[list[Vector]]]:
    """Begin all of one family: the second way, the end, its derivatives."""
    wanted = (SECOND_WAY, END_ALONE, *made(name).by)
    return [workers.submit(_part, name, which) for which in wanted]


def _part(name: str, which: str) -> list[Vector]:
    """The end alone, its derivative by a name, or all of these in the second way."""
    family = made(name)
    if which == SECOND_WAY:
        end = SECOND[name](seeds(family.given, family.by), family.t)
        return _columns(end, len(family.by))
    if which == END_ALONE:
        return [at(family, {key: mpf(value) for key, value in family.given.items()})]
    return [derivative(family, which)]


def _columns(end: Vector, count: int) -> list[Vector]:
    """The end, and its derivatives one after the other."""
    return [[x.value for x in end], *([x.slopes[k] for x in end] for k in range(count))]


def _computed(name: str, parts: list[Future[list[Vector]]]) -> dict[str, Any]:
    second, *others = (part.result() for part in parts)
    family, first = made(name), [one for (one,) in others]
    digits = _agreed(name, first, second)
    written = min(digits, WRITTEN)
    return {
        "source": family.source, "t": family.t, "given": dict(family.given), "digits": digits,
        "end": texts(first[0], written),
        "by": {by: texts(x, written) for by, x in zip(family.by, first[1:], strict=True)},
    }  # fmt: skip


def _agreed(name: str, first: Sequence[Vector], second: Sequence[Vector]) -> int:
    """On how many digits both ways agree, of the end and its derivatives."""
    digits = agreed(first, second, by_row=True)
    print(f"{name}: both ways agree on {digits} digits", flush=True)
    return digits


# -- pendulum -------------------------------------------------------------------------------------


def pendulum() -> Family:
    def end(given: Given) -> Vector:
        pull = number(given["g"] / given["l_0"])
        start = numbers([given["theta_0"], given["omega_0"]])
        t = 3.0
        return by_extrapolation(lambda y: [y[1], -pull * sin(y[0])], start, (t,), "0.2")[-1]

    given = {"theta_0": 1.0, "omega_0": 0.5, "l_0": 1.25, "g": 9.81}
    return Family("a point mass on a massless link", given, end, 3.0, tuple(given))


# -- four-bars ------------------------------------------------------------------------------------

LENGTHS, MASSES = (1.0, 2.0, 3.0), (1.0, 2.0, 3.0)
SPREAD, IMAGINARY = number(mpmath.sqrt(mpf(2) / 3)), number(mpc(0, 1))


def regular_four_bar() -> Family:
    t = 2.0

    def end(given: Given) -> Vector:
        lengths = [mpf(x) for x in LENGTHS] + [given["l_3"]]
        masses = [mpf(MASSES[0]), given["m_1"], mpf(MASSES[2])]
        bar = TangentBar(
            numbers(lengths), numbers(masses), given["g"], number=number, sin=sin, cos=cos
        )
        q = numbers(elbow_up(given["theta_0"], lengths))
        pace = number(given["omega_0"]) / bar.normal(q)[0]
        return bar.state(by_extrapolation(bar.rates, [*q, pace], (t,), "0.1")[-1])

    given = {"theta_0": 1.4835, "omega_0": 0.3, "l_3": 3.5, "m_1": 2.0, "g": 9.81}
    return Family("four-bar of thin rods, 1, 2, 3 and 3.5 m", given, end, t, tuple(given))


def change_point_four_bar() -> Family:
    t = 2.0

    def end(given: Given) -> Vector:
        masses = [mpf(MASSES[0]), given["m_1"], mpf(MASSES[2])]
        bar = TangentBar(numbers(LENGTHS), numbers(masses), given["g"], number=number)
        start = numbers([_psi(given["theta_0"]), 0])
        psi, rate = by_extrapolation(lambda y: _on_curve(bar, y), start, (t,), "0.05")[-1]
        z, n, _ = _curve(psi)
        return [*(mpmath.arg(of_mpmath(x)) for x in z), *(rate * x for x in n)]

    given = {"theta_0": 1.4835298641951802, "m_1": 2.0, "g": 9.81}
    source = "four-bar of thin rods, 1, 2, 3 and 4 m, from rest through its first change point"
    return Family(source, given, end, t, tuple(given))


def _curve(psi: Any) -> tuple[Vector, Vector, Vector]:
    """The links' directions as complex numbers, and their angles' first two derivatives."""
    turn = SPREAD * (cos(psi) + IMAGINARY * sin(psi))
    kappa, first, second = turn - 1, IMAGINARY * turn, -turn
    N, D = 1 + 6 * kappa + 3 * kappa**2, 4 * kappa + 6 * kappa**2
    dN, dD = 6 + 6 * kappa, 4 + 12 * kappa
    q, dq = dN * D - N * dD, 6 * D - 12 * N
    p, dp, ddp = -N / D, -q / D**2, -(dq * D - 2 * q * dD) / D**3
    by_kappa = [(p, dp, ddp), (kappa * p, p + kappa * dp, 2 * dp + kappa * ddp)]
    z = [(1 + f, df * first, ddf * first**2 + df * second) for f, df, ddf in by_kappa]
    crank = tuple((4 if k == 0 else 0) - 2 * z[0][k] - 3 * z[1][k] for k in range(3))
    z = [crank, *z]
    n = [(df / f).imag for f, df, _ in z]
    dn = [(ddf / f - (df / f) ** 2).imag for f, df, ddf in z]
    return [f for f, *_ in z], n, dn


def _on_curve(bar: TangentBar, y: Vector) -> Vector:
    """psi' and psi'' of A psi'' + A' psi'^2 / 2 + V' = 0."""
    psi, rate = y
    z, n, dn = _curve(psi)
    turns = [z[i] * z[j].conjugate() for i, j in PAIRS]
    between = [(turn.real, turn.imag) for turn in turns]
    return [rate, bar.acceleration(rate, n, dn, between, [f.real for f in z])]


def _psi(theta: Any) -> Any:
    """Where the crank has this angle, with the elbow up."""
    wanted = elbow_up(theta, [mpf(x) for x in (*LENGTHS, 4.0)])

    def links(psi: Any) -> Vector:
        return [of_mpmath(z) for z in _curve(number(psi))[0]]

    def miss(psi: Any) -> Any:
        return sum(abs(z - mpmath.expj(x)) for z, x in zip(links(psi), wanted, strict=True))

    near = min((2 * mpmath.pi * k / 720 for k in range(720)), key=miss)
    off = lambda psi: mpmath.im(links(psi)[0] * mpmath.expj(-theta))  # noqa: E731
    return mpmath.findroot(off, (near, near + mpf("1e-3")), tol=mpf(10) ** (8 - 2 * DIGITS))


# -- bicycle --------------------------------------------------------------------------------------


def rolling_bicycle() -> Family:
    t = 0.5

    def end(given: Given) -> Vector:
        closing, parameters, rates = _bicycle()
        start = bicycle_start(closing, parameters, given)
        return by_extrapolation(rates, numbers(start), (t,), "0.1")[-1]

    source = "the bicycle of benchmarks/problems/bicycle.py; states in the order of its NAMES"
    given = {"roll": 0.1, "roll_rate": 0.5, "steer_rate": -0.4}
    return Family(source, given, end, t, ("roll", "steer_rate"))


@cache
def _bicycle() -> tuple[Callable[..., Vector], Vector, Rates]:
    """Its constraints, their parameters, and its rates."""
    method = bicycle()
    constraints = derive(described(method, values()), {})
    parameters = [mpf(values()[p.name]) for p in constraints.parameters]
    return constraints.constraints().function(FUNCTIONS), parameters, bicycle_reduced(method)


# -- a stiff scene --------------------------------------------------------------------------------


def stiff_masses() -> Family:
    """M x'' = -K x - C x': the end by the exponential of the matrix of its first-order form."""
    t = 1.0

    def end(given: Given) -> Vector:
        m, k, c = [given["m_0"], mpf(MASSES[1])], [given["k_0"], given["k_1"]], given["c"]
        rates = mpmath.zeros(4)
        for i in range(2):
            rates[i, 2 + i] = mpf(1)
            other, way = 1 - i, 1 if i == 0 else -1
            rates[2 + i, 0] = -(k[0] * (i == 0) + way * k[1]) / m[i]
            rates[2 + i, 1] = way * k[1] / m[i]
            rates[2 + i, 2 + i], rates[2 + i, 2 + other] = -c / m[i], c / m[i]
        start = mpmath.matrix([given["x_0"], given["x_1"], given["v_0"], mpf(0)])
        return list(mpmath.expm(rates * t, method="pade") * start)

    given = {
        "x_0": 0.3, "x_1": 0.3, "v_0": 0.2, "m_0": 1.0, "k_0": 10.0, "k_1": 1e6, "c": 1e3,
    }  # fmt: skip
    source = "two masses on a soft and a stiff spring, damped: benchmarks/stability/stiff.py"
    return Family(source, given, end, t, ("x_0", "v_0", "m_0", "k_0"))


# -- Andrews' squeezing mechanism, a struck pendulum ----------------------------------------------


def andrews() -> Family:
    end, t = squeezed(), 0.009
    given = {"Theta": 0.0, "T": 0.033, "rr": 0.007}
    source = "Andrews' squeezing mechanism by its published equations, from rest: squeezer.py"
    return Family(source, given, partial(end, t=t), t, tuple(given))


def struck_pendulum() -> Family:
    source = "a pendulum that strikes a wall three times under a torque that jumps: struck.py"
    return Family(source, GIVEN | {"F[1]": TORQUES[1]}, struck, END, BY)


FAMILIES: dict[str, Callable[[], Family]] = {
    "pendulum": pendulum, "four_bar_regular": regular_four_bar,
    "four_bar_change_point": change_point_four_bar, "bicycle": rolling_bicycle,
    "stiff_masses": stiff_masses, "andrews": andrews, "struck_pendulum": struck_pendulum,
}  # fmt: skip


@cache
def made(name: str) -> Family:
    """Once in a process: some derive equations."""
    return FAMILIES[name]()
