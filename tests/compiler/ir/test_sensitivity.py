"""Jacobians of the motion, and outputs of it: against derivatives taken with 50 digits."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest
from mechc.native._driver import Scene
from mechc_codegen import Mechanism
from mechc_codegen.compiler import build_scene
from mechc_codegen.derive import derive_equations
from mechc_codegen.description.derivatives import Derivatives, slope
from mechc_codegen.description.request import USUAL, OutputRequest
from mechc_codegen.description.terms import multiplier
from mechc_codegen.ir.passes.optimize import optimize
from mechc_codegen.ir.sensitivity import add_sensitivities
from mechc_codegen.library.chains.windows import windows
from sympy import Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support import scenes
from tests.support.linkages.jointed import chain
from tests.support.marks import slow_among

JACOBIANS = ("state_jacobian", "parameter_jacobian")
SCENES = ("four_bar", "everything", "swing", "guided swing", "bead")
STATES = 3
Rates = Callable[[list[mpmath.mpf]], list[mpmath.mpf]]


@cache
def model(scene: str) -> mechc.Model:
    return mechc.compile(scenes.SCENES[scene](), outputs=(*JACOBIANS, "points", "accelerations"))


@cache
def exact_rates(scene: str) -> Rates:
    """State rates as a function of (t, q, u, p), solved from the equations as they were derived."""
    names = ("coordinate_rates", "mass_matrix", "forcing", "constraint_jacobian", "gamma")
    derived = scenes.equations(scene)
    evaluate, size = scenes.exact(derived, *names), len(derived.symbols.u)

    def rates(x: list[mpmath.mpf]) -> list[mpmath.mpf]:
        kinematics, mass, forcing, jacobian, gamma = evaluate(*x)
        rows = len(gamma)
        saddle = mpmath.zeros(size + rows)
        for i in range(size):
            for j in range(size):
                saddle[i, j] = mass[i * size + j]
            for k in range(rows):
                saddle[i, size + k] = saddle[size + k, i] = jacobian[k * size + i]
        solution = mpmath.lu_solve(saddle, mpmath.matrix([*forcing, *gamma]))
        return [*kinematics, *list(solution)[:size]]

    return rates


def exact_jacobian(rates: Rates, x: list[Any], columns: range) -> Any:
    """By central differences with a step of 1e-18 in 50 digits."""
    step, found = mpmath.mpf(10) ** -18, []
    for k in columns:
        sides = []
        for sign in (1, -1):
            moved = list(map(mpmath.mpf, x))
            moved[k] += sign * step
            sides.append(rates(moved))
        found.append([float((a - b) / (2 * step)) for a, b in zip(*sides, strict=True)])
    return np.array(found).T


@pytest.mark.parametrize(
    "scene", slow_among(SCENES, {"four_bar", "everything", "guided swing", "swing"})
)
def test_jacobians_are_the_derivatives_of_the_rates(scene: str) -> None:
    made, rng = model(scene), np.random.default_rng(5)
    size, parameters = len(made.coordinates) + len(made.speeds), len(made.parameters)
    assert made.capsule  # all of it, in lanes
    for _ in range(STATES):
        t, y, p = (
            rng.uniform(0, 5),
            rng.normal(0, 1, size),
            10 ** rng.uniform(-0.5, 0.5, parameters),
        )
        with mpmath.workdps(50):
            x = [t, *y.tolist(), *p.tolist()]
            by_state = exact_jacobian(exact_rates(scene), x, range(1, 1 + size))
            by_parameters = exact_jacobian(
                exact_rates(scene), x, range(1 + size, 1 + size + parameters)
            )
        found = made.state_jacobian(y, p, t)
        np.testing.assert_allclose(found, by_state, atol=3e-12 * np.abs(by_state).max(), rtol=0)
        if parameters:
            found, scale = made.parameter_jacobian(y, p, t), np.abs(by_parameters).max()
            np.testing.assert_allclose(found, by_parameters, atol=3e-12 * scale, rtol=0)


@pytest.mark.slow
def test_the_first_unit_has_the_same_jacobians() -> None:
    rng = np.random.default_rng(2)
    y, asked = rng.normal(0, 1, (5, 6)), {"outputs": JACOBIANS, "fix": {"g": 9.5}}
    first = mechc.compile(scenes.SCENES["guided swing"](), **asked)
    found = first.state_jacobian(y, t=0.4)
    made = mechc.Model(first.system.replaced_scene(Scene(first.capsule)))  # with all its parts
    whole = made.state_jacobian(y, t=0.4)
    difference = np.abs(found - whole).max()
    assert difference < 1e-12 * np.abs(whole).max()
    assert whole.shape == (5, 6, 6)


@pytest.mark.parametrize("scene", SCENES)
def test_accelerations_of_points_are_rates_of_their_velocities(scene: str) -> None:
    made, rng, h = model(scene), np.random.default_rng(8), 1e-4
    y = rng.normal(0, 1, len(made.coordinates) + len(made.speeds))
    rates = made.rhs(0.3, y)
    at = [made.point_velocities(y + k * h * rates, t=0.3 + k * h) for k in (-2, -1, 1, 2)]
    slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * h)
    found = made.point_accelerations(y, t=0.3)
    np.testing.assert_allclose(found, slope, atol=1e-9 * np.abs(slope).max(), rtol=0)


def test_outputs_of_ones_own_may_hold_accelerations_and_multipliers() -> None:
    u, q = dynamicsymbols("omega_0"), dynamicsymbols("theta_0")
    t = dynamicsymbols._t
    mechanism = scenes.SCENES["four_bar"]()
    rows = mechanism.rows
    own = {
        "hub": Symbol("I_0") * u.diff(t) + multiplier(0),
        "second": q.diff(t, 2) + multiplier(rows[1]),
    }
    made = mechc.compile(mechanism, outputs=("multipliers", own))
    y = made.assemble({"theta_0": 1.1}, {"omega_0": 2.0})
    rates, multipliers = made.rhs(0.0, y), made.multipliers(y)
    hub = made.defaults["I_0"] * rates[3] + multipliers[0]
    np.testing.assert_allclose(made.output("hub", y), hub, rtol=1e-14)
    np.testing.assert_allclose(made.output("second", y), rates[3] + multipliers[1], rtol=1e-14)


@pytest.mark.parametrize(("mechanism", "speeds"), [(windows(2), 5), (chain(3), 3)])
@pytest.mark.slow
def test_a_trees_jacobians_are_those_of_the_equations_written_out(
    mechanism: Mechanism, speeds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = {"own": multiplier(1)} if mechanism.closures else {}
    asked = {"outputs": (*JACOBIANS, own) if own else JACOBIANS}
    made = []
    for least in (speeds, speeds + 1):
        monkeypatch.setattr(derive_equations, "LEAST_TREE", least)
        monkeypatch.setattr(derive_equations, "LEAST_WRITTEN", least)
        made.append(mechc.compile(mechanism, name=f"least_{least}", **asked))  # not from the cache
    walked, written = made
    assert (walked.system.data["walked"] > 0, written.system.data["walked"]) == (True, 0)
    rng = np.random.default_rng(4)
    y, p = rng.normal(0, 1, (3, 2 * speeds)), rng.uniform(0.5, 2, len(walked.parameters))
    for name in JACOBIANS:
        found, expected = (getattr(m, name)(y, p, 0.2) for m in (walked, written))
        assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()
        if own:
            found, expected = (getattr(m, name)(y, p, 0.2, of="own") for m in (walked, written))
            assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("scene", SCENES)
def test_sensitivities_leave_the_program_as_it_was(scene: str) -> None:
    before = optimize(scenes.lowered(scene))
    after = add_sensitivities(
        before, OutputRequest(frozenset((*USUAL, *JACOBIANS))), (), Derivatives(other=slope)
    )
    names = {o.name for o in before.outputs}
    assert tuple(o for o in after.outputs if o.name in names) == before.outputs
    assert [s for s in after.body if s in before.body] == list(before.body)
    assert add_sensitivities(before, OutputRequest(), (), Derivatives(other=slope)) is before


def test_what_was_not_asked_for_is_not_emitted() -> None:
    texts = build_scene(scenes.SCENES["four_bar"]()).texts
    assert "#define MECHC_STATE_JACOBIAN 0" in texts["scene_sizes.h"]
    assert "solved_" not in texts["scene_program.h"]
    assert "residual" not in texts["scene_program.h"]
