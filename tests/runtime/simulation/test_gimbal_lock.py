"""Beside gimbal lock a run says that its tolerance does not hold, and why.

Judged by a ball turned by three angles, which spins about a fixed axis: its attitude is known.
"""

import numpy as np
import pytest
from sympy import cos, sin
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

T_END = 1.0  # s, with 1 rad/s: the lock is half way


def ball(name, speeds_are_rates):
    """Turned about x, y and z in turn; its speeds are the angles' rates, or along its own axes."""
    (a, b, c), u = dynamicsymbols("a b c"), dynamicsymbols("u_1:4")
    t, N, O = dynamicsymbols._t, ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    B = N.orientnew("B", "Body", (a, b, c), "XYZ")
    rates = u
    if not speeds_are_rates:
        B.set_ang_vel(N, u[0] * B.x + u[1] * B.y + u[2] * B.z)
        across = u[0] * cos(c) - u[1] * sin(c)
        rates = [across / cos(b), u[0] * sin(c) + u[1] * cos(c), u[2] - across * sin(b) / cos(b)]
    kinematics = [q.diff(t) - rate for q, rate in zip((a, b, c), rates, strict=True)]
    kane = KanesMethod(N, [a, b, c], u, kinematics)
    kane.kanes_equations([RigidBody("ball", O, B, 1, (inertia(B, 1, 1, 1), O))], [])
    return mechc.compile(kane, name=name, outputs=())


@pytest.fixture(scope="module")
def by_rates():
    return ball("by_rates", speeds_are_rates=True)


def start(model, beside):
    """An angle of 0.5 rad before the lock, the spin so much off the middle axis."""
    b, spin = np.pi / 2 - 0.5, np.array([beside, 1.0, 0.0])
    axes = np.array([[np.cos(b), 0, 0], [0, 1, 0], [np.sin(b), 0, 1]])  # of the rates, at c = 0
    speeds = np.linalg.solve(axes, spin) if model.name == "by_rates" else spin
    return np.array([0.0, b, 0.0, *speeds])


def attitude(angles):
    a, b, c = angles
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return x @ y @ z


def exact(beside):
    """The attitude after the spin about an axis fixed in the ball (Rodrigues)."""
    spin = np.array([beside, 1.0, 0.0])
    angle = np.linalg.norm(spin) * T_END
    x, y, z = spin / np.linalg.norm(spin)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    return attitude([0.0, np.pi / 2 - 0.5, 0.0]) @ turned


def error(sol, beside):
    return np.abs(attitude(sol.q[-1]) - exact(beside)).max()


def test_beside_the_lock_a_run_warns_of_what_rounding_does(by_rates):
    """Before and after: without the warning at a distance, with it where the error is larger."""
    far = by_rates.simulate(T_END, start(by_rates, 1e-2), rtol=1e-9)
    assert not far.status.warnings
    assert error(far, 1e-2) < 1e-9
    near = by_rates.simulate(T_END, start(by_rates, 1e-5), rtol=1e-9)
    (warning,) = near.status.warnings
    closest = 1e-5 * np.sin(0.5)  # of the spin's axis and the lock
    assert f"b comes within {closest:.2g} rad of gimbal lock, where a and c turn B" in warning
    assert "mechc.BallJoint" in warning
    assert error(near, 1e-5) > 1e-9  # or else the warning is idle


def test_at_the_lock_the_status_names_it(by_rates):
    sol = by_rates.simulate(T_END, start(by_rates, 1e-9))
    assert not sol.status.ok
    assert "of gimbal lock, where a and c turn B about the same axis" in sol.status.cause
    assert "BallJoint" in sol.status.advice
    assert "friction" not in str(sol.status)
    assert sol.status.t == pytest.approx(0.5, abs=1e-3)


def test_what_ends_a_run_beside_the_lock_for_another_reason_stays_its_cause(by_rates):
    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(mechc.RunInterrupt) as caught:
        by_rates.simulate(T_END, [0, np.pi / 2 - 1e-6, 0, 0, 0, 0], progress=interrupt)
    status = caught.value.solution.status
    assert status.code == "interrupted"
    assert "gimbal" not in str(status)


def test_batches_and_steppers_name_the_lock_too(by_rates):
    starts = [start(by_rates, beside) for beside in (1e-2, 1e-9, 1e-10)]
    batch = by_rates.simulate_batch(T_END, starts)
    assert batch.ok.tolist() == [True, False, False]
    assert "where a and c turn B about the same axis" in batch.status(1).cause
    (note,) = [told for told in batch.warnings if "gimbal lock" in told]
    assert note.startswith("2 members ended beside gimbal lock: at the nearest b comes within")
    stepper = by_rates.stepper(starts[1])
    with pytest.raises(mechc.StepError, match="of gimbal lock, where a and c turn B"):
        stepper.step(T_END)


def test_angular_velocities_as_speeds_pass_it():
    model = ball("by_spins", speeds_are_rates=False)
    for beside in (1e-3, 1e-6):
        sol = model.simulate(T_END, start(model, beside))
        assert not sol.status.warnings
        assert error(sol, beside) < 1e-9
