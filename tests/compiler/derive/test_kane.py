"""The derived equations are the mechanism's: against derivations that share nothing with them."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from functools import cache

import mpmath
import pytest
from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.derive.equations import Equations
from mechc_codegen.derive.kane import derive
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.ir.lower import lower
from mechc_codegen.library.catalogue import shipped_mechanism
from sympy import Expr, Matrix, cos, diff, hessian, lambdify, sin
from sympy.physics.mechanics import KanesMethod

from tests.support import scenes

State = list[mpmath.mpf]
DIGITS = 40
TINY = mpmath.mpf(10) ** -28


@pytest.fixture(autouse=True)
def digits() -> Iterator[None]:
    with mpmath.workdps(DIGITS):
        yield


def random_inputs(derived: Equations, seed: int) -> State:
    """Time, angles over several turns, speeds, positive parameters."""
    rng = random.Random(seed)
    symbols = derived.symbols
    ranges = [(0.0, 3.0), *[(-20.0, 20.0)] * len(symbols.q), *[(-5.0, 5.0)] * len(symbols.u)]
    ranges += [(0.2, 5.0)] * len(symbols.parameters)
    return [mpmath.mpf(rng.uniform(*limits)) for limits in ranges]


@cache
def evaluator(scene: str, *names: str) -> Callable[..., list[State]]:
    return scenes.exact(scenes.equations(scene), *names)


def close(one: Sequence[mpmath.mpf], other: Sequence[mpmath.mpf]) -> bool:
    scale = 1 + max(abs(x) for x in one)
    return (
        len(one) == len(other)
        and max(abs(a - b) for a, b in zip(one, other, strict=True)) < TINY * scale
    )


# -- the four-bar by hand ---------------------------------------------------------------------


def by_hand() -> dict[str, list[Expr]]:
    """The four-bar from coordinates alone: positions by sines and cosines, Lagrange's equations.

    Absolute angles q, u = q'; M is the Hessian of T by u; with Lagrange's equations
    d/dt dT/du - dT/dq + dV/dq = 0 without the multipliers, F is what is left at u' = 0.
    """
    s = scenes.equations("four_bar").symbols
    q, u = s.q, s.u
    l, m, inertia, g = s.parameters[:4], s.parameters[4:7], s.parameters[7:10], s.parameters[10]
    joints = [(0, 0)]
    centres = []
    for k in range(3):
        x, y = joints[-1]
        centres.append((x + l[k] / 2 * cos(q[k]), y + l[k] / 2 * sin(q[k])))
        joints.append((x + l[k] * cos(q[k]), y + l[k] * sin(q[k])))

    def rate(expression: Expr) -> Expr:
        return sum(diff(expression, q[k]) * u[k] for k in range(3))

    velocities = [(rate(x), rate(y)) for x, y in centres]
    kinetic = sum(
        m[k] * (velocities[k][0] ** 2 + velocities[k][1] ** 2) / 2 + inertia[k] * u[k] ** 2 / 2
        for k in range(3)
    )
    potential = sum(m[k] * g * centres[k][1] for k in range(3))
    gap = [joints[3][0] - l[3], joints[3][1]]
    spatial = [[*p, 0] for p in [*joints, *centres]]
    return {
        "mass_matrix": list(hessian(kinetic, u)),
        "forcing": [
            diff(kinetic, q[k]) - diff(potential, q[k]) - rate(diff(kinetic, u[k]))
            for k in range(3)
        ],
        "constraints": gap,
        "constraint_jacobian": list(Matrix(gap).jacobian(q)),
        "velocity_constraints": [rate(e) for e in gap],
        "gamma": [-rate(rate(e)) for e in gap],
        "kinetic_energy": [kinetic],
        "potential_energy": [potential],
        "linear_momenta": [m[k] * v for k in range(3) for v in (*velocities[k], 0)],
        "angular_momenta": [
            h
            for k, ((x, y), (vx, vy)) in enumerate(zip(centres, velocities, strict=True))
            for h in (0, 0, m[k] * (x * vy - y * vx) + inertia[k] * u[k])
        ],
        "points": [c for p in spatial for c in p],
        "point_velocities": [rate(c) if c else 0 for p in spatial for c in p],
        "preference": [sin(q[1] - q[2])],
        "coordinate_rates": list(u),
    }


@cache
def by_hand_evaluator(name: str) -> Callable[..., State]:
    derived = scenes.equations("four_bar")
    evaluate: Callable[..., State] = lambdify(
        scenes.arguments(derived), by_hand()[name], modules="mpmath", cse=True
    )
    return evaluate


@pytest.mark.parametrize("name", by_hand())
def test_the_four_bar_is_the_one_of_the_textbook(name: str) -> None:
    for seed in range(5):
        inputs = random_inputs(scenes.equations("four_bar"), seed)
        (derived,) = evaluator("four_bar", name)(*inputs)
        assert close(derived, by_hand_evaluator(name)(*inputs))


def test_nothing_derived_is_left_unproven() -> None:
    derived = {name for name, o in scenes.equations("four_bar").outputs.items() if o.elements}
    assert derived - set(by_hand()) == {"constraint_gradient", "kinematic_matrix"}


# -- every scene ------------------------------------------------------------------------------

CONSTRAINED = ["four_bar", "everything", "guided swing"]


def moved(scene: str, inputs: State, by: mpmath.mpf) -> State:
    """The inputs a moment later: time and coordinates go on, speeds stay."""
    symbols = scenes.equations(scene).symbols
    (rates,) = evaluator(scene, "coordinate_rates")(*inputs)
    count = len(symbols.q)
    q = [x + by * rate for x, rate in zip(inputs[1 : 1 + count], rates, strict=True)]
    return [inputs[0] + by, *q, *inputs[1 + count :]]


def numeric_rate(scene: str, name: str, inputs: State) -> State:
    """Central difference along the motion at constant speeds."""
    step = mpmath.mpf(10) ** -13
    (ahead,) = evaluator(scene, name)(*moved(scene, inputs, step))
    (behind,) = evaluator(scene, name)(*moved(scene, inputs, -step))
    return [(a - b) / (2 * step) for a, b in zip(ahead, behind, strict=True)]


def nearly(one: State, other: State) -> bool:
    scale = 1 + max([abs(x) for x in one], default=mpmath.mpf(0))
    return all(abs(a - b) < scale * mpmath.mpf("1e-20") for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("scene", CONSTRAINED)
def test_velocity_constraints_are_rates_and_linear_in_the_speeds(scene: str) -> None:
    """rate of the closure = first rows of J u + b; b, as lowered, is what is left at rest."""
    derived = scenes.equations(scene)
    inputs = random_inputs(derived, 1)
    names = ("velocity_constraints", "constraint_jacobian")
    velocity, jacobian = evaluator(scene, *names)(*inputs)
    assert nearly(numeric_rate(scene, "constraints", inputs), velocity[: derived.holonomic])
    count, size = len(derived.symbols.q), len(derived.symbols.u)
    u = inputs[1 + count : 1 + count + size]
    at_rest = [*inputs[: 1 + count], *[mpmath.mpf(0)] * size, *inputs[1 + count + size :]]
    (bias,) = evaluator(scene, "velocity_constraints")(*at_rest)
    rows = [jacobian[k * size : (k + 1) * size] for k in range(len(velocity))]
    assert close(velocity, [mpmath.fdot(r, u) + b for r, b in zip(rows, bias, strict=True)])
    emitted = {o.name for o in lower(derived).outputs}
    assert ("velocity_bias" in emitted) == any(b != 0 for b in bias)


@pytest.mark.parametrize("scene", CONSTRAINED)
def test_gamma_is_minus_the_rate_of_the_velocity_constraints(scene: str) -> None:
    """J u' = gamma says d/dt (J u + b) = 0, by numeric differentiation along the motion."""
    inputs = random_inputs(scenes.equations(scene), 2)
    (gamma,) = evaluator(scene, "gamma")(*inputs)
    rates = numeric_rate(scene, "velocity_constraints", inputs)
    assert nearly(rates, [-g for g in gamma])
    assert any(abs(g) > 0.01 for g in gamma)


@pytest.mark.parametrize("scene", scenes.SCENES)
def test_the_mass_matrix_is_symmetric_positive_definite_and_of_the_kinetic_energy(
    scene: str,
) -> None:
    """T is half u'M u where nothing moves by itself, and always has M as its Hessian."""
    derived = scenes.equations(scene)
    u = derived.symbols.u
    hessian_of_t = list(hessian(derived.outputs["kinetic_energy"].elements[0], u))
    inputs = random_inputs(derived, 3)
    (mass,) = evaluator(scene, "mass_matrix")(*inputs)
    known = dict(zip(scenes.arguments(derived), inputs, strict=True))
    assert close(mass, [scenes.value(e, known) for e in hessian_of_t])
    matrix = mpmath.matrix(len(u), len(u))
    for k, entry in enumerate(mass):
        matrix[k // len(u), k % len(u)] = entry
    assert matrix == matrix.T
    mpmath.cholesky(matrix)  # raises unless positive definite


# -- against SymPy's own Kane -----------------------------------------------------------------


def accelerations(mass: State, forcing: State, jacobian: State, gamma: State) -> State:
    """u' and multipliers of M u' + J^T lambda = F, J u' = gamma."""
    size, rows = len(forcing), len(gamma)
    saddle = mpmath.matrix(size + rows, size + rows)
    for i in range(size):
        for j in range(size):
            saddle[i, j] = mass[i * size + j]
    for i in range(rows):
        for j in range(size):
            saddle[size + i, j] = saddle[j, size + i] = jacobian[i * size + j]
    return list(mpmath.lu_solve(saddle, mpmath.matrix([*forcing, *gamma])))


MOTION = ("mass_matrix", "forcing", "constraint_jacobian", "gamma")


def motion(scene: str, inputs: State) -> State:
    return accelerations(*evaluator(scene, *MOTION)(*inputs))


@pytest.mark.parametrize("scene", ["swing", "bead"])
def test_accelerations_are_those_of_sympys_kanes_method(scene: str) -> None:
    mechanism: Mechanism = scenes.SCENES[scene]()
    kane = KanesMethod(
        mechanism.frame,
        q_ind=mechanism.q,
        u_ind=mechanism.u,
        kd_eqs=[rate - q for q, rate in mechanism.rates.items()],
    )
    kane.kanes_equations(list(mechanism.bodies), list(mechanism.loads))
    derived = scenes.equations(scene)
    named = [*mechanism.q, *mechanism.u, *(p.symbol for p in mechanism.parameters)]
    ours = [*derived.symbols.q, *derived.symbols.u, *derived.symbols.parameters]
    plain = dict(zip(named, ours, strict=True)) | {scenes.t: derived.symbols.time}
    outputs = [list(matrix.xreplace(plain)) for matrix in (kane.mass_matrix, kane.forcing)]
    reference = lambdify(scenes.arguments(derived), outputs, modules="mpmath", cse=True)
    for seed in range(3):
        inputs = random_inputs(derived, seed)
        assert close(
            motion(scene, inputs), accelerations(*reference(*inputs), jacobian=[], gamma=[])
        )


# -- options of the four-bar ------------------------------------------------------------------

OPTIONS = {
    "crank_torque": {"T_0"},
    "crank_speed": {"Omega_0"},
    "friction": {"c_0", "c_1", "c_2", "c_3"},
    "coupler_point": {"x_C", "y_C"},
    "placed": {"x_O", "y_O", "alpha"},
}


@pytest.mark.parametrize("option", OPTIONS)
def test_an_option_brings_its_parameters_and_is_gone_without(option: str) -> None:
    plain = {str(p.symbol) for p in shipped_mechanism("four_bar").parameters}
    mechanism = shipped_mechanism("four_bar", {option: True})
    brought = {str(p.symbol) for p in mechanism.parameters} - plain
    assert brought == OPTIONS[option]
    derived = differentiate(derive(mechanism))
    extra = set(derived.symbols.parameters[len(plain) :])
    used = {s for o in derived.outputs.values() for e in o.elements for s in e.free_symbols}
    assert extra <= used
    assert option not in mechanism.skipped
    assert mechanism.skipped == tuple(o for o in OPTIONS if o != option)
    assert option in shipped_mechanism("four_bar").skipped
    base = scenes.equations("four_bar").outputs
    changed = {
        name for name, output in derived.outputs.items() if output.elements != base[name].elements
    }
    speeds = {"motion_constraints", "velocity_constraints", "constraint_jacobian", "gamma"}
    points = {"points", "point_velocities"}
    assert (
        changed
        == {
            "crank_torque": {"forcing"},
            "friction": {"forcing"},
            "crank_speed": speeds,
            "coupler_point": points,
            "placed": {"constraints", "points", "angular_momenta", "potential_energy"},
        }[option]
    )


def test_torque_and_friction_enter_the_forcing_by_their_power() -> None:
    """F . u grows by T_0 omega_0 less c_k times the square of each joint's relative speed."""
    derived = differentiate(
        derive(shipped_mechanism("four_bar", {"crank_torque": True, "friction": True}))
    )
    inputs = random_inputs(derived, 5)
    plain = inputs[: 1 + 6 + 11]
    (with_loads,) = scenes.exact(derived, "forcing")(*inputs)
    (without,) = evaluator("four_bar", "forcing")(*plain)
    u = inputs[4:7]
    torque, *friction = inputs[-5:]
    relative = [u[0], u[1] - u[0], u[2] - u[1], -u[2]]
    power = torque * u[0] - sum(c * w**2 for c, w in zip(friction, relative, strict=True))
    assert close([mpmath.fdot(with_loads, u) - mpmath.fdot(without, u)], [power])
    assert close([with_loads[0] - without[0]], [torque - friction[0] * u[0]
                                                + friction[1] * (u[1] - u[0])])  # fmt: skip


def test_the_coupler_point_moves_with_the_coupler() -> None:
    derived = differentiate(derive(shipped_mechanism("four_bar", {"coupler_point": True})))
    inputs = random_inputs(derived, 6)
    points, velocities = scenes.exact(derived, "points", "point_velocities")(*inputs)
    q, u, l = inputs[1:4], inputs[4:7], inputs[7]
    x, y = inputs[-2:]
    arm = mpmath.mpc(x, y) * mpmath.expj(q[1])
    place = l * mpmath.expj(q[0]) + arm
    speed = 1j * (u[0] * l * mpmath.expj(q[0]) + u[1] * arm)
    assert close(points[-3:], [place.real, place.imag, mpmath.mpf(0)])
    assert close(velocities[-3:], [speed.real, speed.imag, mpmath.mpf(0)])


# -- power balance ----------------------------------------------------------------------------


def energy_rate(derived: Equations, inputs: State, u_dot: State) -> mpmath.mpf:
    """dE/dt along the motion, by the chain rule on T + V."""
    energy = [derived.outputs[k].elements[0] for k in ("kinetic_energy", "potential_energy")]
    s = derived.symbols
    by = [diff(sum(energy), x) for x in (*s.q, *s.u, s.time)]
    gradient = lambdify(scenes.arguments(derived), by, modules="mpmath", cse=True)(*inputs)
    (rates,) = scenes.exact(derived, "coordinate_rates")(*inputs)
    return mpmath.fdot(gradient, [*rates, *u_dot, mpmath.mpf(1)])


def consistent(jacobian: State, bias: State, u: State) -> State:
    """The speeds nearest to u with J u + b = 0."""
    size = len(u)
    unit = [mpmath.mpf(int(i == j)) for i in range(size) for j in range(size)]
    return accelerations(unit, u, jacobian, [-b for b in bias])[:size]


def test_the_four_bars_energy_changes_by_torque_friction_and_drive() -> None:
    """dE/dt = T_0 omega_0 - sum c w^2 + b . lambda: closure itself does no work."""
    options = {"crank_torque": True, "friction": True, "crank_speed": True}
    mechanism = shipped_mechanism("four_bar", options)
    derived = differentiate(derive(mechanism))
    last = ["T_0", "Omega_0", "c_0", "c_1", "c_2", "c_3"]
    assert [str(p.symbol) for p in mechanism.parameters[-6:]] == last
    jacobian_at, motion_at = (scenes.exact(derived, *n) for n in (("constraint_jacobian",), MOTION))
    for seed in range(2):
        inputs = random_inputs(derived, seed)
        torque, drive, *friction = inputs[-6:]
        (jacobian,) = jacobian_at(*inputs)
        bias = [mpmath.mpf(0), mpmath.mpf(0), -drive]
        inputs[4:7] = u = consistent(jacobian, bias, inputs[4:7])
        u_dot_and_forces = accelerations(*motion_at(*inputs))
        relative = [u[0], u[1] - u[0], u[2] - u[1], -u[2]]
        lost = sum(c * w**2 for c, w in zip(friction, relative, strict=True))
        drive_power = -drive * u_dot_and_forces[5]
        expected = torque * u[0] - lost + drive_power
        assert close([energy_rate(derived, inputs, u_dot_and_forces[:3])], [expected])


def test_an_unloaded_four_bar_keeps_its_energy() -> None:
    derived = scenes.equations("four_bar")
    inputs = random_inputs(derived, 8)
    (jacobian,) = evaluator("four_bar", "constraint_jacobian")(*inputs)
    inputs[4:7] = consistent(jacobian, [mpmath.mpf(0)] * 2, inputs[4:7])
    assert abs(energy_rate(derived, inputs, motion("four_bar", inputs)[:3])) < TINY * 1000


def test_the_swings_energy_changes_by_force_and_friction() -> None:
    """Also where speeds are not the rates of the coordinates."""
    derived = scenes.equations("swing")
    for seed in range(3):
        inputs = random_inputs(derived, seed)
        (rates,) = evaluator("swing", "coordinate_rates")(*inputs)
        time, c, f, w = inputs[0], inputs[-3], inputs[-1], inputs[5]
        force = f * mpmath.sin(5 * time) * mpmath.exp(-time / 9)
        expected = force * rates[0] - c * w * rates[1]
        assert close([energy_rate(derived, inputs, motion("swing", inputs))], [expected])


def test_nothing_is_expanded_or_simplified() -> None:
    """A link's own axes cost no trigonometry: the diagonal of M has none."""
    mass = scenes.equations("four_bar").outputs["mass_matrix"].elements
    for k in range(3):
        assert not mass[4 * k].has(sin, cos)
    assert mass[1].has(sin, cos)
