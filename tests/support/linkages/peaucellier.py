"""Peaucellier's cell: point masses as joints, joined by seven rods."""

import sympy.physics.mechanics as me

import mechc

RODS = {"QB": 1.0, "OC": 3.0, "OD": 3.0, "BC": 1.25, "BD": 1.25, "PC": 1.25, "PD": 1.25}  # m


def cell(**options):
    """Compiled, with the coordinates of B, C, D and P; O is the origin, Q at (1, 0)."""
    ground, origin, t = me.ReferenceFrame("N"), me.Point("O"), me.dynamicsymbols._t
    origin.set_vel(ground, 0)
    joints, q, u = {"O": origin, "Q": origin.locatenew("Q", ground.x)}, [], []
    for name in "BCDP":
        x, y, vx, vy = me.dynamicsymbols(f"x_{name} y_{name} vx_{name} vy_{name}")
        joints[name] = origin.locatenew(name, x * ground.x + y * ground.y)
        joints[name].set_vel(ground, vx * ground.x + vy * ground.y)
        q += [x, y]
        u += [vx, vy]
    between = [joints[b].pos_from(joints[a]) for a, b in RODS]
    gaps = [r.dot(r) - length**2 for r, length in zip(between, RODS.values(), strict=True)]
    rates = dict(zip([c.diff(t) for c in q], u, strict=True))
    kane = me.KanesMethod(
        ground, q_ind=q[1:2], u_ind=u[1:2], q_dependent=[q[0], *q[2:]],
        u_dependent=[u[0], *u[2:]], kd_eqs=[speed - rate for rate, speed in rates.items()],
        configuration_constraints=gaps,
        velocity_constraints=[gap.diff(t).subs(rates) for gap in gaps],
    )  # fmt: skip
    kane.kanes_equations(
        [me.Particle(name, joints[name], 1) for name in "BCDP"],
        [(joints[name], -9.81 * ground.y) for name in "BCDP"],
    )
    return mechc.compile(kane, **options)
