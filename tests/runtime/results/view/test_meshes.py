"""Meshes are read as they were written, are few enough for a page, and are no way in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.errors import MechcError, MissingPackageError
from mechc.results.view import meshes
from mechc.system.picture import Solid
from tests.support.page_data import floats

QUAD = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0.5\nusemtl gone\nf 1 2 3 4\nmtllib ../secret.mtl\n"
CORNERS = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0.5]])
DAE = """<?xml version="1.0"?>{doctype}
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="inch" meter="0.0254"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="a" count="9">{numbers}</float_array><technique_common>
    <accessor source="#a" count="3" stride="3"><param name="X" type="float"/>
    <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
  </source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="1" material="m"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p>
  </triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="outer"><translate>0 0 4</translate>
  <node id="inner"><rotate>0 0 1 90</rotate><instance_geometry url="#g"><bind_material>
  <technique_common><instance_material symbol="m" target="#gone"/></technique_common>
  </bind_material></instance_geometry></node></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
NUMBERS = "0 0 0 1 0 0 0 2 0"
INNER = '<node id="inner">'
WHOLE = DAE.format(doctype="", numbers=NUMBERS)
MANY = WHOLE.replace(INNER, INNER + 2000 * '<instance_geometry url="#g"/>')
REFERENCE = '<instance_node url="#n{}"/>'
DOUBLED = WHOLE.replace(INNER, INNER + REFERENCE.format(0)).replace(
    "<library_visual_scenes>",
    "<library_nodes>"
    + "".join(f'<node id="n{k}">{2 * REFERENCE.format(k + 1)}</node>' for k in range(60))
    + '<node id="n60"/></library_nodes><library_visual_scenes>',
)
RING = WHOLE.replace(INNER, INNER + '<instance_node url="#inner"/>')
DEEP = WHOLE.replace(INNER, INNER + 9000 * "<node>" + 9000 * "</node>")
BOMB = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'


def solid(path: Path | str, triangles: bytes = b"") -> Solid:
    return Solid("mesh", "part", "z", str(path), triangles, lambda p: np.ones(1))


def wave(count: int) -> bytes:
    """A curved surface of 2 count^2 triangles."""
    x, y = np.meshgrid(*2 * [np.linspace(0.0, 1.0, count + 1)], indexing="ij")
    at = np.stack([x, y, 0.1 * np.sin(3 * x) * np.cos(2 * y)], axis=-1)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    corners = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)])
    return corners.reshape(-1, 9).astype("<f4").tobytes()


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


@pytest.fixture
def trimesh() -> Any:
    pytest.importorskip("collada")
    pytest.importorskip("fast_simplification")
    return pytest.importorskip("trimesh")


def test_an_obj_is_read_without_the_files_that_it_names(tmp_path: Path, trimesh: Any) -> None:
    (corners,) = meshes.surfaces([solid(written(tmp_path, "part.OBJ", QUAD))])
    assert corners.shape == (2, 3, 3)
    np.testing.assert_allclose(
        np.unique(corners.reshape(-1, 3), axis=0), np.unique(CORNERS, axis=0)
    )
    sides = corners[:, 1:] - corners[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    assert 2.0 < areas.sum() < 2.3


def test_materials_cost_no_time(tmp_path: Path, trimesh: Any) -> None:
    """As materials 20,000 would take minutes; with one each trimesh makes as many meshes."""
    faces = "".join(f"usemtl m{k}\nf 1 2 3\nus\\\nemtl n{k}\nf 1 3 2\n" for k in range(10_000))
    (corners,) = meshes.surfaces([solid(written(tmp_path, "part.obj", QUAD[:34] + faces))])
    assert len(corners) == 20_000


def test_collada_is_placed_by_its_nodes_in_metres(tmp_path: Path, trimesh: Any) -> None:
    """Although its material is missing; up is not turned, as in ROS."""
    text = DAE.format(doctype="", numbers=NUMBERS)
    (corners,) = meshes.surfaces([solid(written(tmp_path, "part.dae", text))])
    expected = 0.0254 * np.array([[[0, 0, 4], [0, 1, 4], [-2, 0, 4]]])
    np.testing.assert_allclose(corners, expected, atol=1e-8)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.dae", DAE.format(doctype=BOMB, numbers=NUMBERS), "declares a document type"),
        ("b.dae", DAE.format(doctype="", numbers=NUMBERS.replace("1", "inf")), "not finite"),
        ("r.dae", DAE.format(doctype="", numbers=NUMBERS.replace("1", "1e39")), "not finite"),
        ("c.dae", DAE.format(doctype="", numbers=NUMBERS).replace(">0 1 2<", ">0 1 9<"), "damaged"),
        ("d.dae", "PK", "not XML"),
        ("e.dae", "<COLLADA/>", "damaged"),
        ("m.dae", MANY, "it draws more than 5000 parts"),
        ("p.dae", DOUBLED, "it draws more than 5000 parts"),
        ("q.dae", RING, "it draws more than 5000 parts"),
        ("n.dae", DEEP, "nested too deeply"),
        ("f.obj", "f 1 2 3\n", "damaged"),
        ("g.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("h.glb", "", "none of STL, OBJ and COLLADA"),
    ],
)
def test_what_is_damaged_is_refused_by_name(
    tmp_path: Path, trimesh: Any, name: str, text: str, words: str
) -> None:
    with pytest.raises(MechcError, match=rf"{name}.*{words}"):
        meshes.surfaces([solid(written(tmp_path, name, text))])


def test_a_missing_file_a_link_and_too_many_triangles_are_refused(
    tmp_path: Path, trimesh: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(MechcError, match="there is no file"):
        meshes.surfaces([solid(tmp_path / "gone.obj")])
    (tmp_path / "link.obj").symlink_to(written(tmp_path, "part.obj", QUAD))
    with pytest.raises(MechcError, match=r"link\.obj"):
        meshes.surfaces([solid(tmp_path / "link.obj")])
    monkeypatch.setattr(meshes, "MOST_TRIANGLES", 1)
    for large in (solid(tmp_path / "part.obj"), solid("", wave(2))):
        with pytest.raises(MechcError, match=r"1 at most are read"):
            meshes.surfaces([large])


def test_a_collada_with_too_many_indices_is_not_given_to_trimesh(
    tmp_path: Path, trimesh: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """64 MiB of them took it six gigabytes."""
    monkeypatch.setattr(meshes, "MOST_INDICES", 2)
    with pytest.raises(MechcError, match="its triangles have more than 2 indices"):
        meshes.surfaces([solid(written(tmp_path, "part.dae", WHOLE))])


@pytest.mark.parametrize(
    "many", [4 * "f 1 2 3\n", "f 1 2 3 1 2 3\n", 7 * " v 1 1 1\n", 10 * "vn\t1 1 1\n"]
)
def test_an_obj_with_too_many_parts_is_not_given_to_trimesh(
    tmp_path: Path, trimesh: Any, monkeypatch: pytest.MonkeyPatch, many: str
) -> None:
    """64 MiB of faces, of corners of one face, or of points took it two gigabytes."""
    monkeypatch.setattr(meshes, "MOST_TRIANGLES", 3)
    monkeypatch.setattr(trimesh, "load_scene", lambda *_, **__: pytest.fail("was read"))
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + many
    with pytest.raises(MechcError, match="many triangles or corners, 3 at most are read"):
        meshes.surfaces([solid(written(tmp_path, "part.obj", text))])


def test_large_meshes_share_what_a_page_may_have(
    trimesh: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Small ones stay as they are, and a surface stays where it was."""
    monkeypatch.setattr(meshes, "MOST_DRAWN", 3000)
    found = meshes.surfaces([solid("", wave(n)) for n in (5, 60, 5, 30)])
    counts = [len(corners) for corners in found]
    assert counts[0] == counts[2] == 50
    assert 2500 < sum(counts) <= 3000
    assert counts[1] > 2 * counts[3] > 1000
    x, y, z = found[1].reshape(-1, 3).T
    np.testing.assert_allclose(z, 0.1 * np.sin(3 * x) * np.cos(2 * y), atol=1e-3)


def test_without_the_packages_few_triangles_are_drawn_still(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(name: str, advice: str) -> None:
        raise MissingPackageError(advice)

    monkeypatch.setattr(meshes, "package", absent)
    assert len(meshes.surfaces([solid("", wave(7))])[0]) == 98
    monkeypatch.setattr(meshes, "MOST_DRAWN", 97)
    for many in (solid("", wave(8)), solid(written(tmp_path, "part.obj", QUAD))):
        with pytest.raises(MissingPackageError, match=r"pip install '\.\[meshes\]'"):
            meshes.surfaces([many])


def test_a_mesh_is_drawn_where_its_link_is(
    tmp_path: Path, trimesh: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Mirrored, turned and moved on a link that is turned; and it is in a saved motion."""
    written(tmp_path, "part.obj", QUAD)
    urdf = """<robot name="r"><link name="post"/><link name="arm"><visual>
      <origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/>
      <geometry><mesh filename="part.obj" scale="1 -1 0.5"/></geometry></visual>
      <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
      </link><joint name="j" type="continuous"><parent link="post"/><child link="arm"/>
      <axis xyz="1 0 0"/></joint></robot>"""
    path = written(tmp_path, "r.urdf", urdf)
    model = mechc.compile(mechc.from_urdf(path), outputs=("energy",))
    sol = model.simulate(0.01, {"q_j": np.pi / 2})
    data = sol.view().data
    (shape,) = data["solids"]
    place = floats(data["placed"]).reshape(-1, 7)[0]
    corners = floats(shape["triangles"]).reshape(-1, 3)
    at = _turned(place[3:])(corners) + place[:3] + data["origin"]
    mirrored = CORNERS * [1, -1, 0.5]
    on_link = np.stack([0.1 - mirrored[:, 1], mirrored[:, 0], mirrored[:, 2]], axis=1)
    in_space = np.stack([on_link[:, 0], -on_link[:, 2], on_link[:, 1]], axis=1)
    np.testing.assert_allclose(
        np.unique(at.round(5) + 0.0, axis=0), np.unique(in_space.round(5) + 0.0, axis=0), atol=2e-5
    )
    sol.save(tmp_path / "sol.nc")
    (again,) = mechc.open_view(tmp_path / "sol.nc").data["solids"]
    assert again["triangles"] == shape["triangles"]


def _turned(quaternion: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quaternion).apply
