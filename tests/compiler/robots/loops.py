"""Machines with loops: links whose frames are parallel at the start, and joints at places of it."""

from itertools import combinations
from math import atan2, cos, pi, sin

from mechc_codegen.robots.robot import Mimic, Pose, Robot, RobotJoint, RobotLink

INERTIA = (0.11, 0.01, 0, 0.2, 0.02, 0.13)
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def machine(name, links, joints, **changes):
    """``links``: name -> origin; ``joints``: (name, kind, parent, child, point, axis, *angles)."""
    places = {"ground": (0, 0, 0), **links}
    made = {each: RobotLink(each) for each in places}
    for each in links:
        made[each] = RobotLink(each, 1.5, Pose((0.1, 0.02, 0.2)), INERTIA)
    found = []
    for own, kind, parent, child, point, axis, *angles in joints:
        places_on = (tuple(p - o for p, o in zip(point, places[link], strict=True))
                     for link in (parent, child))  # fmt: skip
        sides = [Pose(at, tuple(angles) or (0, 0, 0)) for at in places_on]
        described = {"name": own, "kind": kind, "parent": parent, "child": child, "axis": axis,
                     "origin": sides[0], "child_origin": sides[1]}  # fmt: skip
        found.append(RobotJoint(**described | changes.get(own, {})))
    return Robot(name, made, tuple(found), root="ground")


def four_bar(**changes):
    return machine("four_bar", {"crank": (0, 0, 0), "coupler": (0, 0, 1), "rocker": (2, 0, 0)}, [
        ("A", "continuous", "ground", "crank", (0, 0, 0), Y),
        ("B", "continuous", "crank", "coupler", (0, 0, 1), Y),
        ("C", "continuous", "rocker", "coupler", (2, 0, 1.5), Y),
        ("D", "continuous", "ground", "rocker", (2, 0, 0), Y),
    ], **changes)  # fmt: skip


def slider_crank():
    links = {"crank": (0, 0, 0), "rod": (0.3, 0, 0.6), "slider": (2, 0, 0)}
    return machine("slider_crank", links, [
        ("A", "continuous", "ground", "crank", (0, 0, 0), Y),
        ("B", "continuous", "crank", "rod", (0.3, 0, 0.6), Y),
        ("C", "continuous", "slider", "rod", (1.5, 0, 0), Y),
        ("S", "prismatic", "slider", "ground", (1.5, 0, 0), (0.8, 0, 0.6)),
    ])  # fmt: skip


def distance():
    """Two cranks in planes across each other, whose ends are held apart."""
    kind = {"kind": "distance", "origin": Pose((0, 0, 1)), "child_origin": Pose((0, 0.1, 0.8))}
    return machine("distance", {"crank": (0, 0, 0), "rocker": (2, 0.3, 0)}, [
        ("A", "continuous", "ground", "crank", (0, 0, 0), X),
        ("D", "continuous", "ground", "rocker", (2, 0.3, 0), Y),
        ("rod", "distance", "crank", "rocker", (0, 0, 1), X),
    ], rod=kind)  # fmt: skip


def space_four_bar(middle="ball"):
    links = {"crank": (0, 0, 0), "rod": (0, 0.5, 0.5), "rocker": (2, 0, 0)}
    return machine(f"with_{middle}", links, [
        ("A", "continuous", "ground", "crank", (0, 0, 0), X),
        ("B", middle, "crank", "rod", (0, 0.5, 0.5), X, 0, 0, 0.3),
        ("C", "ball", "rocker", "rod", (2, 0.3, 1), X),
        ("D", "continuous", "ground", "rocker", (2, 0, 0), Y),
    ])  # fmt: skip


def cylindrical_four_bar():
    """The general four-bar in space: a pin and three cylindrical joints, whose axes are skew."""
    return machine("cylindrical", {"a": (0, 0, 0), "b": (1, 0, 1), "c": (2, 0.5, 0)}, [
        ("A", "continuous", "ground", "a", (0, 0, 0), Y),
        ("B", "cylindrical", "a", "b", (0.2, 0, 1), (0.6, 0.8, 0)),
        ("C", "cylindrical", "b", "c", (1.7, 0.1, 1.2), (0, 0.6, 0.8)),
        ("D", "cylindrical", "ground", "c", (2, 0.5, 0), (0.36, 0.48, 0.8)),
    ])  # fmt: skip


def six_bar():
    two = four_bar()
    more = machine("six_bar", {"crank": (0, 0, 0), "coupler": (0, 0, 1), "rocker": (2, 0, 0),
                               "e": (1, 0, 2), "f": (3, 0, 0.5)}, [
        ("E", "continuous", "coupler", "e", (1, 0, 2), Y),
        ("F", "continuous", "e", "f", (3, 0, 2), Y),
        ("G", "continuous", "ground", "f", (3, 0, 0.5), Y),
    ])  # fmt: skip
    return Robot("six_bar", more.links, (*two.joints, *more.joints), "ground")


def puck():
    """A body in a plane, which a rod leads: the rod's pins are across the plane."""
    return machine("puck", {"puck": (1, 1, 0), "rod": (0, 0, 0)}, [
        ("table", "planar", "ground", "puck", (1, 1, 0), (0, 0.6, 0.8)),
        ("P", "continuous", "ground", "rod", (0, 0, 0), (0, 0.6, 0.8)),
        ("Q", "continuous", "rod", "puck", (0.5, 0.8, -0.6), (0, 0.6, 0.8)),
    ])  # fmt: skip


def gripper():
    """Two fingers on parallelograms; the second crank mirrors the first."""
    links, joints = {}, []
    for side, s in (("left", 1), ("right", -1)):
        links |= {f"{side}_crank": (0.1 * s, 0, 0), f"{side}_bar": (0.2 * s, 0, 0),
                  f"{side}_finger": (0.1 * s, 0, 0.3)}  # fmt: skip
        joints += [
            (f"{side}_1", "continuous", "ground", f"{side}_crank", (0.1 * s, 0, 0), Y),
            (f"{side}_2", "continuous", "ground", f"{side}_bar", (0.2 * s, 0, 0), Y),
            (f"{side}_3", "continuous", f"{side}_crank", f"{side}_finger", (0.3 * s, 0, 0.4), Y),
            (f"{side}_4", "continuous", f"{side}_bar", f"{side}_finger", (0.4 * s, 0, 0.4), Y),
        ]
    mirrored = {"mimic": Mimic("left_1", -1), "damping": 0.1}
    return machine("gripper", links, joints, right_1=mirrored)


def delta():
    """Three arms, and rods between universal joints, with one axis along that of the arm."""
    links, joints = {"platform": (0, 0, -1.2)}, []
    for k in range(3):
        c, s = cos(2 * pi * k / 3), sin(2 * pi * k / 3)
        angles = (atan2(0.75, 1), 0, 2 * pi * k / 3 + pi / 2)  # y across the rod and the axis
        elbow, wrist = (0.9 * c, 0.9 * s, -0.2), (0.15 * c, 0.15 * s, -1.2)
        links |= {f"arm_{k}": (0.4 * c, 0.4 * s, 0), f"rod_{k}": elbow}
        joints += [
            (f"motor_{k}", "continuous", "ground", f"arm_{k}", (0.4 * c, 0.4 * s, 0), X, *angles),
            (f"elbow_{k}", "universal", f"arm_{k}", f"rod_{k}", elbow, X, *angles),
            (f"wrist_{k}", "universal", "platform", f"rod_{k}", wrist, X, *angles),
        ]
    return machine("delta", links, joints)


MACHINES = {
    each.name: each
    for each in (four_bar(), slider_crank(), distance(), space_four_bar(),
                 space_four_bar("universal"), cylindrical_four_bar(), six_bar(), puck(), gripper(),
                 delta())
}  # fmt: skip


def cut_sets(robot):
    """The joints that may be cut, one set for each spanning tree."""
    loops = len(robot.joints) - len(robot.links) + 1
    for cut in combinations(robot.joints, loops):
        kept = [joint for joint in robot.joints if joint not in cut]
        if any(joint.kind == "distance" for joint in kept):
            continue
        reached = {robot.root}
        for _ in kept:
            for joint in kept:
                if reached & {joint.parent, joint.child}:
                    reached |= {joint.parent, joint.child}
        if len(reached) == len(robot.links):
            yield tuple(joint.name for joint in cut)
