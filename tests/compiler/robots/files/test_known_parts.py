"""Whatever a file has is read, named or refused: nothing is passed over that is not listed so.

Into a file with all that the tables list, something unknown is put at each place; and each thing
that the tables list as read is changed, which has to change the robot.
"""

from xml.etree import ElementTree

import pytest
from mechc_codegen.robots.files.known_parts import SDF, URDF, Schema, unknown_parts
from mechc_codegen.robots.files.read_sdf import read_sdf
from mechc_codegen.robots.files.read_urdf import read_robot
from mechc_codegen.robots.graph import resolve_graph

MOMENTS = 'ixx="3" ixy="0.1" ixz="0.2" iyy="4" iyz="0.3" izz="5"'
AT = 'xyz="1 2 3" rpy="0.1 0.2 0.3"'
INERTIAL = f'<inertial><origin {AT}/><mass value="2"/><inertia {MOMENTS}/></inertial>'
SIDES = '<parent link="{}"/><child link="{}"/>'
URDF_FILE = f"""<robot name="arm" xmlns:drake="https://drake.mit.edu"><link name="g"/>
<link name="a">{INERTIAL}</link><link name="b">{INERTIAL}</link><link name="c">{INERTIAL}</link>
<joint name="A" type="revolute">{SIDES.format("g", "a")}<origin {AT}/>
<axis xyz="0 1 0"/><dynamics damping="1" friction="2"/>
<limit lower="-1" upper="1" velocity="2" effort="3"/></joint>
<joint name="B" type="continuous">{SIDES.format("a", "b")}
<mimic joint="A" multiplier="2" offset="1"/></joint>
<joint name="C" type="prismatic">{SIDES.format("g", "c")}</joint>
<constraint name="D" type="revolute">{SIDES.format("b", "c")}
<parent_origin {AT}/><child_origin {AT}/>
<parent_axis xyz="0 1 0"/><child_axis xyz="1 0 0"/></constraint>
<loop_joint name="E" type="revolute"><link1 link="a" {AT}/>
<link2 link="c" {AT}/><axis xyz="0 1 0"/></loop_joint>
<loop name="G" type="revolute"><predecessor link="a"><origin {AT}/></predecessor>
<successor link="c"><origin {AT}/></successor><axis xyz="0 1 0"/></loop>
<coupling name="H"><predecessor link="b"/><successor link="c"/><ratio value="2"/></coupling>
<drake:ball_constraint name="F"><drake:ball_constraint_body_A name="a"/>
<drake:ball_constraint_body_B name="c"/><drake:ball_constraint_p_AP value="1 2 3"/>
<drake:ball_constraint_p_BQ value="1 2 3"/></drake:ball_constraint>
<gazebo reference="A"/></robot>"""

POSE = "<pose relative_to='f' degrees='false' rotation_format='euler_rpy'>1 2 3 0.1 0.2 0.3</pose>"
ENTRIES = "".join(f"<{w.partition('=')[0]}>{w.partition('=')[2][1:-1]}</{w.partition('=')[0]}>"
                  for w in MOMENTS.split())  # fmt: skip
AXIS = """<xyz expressed_in="f">0 1 0</xyz><dynamics><damping>1</damping><friction>2</friction>
<spring_stiffness>3</spring_stiffness><spring_reference>0.1</spring_reference></dynamics>
<limit><lower>-1</lower><upper>1</upper><velocity>2</velocity><effort>3</effort></limit>"""
SDF_FILE = f"""<sdf version="1.5"><world name="w"><gravity>0 0 -3</gravity>
<frame name="o"><pose>1 0 0 0 0 1</pose></frame>
<joint name="W" type="ball"><parent>m::b</parent><child>m::n::e</child></joint>
<model name="m" canonical_link="a" placement_frame=""><static>false</static>
<model name="n"><link name="e"/></model><pose relative_to="o">1 2 3 0.1 0.2 0.3</pose>
<frame name="f" attached_to="a"><pose>1 0 0 0 0 1</pose></frame>
<link name="a"><inertial auto="false"><pose>1 2 3 0.1 0.2 0.3</pose><mass>2</mass>
<inertia>{ENTRIES}</inertia></inertial><gravity>true</gravity><kinematic>false</kinematic>
<velocity_decay><linear>0</linear><angular>0</angular></velocity_decay></link>
<link name="b">{POSE}</link><link name="c"><pose frame="a">1 0 0 0.5 0 0</pose></link>
<link name="d"/><joint name="A" type="revolute"><parent>a</parent><child>b</child>{POSE}
<axis>{AXIS}</axis></joint>
<joint name="B" type="revolute"><parent>a</parent><child>c</child><axis>
<use_parent_model_frame>false</use_parent_model_frame><mimic joint="A" axis="axis">
<multiplier>2</multiplier><offset>1</offset><reference>3</reference></mimic></axis></joint>
<joint name="C" type="universal"><parent>a</parent><child>d</child><axis>
<xyz expressed_in="f">0 1 0</xyz></axis><axis2><xyz expressed_in="f">1 0 0</xyz></axis2></joint>
</model></world></sdf>"""
FORMATS = {"urdf": (URDF, URDF_FILE, read_robot), "sdf": (SDF, SDF_FILE, read_sdf)}


def tree_of(kind):
    """The elements of the file, their tags as they stand in it."""
    text = FORMATS[kind][1].replace("drake:", "drake_")
    root = ElementTree.fromstring(text)
    for each in root.iter():
        each.tag = each.tag.replace("drake_", "drake:")
    return root


def read(folder, kind, root):
    path = folder / f"robot.{kind}"
    path.write_bytes(ElementTree.tostring(root))
    return FORMATS[kind][2](path)


def seen(robot):
    """What a robot is, to the last number, and what is said of it."""
    return repr(resolve_graph(robot)), robot.skipped


def places(kind):
    return range(sum(1 for _ in tree_of(kind).iter()))


@pytest.mark.parametrize("kind", FORMATS)
def test_the_file_has_all_that_the_table_lists(kind, tmp_path):
    table, root = FORMATS[kind][0], tree_of(kind)
    assert read(tmp_path, kind, root).skipped == ()
    for tag, known in table.items():
        assert tag in {each.tag for each in root.iter()}
        found = [each for each in root.iter() if table.get(each.tag) is known]  # alike: axis, axis2
        for child in known.read.split() if tag != "sdf" else ():
            assert any(each.find(child.rstrip("*")) is not None for each in found), (tag, child)
        for attribute in known.attributes.split():
            assert any(attribute in each.attrib for each in found), (tag, attribute)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize(
    "what", ["element", "foreign element", "attribute", "text", "tail", "twin"]
)
def test_what_is_unknown_is_named_wherever_it_stands(kind, what, tmp_path):
    silent, table = [], FORMATS[kind][0]
    for number in places(kind):
        root = tree_of(kind)
        element = list(root.iter())[number]
        words = "zork"
        if what.endswith("element"):
            words = "other:zork" if what.startswith("foreign") else words
            ElementTree.SubElement(element, words)
        elif what == "attribute":
            element.set("zork", "1")
        elif what == "text" and element.tag in table and not table[element.tag].text:
            element.text = words
        elif what == "tail" and len(element):
            element[-1].tail = words
        elif what == "twin":
            parent = next((each for each in root.iter() if element in list(each)), None)
            if parent is None or f"{element.tag}*" in table[parent.tag].read.split():
                continue
            words = f"a second <{element.tag}>"
            parent.append(element)
        else:
            continue
        if words not in "; ".join(read(tmp_path, kind, root).skipped):
            silent.append((number, element.tag, dict(element.attrib)))
    assert not silent


OTHERS = {  # other values, where they are no numbers and no names of links
    "false": "true", "true": "false", "euler_rpy": "quat_xyzw", "axis": "axis2", "revolute": "ball",
    "continuous": "fixed", "prismatic": "fixed", "universal": "fixed", "ball": "fixed",
    "f": "a", "o": "",
}  # fmt: skip


def others(text):
    """Other values: of numbers one with each of them changed."""
    words = text.split()
    try:
        numbers = [*map(float, words)]
    except ValueError:
        return [OTHERS.get(text, f"{text}_")]
    changed = [f"{number + 0.25}" for number in numbers]
    return [" ".join([*words[:k], changed[k], *words[k + 1 :]]) for k in range(len(words))]


@pytest.mark.parametrize("kind", FORMATS)
def test_what_the_table_lists_as_read_changes_the_robot(kind, tmp_path):
    """Or is refused, or named."""
    silent, before = [], seen(read(tmp_path, kind, tree_of(kind)))
    for number in places(kind):
        sound = list(tree_of(kind).iter())[number]
        closed = FORMATS[kind][0].get(sound.tag, Schema()).closed.split()
        values = {name: text for name, text in sound.items() if f"@{name}" not in closed}
        for name, text in {**values, None: (sound.text or "").strip()}.items():
            for value in others(text) if text else ():
                root = tree_of(kind)
                element = list(root.iter())[number]
                if name is None:
                    element.text = value
                else:
                    element.set(name, value)
                try:
                    after = seen(read(tmp_path, kind, root))
                except ValueError:
                    continue
                if after == before:
                    silent.append((element.tag, name, value))
    along = {("axis", "xyz", "0 1.25 0"), ("xyz", None, "0 1.25 0"), ("xyz", None, "1.25 0 0"),
             ("parent_axis", "xyz", "0 1.25 0"), ("child_axis", "xyz", "1.25 0 0")}  # fmt: skip
    assert set(silent) <= along  # axes whose length alone is another


def test_what_acts_in_gazebo_is_named_unless_it_is_neutral():
    text = "<gazebo reference='a'><{0}>{1}</{0}></gazebo>"
    for tag, neutral in URDF["gazebo"].neutral.items():
        for value in (*neutral, *(["-0.000"] if "0" in neutral else [])):
            element = ElementTree.fromstring(text.format(tag, value.upper()))
            assert unknown_parts(element, table=URDF) == []
        element = ElementTree.fromstring(text.format(tag, "0.3"))
        assert unknown_parts(element, table=URDF) == [
            f"<{tag}> in <gazebo> of a, which is not read"
        ]


def test_a_text_is_shown_without_the_blanks_before_it():
    element = ElementTree.fromstring(f"<robot>{' ' * 200}one  two</robot>")
    assert unknown_parts(element, table=URDF) == [
        "the text 'one two' in <robot> of the file, which is not read"
    ]


@pytest.mark.parametrize("kind", FORMATS)
def test_every_entry_is_that_of_a_child(kind):
    """A misspelt entry would leave its children out."""
    table = FORMATS[kind][0]
    children = {tag.rstrip("*") for known in table.values() for tag in known.read.split()}
    assert table.keys() - children == {"urdf": {"robot"}, "sdf": {"sdf"}}[kind]
