"""Screws of a loop: what its cut holds of the motions of its other joints."""

import numpy as np
import pytest
from mechc_codegen.robots.screws import conditioning

AXES = np.eye(3)


def turn(axis, point):
    return (*axis, *np.cross(point, axis))


@pytest.mark.parametrize("axis", AXES)
def test_a_turn_about_an_axis_through_a_ball_is_the_balls_own(axis):
    """The ball does not hold it: what remains of a pin is its velocity of the ball's centre."""
    centre = np.array([0.3, -0.2, 0.7])
    ball = [turn(x, centre) for x in AXES]
    through, beside = turn(axis, centre), turn(AXES[2], centre + AXES[0])
    assert conditioning(ball, [through], centre) == 0
    assert conditioning(ball, [through, beside], centre) == 1
    assert conditioning(ball, [beside], centre) == 1


def test_motions_are_measured_across_all_of_the_cut():
    """Of one motion: its distance from the cut's screws, here by least squares."""
    random = np.random.default_rng(5)
    for count in range(1, 6):
        cut, motion = random.normal(size=(count, 6)), random.normal(size=6)
        motion[3:] /= np.linalg.norm(motion[3:])  # lengths are in units of its velocity
        fit = cut.T @ np.linalg.lstsq(cut.T, motion, rcond=None)[0]
        assert conditioning(cut, [motion], np.zeros(3)) == pytest.approx(
            np.linalg.norm(motion - fit), abs=1e-8
        )
