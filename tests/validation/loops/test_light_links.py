"""Links whose mass goes to zero: the motion goes to that without their mass.

The angle of every link is a coordinate of its own and the rocker turns about its own pivot, so that
the mass matrix alone is nearly singular, while the mass that the crank moves is not.
"""

import numpy as np
import pytest
from sympy import symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

MASSES = (1e-15, 1e-13, 1e-12, 3e-12, 1e-10, 1e-8, 1e-6, 1e-4)
LENGTHS = {"change points": 4.0, "no change point": 3.5}
END, ALLOWED = 3.0, 1e-9


@pytest.fixture(scope="module")
def four_bar():
    q, u = dynamicsymbols("q_0:3"), dynamicsymbols("u_0:3")
    l, m, g = symbols("l_0:4"), symbols("m_0:3"), symbols("g")
    r, origin = ReferenceFrame("r"), Point("O")
    origin.set_vel(r, 0)
    pivot = origin.locatenew("R", l[3] * r.x)
    pivot.set_vel(r, 0)
    start, ends, bodies = origin, [], []
    for k in range(3):
        frame = r.orientnew(f"e_{k}", "Axis", (q[k], r.z))
        frame.set_ang_vel(r, u[k] * r.z)
        start = pivot if k == 2 else start
        centre, end = (
            start.locatenew(f"{n}_{k}", l[k] / d * frame.x) for n, d in (("g", 2), ("p", 1))
        )
        centre.v2pt_theory(start, r, frame)
        end.v2pt_theory(start, r, frame)
        about = (inertia(frame, 0, 0, m[k] * l[k] ** 2 / 12), centre)
        bodies.append(RigidBody(f"link_{k}", centre, frame, m[k], about))
        ends.append(end)
        start = end
    gap = ends[1].pos_from(ends[2])
    rows = [gap.dot(axis) for axis in (r.x, r.y)]
    rates = {x.diff(): v for x, v in zip(q, u, strict=True)}
    kane = KanesMethod(
        r, [q[0]], [u[0]], [v - x.diff() for x, v in zip(q, u, strict=True)],
        q_dependent=q[1:], u_dependent=u[1:], configuration_constraints=rows, bodies=bodies,
        velocity_constraints=[row.diff(symbols("t")).subs(rates) for row in rows],
        forcelist=[(body.masscenter, -body.mass * g * r.y) for body in bodies],
    )  # fmt: skip
    kane.kanes_equations()
    return mechc.compile(kane)


def given(model, ground, link, mass):
    """A start at rest, and parameters with one of the masses changed."""
    params = {f"l_{k}": k + 1.0 for k in range(3)} | {f"m_{k}": k + 1.0 for k in range(3)}
    params |= {"l_3": ground, "g": 9.81}
    near = {"q_1": 0.6, "q_2": 1.3}
    y0 = model.assemble({"q_0": np.radians(85.0)}, {"u_0": 0.0}, near, params)
    return y0, params | {f"m_{link}": mass}


def end_of(model, ground, link, mass, **options):
    sol = model.simulate(END, *given(model, ground, link, mass), rtol=1e-9, **options)
    assert sol.status.ok, sol.status
    return sol.y[-1], sol.stats["steps"]


@pytest.mark.parametrize("method", ["auto", "dop853"])
@pytest.mark.parametrize("link", [0, 1, 2])
@pytest.mark.parametrize("ground", LENGTHS.values(), ids=LENGTHS)
def test_a_mass_that_goes_to_zero_changes_the_motion_in_proportion(four_bar, ground, link, method):
    without, steps = end_of(four_bar, ground, link, 0.0, method=method)
    largest, _ = end_of(four_bar, ground, link, MASSES[-1], method=method)
    by_mass = np.abs(largest - without).max() / MASSES[-1]
    for mass in MASSES:
        end, taken = end_of(four_bar, ground, link, mass, method=method)
        assert np.abs(end - without).max() <= 1.1 * by_mass * mass + ALLOWED
        assert taken <= 1.1 * steps


@pytest.mark.parametrize("link", [1, 2])
@pytest.mark.parametrize("ground", LENGTHS.values(), ids=LENGTHS)
def test_light_links_in_a_batch_move_as_alone(four_bar, ground, link):
    y0, params = given(four_bar, ground, link, np.array([0.0, *MASSES]))
    batch = four_bar.simulate_batch(END, y0, params, rtol=1e-9)
    for k, mass in enumerate((0.0, *MASSES)):
        alone, _ = end_of(four_bar, ground, link, mass, method=batch.method.split()[0])
        assert batch[k].status.ok, batch[k].status
        assert np.abs(batch[k].y[-1] - alone).max() < 1e-8


def test_a_mechanism_without_any_mass_is_refused(four_bar):
    y0, params = given(four_bar, 3.5, 0, 0.0)
    sol = four_bar.simulate(END, y0, params | {"m_1": 0.0, "m_2": 0.0})
    assert sol.status.code == "singular mass matrix"


@pytest.mark.parametrize("unit", [1.0, 1e3])  # of length: metres and millimetres
@pytest.mark.parametrize("link", ["m_1", "m_2"])
def test_a_light_rod_or_slider_of_a_slider_crank(link, unit):
    model = mechc.load("slider_crank")
    lengths = {"l_0": 0.5 * unit, "l_1": unit, "T": 10.0 * unit**2}

    def end(mass):
        params = lengths | {link: mass}
        sol = model.simulate(1.0, model.assemble(params=params), params, rtol=1e-9)
        assert sol.status.ok, sol.status
        return sol.y[-1], sol.stats["steps"]

    lightest, steps = end(1e-15)
    by_mass = np.abs(end(1e-6)[0] - lightest).max() / 1e-6
    for mass in (1e-13, 1e-12, 1e-9):
        found, taken = end(mass)
        assert (
            np.abs(found - lightest).max() <= 1.1 * by_mass * mass + 2e-11 * np.abs(lightest).max()
        )
        assert taken <= 1.1 * steps
