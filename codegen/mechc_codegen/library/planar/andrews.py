"""Andrews' squeezing mechanism: seven bodies in a plane, three loops that meet in the point E.

Points, bodies and numbers as in Schiehlen's Multibody Systems Handbook (1990) and the Test Set
for IVP Solvers: crank K1 about O, rod K2 from its end F to E, ternary link K3 about B, which
carries E and the spring's end D, and two more chains A-G-E (K5, K4) and A-H-E (K7, K6).
"""

from __future__ import annotations

from types import SimpleNamespace

from sympy import Symbol, cos
from sympy.physics.mechanics import ReferenceFrame, RigidBody, dot, dynamicsymbols, inertia

from mechc_codegen.description.mechanism import Constraint, Drawing, Mechanism, Parameter
from mechc_codegen.library.parts import coordinates, fixed_point, locate, parameter, speeds, spring

ANGLES = ("beta", "Theta", "gamma", "Phi", "delta", "Omega", "epsilon")
MASSES = (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498)
INERTIAS = (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
LENGTHS = {
    "d": 0.028, "da": 0.0115, "e": 0.02, "ea": 0.01421, "rr": 0.007, "ra": 0.00092,
    "ss": 0.035, "sa": 0.01874, "sb": 0.01043, "sc": 0.018, "sd": 0.02,
    "ta": 0.02308, "tb": 0.00916, "u": 0.04, "ua": 0.01228, "ub": 0.00449,
    "zf": 0.02, "zt": 0.04, "fa": 0.01421,
}  # fmt: skip
PIVOTS = {
    "xa": -0.06934, "ya": -0.00227, "xb": -0.03635, "yb": 0.03273, "xc": 0.014, "yc": 0.072,
}  # fmt: skip
LINKS = (
    ("K1", ("O", "F")), ("K2", ("F", "E")), ("K3", ("B", "E", "D", "B")), ("K5", ("A", "G")),
    ("K4", ("G", "E")), ("K7", ("A", "H")), ("K6", ("H", "E")), ("spring", ("C", "D")),
)  # fmt: skip


def andrews() -> Mechanism:
    """The mechanism with a driving torque against a stiff spring: two and a half turns in 0.03 s.

    One degree of freedom.  Of the eight ways to close the loops for a crank angle the published
    one is preferred.
    """
    q, rates = dynamicsymbols(ANGLES), dynamicsymbols([f"{name}_dot" for name in ANGLES])
    beta, Theta, gamma, Phi, delta, Omega, epsilon = q
    s = SimpleNamespace(**{name: Symbol(name) for name in (*LENGTHS, *PIVOTS)})
    m = [Symbol(f"m_{k}") for k in range(1, 8)]
    I = [Symbol(f"I_{k}") for k in range(1, 8)]
    T, c, l0 = Symbol("T"), Symbol("c"), Symbol("l_0")

    # Frames: K2, K4 and K6 turn relative to their parent.
    r = ReferenceFrame("r")
    k1 = r.orientnew("k1", "Axis", (beta, r.z))
    k2 = k1.orientnew("k2", "Axis", (Theta, r.z))
    k3 = r.orientnew("k3", "Axis", (gamma, r.z))
    k5 = r.orientnew("k5", "Axis", (delta, r.z))
    k4 = k5.orientnew("k4", "Axis", (Phi, r.z))
    k7 = r.orientnew("k7", "Axis", (epsilon, r.z))
    k6 = k7.orientnew("k6", "Axis", (Omega, r.z))
    frames = (k1, k2, k3, k4, k5, k6, k7)

    # Pivots on the ground, joints on the bodies.
    O = fixed_point("O", r)
    A, B, C = (
        locate(name, O, x * r.x + y * r.y, r, r)
        for name, x, y in (("A", s.xa, s.ya), ("B", s.xb, s.yb), ("C", s.xc, s.yc))
    )
    F = locate("F", O, s.rr * k1.x, k1, r)
    E = locate("E", F, -s.d * k2.x, k2, r)
    D = locate("D", B, s.sd * k3.x - s.sc * k3.y, k3, r)
    G = locate("G", A, s.zt * k5.x, k5, r)
    H = locate("H", A, -s.u * k7.y, k7, r)

    # Closure: E through K3, through K5 and K4, and through K7 and K6.
    reached = (
        ("K3", locate("E_3", B, -s.ss * k3.y, k3, r)),
        ("K4", locate("E_4", G, -s.e * k4.y, k4, r)),
        ("K6", locate("E_6", H, s.zf * k6.x, k6, r)),
    )
    closure = [
        Constraint(f"closure through {link} along {axis}", dot(E.pos_from(end), unit), "m")
        for link, end in reached
        for axis, unit in (("x", r.x), ("y", r.y))
    ]

    # Bodies: mass centres on their links.
    centres = (
        locate("g_1", O, s.ra * k1.x, k1, r),
        locate("g_2", F, -s.da * k2.x, k2, r),
        locate("g_3", B, s.sb * k3.x - s.sa * k3.y, k3, r),
        locate("g_4", G, -(s.e - s.ea) * k4.y, k4, r),
        locate("g_5", A, s.ta * k5.x - s.tb * k5.y, k5, r),
        locate("g_6", H, (s.zf - s.fa) * k6.x, k6, r),
        locate("g_7", A, s.ub * k7.x - s.ua * k7.y, k7, r),
    )
    bodies = [
        RigidBody(f"K{k + 1}", centre, frame, m[k], (inertia(frame, 0, 0, I[k]), centre))
        for k, (centre, frame) in enumerate(zip(centres, frames, strict=True))
    ]

    return Mechanism(
        name="andrews",
        title="Andrews' squeezing mechanism",
        frame=r,
        origin=O,
        coordinates=coordinates(q, "rad", *[f"angle {name}" for name in ANGLES]),
        speeds=speeds(rates, "rad/s", *[f"rate of {name}" for name in ANGLES]),
        kinematics=tuple(rates),
        parameters=(
            *_parameters(m, I),
            parameter(T, 0.033, "N m", "torque on the crank"),
            parameter(c, 4530.0, "N/m", "stiffness of the spring", positive=True),
            parameter(l0, 0.07785, "m", "rest length of the spring", positive=True),
        ),
        bodies=tuple(bodies),
        loads=((k1, T * r.z), *spring(D, C, c, l0, bodies[2])),
        configuration_constraints=tuple(closure),
        points=(O, A, B, C, D, E, F, G, H),
        drawing=Drawing(links=LINKS, ground=("O", "A", "B", "C"), traced=("E",)),
        start={"Theta": 0.0, "beta_dot": 0.0},
        # The side on which each pair of rods bends: F-E-B, A-G-E and A-H-E.
        preference=cos(gamma - beta - Theta) + cos(Phi) + cos(Omega),
    )


def _parameters(m: list[Symbol], I: list[Symbol]) -> list[Parameter]:
    lengths = [
        parameter(Symbol(name), value, "m", f"length {name}", positive=True)
        for name, value in LENGTHS.items()
    ]
    pivots = [
        parameter(Symbol(name), value, "m", f"{name[0]} of the pivot {name[1].upper()}")
        for name, value in PIVOTS.items()
    ]
    masses = [
        parameter(m[k], MASSES[k], "kg", f"mass of K{k + 1}", positive=True) for k in range(7)
    ]
    about = "moment of inertia of K{} about its mass centre"
    inertias = [
        parameter(I[k], INERTIAS[k], "kg m^2", about.format(k + 1), positive=True) for k in range(7)
    ]
    return [*lengths, *pivots, *masses, *inertias]
