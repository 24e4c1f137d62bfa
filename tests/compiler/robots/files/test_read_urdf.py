"""Files are untrusted: what is wrong is refused by name, and nothing else is opened."""

import pytest

import mechc

GOOD = """<robot name="arm"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1"/></joint></robot>"""

WRONG = {
    "GOOD": ("is not XML", "GOOD"),
    "<robot>": ("is not XML", "<robot>"),
    "<sdf/>": ("outermost element is <sdf>", "<sdf/>"),
    "": ("is not XML", ""),
    "empty": ("the file has no link", '<robot name="empty"/>'),
}
CHANGES = {
    'type="revolute"': ('type="helix"', "the joint 'j' has the type 'helix'"),
    '<child link="b"/>': ('<child link="c"/>', "the joint 'j' is 'c', which is no link"),
    '<parent link="a"/>': ("", "the joint 'j' lacks <parent link="),
    'xyz="0 0 1"': ('xyz="0 0 0"', "the joint 'j' has an axis without direction"),
    'upper="1"': ('upper="-2"', "the joint 'j' has the lower limit"),
    'mass value="1"': ('mass value="1e999"', "the link 'b' has a number without bounds"),
    '<mass value="1"/': ("<masss/", "the link 'b' lacks <mass>"),
    'value="1"/': ('Value="1"/', "the link 'b' lacks value=... in <mass>"),
    'izz="1"': ('lzz="1"', "the link 'b' lacks izz=... in <inertia>"),
    "axis xyz": ("axis axes", "the joint 'j' lacks xyz=... in <axis>"),
    'mass value="1"/': ('mass value="-1"/', "the link 'b' has the mass -1"),
    'ixx="1"': ('ixx="1_0"', "the link 'b' has ixx='1_0' in <inertia>, not a number"),
    'ixy="0"': ('ixy="nan"', "the link 'b' has ixy='nan'"),
    '<axis xyz="0 0 1"/>': ('<dynamics friction="-1"/><axis xyz="0 0 1"/>', "that is negative"),
    'axis xyz="0 0 1"': ('axis xyz="0 1"', "'0 1' in <axis>, not 3 numbers"),
    '<link name="a"/>': ('<link name="a"/><link name="a"/>', "more than one link is called 'a'"),
    '<link name="a"/><': ('<link name="a"/><link name="c"/><', "these are 'a', 'c'"),
    "<limit": ('<mimic joint="j"/><limit', "mimics 'j', which leads back to itself"),
    "<axis": ('<mimic joint="k"/><axis', "mimics 'k', which is no joint"),
    '<mass value="1"/>': (
        '<mass value="0"/>',
        "so no acceleration is defined: 'j'; write type=\"fixed\"",
    ),
    'type="revolute"><parent': ('type="fixed"><parent', "no joint of the file moves; floating="),
}


def read(folder, text, **options):
    path = folder / "arm.urdf"
    path.write_text(text)
    return mechc.from_urdf(path, limits="ignore", **options)


@pytest.mark.parametrize("text", WRONG)
def test_what_is_no_robot_is_refused(text, tmp_path):
    words, content = WRONG[text]
    with pytest.raises(mechc.MechanismError, match=words):
        read(tmp_path, content)


@pytest.mark.parametrize("part", CHANGES)
def test_errors_name_the_link_or_joint(part, tmp_path):
    new, words = CHANGES[part]
    assert part in GOOD
    text = GOOD.replace(part, new, 1)
    if "no acceleration" in words:
        text = text.replace('"1"', '"0"')
    with pytest.raises(mechc.MechanismError) as caught:
        read(tmp_path, text)
    assert words in str(caught.value)


UNKNOWN = {
    "<tendon> in <robot> of arm": ("</robot>", '<tendon name="t"/></robot>'),
    "<drake:joint> in <robot> of arm": ("</robot>", '<drake:joint name="w"/></robot>'),
    "<orgin> in <joint> of j": ("<axis", '<orgin xyz="0 0 1"/><axis'),
    "armature=... in <limit> of j": ("upper", 'armature="2" upper'),
    "axes=... in <axis> of j": ("axis xyz", 'axis axes="1 0 0" xyz'),
    "<spring> in <joint> of j": ("<axis", '<spring stiffness="1"/><axis'),
    "the text '1' in <mass> of b": ('<mass value="1"/>', '<mass value="1">1</mass>'),
}


@pytest.mark.parametrize("words", UNKNOWN)
def test_what_is_not_read_is_warned_of(words, tmp_path):
    text = GOOD.replace("<robot ", '<robot xmlns:drake="d" ').replace(*UNKNOWN[words], 1)
    with pytest.warns(mechc.SkippedPartWarning) as told:
        described = read(tmp_path, text)
    assert described.skipped == (f"{words}, which is not read",)
    assert words in str(told[0].message)


def test_a_ring_is_refused(tmp_path):
    ring = GOOD.replace("</robot>", "") + (
        '<link name="c"/><link name="d"/>'
        '<joint name="k" type="fixed"><parent link="c"/><child link="d"/></joint>'
        '<joint name="l" type="fixed"><parent link="d"/><child link="c"/></joint></robot>'
    )
    with pytest.raises(mechc.MechanismError, match="no joint connects 'c', 'd' with the root, 'a'"):
        read(tmp_path, ring)


def test_every_joint_without_inertia_is_named(tmp_path):
    """A joint whose inertia comes from one that mimics it is none of them."""
    more = "".join(
        f'<link name="{name}"/><joint name="{name}" type="revolute"><parent link="a"/>'
        f'<child link="{name}"/><limit lower="0" upper="1"/></joint>' for name in "klm"
    )  # fmt: skip
    text = GOOD.replace("<limit", '<mimic joint="m"/><limit').replace("</robot>", more + "</robot>")
    with pytest.raises(mechc.MechanismError, match="is defined: 'k', 'l'; write"):
        read(tmp_path, text)


def test_entities_are_never_expanded(tmp_path):
    """Neither a bomb of entities nor one that names a file."""
    (tmp_path / "secret").write_text("a")
    for declared in ('<!ENTITY x "a">', f'<!ENTITY x SYSTEM "file://{tmp_path}/secret">'):
        text = f"<!DOCTYPE robot [{declared}]>" + GOOD.replace('name="a"', 'name="&x;"')
        with pytest.raises(mechc.MechanismError, match="declares a document type"):
            read(tmp_path, text)


def test_meshes_are_not_opened(tmp_path):
    shape = '<visual><geometry><mesh filename="/etc/passwd"/></geometry></visual>'
    with pytest.warns(mechc.SkippedPartWarning, match="meshes"):
        described = read(tmp_path, GOOD.replace("<inertial>", shape + "<inertial>"))
    assert described.drawing.solids == ()


def test_macros_are_refused_with_advice(tmp_path):
    macro = '<xacro:include xmlns:xacro="http://ros.org/wiki/xacro" filename="x"/></robot>'
    with pytest.raises(mechc.MechanismError, match=r"xacro FILE > robot\.urdf"):
        read(tmp_path, GOOD.replace("</robot>", macro))


def test_a_missing_or_large_file_is_refused(tmp_path):
    with pytest.raises(mechc.MechanismError, match=r"arm.urdf' cannot be read: No such file"):
        mechc.from_urdf(tmp_path / "arm.urdf")
    with open(tmp_path / "large.urdf", "wb") as file:
        file.truncate(2**25 + 1)
    with pytest.raises(mechc.MechanismError, match="larger than 32 MiB"):
        mechc.from_urdf(tmp_path / "large.urdf")


@pytest.mark.parametrize("name", ["a:3", "x, y", "q'; rm -rf", "λ$_{/", '"><script>'])
def test_names_may_be_anything(name, tmp_path):
    """As coordinates and parameters they are one symbol each, and never code."""
    from xml.sax.saxutils import quoteattr

    text = GOOD.replace('name="j"', f"name={quoteattr(name)}")
    model = mechc.compile(read(tmp_path, text), outputs=("energy",))
    assert model.coordinates == (f"q_{name}",)
    assert model.rhs(0.0, [0.1, 2.0])[0] == 2.0


def test_wishes_for_symbols_are_checked(tmp_path):
    for wish in ("masses", ("b", "damping"), ("bb", "mass"), 3):
        with pytest.raises(mechc.MechanismError, match="neither a kind of value"):
            read(tmp_path, GOOD, symbolic=[wish])
    assert len(read(tmp_path, GOOD, symbolic="mass").parameters) == 3
