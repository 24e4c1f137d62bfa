"""Assembly: every way to close the loop, to rounding, with consistent speeds, or why not."""

import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from sympy.physics.mechanics import Torque, dynamicsymbols

import mechc
from mechc.errors import (
    AssemblyError,
    MissingInputError,
    UnknownNameError,
    ValueOutOfBoundsError,
)
from tests.support.linkages.loops import spatial_four_bar
from tests.support.sympy_objects import four_bar_system

REFERENCE = (1.0, 2.0, 3.0, 4.0)
REGULAR = (1.0, 2.0, 3.0, 3.5)


def named(lengths):
    return {f"l_{k}": float(length) for k, length in enumerate(lengths)}


def diagonal(crank, lengths):
    """Distance and direction from p_1 to the rocker's pivot."""
    gap = lengths[3] - lengths[0] * np.exp(1j * crank)
    return abs(gap), np.angle(gap)


def by_cosines(crank, lengths):
    """Both assemblies (theta_1, theta_2), elbow up first, by the law of cosines."""
    _, l_1, l_2, _ = lengths
    d, slope = diagonal(crank, lengths)
    first = np.arccos(np.clip((l_1**2 + d**2 - l_2**2) / (2 * l_1 * d), -1, 1))
    second = np.arccos(np.clip((l_2**2 + d**2 - l_1**2) / (2 * l_2 * d), -1, 1))
    return np.array([[slope + first, slope - second], [slope - first, slope + second]])


def shortfall(crank, lengths):
    """By how many metres the loop misses closing; negative inside its range."""
    d, _ = diagonal(crank, lengths)
    return max(d - lengths[1] - lengths[2], abs(lengths[1] - lengths[2]) - d)


def apart(a, b):
    """Largest difference of angles, turns apart."""
    return np.abs(np.angle(np.exp(1j * (np.asarray(a) - np.asarray(b))))).max()


length = st.floats(0.1, 10.0)


@settings(derandomize=True, deadline=None, max_examples=40)
@given(st.tuples(length, length, length, length), st.floats(-7.0, 7.0))
def test_any_lengths_close_as_the_law_of_cosines_says(model, lengths, crank):
    miss, params = shortfall(crank, lengths), named(lengths)
    assume(abs(miss) > 1e-3 and diagonal(crank, lengths)[0] > 1e-2)
    if miss > 0:
        with pytest.raises(AssemblyError):
            model.assemble({"theta_0": crank}, params=params)
        return
    found = model.assemblies({"theta_0": crank}, params=params)
    assert found.shape == (2, 6)
    for y, expected in zip(found, by_cosines(crank, lengths), strict=True):
        assert y[0] == crank
        assert apart(y[1:3], expected) < 1e-10
    closure = np.abs(model.constraints(found, params)).max()
    assert closure <= 8 * np.spacing(max(lengths))


@settings(derandomize=True, deadline=None, max_examples=25)
@given(st.tuples(length, length, length, length), st.floats(-7.0, 7.0))
def test_lengths_that_cannot_close_say_by_how_many_metres(model, lengths, crank):
    miss = shortfall(crank, lengths)
    assume(miss > 1e-3)
    with pytest.raises(AssemblyError, match=r"theta_0 = .* deg") as refusal:
        model.assemblies({"theta_0": crank}, params=named(lengths))
    told = float(re.search(r"least gap met is (\S+) m\.", str(refusal.value)).group(1))
    assert told == pytest.approx(miss, rel=1e-4)


@pytest.mark.parametrize("lengths", [REFERENCE, REGULAR])
@pytest.mark.parametrize("crank", np.radians([85.0, -120.0, 30.0, 300.0]))
def test_elbow_up_comes_first_and_is_what_assemble_takes(model, lengths, crank):
    params = named(lengths)
    up, down = model.assemblies({"theta_0": crank}, params=params)
    assert np.sin(up[1] - up[2]) > 0 > np.sin(down[1] - down[2])
    np.testing.assert_array_equal(model.assemble({"theta_0": crank}, params=params), up)
    solved = np.concatenate([up[1:3], down[1:3]])
    assert ((solved > -np.pi) & (solved <= np.pi)).all()
    assert (up[3:] == 0).all()


def test_any_coordinate_may_be_the_one_given(model):
    for name, index in (("theta_1", 1), ("theta_2", 2)):
        reference = model.assemble({"theta_0": 1.2}, params={"l_3": 3.5})
        found = model.assemblies({name: reference[index]}, params={"l_3": 3.5})
        assert min(apart(y[:3], reference[:3]) for y in found) < 1e-12


def test_several_coordinates_may_be_given_where_they_close(model):
    y = model.assemble({"theta_0": 1.2})
    whole = dict(zip(model.coordinates, y[:3], strict=True))
    np.testing.assert_allclose(model.assemble(whole), y, rtol=0, atol=1e-14)
    with pytest.raises(AssemblyError, match=r"open by 0\.0\d+ m"):
        model.assemble(whole | {"theta_2": whole["theta_2"] + 0.01})


def test_a_guess_picks_the_nearest_and_its_turn(model):
    up, down = model.assemblies({"theta_0": 1.2})
    for y in (up, down):
        for turns in (-2, 0, 1):
            guess = {"theta_2": y[2] + 2 * np.pi * turns + 0.2}
            chosen = model.assemble({"theta_0": 1.2}, guess=guess)
            assert chosen[2] == pytest.approx(y[2] + 2 * np.pi * turns, abs=1e-12)
            assert apart(chosen[:3], y[:3]) < 1e-12


def test_a_guess_of_everything_moves_to_the_linkage_nearby(model):
    near = model.assemble({"theta_0": 1.2})[:3] + np.array([0.01, -0.01, 0.02])
    y = model.assemble({}, guess=dict(zip(model.coordinates, near, strict=True)))
    assert np.abs(model.constraints(y)).max() < 1e-14
    assert np.abs(y[:3] - near).max() < 0.1


def test_a_coordinate_is_given_or_guessed_but_not_both(model):
    with pytest.raises(AssemblyError, match="theta_0 is both given and guessed"):
        model.assemble({"theta_0": 1.0}, guess={"theta_0": 1.0})


def test_too_few_coordinates_are_refused_unless_guessed(model):
    with pytest.raises(AssemblyError, match=r"theta_0, theta_1, theta_2: give 1 more .* a guess"):
        model.assemble({})
    with pytest.raises(AssemblyError, match="give 1 more"):
        model.assemblies({})


def test_speeds_follow_the_one_given(model):
    y = model.assemble({"theta_0": 1.2}, {"omega_0": 2.5})
    assert y[3] == 2.5
    assert np.abs(model.velocity_constraints(y)).max() < 1e-14
    ahead = model.assemble({"theta_0": 1.2 + 2.5e-6})[:3]
    behind = model.assemble({"theta_0": 1.2 - 2.5e-6})[:3]
    np.testing.assert_allclose(y[3:], (ahead - behind) / 2e-6, rtol=1e-8)


def test_every_assembly_has_consistent_speeds(model):
    states = model.assemblies({"theta_0": 1.2}, {"omega_1": -0.7})
    assert (states[:, 4] == -0.7).all()
    assert np.abs(model.velocity_constraints(states)).max() < 1e-13


def test_speeds_that_contradict_each_other_are_refused(model):
    consistent = model.assemble({"theta_0": 1.2}, {"omega_0": 2.5})[3:]
    both = dict(zip(model.speeds, consistent, strict=True))
    np.testing.assert_allclose(model.assemble({"theta_0": 1.2}, both)[3:], consistent)
    with pytest.raises(AssemblyError, match=r"omega_0 = 2.5, omega_1 = 9 .*closure along"):
        model.assemble({"theta_0": 1.2}, {"omega_0": 2.5, "omega_1": 9.0})


def dead_point():
    """Crank angle at which coupler and rocker of a triple rocker are stretched."""
    lengths = (1.0, 1.2, 1.5, 3.2)
    cosine = (lengths[0] ** 2 + lengths[3] ** 2 - 2.7**2) / (2 * lengths[0] * lengths[3])
    return lengths, np.arccos(cosine)


def test_at_a_dead_point_the_two_assemblies_are_one(model):
    lengths, crank = dead_point()
    (y,) = model.assemblies({"theta_0": crank}, params=named(lengths))
    assert apart(y[1], y[2]) < 1e-6
    assert np.abs(model.constraints(y, named(lengths))).max() < 1e-14
    assert len(model.assemblies({"theta_0": crank - 1e-6}, params=named(lengths))) == 2
    with pytest.raises(AssemblyError, match=r"9\.3\d+e-07 m"):
        model.assemblies({"theta_0": crank + 1e-6}, params=named(lengths))


def test_at_a_dead_point_the_crank_cannot_move(model):
    lengths, crank = dead_point()
    with pytest.raises(AssemblyError, match="no speeds with omega_0 = 1"):
        model.assemble({"theta_0": crank}, {"omega_0": 1.0}, params=named(lengths))


def test_all_links_in_line_is_one_assembly(model):
    (y,) = model.assemblies({"theta_0": np.pi})
    np.testing.assert_allclose(y[:3], [np.pi, 0.0, 0.0], atol=1e-7)


@pytest.mark.parametrize("part", ["coordinates", "speeds", "guess"])
@pytest.mark.parametrize("value", [np.nan, np.inf, "wide", None])
def test_what_is_no_finite_number_is_refused_by_name(model, part, value):
    name = "omega_0" if part == "speeds" else "theta_1" if part == "guess" else "theta_0"
    arguments = {"coordinates": {"theta_0": 1.0}} | {part: {name: value}}
    with pytest.raises(ValueOutOfBoundsError, match=rf"^{name}\b"):
        model.assemble(**arguments)


@pytest.mark.parametrize(
    ("part", "name", "nearest"),
    [
        ("coordinates", "theta0", "theta_0"),
        ("speeds", "omega", "omega_0"),
        ("guess", "tehta_1", "theta_1"),
        ("params", "l0", "l_0"),
    ],
)
def test_unknown_names_are_met_with_the_nearest(model, part, name, nearest):
    arguments = {"coordinates": {"theta_0": 1.0}} | {part: {name: 1.0}}
    with pytest.raises(UnknownNameError, match=f"{name!r}.*{nearest!r}"):
        model.assemble(**arguments)


@pytest.mark.parametrize(
    ("part", "name", "home"),
    [
        ("coordinates", "omega_0", "speeds"),
        ("speeds", "theta_1", "coordinates"),
        ("guess", "m_0", "params"),
    ],
)
def test_names_in_the_wrong_argument_are_told_the_right_one(model, part, name, home):
    arguments = {"coordinates": {"theta_0": 1.0}} | {part: {name: 2.5}}
    with pytest.raises(UnknownNameError, match=rf"{home}=\{{'{name}': 2.5\}}"):
        model.assemble(**arguments)


def test_one_set_of_parameters_at_a_time(model):
    with pytest.raises(ValueOutOfBoundsError, match="one set of parameters"):
        model.assemble({"theta_0": 1.0}, params={"l_3": np.array([3.5, 3.6])})


# -- poses in which all links lie in line ----------------------------------------------------------


@pytest.fixture(scope="module")
def driven():
    """A four-bar in relative angles, its crank driven by the torque T, which is an input."""
    system = four_bar_system()
    crank, axis = system.bodies[1].frame, system.frame.z
    system.add_loads(Torque(crank, dynamicsymbols("T") * axis))
    return mechc.compile(system, defaults=named(REGULAR) | {"rho": 1.0, "g": 9.81})


@pytest.mark.parametrize(
    "lengths", [REGULAR, REFERENCE, (1.0, 2.0, 2.0, 3.0), (1.0, 1.0, 1.0, 1.0)]
)
def test_a_flat_pose_is_a_guess_though_no_step_from_it_closes_the_loop(driven, lengths):
    """There the gap is along all links, which nothing that turns changes at first."""
    flat = dict.fromkeys(driven.coordinates, 0.0)
    y = driven.assemble(guess=flat, params=named(lengths))
    assert np.abs(driven.constraints(y, named(lengths))).max() < 1e-14
    assert np.abs(y[:3]).max() < 2.2
    with pytest.raises(AssemblyError, match="no configuration was found that closes the loops"):
        driven.assemble(guess=flat, params=named((1.0, 2.0, 2.0, 5.5)))


def test_inputs_in_loads_are_not_asked_for(driven):
    """At a change point, where the rank of the constraints around it is looked for."""
    flat = named((1.0, 2.0, 1.0, 4.0))
    np.testing.assert_array_equal(driven.assemble({"q_0": 0.0}, params=flat), np.zeros(6))
    crossing = named((1.0, 2.0, 3.0, 4.0))
    y = driven.assemble({"q_0": np.pi}, params=crossing)
    np.testing.assert_allclose(np.cos(y[:3]), [-1.0, -1.0, 1.0], atol=1e-12)
    with pytest.raises(AssemblyError, match="is a change point, where u_0 = 1 is possible on 2"):
        driven.assemble({"q_0": np.pi}, {"u_0": 1.0}, params=crossing)
    assert len(driven.redundant_constraints()) == 0
    with pytest.raises(MissingInputError, match="no value: T"):
        driven.simulate(1.0, y, crossing)


# -- quaternions -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_quaternions_that_follow_have_length_one():
    model = mechc.compile(spatial_four_bar(by_quaternion=True), outputs=())
    turns = [0.9, 1.0, 1.3, -1.5]
    states = [model.assemble({"a": a}) for a in turns]
    states += [model.assemble(guess={"a": a, "q0_ball": 2.0, "q3_ball": 1.0}) for a in turns]
    batch = model.simulate_batch(1e-3, {"a": np.array(turns)})
    states += [batch[k].y[0] for k in range(len(turns))]
    states += [e.y for e in model.equilibria(most_starts=48)]
    places = [model.coordinates.index(f"q{k}_ball") for k in range(4)]
    for y in states:
        assert np.linalg.norm(y[places]) == pytest.approx(1.0, abs=4e-16)
        assert np.abs(model.constraints(y)).max() < 1e-13
    typed = model.assemble({"q0_ball": 2.0}, guess={"a": 1.0})
    assert typed[places[0]] == 2.0, "what is given stays"
