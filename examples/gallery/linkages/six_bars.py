"""
Six-bar linkages of Watt and Stephenson
=======================================

A four-bar and a dyad: hinged to the rocker it makes a chain of Watt's, hinged to the coupler one
of Stephenson's (R. L. Norton, *Design of Machinery*, 1992).
"""

import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
lengths = (0.1, 0.35, 0.25, 0.4, 0.3)


def six_bar(stephenson):
    """Links O1-A, A-B, O2-B, C-D, O3-D; C is on the coupler (Stephenson) or the rocker (Watt)."""
    q, u = me.dynamicsymbols("q1:6"), me.dynamicsymbols("u1:6")
    rho, g, T = *sm.symbols("rho g"), me.dynamicsymbols("T")
    N, O1 = me.ReferenceFrame("N"), me.Point("O1")
    O1.set_vel(N, 0)
    frames = [N.orientnew(f"link {k + 1}", "Axis", (q[k], N.z)) for k in range(5)]
    for frame, rate in zip(frames, u, strict=True):
        frame.set_ang_vel(N, rate * N.z)
    O2 = O1.locatenew("O2", 0.4 * N.x)
    O3 = O1.locatenew("O3", (0.7 if stephenson else 0.8) * N.x + 0.05 * N.y)
    O2.set_vel(N, 0)
    O3.set_vel(N, 0)

    def far_end(name, root, k):
        end = root.locatenew(name, lengths[k] * frames[k].x)
        end.v2pt_theory(root, N, frames[k])
        return end

    A = far_end("A", O1, 0)
    B, B2 = far_end("B", A, 1), far_end("B of the rocker", O2, 2)
    root, carrier = (A, frames[1]) if stephenson else (O2, frames[2])
    C = root.locatenew("C", 0.12 * carrier.x + 0.12 * carrier.y)
    C.v2pt_theory(root, N, carrier)
    D, D2 = far_end("D", C, 3), far_end("D of the last", O3, 4)

    bodies, loads = [], [(frames[0], T * N.z)]
    for k, (start, frame) in enumerate(zip((O1, A, O2, C, O3), frames, strict=True)):
        G = start.locatenew(f"G{k + 1}", lengths[k] / 2 * frame.x)
        G.v2pt_theory(start, N, frame)
        mass = rho * lengths[k]
        central = me.inertia(frame, 0, 0, mass * lengths[k] ** 2 / 12)
        bodies.append(me.RigidBody(f"link {k + 1}", G, frame, mass, (central, G)))
        loads.append((G, -mass * g * N.y))
    gaps = [B.pos_from(O1) - B2.pos_from(O1), D.pos_from(O1) - D2.pos_from(O1)]
    kane = me.KanesMethod(
        N,
        q_ind=[q[0]],
        u_ind=[u[0]],
        kd_eqs=[a.diff(t) - b for a, b in zip(q, u, strict=True)],
        q_dependent=q[1:],
        u_dependent=u[1:],
        configuration_constraints=[gap.dot(axis) for gap in gaps for axis in (N.x, N.y)],
        velocity_constraints=[
            (gap.dt(N)).dot(axis).subs(dict(zip([a.diff(t) for a in q], u, strict=True)))
            for gap in gaps
            for axis in (N.x, N.y)
        ],
    )
    kane.kanes_equations(bodies, loads)
    return mechc.compile(
        kane,
        defaults={"rho": 2.0, "g": 9.81},
        inputs={T: 0.3 * (6 - u[0])},
        drawing=mechc.Drawing(links=(("carrier", (root, C)),), ground=(O1, O2, O3)),
    )


def run(model):
    guess = {"q2": 0.5, "q3": 1.3, "q4": 0.2, "q5": 1.5}
    sol = model.simulate(2, model.assemble({"q1": 0.7}, speeds={"u1": 6.0}, guess=guess))
    assert sol.status.ok
    assert sol.closure.max() < 1e-12
    return sol


# %%
# Watt's chain:

sol = run(six_bar(stephenson=False))
sol.animate()

# %%
# and Stephenson's:

run(six_bar(stephenson=True)).animate()
