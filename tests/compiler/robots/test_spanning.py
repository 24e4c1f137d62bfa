"""A graph of joints has one motion, whichever of its joints are cut, and the choice is known."""

from dataclasses import replace

import numpy as np
import pytest
from mechc_codegen.robots.mechanism import mechanism_of
from mechc_codegen.robots.robot import Pose, Robot, RobotJoint, RobotLink

import mechc

BAR = (0.1, 0, 0, 0.2, 0, 0.1)


def link(name, *centre, mass=1.0):
    return RobotLink(name, mass, Pose(centre), BAR)


def four_bar(**changes):
    """Pins across the plane of x and z at A (0, 0), B (0, 1), C (2, 1.5) and D (2, 0)."""
    links = [RobotLink("ground"), link("crank", 0, 0, 0.5), link("coupler", 1, 0, 0.3, mass=2.0)]
    links.append(link("rocker", 0.1, 0, 0.7))
    pins = [
        RobotJoint("A", "continuous", "ground", "crank", Pose(), (0, 1, 0)),
        RobotJoint("B", "continuous", "crank", "coupler", Pose((0, 0, 1)), (0, 1, 0)),
        RobotJoint("C", "continuous", "rocker", "coupler", Pose((0, 0, 1.5), (0, 0.7, 0)),
                   (0, 1, 0), child_origin=Pose((2, 0, 0.5), (0, 0.7, 0))),
        RobotJoint("D", "continuous", "ground", "rocker", Pose((2, 0, 0)), (0, 1, 0)),
    ]  # fmt: skip
    pins = [replace(pin, **changes.get(pin.name, {})) for pin in pins]
    return Robot("four_bar", {each.name: each for each in links}, tuple(pins))


def motion(robot, start, speeds, cut=(), t=1.0):
    """Where the links are after a motion, with its energy, and the names of what is cut."""
    described = mechanism_of(robot, cut=cut)
    model = mechc.compile(described, outputs=("energy", "points"))
    y = model.assemble(start, speeds)
    end = model.simulate(t, y, rtol=1e-12, method="dop853").y[-1]
    at = dict(zip(model.system.point_names, model.points(end), strict=True))
    places = np.array([at[name] for name in robot.links])
    return places, model.energy(end), described.cuts


def test_every_spanning_tree_gives_the_same_motion():
    robot = four_bar()
    start = {"q_A": 0.4}, {"u_A": 0.5}
    places, energy, cuts = motion(robot, *start, cut="C")
    assert cuts == ("C",)
    for cut in "BD":
        others, same, cuts = motion(robot, *start, cut=cut)
        assert cuts == (cut,)
        assert others == pytest.approx(places, abs=1e-9)
        assert same == pytest.approx(energy, rel=1e-10)
