"""Each rule by which a joint is cut has its words, and they name the rule that decided."""

from dataclasses import replace

import pytest
from mechc_codegen.robots.mechanism import mechanism_of

from tests.compiler.robots.loops import MACHINES


def with_joint(robot, name, **changes):
    """The robot with one joint changed."""
    joints = tuple(replace(j, **changes) if j.name == name else j for j in robot.joints)
    return replace(robot, joints=joints)


BARS = MACHINES["four_bar"]


@pytest.mark.parametrize(
    ("robot", "options", "cut", "words"),
    [
        (MACHINES["with_universal"], {}, "C", "it has more coordinates"),
        (MACHINES["distance"], {}, "rod", "it holds a distance"),
        (BARS, {"cut": "D"}, "D", "cut= names it"),
        (with_joint(BARS, "A", closes=True), {}, "A", "the file says that it closes a loop"),
        (BARS, {}, "B", "alike in all this"),
        (MACHINES["delta"], {}, "wrist_2", "alike in all this"),
        (MACHINES["six_bar"], {}, "E", "alike in all this"),
        (with_joint(with_joint(with_joint(BARS, "A", damping=1), "B", damping=1), "D", damping=1),
         {}, "C", "needs the coordinate of each of the others"),
    ],
)  # fmt: skip
def test_the_reason_is_the_rule_that_decided(robot, options, cut, words):
    mechanism = mechanism_of(robot, **options)
    assert cut in mechanism.cuts
    assert words in mechanism.cut_reasons[cut]
    assert mechanism.cut_reasons.keys() == {*mechanism.cuts}


def test_a_link_that_is_cut_in_two_is_named():
    robot = replace(BARS, joints=tuple(replace(j, damping=1) for j in BARS.joints))
    mechanism = mechanism_of(robot)
    (cut,) = mechanism.cuts
    assert cut.endswith(" weld")
    assert "so a link is cut in two" in mechanism.cut_reasons[cut]


def test_numbers_of_links_are_those_before_fixed_links_become_one_body():
    mechanism = mechanism_of(MACHINES["gripper"])
    assert mechanism.links.keys() == {*MACHINES["gripper"].links}
    assert {body for body, *_ in mechanism.links.values()} == {
        "",
        *(str(b.name) for b in mechanism.bodies),
    }
