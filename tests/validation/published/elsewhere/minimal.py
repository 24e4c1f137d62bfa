"""Modelica's engines by energy, its wheels by Newton and Lagrange, its orbits: by hand.

Each function gives the recorded signals at the times, by their names, from equations in the
fewest coordinates, integrated by DOP853 with relative tolerance 1e-13.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ..scenes.engines import ANGLES, V6, V6_ANALYTIC, Cylinder, crank_moment, v6_moment
from ..scenes.loops import G, box, cylinder
from .absolute import AXES

X, Y, Z = AXES


def _piston(angle, a, length):
    """Of a slider crank: the lean of the rod, the pin's place, and both rates by the angle."""
    sine = a * np.sin(angle) / length
    cosine = np.sqrt(1 - sine**2)
    lean_rate = a * np.cos(angle) / (length * cosine)
    place = a * np.cos(angle) + length * cosine
    return sine, cosine, place, -a * np.sin(angle) - length * sine * lean_rate, lean_rate


def _gas(x, compresses):
    polynomial = (
        [177.4132, -287.2189, 151.8252, -24.9973, 2.4]
        if compresses
        else [145.930, -131.707, 17.3438, 17.9272, 2.4]
    )
    return 1e5 * np.polyval(polynomial, x)


def engine(times, one, moment, unbalance, angles, names, *, gas, brake):
    """φ' = ω(φ, W) by the energy: ½ I ω² + V = E + W, and W the work of the gas and the brake.

    The gas jumps where a piston turns back; the run is cut there.
    """
    angles = np.deg2rad(angles)
    area = np.pi * 0.1**2 / 4

    def parts(phi):
        inertia, potential, strokes = moment, unbalance * G * np.cos(phi), []
        for offset, tilt in angles:
            angle = phi + offset - tilt
            sine, cosine, pin, rate, lean_rate = _piston(angle, one.crank, one.rod)
            centre = one.rod_centre
            y = one.crank * np.cos(angle) + centre * cosine
            z = one.crank * np.sin(angle) - centre * sine
            dy = -one.crank * np.sin(angle) - centre * sine * lean_rate
            dz = one.crank * np.cos(angle) - centre * cosine * lean_rate
            inertia += one.rod_mass * (dy**2 + dz**2) + one.rod_moment * lean_rate**2
            inertia += one.piston_mass * rate**2
            height = one.rod_mass * y + one.piston_mass * pin
            potential += G * (np.cos(tilt) * height - np.sin(tilt) * one.rod_mass * z)
            strokes.append((one.top - pin - one.piston, -rate, angle))
        return inertia, potential, strokes

    inertia, potential, _ = parts(0.0)
    energy = inertia * 10.0**2 / 2 + potential
    pitch = np.pi if len(angles) == 1 else np.pi / 3

    def speed(state):
        inertia, potential, strokes = parts(state[0])
        return np.sqrt(2 * (energy + state[1] - potential) / inertia), strokes

    def rates(t, state, middle):
        w, strokes = speed(state)
        power = 0.0
        if gas:
            for s, rate, angle in strokes:
                compresses = np.sin(angle - state[0] + middle) < 0
                power += _gas(1 - s / one.gas_length, compresses) * area * rate * w
        if brake:
            power -= 100 * (w / 200) ** 2 * w
        return [w, power]

    now, state, turns, found = 0.0, np.zeros(2), 0, {}
    while now < times[-1]:

        def turns_back(t, state, middle, end=(turns + 1) * pitch):
            return state[0] - end

        turns_back.terminal = True
        run = solve_ivp(
            rates,
            (now, times[-1]),
            state,
            "DOP853",
            args=((turns + 0.5) * pitch,),
            events=turns_back,
            dense_output=True,
            rtol=1e-13,
            atol=1e-13,
        )
        found |= {float(t): run.sol(t) for t in times if now < t <= run.t[-1]}
        if run.status == 0:
            break
        now, state, turns = run.t_events[0][0], run.y_events[0][0].copy(), turns + 1
        state[0] = turns * pitch
    states = [found[float(t)] for t in times]
    return {
        names[0]: [float(state[0]) for state in states],
        names[1]: [float(speed(state)[0]) for state in states],
    }


@dataclass(frozen=True)
class _LongCylinder(Cylinder):
    """Modelica gives the gas of the engine of one cylinder a length of its own."""

    gas_length: float = 0.35


def engine_of_one(times, gas):
    moment, unbalance = crank_moment()
    mass, _, _, about = box(0.2, 0.06, 0.02)
    one = _LongCylinder(0.1, 0.2, 0.1, mass, about, cylinder(0.1, 0.1)[0], 0.45)
    names = "inertia.phi", "inertia.w"
    return engine(times, one, moment + 1, unbalance, [(0, 0)], names, gas=gas, brake=False)


def engine_of_six(times, analytic):
    one, moment = (V6_ANALYTIC, 1.1) if analytic else (V6, v6_moment())
    names = "load.phi", "load.w"
    return engine(times, one, moment, 0.0, ANGLES, names, gas=True, brake=True)


def wheel(times):
    """Newton's and Euler's equations at the centre, the contact force from the rolling."""
    radius, mass, tensor = 0.3, 2.0, np.diag([0.12, 0.06, 0.12])

    def kinematics(angles, rates):
        R = Rotation.from_euler("ZYX", angles).as_matrix()
        a = Rotation.from_euler("Z", angles[0]).as_matrix() @ Y
        b = R @ X
        spins = np.array([Z, a, b]).T
        w = spins @ rates
        # second rates enter as `spins`; the rest comes from the axes that turn
        rest = rates[1] * np.cross(rates[0] * Z, a) + rates[2] * np.cross(w, b)
        return R, spins, w, rest

    def contact(axle, w):
        """The arm to the road and the rate of the centre's velocity arm × w, without w'."""
        heading = np.cross(Z, axle)
        size = np.linalg.norm(heading)
        heading_rate = np.cross(Z, np.cross(w, axle))
        e = heading / size
        de = (heading_rate - e * (e @ heading_rate)) / size
        arm = radius * np.cross(e, axle)
        arm_rate = radius * (np.cross(de, axle) + np.cross(e, np.cross(w, axle)))
        return arm, np.cross(arm_rate, w)

    def rates(t, state):
        angles, spin = state[2:5], state[5:8]
        R, spins, w, rest = kinematics(angles, spin)
        arm, drift = contact(R @ Y, w)
        J = R @ tensor @ R.T
        # J w' + w × J w = arm × f, f = m (a + g z), a = arm × w' + drift
        cross = np.array([np.cross(arm, e) for e in AXES]).T
        left = J - mass * cross @ cross
        right = np.cross(arm, mass * (drift + G * Z)) - np.cross(w, J @ w)
        w_rate = np.linalg.solve(left, right)
        velocity = np.cross(arm, w)
        return np.concatenate([velocity[:2], spin, np.linalg.solve(spins, w_rate - rest)])

    start = [0.2, 0.2, 0, 0, 0, 0, 5, 1]
    run = solve_ivp(rates, (0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-13)
    names = ["x", "y", *(f"angles[{k}]" for k in (1, 2, 3))]
    names += [f"der_angles[{k}]" for k in (1, 2, 3)]
    return {"wheel1." + name: row.tolist() for name, row in zip(names, run.y, strict=True)}


def wheel_set(times, torques, force, kinks=()):
    """Lagrange's equations of the two angles: forward speed and turning follow from them."""
    R, half, m, load, ahead = 0.1, 0.25, 0.5, 0.01, 0.2

    def rates(t, state):
        phi, w1, w2 = state[2], *state[5:]
        v, w = R * (w1 + w2) / 2, R * (w2 - w1) / (2 * half)
        c, s = np.cos(phi), np.sin(phi)
        f = np.asarray(force(t), float)
        push_on, turn = f @ [c, s], ahead * (f @ [-s, c])
        # forward: (2 m + load) v' − load ahead w² = F; turning: (…) w' + load ahead v w = M
        forward = push_on + load * ahead * w**2
        moment = 2 * (0.02 + m * half**2) + 0.001 + load * ahead**2
        turning = turn - load * ahead * v * w
        T1, T2 = torques(t)
        # v' = R (a1 + a2)/2, w' = R (a2 − a1)/(2 half); each wheel: 0.01 a = T − R (its force)
        total, spin = 2 * m + load, moment
        A = np.array([
            [0.01 + total * R * R / 4 + spin * (R / (2 * half)) ** 2,
             total * R * R / 4 - spin * (R / (2 * half)) ** 2],
            [total * R * R / 4 - spin * (R / (2 * half)) ** 2,
             0.01 + total * R * R / 4 + spin * (R / (2 * half)) ** 2],
        ])  # fmt: skip
        b = np.array([T1 + R * forward / 2 - R * turning / (2 * half),
                      T2 + R * forward / 2 + R * turning / (2 * half)])  # fmt: skip
        return [v * c, v * s, w, w1, w2, *np.linalg.solve(A, b)]

    state, now, found = np.array([0.1, 0.1, 0, 0, 0, 0, 0.0]), 0.0, {}
    for stop in [*kinks, times[-1]]:
        asked = [t for t in times if now < t <= stop]
        run = solve_ivp(
            rates, (now, stop), state, "DOP853", sorted({*asked, stop}), rtol=1e-13, atol=1e-13
        )
        found |= {float(t): row for t, row in zip(run.t, run.y.T, strict=True)}
        state, now = run.y[:, -1], stop
    names = "x", "y", "phi", "theta1", "theta2", "der_theta1", "der_theta2"
    return {
        "wheelSet." + name: [float(found[float(t)][k]) for t in times]
        for k, name in enumerate(names)
    }


def _ramp(t):
    return (1 - np.clip(t - 1, 0, 1), 2 * np.clip(t - 1, 0, 1))


def orbits(times, bodies, places, speeds, spring):
    places, speeds = np.array(places, float), np.array(speeds, float)

    def rates(t, state):
        r, v = state.reshape(2, 2, 3)
        a = -r / np.linalg.norm(r, axis=1)[:, None] ** 3
        a[0] += spring * (r[1] - r[0])
        a[1] -= spring * (r[1] - r[0])
        return np.concatenate([v.ravel(), a.ravel()])

    start = np.concatenate([places.ravel(), speeds.ravel()])
    run = solve_ivp(rates, (0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-14)
    y = run.y.reshape(2, 2, 3, -1)
    return {
        f"{body}.{name}[{n + 1}]": y[kind, k, n].tolist()
        for k, (body, place) in enumerate(bodies)
        for kind, name in ((0, place), (1, "v_0"))
        for n in range(3)
    }


def filtered(times):
    """The Bessel filter that turns the crank of the planar loops."""
    w, af, bf = 100 * np.pi, 1.3617, 0.6180

    def rates(t, state):
        wanted = 0.7 * np.sin(2 * np.pi * t)
        return [state[1], ((wanted - state[0]) * w - af * state[1]) * w / bf]

    run = solve_ivp(rates, (0, times[-1]), [0, 0], "DOP853", times, rtol=1e-13, atol=1e-14)
    return {"rev.phi": run.y[0].tolist(), "rev.w": run.y[1].tolist()}


def telescope(times):
    """One angle; the tubes are two points on the line from the foot to the hand."""
    foot, shoulder = np.array([0.0, -0.9]), np.array([0.0, 0.3])
    mass, _, _, moment = box(0.7, 0.035, 0.035)

    def rates(t, state):
        phi, w = state
        hand = 0.7 * np.array([np.cos(phi), np.sin(phi)])
        line, dh, ddh = shoulder + hand - foot, np.array([-hand[1], hand[0]]), -hand
        length = np.linalg.norm(line)
        e = line / length
        dl = e @ dh
        de = (dh - e * dl) / length
        ddl = de @ dh + e @ ddh
        dde = (ddh - 2 * dl * de - e * ddl) / length
        points = (0.2 * de, 0.2 * dde), (dh - 0.2 * de, ddh - 0.2 * dde)
        inertia = moment + mass * 0.35**2 + sum(d @ d for d, _ in points)
        force = -sum(d @ dd for d, dd in points) * w**2 - 3 * dl**2 * w
        force -= G * (mass * 0.35 * np.cos(phi) + sum(d[1] for d, _ in points))
        return [w, force / inertia]

    run = solve_ivp(rates, (0, times[-1]), [0, 0], "DOP853", times, rtol=1e-13, atol=1e-13)
    phi, w = run.y.tolist()
    return {f"revolute{k}.{name}": row for k in (1, 2) for name, row in (("phi", phi), ("w", w))}
