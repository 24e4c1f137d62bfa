"""The meshes of a picture -> their triangles, fewer where a page would have too many.

Input: solids that are meshes, by the path of a file or by their triangles.  Output: corners in the
units of the file.  Invariant: all together have MOST_DRAWN triangles at most.  Files are untrusted:
nothing beside them is opened.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any, Final, NoReturn
from xml.etree.ElementTree import Element, TreeBuilder, tostring
from xml.parsers import expat

import numpy as np

from mechc.errors import MechcError, install_command, package
from mechc.results.untrusted import printable, read_regular
from mechc.results.view.stl import LARGEST, MOST_TRIANGLES, read_stl
from mechc.system.parameters import Array
from mechc.system.picture import Solid

MOST_DRAWN: Final = 80_000  # triangles of a page: 4 MB
MOST_PARTS: Final = 5000  # of a file in COLLADA: lists of polygons, and of numbers for them
MOST_INDICES: Final = 12 * MOST_TRIANGLES  # of COLLADA, 170 bytes each: corners with four inputs
KEPT: Final = 300  # triangles that a small mesh keeps
# Elements of COLLADA about colours, which are not drawn, and often refer to what is not there.
COLOURS: Final = ("bind_material", "library_effects", "library_images", "library_materials")
WORD: Final = re.compile(rb"\S++")
ROW: Final = re.compile(rb"^[ \t]*+(f|v[nt]?+)(?=\s)([^\n]*+)", re.MULTILINE)  # of an OBJ
_Source = tuple[str, int, bytes]  # path, when it was written, triangles


def surfaces(solids: Sequence[Solid]) -> Sequence[Array]:
    """Corners of the triangles of each mesh, (triangles, 3, 3).

    Raises
    ------
    MechcError
        If a file is missing, too large, or damaged; the message names it.
    MissingPackageError
        If a package is needed that is not installed.
    """
    return _within_bound(tuple((s.path, _write_time(s.path), s.triangles) for s in solids))


def _write_time(path: str) -> int:
    return Path(path).stat().st_mtime_ns if path and Path(path).exists() else 0


@lru_cache(maxsize=2)  # a slider draws the same meshes again and again
def _within_bound(sources: tuple[_Source, ...]) -> tuple[Array, ...]:
    read = {source: _finite_corners(source) for source in dict.fromkeys(sources)}
    counts = [len(read[source]) for source in sources]
    most = dict(zip(sources, _shares(counts), strict=True))
    fewer = {s: c if len(c) <= most[s] else _simplify(c, most[s]) for s, c in read.items()}
    return tuple(fewer[source] for source in sources)


def _shares(counts: Sequence[int]) -> list[int]:
    """How many triangles each mesh may have, in proportion to those it has above KEPT."""
    if sum(counts) <= MOST_DRAWN:
        return list(counts)
    kept = [min(count, KEPT, MOST_DRAWN // len(counts)) for count in counts]
    ratio = (MOST_DRAWN - sum(kept)) / (sum(counts) - sum(kept))
    return [own + int(ratio * (count - own)) for own, count in zip(kept, counts, strict=True)]


def _simplify(corners: Array, most: int) -> Array:
    """A surface near to this one (Garland and Heckbert's quadrics) of some ``most`` triangles."""
    trimesh = _trimesh(
        f"of the meshes, a page has {MOST_DRAWN} triangles at most; more are made fewer"
    )
    merged = trimesh.Trimesh(**trimesh.triangles.to_kwargs(corners))
    return np.asarray(merged.simplify_quadric_decimation(face_count=most).triangles)[:most]


# -- files ------------------------------------------------------------------------------------


def _finite_corners(source: _Source) -> Array:
    corners, path = _corners(source), source[0] or "a mesh of the mechanism"
    # A page has single precision; what is not a number is not below its largest number either.
    if not len(corners) or not (np.abs(corners) <= np.finfo(np.float32).max).all():
        raise _damage_error(path, "it has no triangles, or corners that are not finite")
    if len(corners) > MOST_TRIANGLES:
        raise MechcError(
            f"{printable(path)} has {len(corners)} triangles, {MOST_TRIANGLES} at most are read"
        )
    return corners


def _corners(source: _Source) -> Array:
    path, _, triangles = source
    if not path:
        return np.frombuffer(triangles, "<f4").reshape(-1, 3, 3).astype(float)
    return read_stl(path) if Path(path).suffix.lower() == ".stl" else _read_mesh(path)


def _read_mesh(path: str) -> Array:
    """The triangles of an OBJ or COLLADA file; COLLADA in m.

    Its axes are those of the file, whichever it calls up: as ROS draws robots.
    """
    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in ("obj", "dae"):
        raise MechcError(f"{printable(path)} is none of STL, OBJ and COLLADA (.dae)")
    trimesh = _trimesh(f"{printable(path)}: {kind.upper()} is read")
    try:
        content = read_regular(Path(path), LARGEST)
    except FileNotFoundError:
        raise MechcError(f"there is no file {printable(path)}") from None
    try:
        content = _without_colours(path, content) if kind == "dae" else _without_materials(content)
        scene = trimesh.load_scene(BytesIO(content), file_type=kind, skip_materials=True)
        count = sum(len(scene.geometry[scene.graph[each][1]].faces)
                    for each in scene.graph.nodes_geometry)  # fmt: skip
        if count > MOST_TRIANGLES:
            raise ValueError(f"{count} triangles, {MOST_TRIANGLES} at most are read")
        whole = scene.convert_units("meters") if kind == "dae" and scene.units else scene
        return np.asarray(whole.to_mesh().triangles) if count else np.empty((0, 3, 3))
    except MechcError:
        raise
    except Exception as error:  # of any kind, as the packages do not bound what a file may hold
        raise _damage_error(path, f"{type(error).__name__} {error}") from None


def _without_materials(content: bytes) -> bytes:
    """An OBJ without its materials: trimesh takes time with the square of their number.

    Raises :class:`ValueError` where triangles, or corners for them, are more than are read: before
    trimesh does, which takes thirty times the file.
    """
    whole = content.replace(b"\r\n", b"\n").replace(b"\\\n", b"")  # lines that go on are joined
    counts = {b"f": 0, b"v": 0, b"vn": 0, b"vt": 0}
    for line in ROW.finditer(whole):
        kind, given = line[1], WORD.finditer(whole, *line.span(2))
        counts[kind] += 1 if kind != b"f" else max(1, _count(given, MOST_TRIANGLES + 3) - 2)
        if counts[kind] > MOST_TRIANGLES * (1 if kind == b"f" else 3):
            raise ValueError(f"many triangles or corners, {MOST_TRIANGLES} at most are read")
    lines = whole.replace(b"usemtl", b"#").replace(b"mtllib", b"#").splitlines()
    return b"\n".join(line for line in lines if not line.lstrip().startswith(b"#"))


def _count(words: Iterator[Any], most: int) -> int:
    """How many there are, ``most`` if there are more."""
    return sum(1 for _ in islice(words, most))


def _without_colours(path: str, content: bytes) -> bytes:
    """The document without COLOURS; refused if it declares a document type."""

    def refuse(*_: Any) -> NoReturn:
        raise _damage_error(path, "it declares a document type (<!DOCTYPE>)")

    builder, parser = TreeBuilder(), expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    parser.StartElementHandler = lambda tag, given: builder.start(tag.rpartition(":")[2], given)
    parser.EndElementHandler = lambda tag: builder.end(tag.rpartition(":")[2])
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(content, True)
        root = builder.close()
        for parent in list(root.iter()):
            for child in [each for each in parent if each.tag in COLOURS]:
                parent.remove(child)
        if _parts(root) > MOST_PARTS:
            raise _damage_error(path, f"it draws more than {MOST_PARTS} parts")
        given = sum(_count(re.finditer(r"\S++", each.text or ""), MOST_INDICES + 1)
                    for each in root.iter("p"))  # fmt: skip
        if given > MOST_INDICES:
            raise _damage_error(path, f"its triangles have more than {MOST_INDICES} indices")
        return tostring(root)
    except (expat.ExpatError, LookupError, RecursionError) as error:
        raise _damage_error(path, f"it is not XML, or nested too deeply: {error}") from None


def _parts(root: Element) -> int:
    """How many lists and nodes of others a scene draws, each some milliseconds of trimesh.

    A node that twice refers to another, which does so too, draws as many as 2 to the power of such
    nodes; one that refers to itself draws more than any bound.
    """
    of = {
        f"#{each.get('id')}": sum(element.get("count") is not None for element in each.iter())
        for each in root.iter("geometry")
    }
    nodes = {f"#{each.get('id')}": each for each in root.iter("node")}
    known = dict[str, int]()

    def drawn(element: Element) -> int:
        url = element.get("url", "")
        if element.tag == "instance_geometry":
            return of.get(url, 0)
        if element.tag == "instance_node" and url in nodes:
            if url not in known:
                known[url] = MOST_PARTS
                known[url] = drawn(nodes[url])
            return 1 + known[url]
        return sum(map(drawn, element))

    return drawn(root)


def _trimesh(words: str) -> Any:
    """The package; the words say what cannot be done without it."""
    for needed in ("collada", "fast_simplification", "trimesh"):
        found = package(needed, f"{words} by trimesh: {install_command('meshes')}")
    return found


def _damage_error(path: str, why: str) -> MechcError:
    return MechcError(f"{printable(path)} is damaged: {printable(why[:200])}")
