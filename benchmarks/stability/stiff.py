"""Springs so stiff that they are all but rigid: linear ones against their modes, others the limit.

``two_masses``: a mass on a soft spring carries another on a stiff one with a damper; a linear
system, whose exact motion is that of its four modes in 60 digits.  ``elbow``: a double pendulum
whose elbow a stiff spring and damper keep straight; as the stiffness grows it becomes a rigid
pendulum, whose motion the Jacobi functions give, and is off it by the bend M / k.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import mpmath as mp
import numpy as np
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.library.parts import (
    coordinates,
    fixed_point,
    locate,
    parameter,
    speeds,
    weight,
)
from mechc_codegen.library.spatial.flyball_governor import flyball_governor
from sympy import symbols
from sympy.physics.mechanics import Particle, ReferenceFrame, dynamicsymbols

import mechc

from ..problems.data import reference
from ..timing.cases import Array
from .judge import Row, limit_of, runs, speeds_apart, verdict
from .long_runs import swing

METHODS = ("auto", "radau5")
RTOLS = (1e-4, 1e-6, 1e-8, 1e-10)
STIFFNESSES = (1e2, 1e4, 1e6, 1e8, 1e10, 1e12)
SOFT, MASSES = 10.0, (1.0, 2.0)
LENGTH, G = 1.0, 9.81
CONDITION = 10.0
TURNED = 2e3  # rad, through which an undamped fast mode is followed
FAST_CONDITION = 0.1 * TURNED  # its velocity is a tenth of a metre a second at most
BENT = 30.0  # times M / k, what the straight pendulum's moment M bends the elbow by


def springs(quick: bool) -> Iterator[Row]:
    rtols = (1e-6,) if quick else RTOLS
    some = STIFFNESSES[1::4] if quick else STIFFNESSES
    yield from _linear(some, rtols)
    yield from _straight([k for k in some if k >= 1e6], rtols)
    yield from _governor(rtols)


# -- two masses on a line -------------------------------------------------------------------------


def two_masses() -> Mechanism:
    """Places x_0 and x_1 of two masses from where their springs are at rest."""
    x, v = dynamicsymbols("x_0:2"), dynamicsymbols("v_0:2")
    m, k, c = symbols("m_0:2"), symbols("k_0:2"), symbols("c")
    r = ReferenceFrame("r")
    origin = fixed_point("O", r)
    points = [origin.locatenew(f"P_{i}", x[i] * r.x) for i in range(2)]
    for point, rate in zip(points, v, strict=True):
        point.set_vel(r, rate * r.x)
    between = (k[1] * (x[1] - x[0]) + c * (v[1] - v[0])) * r.x
    return Mechanism(
        name="two_masses",
        title="Two masses on a soft and a stiff spring",
        frame=r,
        origin=origin,
        coordinates=coordinates(x, "m", "place of the first mass", "place of the second"),
        speeds=speeds(v, "m/s", "velocity of the first mass", "velocity of the second"),
        kinematics=tuple(v),
        parameters=(
            *(parameter(m[i], MASSES[i], "kg", f"mass {i}", positive=True) for i in range(2)),
            parameter(k[0], SOFT, "N/m", "stiffness of the soft spring"),
            parameter(k[1], 1e6, "N/m", "stiffness of the stiff spring"),
            parameter(c, 0.0, "N s/m", "damping between the masses"),
        ),
        bodies=tuple(Particle(f"mass_{i}", points[i], m[i]) for i in range(2)),
        loads=((points[0], -k[0] * x[0] * r.x + between), (points[1], -between)),
        points=(origin, *points),
    )


def modes(stiffness: float, damping: float, y0: Array, t: float) -> Array:
    """The exact state at t: y' = A y by the eigenvectors of A, in 60 digits."""
    with mp.workdps(60):
        (m0, m1), k, c = MASSES, mp.mpf(stiffness), mp.mpf(damping)
        A = mp.matrix([
            [0, 0, 1, 0], [0, 0, 0, 1],
            [-(SOFT + k) / m0, k / m0, -c / m0, c / m0],
            [k / m1, -k / m1, c / m1, -c / m1],
        ])  # fmt: skip
        values, vectors = mp.eig(A)
        shares = mp.lu_solve(vectors, mp.matrix([mp.mpf(x) for x in y0]))
        grown = mp.matrix([s * mp.exp(value * t) for s, value in zip(shares, values, strict=True)])
        return np.array([float(mp.re(x)) for x in vectors * grown])


def _linear(stiffnesses, rtols):  # type: ignore[no-untyped-def]
    """From a stretch of both springs; damped a tenth of, and beyond, what is critical, or not."""
    model = _model(two_masses)
    for k in stiffnesses:
        reduced = MASSES[0] * MASSES[1] / sum(MASSES)
        for ratio in (0.0, 0.1, 10.0):
            c = ratio * 2 * float(np.sqrt(k * reduced))
            t_end = 2.0 if ratio else min(2.0, TURNED * float(np.sqrt(reduced / k)))
            y0 = np.array([0.3, 0.3 + 0.1 / k**0.5, 0.0, 0.0])
            exact = modes(k, c, y0, t_end)
            params = {"k_1": k, "c": c}
            for how, _, rtol, found in runs(model, t_end, y0, params, methods=METHODS, rtols=rtols):
                case = f"two masses, {k:g} N/m, damping {ratio:g}, {how}"
                limit = limit_of(rtol, CONDITION if ratio else FAST_CONDITION)
                yield verdict(case, found, exact, limit, speeds_apart(exact, 2))


# -- an elbow kept straight -----------------------------------------------------------------------


def elbow() -> Mechanism:
    """Two links of 1 m with masses of 1 kg at their ends; phi is the bend of the elbow."""
    (theta, phi), (omega, nu) = q, u = dynamicsymbols("theta phi"), dynamicsymbols("omega nu")
    k, c = symbols("k c")
    r = ReferenceFrame("r")
    origin = fixed_point("O", r)
    upper = r.orientnew("upper", "Axis", (theta, r.z))
    lower = upper.orientnew("lower", "Axis", (phi, r.z))
    upper.set_ang_vel(r, omega * r.z)
    lower.set_ang_vel(upper, nu * r.z)
    joint = locate("E", origin, -LENGTH * upper.y, upper, r)
    end = locate("F", joint, -LENGTH * lower.y, lower, r)
    bobs = (Particle("first", joint, 1), Particle("second", end, 1))
    torque = (k * phi + c * nu) * r.z
    return Mechanism(
        name="elbow",
        title="Double pendulum with a stiff elbow",
        frame=r,
        origin=origin,
        coordinates=coordinates(q, "rad", "angle of the upper link", "bend of the elbow"),
        speeds=speeds(u, "rad/s", "rate of the upper link", "rate of the bend"),
        kinematics=(omega, nu),
        parameters=(
            parameter(k, 1e6, "N m", "stiffness of the elbow"),
            parameter(c, 0.0, "N m s", "damping of the elbow"),
        ),
        bodies=bobs,
        loads=(*(weight(bob, origin, G, r.y) for bob in bobs), (upper, torque), (lower, -torque)),
        points=(origin, joint, end),
    )


def straight(theta: float, t: float) -> Array:
    """The rigid limit from rest: masses at 1 and 2 m swing as a pendulum of 5/3 m."""
    with mp.workdps(30):
        pace = 1 / mp.sqrt(mp.mpf(5) / 3 * LENGTH)  # of the pendulum of 1 m
        angle, rate = swing(mp.mpf(theta), pace * t)
        return np.array([angle, 0.0, float(pace * rate), 0.0])


def _straight(stiffnesses, rtols):  # type: ignore[no-untyped-def]
    model = _model(elbow)
    for k in stiffnesses:
        # the damper is critical for the elbow's own vibration, whose inertia is at most 2 kg m^2
        params = {"k": k, "c": 2 * float(np.sqrt(2 * k))}
        y0 = np.array([1.0, 0, 0, 0])
        for how, _, rtol, found in runs(model, 3.0, y0, params, methods=METHODS, rtols=rtols):
            limit = limit_of(rtol, CONDITION) + BENT * 2 * G * LENGTH / k
            yield verdict(f"elbow, {k:g} N m, {how}", found, straight(1.0, 3.0), limit)


# -- the governor at the stiffness of its problem -------------------------------------------------


def _governor(rtols):  # type: ignore[no-untyped-def]
    """IFToMM A05 after ten seconds; its reference is in quadruple precision."""
    model = _model(flyball_governor)
    known = reference("flyball_governor")
    last = dict(zip(known["columns"], known["rows"][-1], strict=True))
    start = {"s": 0.5, "alpha_1": np.pi / 6, "alpha_2": np.pi / 6}
    y0 = model.assemble(start, {"omega": 2 * np.pi})
    exact = np.array([last[name] for name in ("psi", "s", "alpha", "omega", "s_dot", "alpha_dot")])
    names, methods = ("psi", "s", "alpha_1", "omega", "v", "nu_1"), (*METHODS, "dop853")
    for how, _, rtol, found in runs(model, last["t"], y0, methods=methods, rtols=rtols):
        yield verdict(
            f"governor, {how}", found, exact, limit_of(rtol, CONDITION), speeds_apart(exact, 3),
            lambda sol: np.array([sol[name][-1] for name in names]),
        )  # fmt: skip


@cache
def _model(build: Any) -> mechc.Model:
    return mechc.compile(build())
