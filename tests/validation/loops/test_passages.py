"""Times at which motions pass change points.

A parallelogram that carries a pendulum has two freedoms, and its links are in line where the
crank's angle is a multiple of pi, wherever the pendulum is.
"""

import numpy as np
import pytest
from sympy import symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    Point,
    ReferenceFrame,
    dynamicsymbols,
)

import mechc

ALIKE = 1e-10  # of times by methods at rtol 1e-12


@pytest.fixture(scope="module")
def carrier():
    """The cranks of length a are b apart; the pendulum hangs at a third of the coupler."""
    q, u = dynamicsymbols("q_0:4"), dynamicsymbols("u_0:4")
    a, b = symbols("a b")
    r, origin = ReferenceFrame("r"), Point("O")
    origin.set_vel(r, 0)
    e = [r.orientnew(f"e_{k}", "Axis", (q[k], r.z)) for k in range(4)]
    for k in range(4):
        e[k].set_ang_vel(r, u[k] * r.z)
    pivot = origin.locatenew("R", b * r.x)
    pivot.set_vel(r, 0)

    def along(name, start, length, k):
        end = start.locatenew(name, length * e[k].x)
        end.v2pt_theory(start, r, e[k])
        return end

    p = along("p", origin, a, 0)
    end, top = along("end", p, b, 1), along("top", pivot, a, 2)
    hook = along("hook", p, b / 3, 1)
    points = {p: 1.0, top: 2.0, hook: 1.0, along("bob", hook, 0.4, 3): 1.5}
    bodies = [Particle(f"at {point.name}", point, mass) for point, mass in points.items()]
    gap = end.pos_from(top)
    rates = {x.diff(): v for x, v in zip(q, u, strict=True)}
    rows = [gap.dot(axis) for axis in (r.x, r.y)]
    kane = KanesMethod(
        r, [q[0], q[3]], [u[0], u[3]], [v - x.diff() for x, v in zip(q, u, strict=True)],
        q_dependent=[q[1], q[2]], u_dependent=[u[1], u[2]], configuration_constraints=rows,
        velocity_constraints=[row.diff(symbols("t")).subs(rates) for row in rows], bodies=bodies,
        forcelist=[(body.point, -9.81 * body.mass * r.y) for body in bodies],
    )  # fmt: skip
    kane.kanes_equations()
    return mechc.compile(kane)


def moves(model, crank, speed, span, method):
    """A motion of parallel cranks from this angle."""
    start = {"q_0": crank, "q_2": crank, "q_3": -1.0, "u_0": speed, "u_2": speed, "u_3": 0.3}
    y0 = [start.get(name, 0.0) for name in (*model.coordinates, *model.speeds)]
    sol = model.simulate(span, y0, {"a": 1.0, "b": 2.0}, method=method, rtol=1e-12)
    assert sol.status.ok, sol.status
    return sol


@pytest.mark.parametrize("method", ["auto", "dop853"])
def test_with_two_freedoms_passages_are_where_links_are_in_line(carrier, method):
    sol = moves(carrier, 1.0, 6.0, 2.0, method)
    crank, bob = (list(carrier.coordinates).index(name) for name in ("q_0", "q_3"))
    assert len(sol.change_points) == 4
    for passage in sol.change_points:
        assert abs(np.sin(sol(passage.t)[crank])) < 1e-12
        assert abs(np.sin(passage.q[crank])) < 1e-12
        assert abs(passage.q[bob] - sol(passage.t)[bob]) < 1e-12


def test_with_two_freedoms_methods_agree_about_times_of_passages(carrier):
    first, second = (
        [passage.t for passage in moves(carrier, 1.0, 6.0, 2.0, method).change_points]
        for method in ("auto", "dop853")
    )
    assert np.abs(np.subtract(first, second)).max() < ALIKE


@pytest.mark.parametrize("method", ["auto", "dop853"])
def test_the_change_point_at_which_a_run_begins_is_not_passed(carrier, method):
    sol = moves(carrier, 0.0, 6.0, 1.0, method)
    assert [passage.t > 0.1 for passage in sol.change_points] == [True]


@pytest.mark.parametrize("method", ["auto", "dop853"])
def test_no_passage_is_beyond_the_end_of_a_run(carrier, method):
    there = moves(carrier, 0.0, 6.0, 1.0, method)
    params = {"a": 1.0, "b": 2.0}
    back = carrier.simulate((1.0, 0.0), there.y[-1], params, method=method, rtol=1e-12)
    assert back.status.ok
    assert len(back.change_points) >= 1
    assert all(0.0 <= passage.t <= 1.0 for passage in back.change_points)
    assert abs(back.change_points[0].t - there.change_points[0].t) < ALIKE


@pytest.mark.parametrize("method", ["auto", "dopri5", "dop853"])
def test_a_linkage_of_one_freedom_that_begins_in_line_has_not_passed_it(method):
    model = mechc.load("four_bar")
    through = model.simulate(3.0, model.assemble({"theta_0": np.radians(85.0)}), method=method)
    passage = through.change_points[0]
    speeds = through(passage.t)[3:]
    sol = model.simulate(0.3, np.array([*passage.q, *speeds]), method=method)
    assert sol.status.ok, sol.status
    assert all(passage.t > 1e-6 for passage in sol.change_points)
