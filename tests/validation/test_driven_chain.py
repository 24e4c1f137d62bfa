"""A chain of links walked as a tree, with motors given with a run and a controller at its pivot."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from mechc_codegen.derive import derive_equations
from mechc_codegen.library.chains.rods import planar_chain
from sympy.physics.mechanics import dynamicsymbols

import mechc

LINKS = 8


def driven_chain(name):
    """A PI controller holds the first link, an open torque acts between the second and third."""
    chain = planar_chain(LINKS)
    torque, target, z = dynamicsymbols("T target z")
    axis, frames = chain.frame.z, [body.frame for body in chain.bodies]
    error = target - chain.q[0]
    hold = 200 * error + 50 * z - 20 * chain.u[0]
    loads = ((frames[0], hold * axis), (frames[2], torque * axis), (frames[1], -torque * axis))
    return replace(
        chain,
        name=name,
        loads=loads,
        inputs={torque: None, target: None},
        states=(
            mechc.State(
                z, error - z**2 / 10, mechc.Quantity("rad s", "integral of the error"), 0.1
            ),
        ),
    )


@pytest.fixture(scope="module")
def walked():
    return mechc.compile(driven_chain("walked"), outputs=())


@pytest.mark.slow
def test_a_tree_with_inputs_and_states_is_what_is_written_out(walked, monkeypatch):
    monkeypatch.setattr(derive_equations, "LEAST_TREE", LINKS + 1)
    written = mechc.compile(driven_chain("written"), outputs=())
    assert walked.inputs == written.inputs == ("T", "target")
    assert walked.states == ("z",)
    rng = np.random.default_rng(5)
    y = rng.uniform(-1, 1, (6, 2 * LINKS + 1))
    given = {"T": lambda t, q, u: 3.0 + t - 0.5 * u[2], "target": np.sin}
    rates = [m.with_inputs(given).rhs(np.linspace(0, 2, 6), y) for m in (walked, written)]
    np.testing.assert_allclose(rates[0], rates[1], rtol=1e-11, atol=1e-11)


@pytest.mark.slow
def test_a_chain_driven_by_samples_keeps_the_balance_of_power(walked):
    """The power of motor and controller is the rate of the energy."""
    model = mechc.compile(driven_chain("weighed"), outputs=("energy",))
    times = np.linspace(0.0, 1.0, 5)
    signal = mechc.Signal(times, [0.0, 20.0, -20.0, 5.0, 0.0], "linear")
    y0 = model.assemble({"q_0": -1.5}, {})
    sol = model.simulate(1.0, y0, inputs={"T": signal, "target": -1.0}, rtol=1e-10)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    work = 0.0
    for low, high in pairwise(times):
        s = 0.5 * (low + high) + 0.5 * (high - low) * nodes
        y = sol(s)
        q, z, u = y[:, 0], y[:, LINKS], y[:, LINKS + 1 :]
        power = (200 * (-1.0 - q) + 50 * z - 20 * u[:, 0]) * u[:, 0]
        power += signal(s) * u[:, 2]
        work += 0.5 * (high - low) * float(weights @ power)
    assert sol.energy[-1] - sol.energy[0] == pytest.approx(work, abs=1e-6)
