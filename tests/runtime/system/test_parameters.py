"""Parameter values: defaults that follow, names that are offered, values that are refused."""

import numpy as np
import pytest

import mechc
from mechc.errors import UnknownNameError, ValueOutOfBoundsError

LENGTHS, MASSES, INERTIAS = ("l_0", "l_3"), ("m_0", "m_2"), ("I_0", "I_2")


def values_of(model, params):
    return dict(
        zip(model.parameters, model.system.parameter_set.resolve(params).tolist(), strict=True)
    )


def test_the_defaults_are_those_of_the_reference_scene(model):
    expected = {f"l_{k}": k + 1.0 for k in range(4)} | {f"m_{k}": k + 1.0 for k in range(3)}
    expected |= {f"I_{k}": (k + 1.0) ** 3 / 12 for k in range(3)} | {"g": 9.81}
    assert model.defaults == pytest.approx(expected, rel=1e-15)


def test_inertias_follow_mass_and_length_unless_they_are_set(model):
    followed = values_of(model, {"l_1": 3.0, "m_1": 5.0})
    assert followed["I_1"] == pytest.approx(5.0 * 9.0 / 12, rel=1e-15)
    assert followed["I_0"] == model.defaults["I_0"]
    assert values_of(model, {"l_1": 3.0, "I_1": 0.25})["I_1"] == 0.25
    many = model.system.parameter_set.resolve({"m_2": np.array([1.0, 2.0])})
    assert many[:, model.parameters.index("I_2")] == pytest.approx([0.75, 1.5], rel=1e-15)


def test_a_followed_default_reaches_the_equations(model):
    y = np.array([0.1, 0.2, 0.3, 1.0, 0.0, 0.0])
    explicit = {"m_0": 4.0, "I_0": 4.0 / 12}
    assert model.kinetic_energy(y, {"m_0": 4.0}) == model.kinetic_energy(y, explicit)


@pytest.mark.parametrize(
    ("name", "offered"), [("l_4", "l_3"), ("L_0", "l_0"), ("mass_0", "m_0"), ("gg", "'g'")]
)
def test_unknown_parameters_are_met_with_the_nearest_known(model, name, offered):
    with pytest.raises(UnknownNameError) as refusal:
        model.energy(np.zeros(6), {name: 1.0})
    assert repr(name) in str(refusal.value)
    assert offered in str(refusal.value)
    assert isinstance(refusal.value, KeyError)


def test_a_name_that_is_near_nothing_is_met_with_all_of_them(model):
    with pytest.raises(UnknownNameError, match=r"known are l_0, .*, g"):
        model.energy(np.zeros(6), {"wibble": 1.0})


def test_unknown_mechanisms_and_states_are_met_with_the_nearest_known(model, sol):
    with pytest.raises(UnknownNameError, match=r"no mechanism is called 'fuor_bar'.*'four_bar'"):
        mechc.load("fuor_bar")
    with pytest.raises(UnknownNameError, match=r"no quantity .*'theta_0'"):
        sol["thta_0"]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, -1.0])
@pytest.mark.parametrize("name", [*LENGTHS, *MASSES, *INERTIAS])
def test_lengths_masses_and_inertias_are_positive_and_finite(model, name, value):
    for given in (value, int(value) if value in (0, -1) else np.array([1.0, value])):
        with pytest.raises(ValueOutOfBoundsError, match=f"^{name} = .*must be finite and > 0"):
            model.energy(np.zeros(6), {name: given})
    array = np.array([*model.defaults.values()])
    array[model.parameters.index(name)] = value
    with pytest.raises(ValueOutOfBoundsError, match=f"^{name} = "):
        model.rhs(0.0, np.zeros(6), array)


def test_gravity_may_point_up_or_vanish_but_is_finite(model):
    y = np.full(6, 0.5)
    assert model.potential_energy(y, {"g": 0.0}) == 0.0
    assert model.potential_energy(y, {"g": -9.81}) == -model.potential_energy(y)
    with pytest.raises(ValueOutOfBoundsError, match=r"^g = nan"):
        model.potential_energy(y, {"g": np.nan})


def test_what_is_no_number_is_refused_by_name(model):
    with pytest.raises(ValueOutOfBoundsError, match="l_2: 'long' is not a number"):
        model.energy(np.zeros(6), {"l_2": "long"})
    with pytest.raises(ValueOutOfBoundsError, match="all 11 of them"):
        model.energy(np.zeros(6), np.ones(10))


def test_what_contains_itself_is_no_value(model):
    endless = [1.0]
    endless.append(endless)
    with pytest.raises(ValueOutOfBoundsError, match="contains itself"):
        model.assemble({"theta_0": endless})


def test_options_that_a_mechanism_does_not_have_are_met_with_the_nearest():
    for value in (True, False):
        with pytest.raises(UnknownNameError, match=r"'frction'.*'friction'"):
            mechc.load("four_bar", frction=value)


def test_an_option_switched_off_is_the_shipped_model(model):
    assert mechc.load("four_bar", friction=False) is model


@pytest.mark.parametrize("given", [[("l_3", 3.5)], zip(["l_3"], [3.5], strict=True), 3 + 4j, "l_3"])
def test_parameters_of_a_wrong_kind_are_named(model, given):
    with pytest.raises(TypeError, match="parameters are given by name, such as"):
        model.rhs(0.0, np.zeros(6), given)
