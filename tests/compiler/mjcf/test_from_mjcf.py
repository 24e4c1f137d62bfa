"""What is refused, what is named, and every file that MuJoCo ships."""

import sys
from pathlib import Path

import pytest
from mechc_codegen.mjcf.names import names_of
from mechc_codegen.mjcf.read import read_model

import mechc
from tests.compiler.mjcf.reference import Reference, differences, write_model

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.filterwarnings("ignore::mechc.SkippedPartWarning")  # contacts

REASONS = ("MuJoCo refuses the file", "flexible bodies", "no body has a joint")
SHIPPED = sorted(Path(mujoco.__file__).parent.rglob("*.xml"))
BODY = '<body name="b"><joint name="j" {joint}/><geom size="0.1"/>{more}</body>'
WORLD = "<mujoco>{before}<worldbody>{body}</worldbody>{after}</mujoco>"


def model(joint="", more="", before="", after=""):
    body = BODY.format(joint=joint, more=more)
    return WORLD.format(before=before, body=body, after=after)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<mujoco>", r"'model.xml' is not XML"),
        ('<robot name="r"><link name="b"/></robot>', r"is a URDF: read it by mechc.from_urdf"),
        ("<sdf/>", r"the outermost element is <sdf>, not <mujoco>"),
        ("<!DOCTYPE a><mujoco/>", r"declares a document type"),
        ("<mujoco><wordlbody/></mujoco>", r"MuJoCo refuses the file: .*unrecognized.*wordlbody"),
        ('<mujoco><include file="gone.xml"/></mujoco>', r"MuJoCo refuses the file: .*gone.xml"),
        (model(joint='pos="inf 0 0"'), r"jnt_pos\[0\] .*not finite"),
        (model(before='<option gravity="0 0 -inf"/>'), r"gravity\[2\] .*not finite"),
        ("<mujoco/>", r"no body has a joint"),
        (model(before='<worldbody><flexcomp name="f" type="grid" count="3 3 1" spacing="1 1 1" '
                      'radius="0.1"><edge equality="true"/></flexcomp></worldbody>'),
         r"1 flexible bodies"),
        (model(more='<body name="c"><joint name="k"/><geom size="0.1"/></body>',
               after='<tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>'
                     '<equality><tendon name="e" tendon1="t"/></equality>'),
         r"the equality 'e' is of the kind tendon"),
    ],
)  # fmt: skip
def test_what_is_refused(tmp_path, text, words):
    with pytest.raises(mechc.MechanismError, match=words):
        mechc.from_mjcf(write_model(tmp_path, text))


def test_a_number_that_is_none_warns_and_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = write_model(tmp_path, model(joint='pos="nan 0 0"'))
    with (
        pytest.warns(UserWarning, match="MuJoCo warns: XML contains a 'NaN'"),
        pytest.raises(mechc.MechanismError, match=r"jnt_pos\[0\] .*not finite"),
    ):
        mechc.from_mjcf(path)
    assert [each.name for each in tmp_path.iterdir()] == ["model.xml"]  # no log of MuJoCo's


def test_without_the_package_the_message_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(mechc.MechanismError, match=r"pip install '\.\[mjcf\]'"):
        mechc.from_mjcf(write_model(tmp_path, model()))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (model(), "contacts"),
        (model(before='<option density="2"/>'), "the medium (density 2.0, viscosity 0.0)"),
        (model(joint='type="ball" stiffness="3"'), "the spring (3.0) of the joint j"),
        (model(joint='type="ball" range="0 30"'), "the range of the joint j"),
        (model(joint='stiffness="3 1"'), "the higher powers of the spring of the joint j"),
        (model(joint='damping="3 1"'), "the higher powers of the damping of the joint j"),
        (model(joint='frictionloss="3"'), "friction='ignore' leaves it): j 3.0"),
        (model(joint='actuatorfrcrange="-1 2"'), "the bounds of the force, -1.0 to 2.0, of the"),
        (model(more='<body name="c" gravcomp="1"><geom size="0.1"/></body>'), "weight of c (1.0)"),
        (model(before='<worldbody><body name="h" mocap="true"/></worldbody>'), "capture of h"),
        (model(after='<tendon><fixed name="t" stiffness="1"><joint joint="j" coef="1"/></fixed>'
                     "</tendon>"), "the tendon t (stiffness)"),
        (model(before='<option><flag equality="disable"/></option>',
               after='<equality><joint joint1="j"/></equality>'), "its equalities, which the file"),
    ],
)  # fmt: skip
def test_what_is_named(tmp_path, text, words):
    with pytest.warns(mechc.SkippedPartWarning) as told:
        found = mechc.from_mjcf(write_model(tmp_path, text))
    assert words in "; ".join(found.skipped)
    assert words in str(told[0].message)
    assert told[0].filename == __file__


def test_names_of_a_file_reach_no_code(tmp_path):
    text = (
        model('axis="0 1 0" pos="1 0 0"')
        .replace('"j"', '"a; drop(&quot;b&quot;) + /*"')
        .replace('"b"', '"(x)\\n"')
    )
    path = write_model(tmp_path, text)
    built = mechc.compile(mechc.from_mjcf(path))
    name = 'a; drop("b") + /*'
    assert built.coordinates == (f"q_{name}",)
    assert differences(built, Reference(path), (name,)) < 1e-9


def test_parts_without_names(tmp_path):
    body = '<body><joint/><joint axis="1 0 0"/><geom size="0.1" pos="1 0 0"/>{}</body>'
    path = write_model(tmp_path, WORLD.format(
        before="", body=body.format('<body name="b"><joint/><geom size="0.1" pos="1 1 0"/></body>'),
        after="",
    ))  # fmt: skip
    built = mechc.compile(mechc.from_mjcf(path))
    assert built.coordinates == ("q_body1_0", "q_body1_1", "q_b")
    assert differences(built, Reference(path), ("body1_0", "body1_1", "b")) < 1e-9


@pytest.mark.thorough
def test_accelerations_of_the_largest_file_of_the_package():
    """Without its medium, gravcomp, and the actuators that are not taken."""
    path = max(SHIPPED, key=lambda each: each.stat().st_size)
    mechanism, reference = mechc.from_mjcf(path), Reference(path)
    model, skipped = reference.model, "; ".join(mechanism.skipped)
    model.opt.density = model.opt.viscosity = 0.0
    model.body_gravcomp[:] = 0.0
    names = names_of(read_model(path))
    for number, name in enumerate(names.actuators):
        if f"the actuator {name} (" in skipped:
            model.actuator_gainprm[number] = model.actuator_biasprm[number] = 0.0
    gap = differences(mechc.compile(mechanism), reference, names.joints, states=2, spread=0.2)
    assert gap < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_every_file_of_the_package(path):
    """Each is read, or refused for a reason that is in the file."""
    try:
        mechanism = mechc.from_mjcf(path)
    except mechc.MechanismError as error:
        reason = str(error)
        print(f"\n{path.name}: {reason}")
        assert any(words in reason for words in REASONS)
        return
    print(f"\n{path.name}: {mechanism!r}, not taken: {', '.join(mechanism.skipped)}")
    assert mechanism.coordinates
