"""Meshes of a robot's file: which files are taken, and what is said of the others."""

import pytest
from mechc_codegen.description.drawing import Drawing
from mechc_codegen.drawing.plan import picture_plan
from mechc_codegen.robots import meshes

import mechc

MESH = '<visual><geometry><mesh filename="{}" scale="0.1 -0.1 0.1"/></geometry></visual>'
LINK = """<link name="{0}">{1}<inertial><origin xyz="0.1 0 0"/><mass value="2"/>
  <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="{0}" type="continuous"><parent link="post"/><child link="{0}"/></joint>"""
TAKEN = ("arm.stl", "package://own/arm.stl", "package://x/y/inner/leg.OBJ", "model://own/arm.stl",
         "inner/../arm.stl", "inner/leg.OBJ", "link.dae", "file://{}/own/arm.stl")  # fmt: skip
REFUSED = ("../secret.stl", "file://{}/secret.stl", "package://own/../../secret.stl", "out.stl",
           "none.stl", "ring.stl",
           "inner.stl", 400 * "a" + ".stl", 600 * "a/" + "a.stl")  # fmt: skip


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(meshes, "PACKAGES", ())
    own = tmp_path / "own"
    (own / "inner").mkdir(parents=True)
    for name in ("arm.stl", "inner/leg.OBJ", "../secret.stl"):
        (own / name).write_text("not opened when a robot is read")
    (own / "out.stl").symlink_to(tmp_path / "secret.stl")
    (own / "link.dae").symlink_to(own / "arm.stl")
    (own / "inner.stl").mkdir()
    (own / "ring.stl").symlink_to(own / "ring.stl")
    return own


def read(folder, file="", bodies=1, **options):
    visual = MESH.format(file.format(folder.parent)) if file else ""
    links = "".join(LINK.format(f"b{k}", visual * (k == 0)) for k in range(bodies))
    path = folder / "robot.urdf"
    path.write_text(f'<robot name="r"><link name="post"/>{links}</robot>')
    return mechc.from_urdf(path, **options)


@pytest.mark.parametrize("file", TAKEN)
def test_files_in_the_folder_or_below_are_taken(folder, file):
    (solid,) = read(folder, file).drawing.solids
    assert (solid.kind, solid.sizes) == ("mesh", (0.1, -0.1, 0.1))
    assert solid.path in {str(folder / "arm.stl"), str(folder / "inner/leg.OBJ")}


@pytest.mark.parametrize("file", REFUSED)
def test_others_are_not_whether_they_are_there_or_not(folder, file):
    with pytest.warns(mechc.SkippedPartWarning, match="meshes=FOLDER says where they are"):
        mechanism = read(folder, file)
    assert mechanism.drawing.solids == ()
    (words,) = mechanism.skipped
    assert f"not below {folder})" in words


def test_a_folder_may_be_named_and_meshes_left(folder):
    (solid,) = read(folder / "inner", "package://any/arm.stl", meshes=folder).drawing.solids
    assert solid.path == str(folder / "arm.stl")
    left = read(folder, "arm.stl", meshes="ignore")
    assert (left.drawing.solids, left.skipped) == ((), ())
    with pytest.raises(mechc.MechanismError, match="is no folder"):
        read(folder, "arm.stl", meshes=folder / "arm.stl")


def test_other_formats_and_a_package_that_is_missing_are_named(folder, monkeypatch):
    with pytest.warns(mechc.SkippedPartWarning, match="STL, OBJ and COLLADA are read"):
        assert read(folder, "arm.glb").drawing.solids == ()
    monkeypatch.setattr(meshes, "PACKAGES", ("no_such_package",))
    with pytest.warns(mechc.SkippedPartWarning, match=r"pip install '\.\[meshes\]'"):
        assert read(folder, "arm.stl").drawing.solids == ()


def test_a_body_with_a_shape_has_no_other(folder):
    """Its mesh is not at its mass centre; the body without one is drawn by its inertia."""
    plan = picture_plan(read(folder, "arm.stl", bodies=2), Drawing(), {"g"}, in_space=True)
    assert [(s.kind, s.label) for s, _, _ in plan.solids] == [("mesh", "b0"), ("inertia", "b1")]
