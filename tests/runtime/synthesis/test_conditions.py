"""Conditions along an assembly, against the position sweep and differences."""

import numpy as np
import pytest

from mechc.synthesis.conditions import Conditions, transmission_angle

POINTS = np.random.default_rng(3).normal(size=(6, 4, 3))


def conditions(**given):
    usual = {
        "turns": False, "one_assembly": True, "ordered": True, "joints": (), "box": None,
        "size": 2.0,
    }  # fmt: skip
    return Conditions(**{**usual, **given})


def test_the_transmission_angle_is_acute_and_has_its_slope():
    angle, slope = transmission_angle(POINTS, (0, 2, 3))
    a, b = POINTS[:, 0] - POINTS[:, 2], POINTS[:, 3] - POINTS[:, 2]
    cosine = (a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
    assert angle == pytest.approx(np.arccos(np.abs(cosine)))
    along = np.random.default_rng(4).normal(size=POINTS.shape)
    ends = [transmission_angle(POINTS + side * 1e-6 * along, (0, 2, 3))[0] for side in (1, -1)]
    assert (slope * along).sum((1, 2)) == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-7)


def test_a_point_beyond_the_box_falls_short_by_its_distance_in_sizes():
    box = np.array([[-5.0, -5.0], [5.0, 5.0]])
    inside = np.zeros((1, 3, 3))
    outside = inside.copy()
    outside[0, 1, 1] = 6.0
    outside[0, 2, 0] = -5.5
    one = conditions(box=box)
    assert not one.shortfalls(inside).any()
    assert one.shortfalls(outside)[0] == pytest.approx([0.25, 0.0, 0.0, 0.5])
    assert one.beyond(outside) == pytest.approx(0.5)


def test_without_conditions_nothing_is_followed():
    assert not conditions().swept
    assert conditions().shortfalls(POINTS).shape == (6, 0)
    assert conditions(turns=True).swept
