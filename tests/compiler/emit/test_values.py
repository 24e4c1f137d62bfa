"""Compiled code gives the values of the equations, against 30-digit evaluation of them."""

from __future__ import annotations

from functools import cache

import mpmath
import numpy as np
import pytest

import mechc
from tests.support import scenes
from tests.support.exact_values import OUTPUTS, Array, Reference

STATES = 1000


@cache
def model(scene: str, instruction_set: str | None = None) -> mechc.Model:
    if scene == "four_bar":
        return mechc.load("four_bar", instruction_set=instruction_set)
    if scene == "everything":
        return mechc.load("four_bar", instruction_set=None, **scenes.EVERYTHING)
    return mechc.compile(scenes.SCENES[scene]())


def here(instruction_set: str) -> bool:
    try:
        mechc.load("four_bar", instruction_set=instruction_set)
    except ValueError:
        return False
    return True


SETS = [s for s in ("baseline", "avx2", "avx512") if here(s)]


@cache
def reference(scene: str) -> Reference:
    return Reference(scene, STATES if scene == "four_bar" else STATES // 10)


def compiled(made: mechc.Model, name: str, at: Reference) -> Array:
    """An output through the public interface."""
    if name.endswith("_momenta"):
        return np.asarray(getattr(made.momenta(at.y, at.p, at.t), name.removesuffix("_momenta")))
    if name == "coordinate_rates":
        return made.rhs(at.t, at.y, at.p)[:, : len(made.coordinates)]
    return np.asarray(getattr(made, name)(at.y, at.p, at.t))


# -- outputs ----------------------------------------------------------------------------------


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("name", OUTPUTS)
@pytest.mark.parametrize("instruction_set", SETS)
def test_the_four_bar_agrees_with_30_digits(instruction_set: str, name: str) -> None:
    at = reference("four_bar")
    at.check(name, compiled(model("four_bar", instruction_set), name, at))


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("scene", sorted(set(scenes.SCENES) - {"four_bar"}))
def test_scenes_compiled_on_demand_agree_with_30_digits(scene: str) -> None:
    at, made = reference(scene), model(scene)
    for name in at.names:
        at.check(name, compiled(made, name, at))


@pytest.mark.parametrize("instruction_set", SETS)
def test_one_state_gives_what_many_give(instruction_set: str) -> None:
    """To the bit, whatever lane a state falls in and whoever its neighbours are."""
    at, made = reference("four_bar"), model("four_bar", instruction_set)
    for name in ("mass_matrix", "points", "multipliers"):
        evaluate = getattr(made, name)
        together = evaluate(at.y[:11], at.p[:11])
        for k in range(11):
            np.testing.assert_array_equal(evaluate(at.y[k], at.p[k]), together[k])
    broken = at.y[:11].copy()
    broken[4] = np.nan
    others = np.arange(11) != 4
    rates = made.rhs(0.0, broken, at.p[:11])
    np.testing.assert_array_equal(rates[others], made.rhs(0.0, at.y[:11], at.p[:11])[others])
    assert np.all(np.isnan(rates[4]))


# -- accelerations and multipliers ------------------------------------------------------------


def check_motion(at: Reference, made: mechc.Model) -> None:
    accelerations = made.rhs(at.t, at.y, at.p)[:, -len(made.speeds) :]
    at.check_motion(np.hstack([accelerations, made.multipliers(at.y, at.p, at.t)]))


@pytest.mark.parametrize("instruction_set", SETS)
def test_accelerations_and_multipliers_of_the_four_bar(instruction_set: str) -> None:
    check_motion(reference("four_bar"), model("four_bar", instruction_set))


@pytest.mark.parametrize("scene", sorted(set(scenes.SCENES) - {"four_bar"}))
def test_accelerations_and_multipliers_of_scenes_compiled_on_demand(scene: str) -> None:
    check_motion(reference(scene), model(scene))


# -- sine and cosine --------------------------------------------------------------------------


def angles() -> Array:
    """Small, ordinary and huge angles, and the doubles nearest to multiples of pi/2."""
    rng = np.random.default_rng(3)
    with mpmath.workdps(400):
        quarters = [float(k * mpmath.pi / 2) for k in [*range(1, 40), 636_619, 636_620, 10**9]]
    huge = [1e5, 1e6, np.nextafter(1e6, 2e6), 1e6 + 1, 1e15, 1e22, 1e300, np.finfo(float).max]
    tiny = [0.0, 5e-324, 1e-300, 1e-20, 1e-8]
    spread = rng.uniform(-1, 1, 500) * 10.0 ** rng.integers(-3, 17, 500)
    positive = np.array([*quarters, *huge, *tiny])
    return np.concatenate([positive, -positive, spread])


@pytest.mark.parametrize("instruction_set", SETS)
def test_sine_and_cosine_are_right_at_every_angle(instruction_set: str) -> None:
    """Within 4 units in the last place of the value itself, through the point p_1 = (cos, sin)."""
    made, theta = model("four_bar", instruction_set), angles()
    y = np.zeros((len(theta), 6))
    y[:, 0] = theta
    point = made.points(y, {"l_0": 1.0})[:, made.point_names.index("p_1")]
    with mpmath.workdps(700):
        exact = [(mpmath.cos(x), mpmath.sin(x)) for x in map(mpmath.mpf, theta.tolist())]
        for one, (x, y_), found in zip(theta, exact, point.tolist(), strict=True):
            for wanted, got in ((x, found[0]), (y_, found[1])):
                assert abs(got - wanted) <= 4 * np.spacing(abs(float(wanted))), (one, got)
    assert np.all(point[:, 2] == 0)


def test_angles_that_are_not_finite_give_nan_there_alone() -> None:
    made = model("four_bar")
    y = np.zeros((9, 6))
    y[[1, 5], 0] = np.inf, np.nan
    points = made.points(y)
    bad = np.isnan(points).any(axis=(1, 2))
    assert bad.tolist() == [k in (1, 5) for k in range(9)]
