"""What MuJoCo's schema lists in a joint, a body or an actuator is taken, refused or named.

MuJoCo refuses elements and attributes that it does not know; each that it knows is changed here.
"""

import json
from xml.etree import ElementTree

import numpy as np
import pytest
from mechc_codegen.mjcf import compiled_model, read
from mechc_codegen.mjcf.from_mjcf import _start, robot_of
from mechc_codegen.mjcf.names import names_of
from mechc_codegen.robots.bounds import take_bounds

from tests.compiler.mjcf.reference import write_model

mujoco = pytest.importorskip("mujoco")

FILE = """<mujoco><compiler angle="radian" autolimits="true"/><worldbody>
<body name="a" pos="0 0 1"><inertial pos="0.1 0.2 0.3" mass="2" diaginertia="1 1.1 1.2"/>
  <joint name="j" axis="0 1 0" stiffness="2" damping="0.5" range="-1 1"/>
  <body name="b" pos="0 1 0"><joint name="k" type="slide"/><geom size="0.1 0.2 0.3" type="box"/>
  </body></body>
<body name="c"><joint name="l" axis="1 0 0"/><geom size="1"/>
  <body name="e"><joint name="m"/><geom size="0.2" pos="0.1 0 0"/></body></body>
</worldbody>
<equality><connect name="C" body1="b" body2="c" anchor="0.1 0 0"/>
<weld name="W" body1="b" body2="e" relpose="0 0 0.2 1 0 0 0"/>
<joint name="E" joint1="l" joint2="k" polycoef="0 1 0 0 0"/></equality>
<actuator><motor name="A" joint="j"/><position name="P" joint="j" kp="2" ctrlrange="-1 1"/>
<velocity name="V" joint="j" kv="2"/><general name="G" joint="j" gainprm="2" biastype="affine"/>
</actuator></mujoco>"""
PLACES = {
    "(world)body": ".//body", "(world)body/joint": ".//joint",
    "(world)body/inertial": ".//inertial", "equality/connect": "equality/connect",
    "equality/weld": "equality/weld",
    "equality/joint": "equality/joint",
    "actuator/motor": "actuator/motor", "actuator/position": "actuator/position",
    "actuator/velocity": "actuator/velocity", "actuator/general": "actuator/general",
}  # fmt: skip
VALUES = (
    "0.37", "3", "-0.3 0.4", "0.1 0.2 0.3", "0.1 0.2 0.3 0.4", "0.5 0.1 0.2 0.3 0.4 0.6",
    "0.1 0.2 0.3 0.4 0.5 0.6 0.7", "0", "true", "false", "slide", "l", "b", "affine", "user",
)  # fmt: skip
WITHOUT_MOTION = {
    "group user name": "for the eye and for programs",
    "margin solimplimit solreflimit solimpfriction solreffriction solimp solref torquescale":
        "how soft MuJoCo's constraints are, which hold exactly here",
    "actuatorgravcomp": "of gravcomp, which is named",
    "actuatorfrclimited limited ctrllimited forcelimited": "of bounds that the file does not give",
    "nsample interp delay": "of delays, which MuJoCo takes together; they are named",
    "actearly actlimited dynprm actdim actrange": "of an activation, which is named",
    "ffrange velrange inheritrange lengthrange": "bounds of other controls and other actuators",
    "fuse simple sleep": "what MuJoCo reckons as one, and leaves out while it rests",
    "mocap": "refused with a joint, named of other bodies",
    "childclass": "a class of defaults, of which the file has none",
}  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def in_this_process():
    """The process of each file takes a second."""

    def run(path, asked, folder):
        told, arrays = compiled_model._answer(json.loads(asked), np)
        arrays["told"] = np.frombuffer(json.dumps(told).encode(), np.uint8)
        np.savez(folder / compiled_model.ANSWER, **arrays)
        return folder / compiled_model.ANSWER

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(read, "_run", run)
        patch.setattr(compiled_model, "_limit", lambda memory, time: None)
        yield


def attributes_of_the_schema():
    """Attributes by the path of their element, from MuJoCo's own print of its schema."""
    found, path = {}, []
    for line in mujoco.mj_printSchema(False, False).splitlines():
        words = line.split()
        if len(words) > 1 and words[1].startswith("(") and line[:27].strip():
            depth = (len(line) - len(line.lstrip())) // 3
            path = [*path[:depth], words[0]]
            words = words[2:]
        found.setdefault("/".join(path[1:]), []).extend(words)
    return found


def seen(folder, root):
    """All that is made of a file, and said of it."""
    file = read.read_model(write_model(folder, ElementTree.tostring(root, "unicode")))
    names = names_of(file)
    return repr((take_bounds(robot_of(file, names, "all")), _start(file, names)))


@pytest.mark.filterwarnings("ignore:.*MuJoCo warns")
@pytest.mark.parametrize("place", PLACES)
def test_each_attribute_changes_the_robot_or_is_named(place, tmp_path):
    before = seen(tmp_path, ElementTree.fromstring(FILE))
    listed = {attribute for words in WITHOUT_MOTION for attribute in words.split()}
    silent, attributes = [], attributes_of_the_schema()[place]
    assert len(attributes) > 3
    for attribute in sorted({*attributes} - listed):
        changed = None  # where MuJoCo or mechc refuses all of the values
        for value in VALUES:
            root = ElementTree.fromstring(FILE)
            element = root.find(PLACES[place])
            if element.get(attribute) == value:
                continue
            element.set(attribute, value)
            try:
                changed = changed or seen(tmp_path, root) != before
            except ValueError:
                continue
            if changed:
                break
        if changed is False:
            silent.append(attribute)
    assert not silent


def test_texts_are_named(tmp_path):
    """MuJoCo passes over them: <mass>1</mass> in the way of SDFormat, numbers beside an element."""
    for number in range(len(list(ElementTree.fromstring(FILE).iter()))):
        root = ElementTree.fromstring(FILE)
        list(root.iter())[number].text = "1 kg"
        assert "the text '1 kg', which is not read" in seen(tmp_path, root)
