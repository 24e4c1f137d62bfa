"""The bicycle in Exudyn: four bodies, three revolute joints, and two discs that roll.

Axes as in mechc's model: x forward, y to the right, z down.  The ground is the plane z = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    MarkerBodyRigid,
    ObjectGround,
    ObjectJointGeneric,
    ObjectJointRollingDisc,
)
from exudyn.rigidBodyUtilities import RigidBodyInertia
from scipy.spatial.transform import Rotation

from ...problems.problem import Array, Problem
from .parts import Assembled, empty

Values = Mapping[str, float]
BODIES = ("rear_frame", "front_frame", "rear_wheel", "front_wheel")
TURNS = "ZXY"  # yaw, roll, pitch
HUB, AXLE, DOWN = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Pose:
    """Where a body's reference point is and how the body is turned, and their rates."""

    place: Array
    turn: Array  # from the body's axes to the inertial ones
    velocity: Array
    spin: Array  # angular velocity in inertial axes

    def at(self, local: Array) -> Pose:
        """The same body seen from another of its points."""
        arm = self.turn @ local
        return Pose(
            self.place + arm, self.turn, self.velocity + np.cross(self.spin, arm), self.spin
        )

    def turned(self, letter: str, angle: float, rate: float) -> Pose:
        """A body that turns about one of this one's axes, at the same point."""
        turn = self.turn @ Rotation.from_euler(letter, angle).as_matrix()
        axis = self.turn[:, "XYZ".index(letter)]
        return Pose(self.place, turn, self.velocity, self.spin + rate * axis)


def bicycle(problem: Problem) -> Assembled:
    """The bicycle where it starts, without loads but its weight."""
    p, model = problem.values, problem.model
    names = (*model.coordinates, *model.speeds)
    hubs = _hubs(dict(zip(names, problem.start, strict=True)), p)
    container, mbs = empty()
    bodies = {name: _body(mbs, name, hubs[name], p) for name in BODIES}

    def marker(name: str, point: Array = HUB) -> Any:
        return mbs.AddMarker(
            MarkerBodyRigid(bodyNumber=bodies[name], localPosition=point - _centre(name, p))
        )

    head, stem = np.array([p["behind"], 0.0, 0.0]), -np.array([p["ahead"], 0.0, p["along"]])
    _hinge(mbs, [marker("rear_frame"), marker("rear_wheel")], "Y")
    _hinge(mbs, [marker("rear_frame", head), marker("front_frame", stem)], "Z")
    _hinge(mbs, [marker("front_frame"), marker("front_wheel")], "Y")
    ground = mbs.AddMarker(MarkerBodyRigid(bodyNumber=mbs.AddObject(ObjectGround())))
    for end in ("rear", "front"):
        mbs.AddObject(
            ObjectJointRollingDisc(
                markerNumbers=[ground, marker(f"{end}_wheel")], discRadius=p[f"r_{end}"],
                discAxis=AXLE, planeNormal=-DOWN,
            )
        )  # fmt: skip
    mbs.Assemble()

    def state() -> Array:
        poses = {name: _present(mbs, bodies[name], -_centre(name, p)) for name in BODIES}
        found = _told(poses, p)
        y = np.array([found[name] for name in names])
        return _whole_turns(y, names, problem)

    return Assembled(container, mbs, state)


def _hinge(mbs: Any, ends: list[Any], letter: str) -> None:
    """Bodies that keep a point in common and turn about one axis only."""
    axes = [1, 1, 1, *[int(axis != letter) for axis in "XYZ"]]
    mbs.AddObject(ObjectJointGeneric(markerNumbers=ends, constrainedAxes=axes))


def _hubs(y: Mapping[str, float], p: Values) -> dict[str, Pose]:
    """Frames at their wheels' hubs, and the wheels, in a state of the model."""
    touch = Pose(
        np.array([y["x"], y["y"], 0.0]), np.eye(3),
        np.array([y["x_rate"], y["y_rate"], 0.0]), np.zeros(3),
    )  # fmt: skip
    leaning = touch.turned("Z", y["yaw"], y["yaw_rate"]).turned("X", y["roll"], y["roll_rate"])
    frame = leaning.at(-p["r_rear"] * DOWN).turned("Y", y["pitch"], y["pitch_rate"])
    head = frame.at(np.array([p["behind"], 0.0, 0.0]))
    fork = head.turned("Z", y["steer"], y["steer_rate"]).at(np.array([p["ahead"], 0.0, p["along"]]))
    return {
        "rear_frame": frame,
        "front_frame": fork,
        "rear_wheel": frame.turned("Y", y["rear"], y["rear_rate"]),
        "front_wheel": fork.turned("Y", y["front"], y["front_rate"]),
    }


def _centre(name: str, p: Values) -> Array:
    """The mass centre seen from the hub, in the body's axes."""
    if name.endswith("wheel"):
        return HUB
    return np.array([p[f"x_{name}"], 0.0, p[f"z_{name}"]])


def _body(mbs: Any, name: str, hub: Pose, p: Values) -> Any:
    """A rigid body with Euler parameters; its reference point is its mass centre."""
    xx, yy, mass = p[f"I_xx_{name}"], p[f"I_yy_{name}"], p[f"m_{name}"]
    zz, xz = p.get(f"I_zz_{name}", xx), p.get(f"I_xz_{name}", 0.0)
    pose = hub.at(_centre(name, p))
    return mbs.CreateRigidBody(
        referencePosition=pose.place, referenceRotationMatrix=pose.turn,
        initialVelocity=pose.velocity, initialAngularVelocity=pose.spin,
        inertia=RigidBodyInertia(mass, np.array([[xx, 0, xz], [0, yy, 0], [xz, 0, zz]])),
        gravity=p["g"] * DOWN,
    )  # fmt: skip


def _present(mbs: Any, body: Any, hub: Array) -> Pose:
    """The body now, at its hub."""
    place, turn, velocity, spin = (
        mbs.GetObjectOutputBody(body, getattr(exu.OutputVariableType, name))
        for name in ("Position", "RotationMatrix", "Velocity", "AngularVelocity")
    )
    return Pose(place, turn.reshape(3, 3), velocity, spin).at(hub)


def _told(poses: Mapping[str, Pose], p: Values) -> dict[str, float]:
    """The model's coordinates and speeds by name; angles of wheels but for whole turns."""
    frame, fork = poses["rear_frame"], poses["front_frame"]
    yaw, roll, pitch = Rotation.from_matrix(frame.turn).as_euler(TURNS)
    leaning = frame.turn @ Rotation.from_euler("Y", -pitch).as_matrix()
    # Yaw about the vertical, roll about the leaning frame's x, pitch about its y.
    axes = np.column_stack([DOWN, leaning[:, 0], leaning[:, 1]])
    rates = np.linalg.solve(axes, frame.spin)
    contact = Pose(frame.place, leaning, frame.velocity, frame.spin - rates[2] * leaning[:, 1])
    contact = contact.at(p["r_rear"] * DOWN)
    found = {"x": contact.place[0], "y": contact.place[1], "yaw": yaw, "roll": roll}
    found |= {"x_rate": contact.velocity[0], "y_rate": contact.velocity[1], "pitch": pitch}
    found |= {f"{name}_rate": rates[k] for k, name in enumerate(("yaw", "roll", "pitch"))}
    found |= _turns("steer", "Z", frame, fork)
    found |= _turns("rear", "Y", frame, poses["rear_wheel"])
    found |= _turns("front", "Y", fork, poses["front_wheel"])
    return found


def _turns(name: str, letter: str, on: Pose, part: Pose) -> dict[str, float]:
    """Angle and rate of a part about an axis of the body that carries it."""
    k = "XYZ".index(letter)
    angle = Rotation.from_matrix(on.turn.T @ part.turn).as_rotvec()[k]
    return {name: angle, f"{name}_rate": (part.spin - on.spin) @ on.turn[:, k]}


def _whole_turns(y: Array, names: tuple[str, ...], problem: Problem) -> Array:
    """Wheels' angles with as many whole turns as come nearest to the exact ones.

    Exudyn keeps orientations, which do not count turns; an error of whole turns is not seen.
    """
    exact = dict(zip(problem.quantities, problem.exact, strict=True))
    for name in ("rear", "front"):
        k = names.index(name)
        y[k] += 2 * np.pi * np.round((exact[name] - y[k]) / (2 * np.pi))
    return y
