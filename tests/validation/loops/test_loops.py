"""Rows of loops, eliminated link by link or solved together: the same motion."""

from dataclasses import replace

import numpy as np
import pytest
from mechc_codegen.description.mechanism import Closure, Mechanism
from mechc_codegen.library.chains.rods import planar_chain, spatial_chain
from mechc_codegen.library.chains.windows import windows
from sympy import cos, eye, sin
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support.marks import slow_among


def ring(chain: Mechanism) -> Mechanism:
    """The chain with its end fixed to the ground, three links' lengths from the pivot.

    In space the end is fixed in all three directions and may turn.
    """
    end, r = chain.points[-1], chain.frame
    held = chain.origin.locatenew("held", 3 * chain.parameters[0].symbol * r.x)
    axes = (r.x, r.y, r.z) if chain.name == "spatial_chain" else (r.x, r.y)
    return replace(chain, name="ring", start={}, closures=(Closure("end", end, held, axes),))


SCENES = {
    "windows_4": lambda: windows(4),
    "ring_of_8": lambda: ring(spatial_chain(8)),
    "planar_ring_of_9": lambda: ring(planar_chain(9)),
}


@pytest.fixture(
    scope="module", params=slow_among(SCENES, {"windows_4", "ring_of_8", "planar_ring_of_9"})
)
def model(request):
    return mechc.compile(SCENES[request.param](), outputs=("energy", "multipliers"))


def states(model, count, spread=0.4):
    """States on the constraints, far from any where rows are dependent."""
    rng = np.random.default_rng(7)
    size = len(model.coordinates)
    start = np.zeros(size)
    if model.name.startswith("windows"):
        start[:2], start[2::2] = (1.9, -1.9), 1.9 - np.pi
    else:
        start = np.full(size, 2 * np.pi / (size + 1))
        start[0] = 0.3
    for _ in range(count):
        y = np.concatenate([start + spread * rng.uniform(-1, 1, size), rng.uniform(-1, 1, size)])
        for _ in range(20):
            back = np.linalg.pinv(model.constraint_jacobian(y))
            y[:size] -= back @ model.constraints(y)
        y[size:] -= back @ model.velocity_constraints(y)
        assert np.abs(model.constraints(y)).max() < 1e-13
        yield y


def test_what_is_left_of_the_forces_pulls_along_the_rows(model):
    """F - M u' is J^T times the multipliers that the dense solution gives."""
    size = len(model.coordinates)
    for y in states(model, 5):
        rates = model.rhs(0.0, y)[size:]
        jacobian = model.constraint_jacobian(y)
        left = model.forcing(y) - model.mass_matrix(y) @ rates
        np.testing.assert_allclose(jacobian.T @ model.multipliers(y), left, atol=1e-10)


def test_accelerations_keep_the_loops_closed(model):
    """The constraints' rates stay zero to second order along the motion."""
    size, step = len(model.coordinates), 1e-5
    for y in states(model, 5):
        rates = model.rhs(0.0, y)
        q, u, du = y[:size], y[size:], rates[size:]
        late, early = (
            np.concatenate([q + s * u + 0.5 * s**2 * du, u + s * du]) for s in (step, -step)
        )
        change = model.velocity_constraints(late) - model.velocity_constraints(early)
        assert np.abs(change / (2 * step)).max() < 1e-6


def test_states_side_by_side_are_solved_as_one_by_one(model):
    y = np.array(list(states(model, 5)))
    together = model.rhs(0.0, y)
    for one, row in zip(y, together, strict=True):
        np.testing.assert_allclose(model.rhs(0.0, one), row, rtol=1e-13, atol=1e-13)


def test_energy_is_kept(model):
    y = next(iter(states(model, 1)))
    sol = model.simulate(0.5, y, rtol=1e-10)
    assert sol.status.ok, str(sol.status)
    assert sol.energy_drift < 1e-8
    assert sol.closure.max() < 1e-12


@pytest.mark.parametrize("method", ["gauss8", "dop853"])
def test_loops_close_to_rounding_beside_rows_of_speeds_in_another_unit(method):
    """A four-bar beside two wheels whose speeds are tied, in a unit of which a metre has 10^4."""
    q, u = dynamicsymbols("a b c z w"), dynamicsymbols("v_a v_b v_c v_z v_w")
    loop = [
        sum(size * f(x) for size, x in zip((1, 2, -1.5), q, strict=False)) - 2 * f(0)
        for f in (cos, sin)
    ]
    tied = 1e4 * (u[3] - cos(q[0]) * u[4])
    forces = [-sin(x) for x in q]
    beside = mechc.compile(
        mechc.from_equations(q, u, eye(5), forces, constraints=loop, velocity_constraints=[tied])
    )
    start = beside.assemble({"a": 1.0, "z": 0.0, "w": 0.0})
    a, b, c = beside.simulate(np.linspace(0, 2, 41), start, method=method).y[:, :3].T
    gaps = [f(a) + 2 * f(b) - 1.5 * f(c) - 2 * f(0) for f in (np.cos, np.sin)]
    assert np.abs(gaps).max() < 1e-14
