"""Actuators of joints -> motors, and springs and dampers that feed position and speed back.

With its length l, the gear times the joint's coordinate, an actuator's force is gain * control +
c + b l + d l'.  The gain and the gear are those of a motor; b and d are negative in servos, and add
to the joint's stiffness and damping.  Others than these are not taken, and named.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from mechc_codegen.mjcf.names import PartNames
from mechc_codegen.mjcf.poses import exact
from mechc_codegen.mjcf.read import CompiledFile
from mechc_codegen.robots.robot import Number, RobotJoint, RobotMotor

_GROUPS = 31  # that a file may disable
_KINDS = (
    ("mjtTrn", "trntype", ("JOINT", "JOINTINPARENT")),
    ("mjtDyn", "dyntype", ("NONE",)),
    ("mjtGain", "gaintype", ("FIXED",)),
    ("mjtBias", "biastype", ("NONE", "AFFINE")),
)


class Actuators:
    """Those of a file that are taken, and what is not.

    Attributes
    ----------
    motors
        By the names of their actuators.
    joints
        With what the actuators add to them, by name.
    skipped
        What is not taken.
    """

    def __init__(self, file: CompiledFile, names: PartNames, joints: Iterable[RobotJoint]) -> None:
        self._file, self._names = file, names
        self.motors: dict[str, RobotMotor] = {}
        self.joints = {joint.name: joint for joint in joints}
        self.skipped: list[str] = []
        if file.disables("ACTUATION"):
            self.skipped += ["its actuators, which the file disables"] * bool(names.actuators)
            return
        for number, name in enumerate(names.actuators):
            group = int(file.model.actuator_group[number])
            if 0 <= group < _GROUPS and int(file.model.opt.disableactuator) & (1 << group):
                self.skipped.append(f"the actuator {name}, whose group {group} is disabled")
                continue
            refused = next(self._reasons(number), "")
            if refused:
                self.skipped.append(f"the actuator {name} ({refused})")
            else:
                self._take(number, name)

    def _reasons(self, number: int) -> Iterator[str]:
        """Why an actuator is not taken."""
        model = self._file.model
        for kind, field, taken in _KINDS:
            code = self._file.code(kind, getattr(model, f"actuator_{field}")[number])
            if code not in taken:
                yield f"its {field} is {code.lower()}"
        if model.actuator_plugin[number] >= 0:
            yield "it is a plugin"
        if model.actuator_delay[number] > 0:
            yield "its control is delayed"
        joint = self.joints[self._names.joints[int(model.actuator_trnid[number][0])]]
        if not joint.row.unit and joint.kind != "fixed":
            yield f"the joint {joint.name} has more than one coordinate"
        if model.actuator_dampingpoly[number].any():
            yield "its damping is a polynomial"

    def _take(self, number: int, name: str) -> None:
        model = self._file.model
        joint = self.joints[self._names.joints[int(model.actuator_trnid[number][0])]]
        if joint.kind == "fixed":  # an equality locks it: no force moves it
            return
        gear = float(model.actuator_gear[int(model.actuator_outadr[number])][0])
        affine = self._file.code("mjtBias", model.actuator_biastype[number]) == "AFFINE"
        constant, at_position, at_speed = model.actuator_biasprm[number].tolist()[:3]
        constant, at_position, at_speed = (
            (constant, at_position, at_speed) if affine else (0.0, 0.0, 0.0)
        )
        stiffness = joint.stiffness - gear**2 * at_position
        force = joint.stiffness * joint.rest + gear * constant  # at the coordinate zero
        if force and not stiffness:
            self.skipped.append(f"the constant force {constant} of the actuator {name}")
            force = 0
        damping = -at_speed + (0 if self._file.disables("DAMPER") else
                               float(model.actuator_damping[number]))  # fmt: skip
        self.joints[joint.name] = replace(
            joint,
            stiffness=exact(stiffness),
            rest=exact(force / stiffness) if stiffness else 0,
            damping=exact(joint.damping + gear**2 * damping),
            armature=exact(joint.armature + gear**2 * float(model.actuator_armature[number])),
        )
        feeds_back = bool(constant or at_position or at_speed)
        self.motors[name] = self._motor(number, name, joint, gear, feeds_back)

    def _motor(
        self, number: int, name: str, joint: RobotJoint, gear: float, feeds_back: bool
    ) -> RobotMotor:
        """The motor with its bounds; those of a force that feeds back are not taken, and named."""
        model = self._file.model
        control, force = None, None
        slot = int(model.actuator_ctrladr[number])
        if model.actuator_ctrllimited[slot] and not self._file.disables("CLAMPCTRL"):
            control = _pair(model.actuator_ctrlrange[slot].tolist())
        if model.actuator_forcelimited[number]:
            force = _pair(sorted(gear * x for x in model.actuator_forcerange[number].tolist()))
        if feeds_back and force:
            lower, upper = model.actuator_forcerange[number].tolist()
            self.skipped.append(f"the bounds of the force of the servo {name}, {lower} to {upper}")
            force = None
        if feeds_back and "effort" in joint.limits:
            self.skipped.append(f"the bound of the force of {joint.name}, where {name} is a servo")
            self.joints[joint.name] = replace(self.joints[joint.name], saturates=False)
        gain = float(model.actuator_gainprm[number][0])
        return RobotMotor(f"ctrl_{name}", joint.name, exact(gear * gain), control, force)


def _pair(bounds: list[float]) -> tuple[Number, Number]:
    lower, upper = map(exact, bounds)
    return lower, upper
