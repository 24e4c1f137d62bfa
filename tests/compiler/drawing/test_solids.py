"""Which bodies are drawn as solids."""

from mechc_codegen.description.drawing import Drawing
from mechc_codegen.drawing.plan import picture_plan
from mechc_codegen.robots.mechanism import mechanism_of
from mechc_codegen.robots.robot import Pose, Robot, RobotJoint, RobotLink


def test_a_rotor_is_not_drawn():
    """It has inertia but no mass, so that no solid has its inertia."""
    body = RobotLink("body", 2.0, Pose((0.1, 0, 0)), (0.1, 0, 0, 0.2, 0, 0.3))
    joint = RobotJoint("j", "continuous", "ground", "body", armature=0.9)
    robot = Robot("one", {"ground": RobotLink("ground"), "body": body}, (joint,), "ground")
    plan = picture_plan(mechanism_of(robot), Drawing(), {"g"}, in_space=True)
    assert [shape.label for shape, _, _ in plan.solids] == ["body"]
    assert all(entry.is_finite for shape, _, _ in plan.solids for entry in shape.entries)
