"""The words about a four-bar's lengths are true: they agree with closing the loop by hand."""

from __future__ import annotations

from math import acos, cos, hypot, pi, radians, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mechc_codegen.library.planar.four_bar_geometry import (
    change_points,
    crank_limits,
    geometry_notes,
    grashof_class,
)

CLASSES = {
    (1.0, 3.0, 3.0, 4.0): "crank-rocker",
    (3.0, 1.0, 3.0, 4.0): "double-rocker",
    (4.0, 3.0, 1.0, 3.0): "rocker-crank",
    (3.0, 3.0, 4.0, 1.0): "double-crank",
    (3.0, 3.0, 3.5, 5.0): "triple-rocker",
    (1.0, 2.0, 3.0, 4.0): "change-point",
    (1.0, 2.0, 1.0, 2.0): "change-point",
    (1.0, 1.0, 2.0, 2.0): "change-point",
    (1.0, 1.0, 1.0, 1.0): "change-point",
    (0.1, 0.2, 0.3, 0.4): "change-point",
    (1.0, 2.0, 3.0, 6.0): "a structure",
    (6.0, 1.0, 2.0, 3.0): "a structure",
    (1.0, 1.0, 1.0, 4.0): "cannot be assembled",
}
GRID = [pi * (k + 0.5) / 2000 for k in range(2000)]
length = st.floats(0.1, 10.0)


def closes(turning: float, angle: float, two: tuple[float, float], ground: float) -> bool:
    """Whether a link at ``angle`` leaves a distance that the other two can span."""
    span = hypot(turning * cos(angle) - ground, turning * sin(angle))
    return abs(two[0] - two[1]) <= span <= two[0] + two[1]


def turns_fully(link: int, lengths: tuple[float, ...]) -> bool:
    """The closure z_0 l_0 + z_1 l_1 + z_2 l_2 = l_3 does not mind the order of its terms."""
    two = tuple(lengths[k] for k in range(3) if k != link)
    return all(closes(lengths[link], a, two, lengths[3]) for a in GRID)


@pytest.mark.parametrize(("lengths", "expected"), CLASSES.items())
def test_class_of_known_linkages(lengths: tuple[float, ...], expected: str) -> None:
    assert grashof_class(list(lengths)).startswith(expected)


@pytest.mark.parametrize(
    ("name", "turning"),
    [
        ("crank-rocker", [True, False, False]),
        ("double-rocker", [False, True, False]),
        ("rocker-crank", [False, False, True]),
        ("double-crank", [True, True, True]),
        ("triple-rocker", [False, False, False]),
    ],
)
def test_links_said_to_turn_fully_do(name: str, turning: list[bool]) -> None:
    (lengths,) = [key for key, value in CLASSES.items() if value == name]
    assert [turns_fully(link, lengths) for link in range(3)] == turning


@given(st.tuples(length, length, length, length))
def test_class_is_what_turning_links_say(lengths: tuple[float, float, float, float]) -> None:
    """For lengths away from every border the class follows from which links turn."""
    shortest, second, third, longest = sorted(lengths)
    if abs(second + third - shortest - longest) < 0.05:
        return
    said = grashof_class(list(lengths))
    if not any(closes(lengths[0], a, lengths[1:3], lengths[3]) for a in GRID):
        if abs(shortest + second + third - longest) > 0.05:
            assert said.startswith("cannot be assembled")
        return
    turning = [turns_fully(link, lengths) for link in range(3)]
    assert said.startswith(
        {
            (True, False, False): "crank-rocker",
            (False, True, False): "double-rocker",
            (False, False, True): "rocker-crank",
            (True, True, True): "double-crank",
            (False, False, False): "triple-rocker",
        }[tuple(turning)]
    )


@given(st.tuples(length, length, length, length))
def test_limits_are_where_the_loop_stops_closing(
    lengths: tuple[float, float, float, float],
) -> None:
    limits = crank_limits(list(lengths))
    for angle in GRID:
        if limits is not None and min(abs(angle - limit) for limit in limits) < 1e-6:
            continue
        inside = limits is not None and limits[0] < angle < limits[1]
        assert closes(lengths[0], angle, lengths[1:3], lengths[3]) == inside


@pytest.mark.parametrize("lengths", CLASSES)
def test_limits_of_the_known_linkages(lengths: tuple[float, ...]) -> None:
    limits = crank_limits(list(lengths))
    closing = [a for a in GRID if closes(lengths[0], a, lengths[1:3], lengths[3])]
    if limits is None:
        assert closing == []
    elif limits[0] == limits[1]:
        assert limits[0] in (0.0, pi)
    else:
        assert limits == pytest.approx((min(closing), max(closing)), abs=2 * pi / len(GRID))


def test_change_points_are_the_closed_collinear_configurations() -> None:
    assert change_points([1, 2, 3, 4]) == [(180.0, 0.0, 0.0)]
    assert change_points([1, 2, 1, 2]) == [(0.0, 0.0, 180.0), (180.0, 0.0, 0.0)]
    assert change_points([1, 1, 2, 2]) == [(0.0, 180.0, 0.0), (180.0, 0.0, 0.0)]
    assert len(change_points([1, 1, 1, 1])) == 3
    assert change_points([0.1, 0.2, 0.3, 0.4]) == [(180.0, 0.0, 0.0)]
    assert change_points([1, 2, 3, 3.5]) == []


@given(st.tuples(length, length, length, length))
def test_change_points_close_the_loop(lengths: tuple[float, float, float, float]) -> None:
    made = [*lengths[:3], abs(lengths[0] + lengths[1] - lengths[2])]
    if made[3] == 0:
        return
    found = change_points(made)
    assert found
    for angles in found:
        x = sum(link * cos(radians(a)) for link, a in zip(made, angles, strict=False)) - made[3]
        assert abs(x) < 1e-13 * max(made)


def test_the_reference_scene_in_words() -> None:
    notes = dict(geometry_notes({"l_0": 1.0, "l_1": 2.0, "l_2": 3.0, "l_3": 4.0, "g": 9.81}))
    assert notes["Grashof class"].startswith("change-point linkage")
    assert notes["Limits of theta_0"] == "none: the loop closes at every theta_0"
    assert "theta_0 = 180, theta_1 = 0, theta_2 = 0 deg" in notes["Change points"]


def test_the_regular_scene_in_words() -> None:
    """l_3 = 3.5 m: a crank-rocker by the lengths, l_0 + l_3 < l_1 + l_2."""
    notes = dict(geometry_notes({"l_0": 1.0, "l_1": 2.0, "l_2": 3.0, "l_3": 3.5}))
    assert notes["Grashof class"].startswith("crank-rocker")
    assert notes["Change points"].startswith("none")


def test_a_swinging_crank_is_given_its_range_in_degrees() -> None:
    lengths = [3.0, 1.0, 3.0, 4.0]
    words = geometry_notes(dict(zip(("l_0", "l_1", "l_2", "l_3"), lengths, strict=True)))[1][1]
    low, high = (acos((9 + 16 - reach**2) / 24) * 180 / pi for reach in (2.0, 4.0))
    assert f"from {low:.8g} to {high:.8g} deg" in words
    assert f"from {-high:.8g} to {-low:.8g} deg" in words


def test_a_near_miss_is_not_a_change_point() -> None:
    """A gap of 1e-12 m is far above rounding: the linkage turns back before 180 degrees."""
    limits = crank_limits([1.0, 2.0, 3.0, 4.0 + 1e-12])
    assert limits is not None
    assert pi - 1e-5 < limits[1] < pi
    assert change_points([1.0, 2.0, 3.0, 4.0 + 1e-12]) == []
    assert grashof_class([1.0, 2.0, 3.0, 4.0 + 1e-12]).startswith("triple-rocker")
