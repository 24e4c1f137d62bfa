"""What a model computes: right, fresh, of the promised shape, vectorised and reentrant."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from tests.support import fake_linkage

EPS = np.finfo(float).eps
SHAPES = {
    "rhs": (6,),
    "mass_matrix": (3, 3),
    "forcing": (3,),
    "constraints": (2,),
    "velocity_constraints": (2,),
    "constraint_jacobian": (2, 3),
    "multipliers": (2,),
    "kinetic_energy": (),
    "potential_energy": (),
    "energy": (),
    "points": (7, 3),
    "point_velocities": (7, 3),
    "linear": (3, 3),
    "angular": (3, 3),
}
every_output = pytest.mark.parametrize("name", SHAPES)


def output(model, name, y, params=None, t=0.0):
    if name == "rhs":
        return model.rhs(t, y, params)
    if name in ("linear", "angular"):
        return getattr(model.momenta(y, params, t), name)
    return getattr(model, name)(y, params, t)


def some_states(*shape):
    return np.random.default_rng(7).normal(size=(*shape, 6))


def some_parameters(model, *shape):
    factors = np.random.default_rng(8).uniform(0.5, 2.0, size=(*shape, len(model.parameters)))
    return factors * np.array(list(model.defaults.values()))


@every_output
def test_shapes_are_those_of_the_documentation(model, name):
    assert output(model, name, some_states()).shape == SHAPES[name]
    assert output(model, name, some_states(2, 5)).shape == (2, 5, *SHAPES[name])
    assert output(model, name, some_states(0)).shape == (0, *SHAPES[name])


@every_output
@pytest.mark.parametrize("count", [1, 3, 8, 17])
def test_many_states_at_once_equal_one_by_one_to_the_bit(model, name, count):
    y, params, t = some_states(count), some_parameters(model, count), np.arange(float(count))
    together = output(model, name, y, params, t)
    for k in range(count):
        np.testing.assert_array_equal(together[k], output(model, name, y[k], params[k], t[k]))


@every_output
def test_leading_axes_broadcast_against_each_other(model, name):
    y, params, t = some_states(4, 1), some_parameters(model, 3), np.zeros((2, 1, 1))
    whole = output(model, name, y, params, t)
    assert whole.shape == (2, 4, 3, *SHAPES[name])
    np.testing.assert_array_equal(whole[1, 2, 1], output(model, name, y[2, 0], params[1]))
    by_name = output(model, name, y[0, 0], {"l_0": np.array([1.0, 1.5])})
    np.testing.assert_array_equal(by_name[1], output(model, name, y[0, 0], {"l_0": 1.5}))


@every_output
def test_results_are_fresh_arrays_and_inputs_stay_as_they_are(model, name):
    y, params = some_states(3), some_parameters(model)
    first = output(model, name, y, params)
    kept = first.copy()
    second = output(model, name, y, params)
    assert not np.shares_memory(first, second)
    first[...] = np.nan
    np.testing.assert_array_equal(second, kept)
    np.testing.assert_array_equal(output(model, name, y, params), kept)
    np.testing.assert_array_equal(y, some_states(3))
    np.testing.assert_array_equal(params, some_parameters(model))


@every_output
def test_states_need_not_be_contiguous(model, name):
    y = some_states(6)
    expected = output(model, name, y)
    np.testing.assert_array_equal(output(model, name, np.asfortranarray(y)), expected)
    np.testing.assert_array_equal(output(model, name, y[::2]), expected[::2])
    np.testing.assert_array_equal(output(model, name, y[::-1]), expected[::-1])
    np.testing.assert_array_equal(output(model, name, y.T[:, 2]), expected[2])
    np.testing.assert_array_equal(output(model, name, y.tolist()), expected)


@every_output
def test_parameters_come_as_nothing_a_mapping_or_an_array(model, name):
    y, defaults = some_states(3), model.defaults
    expected = output(model, name, y)
    np.testing.assert_array_equal(output(model, name, y, {}), expected)
    np.testing.assert_array_equal(output(model, name, y, defaults), expected)
    np.testing.assert_array_equal(output(model, name, y, np.array([*defaults.values()])), expected)
    np.testing.assert_array_equal(output(model, name, y, [*defaults.values()]), expected)


@every_output
@pytest.mark.parametrize("each", ["baseline", "avx2", "avx512"])
def test_instruction_sets_agree_to_rounding(model, name, each):
    try:
        other = mechc.load("four_bar", instruction_set=each)
    except ValueError:
        pytest.skip(f"this processor has no {each}")
    assert other.instruction_set == each
    y = some_states(19)
    expected = output(model, name, y)
    size = np.abs(expected).max()
    np.testing.assert_allclose(output(other, name, y), expected, rtol=0, atol=500 * EPS * size)


def test_an_instruction_set_that_does_not_exist_is_refused():
    with pytest.raises(ValueError, match="'mmx'"):
        mechc.load("four_bar", instruction_set="mmx")


def test_baseline_is_always_there():
    assert mechc.load("four_bar", instruction_set="baseline").instruction_set == "baseline"


def test_energies_and_points_are_those_of_a_linkage_written_down_by_hand(model):
    y, params = some_states(40), {"l_3": fake_linkage.GROUND}
    q, u = y[:, :3], y[:, 3:]
    for got, expected in [
        (model.kinetic_energy(y, params), fake_linkage.kinetic(q, u)),
        (model.potential_energy(y, params), fake_linkage.potential(q)),
        (model.points(y, params), fake_linkage.joints(q)),
        (model.constraints(y, params), fake_linkage.FakeModel().constraints(y)),
        (model.velocity_constraints(y, params), fake_linkage.FakeModel().velocity_constraints(y)),
    ]:
        np.testing.assert_allclose(got, expected, rtol=0, atol=50 * EPS * np.abs(expected).max())
    total = model.kinetic_energy(y, params) + model.potential_energy(y, params)
    np.testing.assert_array_equal(model.energy(y, params), total)


def test_accelerations_satisfy_the_equations_of_motion(model):
    """M u' + J^T lambda = F with M symmetric and positive definite, on the closed loop."""
    y = np.array([model.assemble({"theta_0": a}, {"omega_0": 1.3}) for a in (0.4, 1.5, 2.6)])
    M, F, J = model.mass_matrix(y), model.forcing(y), model.constraint_jacobian(y)
    rates, multipliers = model.rhs(0.0, y), model.multipliers(y)
    np.testing.assert_array_equal(rates[:, :3], y[:, 3:])
    np.testing.assert_array_equal(M, np.swapaxes(M, 1, 2))
    assert (np.linalg.eigvalsh(M) > 0).all()
    balance = np.einsum("nij,nj->ni", M, rates[:, 3:]) + np.einsum("nji,nj->ni", J, multipliers) - F
    assert np.abs(balance).max() < 1e-12 * np.abs(F).max()


def test_accelerations_keep_the_loop_closed(model):
    """The speed at which closure opens does not change: d/dt (J u) = 0, by differences."""
    y = model.assemble({"theta_0": 1.1}, {"omega_0": 2.0})
    rates, h = model.rhs(0.0, y), 1e-5
    change = model.velocity_constraints(y + h * rates) - model.velocity_constraints(y - h * rates)
    assert np.abs(change / (2 * h)).max() < 1e-8


def test_point_velocities_are_the_rates_of_points(model):
    y = some_states(5)
    moved = np.zeros_like(y)
    moved[:, :3] = 1e-6 * y[:, 3:]
    rate = (model.points(y + moved) - model.points(y - moved)) / 2e-6
    np.testing.assert_allclose(model.point_velocities(y), rate, rtol=0, atol=1e-8)


def test_rhs_writes_into_out_and_returns_it(model):
    y, out = some_states(4), np.full((4, 6), np.nan)
    assert model.rhs(0.0, y, out=out) is out
    np.testing.assert_array_equal(out, model.rhs(0.0, y))
    column_wise = np.empty((6, 4)).T
    model.rhs(0.0, y, out=column_wise)
    np.testing.assert_array_equal(column_wise, out)


@pytest.mark.parametrize("method", ["RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA"])
def test_ode_serves_every_method_of_scipy(model, regular, method):
    params, start = regular
    done = solve_ivp(model.ode(params), (0, 0.5), start, method=method, rtol=1e-8, atol=1e-8)
    assert done.success
    np.testing.assert_allclose(done.y[:, -1], fake_linkage.exact_state(np.array(0.5)), atol=1e-5)


def test_rhs_itself_serves_scipy_vectorised(model, regular):
    """Radau asks for several states at once, as columns of an array."""
    params, start = regular
    done = solve_ivp(
        lambda t, y: model.rhs(t, y.T, params).T, (0, 0.5), start, method="Radau",
        vectorized=True, rtol=1e-8, atol=1e-8,
    )  # fmt: skip
    np.testing.assert_allclose(done.y[:, -1], fake_linkage.exact_state(np.array(0.5)), atol=1e-5)


def test_ode_keeps_the_parameters_it_was_given(model):
    values, y = np.array([*model.defaults.values()]), some_states()
    ode = model.ode(values)
    before = ode(0.0, y)
    values[:] = 7.0
    np.testing.assert_array_equal(ode(0.0, y), before)


def test_ode_takes_whatever_rhs_takes(model):
    ode, states = model.ode(), some_states(3)
    column = np.asfortranarray(states)[0]
    for y in (states[0], list(states[0]), column, states[0].astype(np.float32), states):
        np.testing.assert_array_equal(ode(0.0, y), model.rhs(0.0, y))
    held = states[0].copy()
    first = ode(0.0, held)
    ode(0.0, states[1])
    np.testing.assert_array_equal(first, model.rhs(0.0, states[0]))  # a fresh array each time
    np.testing.assert_array_equal(held, states[0])
    with pytest.raises(ValueError, match="6 components"):
        ode(0.0, states[0, :4].copy())


def test_threads_do_not_disturb_each_other(model):
    states = some_states(8, 2000)
    expected = [model.rhs(0.0, y) for y in states]
    with ThreadPoolExecutor(8) as pool:
        for _ in range(5):
            for got, right in zip(
                pool.map(lambda y: model.rhs(0.0, y), states), expected, strict=True
            ):
                np.testing.assert_array_equal(got, right)


@pytest.mark.parametrize("shape", [(), (5,), (7,), (6, 1)])
def test_states_of_the_wrong_width_are_refused_with_the_right_one(model, shape):
    with pytest.raises(ValueError, match="6 components"):
        model.energy(np.zeros(shape))


def test_every_name_has_unit_bounds_and_description(model):
    names = {*model.coordinates, *model.speeds, *model.parameters}
    assert len(names) == 6 + 12 - 1
    for told in (model.units, model.bounds, model.descriptions, model.quantities):
        assert set(told) == names
    assert set(model.units.values()) == {"rad", "rad/s", "m", "kg", "kg m^2", "m/s^2"}
    assert all(len(text) > 10 and "\n" not in text for text in model.descriptions.values())
    assert len(set(model.descriptions.values())) == len(names)
    assert all(low < high for low, high in model.bounds.values())
    assert model.bounds["l_0"][0] == 0
    assert set(model.defaults) == set(model.parameters)


def test_what_is_drawn_is_named(model):
    drawn = {point for _, points in model.skeleton for point in points}
    assert drawn | set(model.ground) | set(model.traced) <= set(model.point_names)
    assert model.body_names == ("crank", "coupler", "rocker")
    assert model.constraint_names == ("closure along x", "closure along y")


def test_what_a_model_tells_cannot_change_it(model):
    model.defaults["l_0"] = 99.0
    model.units["l_0"] = "ft"
    assert model.defaults["l_0"] == 1.0
    assert model.units["l_0"] == "m"


def test_the_report_counts_fewer_operations_after_optimisation(model):
    (line,) = [line for line in model.report().splitlines() if line.startswith("all at once")]
    before, after = map(int, line.split()[-2:])
    assert 0 < 4 * after < before
    assert "friction" in model.report()
