"""The meshes of a robot's file -> those that can be drawn, and words on the others.

Output: a robot whose meshes have triangles, or the path of a file in one folder or below it.  The
file of the robot is untrusted: no file elsewhere is taken, nor is it said whether there is one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.bounds import IGNORE
from mechc_codegen.robots.robot import Robot, Visual

KINDS = (".stl", ".obj", ".dae")
PACKAGES = ("trimesh", "collada", "fast_simplification")
LISTED = 3  # meshes that are not drawn, by name
LONGEST = 1000  # letters of a path
ADVICE = "meshes=FOLDER says where they are, meshes='ignore' leaves them"


def take_meshes(robot: Robot, file: Path, meshes: str | Path | None = None) -> Robot:
    """The robot with the meshes that can be drawn, and what is to be warned of in ``skipped``.

    ``meshes``: the folder with them; None: that of the robot's file; ``"ignore"``: none is drawn.

    Raises
    ------
    MechanismError
        If ``meshes`` is no folder.
    """
    beside = file.resolve().parent
    folder = beside if meshes in (None, IGNORE) else Path(str(meshes)).resolve()
    if not folder.is_dir():
        raise MechanismError(f"{robot.name}: meshes={str(meshes)!r} is no folder")
    links, undrawn = {}, dict[str, list[str]]()
    for name, link in robot.links.items():
        drawn = [each for each in link.visuals if each.kind != "mesh"]
        for mesh in (each for each in link.visuals if each.kind == "mesh" and meshes != IGNORE):
            found = _with_file(mesh, folder, beside)
            if isinstance(found, Visual):
                drawn.append(found)
            else:
                undrawn.setdefault(found, []).append(mesh.path or mesh.label)
        links[name] = replace(link, visuals=tuple(drawn))
    words = (_words(why, names) for why, names in undrawn.items())
    return replace(robot, links=links, skipped=(*robot.skipped, *words))


def _words(why: str, names: list[str]) -> str:
    more = len(names) - LISTED
    listed = ", ".join(names[:LISTED]) + (f" and {more} more" if more > 0 else "")
    return f"the drawing of meshes ({why}): {listed}"


def _with_file(mesh: Visual, folder: Path, beside: Path) -> Visual | str:
    """The mesh with the path of its file, or why it is not drawn."""
    if not all(map(find_spec, PACKAGES)):
        return "pip install '.[meshes]' in the clone of mechc draws them"
    if mesh.triangles:
        return mesh
    if Path(mesh.path).suffix.lower() not in KINDS:
        return "STL, OBJ and COLLADA are read"
    try:
        found = next(_files(mesh.path, folder, beside), None)
    except (OSError, ValueError, RuntimeError):  # a name that no file has, a ring of links
        found = None
    return replace(mesh, path=str(found)) if found else f"{ADVICE}; not below {folder}"


def _files(text: str, folder: Path, beside: Path) -> Iterator[Path]:
    """Files in the folder or below that a text may name, links resolved."""
    scheme, _, rest = text.rpartition("://")
    places = [beside / rest, folder / rest]
    if scheme in ("package", "model"):  # the folder may be the package, or one within it
        parts = Path(rest.lstrip("/")).parts
        places = [folder.joinpath(*parts[k:]) for k in range(len(parts))]
    for place in places if len(text) <= LONGEST else ():
        file = place.resolve()
        if file.is_relative_to(folder) and file.is_file():
            yield file
