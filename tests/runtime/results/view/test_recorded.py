"""The picture in a file is that which was saved, and anything else in its place is refused."""

from __future__ import annotations

import base64
import copy
import json
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.cli.commands import main
from mechc.compilation import build
from mechc.errors import MechcError
from mechc.model import Model
from mechc.results import files
from mechc.results.view.page import view_data
from mechc.results.view.recorded import MOST_BYTES, packed_view, unpacked_view
from tests.support import fake_linkage
from tests.support.pendulums import pendulum


@pytest.fixture(scope="module")
def data() -> dict[str, Any]:
    return view_data(fake_linkage.run(0.5))


def packed(data: Any) -> bytes:
    return zlib.compress(json.dumps(data).encode())


def test_what_is_packed_is_unpacked(data: dict[str, Any]) -> None:
    assert unpacked_view(packed_view(fake_linkage.run(0.5))) == json.loads(json.dumps(data))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("title", ["no text"]),
        ("title", "x" * 2000),
        ("title", "two\nlines"),
        ("start", float("nan")),
        ("frames", 0),
        ("frames", 10**9),
        ("start", 10**400),
        ("speeds", [10**400]),
        ("frames", True),
        ("tracks", "AAAA"),
        ("tracks", "no base64!"),
        ("points", "names"),
        ("links", [{"label": "a", "points": [10**6]}]),
        ("links", [{"label": "a", "points": [0], "more": 1}]),
        ("ground", [-1]),
        ("right", [1.0, 0.0]),
        ("solids", [{"kind": "script", "label": "a", "name": "a", "sizes": [1.0]}]),
        ("panels", [{"title": "a"}]),
        ("marks", [{"t": 0.0, "kind": "else", "label": "a"}]),
        ("flat", "yes"),
        ("speeds", [[1.0]]),
        ("paths", {"times": "", "points": ""}),
        ("paths", {"times": "AAAAAA==", "points": "AAAAAA=="}),
        ("paths", {"times": "AAAAAA=="}),
        ("paths", "AAAA"),
        ("forces", ["else"]),
        ("more", 1),
    ],
    ids=str,
)
def test_other_data_are_refused(data: dict[str, Any], key: str, value: Any) -> None:
    changed = {**copy.deepcopy(data), key: value}
    with pytest.raises(MechcError, match="damaged"):
        unpacked_view(packed(changed))


def test_numbers_that_are_not_finite_and_missing_fields_are_refused(data: dict[str, Any]) -> None:
    tracks = np.frombuffer(base64.b64decode(data["tracks"]), "<f4").copy()
    tracks[0] = np.inf
    bad = {**data, "tracks": base64.b64encode(tracks.tobytes()).decode()}
    less = {key: value for key, value in data.items() if key != "links"}
    for changed in (bad, less, [], "text"):
        with pytest.raises(MechcError, match="damaged"):
            unpacked_view(packed(changed))


def test_bytes_of_any_size_are_refused() -> None:
    for content in (b"", b"\x78\x9c", b"else", zlib.compress(b" " * (MOST_BYTES + 1))):
        with pytest.raises(MechcError, match=r"damaged|bytes"):
            unpacked_view(content)


def test_values_that_outgrow_their_text_are_refused_unread() -> None:
    """67 kB, unpacked 64 MiB, of empty lists took 3.4 GB and 33 s."""
    small, most = b'{"a": [' + b"[]," * 20_000_000 + b"[]]}", 10**6
    tracemalloc.start()
    with pytest.raises(MechcError, match="are allowed"):
        unpacked_view(zlib.compress(small))
    with pytest.raises(MechcError, match="are allowed"):
        unpacked_view(zlib.compress(small[: most // 10] + b"[]]}"), most)
    assert tracemalloc.get_traced_memory()[1] < 4 * MOST_BYTES
    tracemalloc.stop()


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory) -> tuple[mechc.Solution, Path]:
    """A user-defined body on a pin, and its file."""
    model = mechc.compile(pendulum())
    sol = model.simulate(0.5, _start(model))
    return sol, sol.save(tmp_path_factory.mktemp("saved") / "swing.nc")


def _start(model: Model) -> np.ndarray:
    return np.linspace(0.5, 0.7, len(model.coordinates) + len(model.speeds))


def test_a_motion_without_its_model_has_its_picture(
    motion: tuple[mechc.Solution, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    pytest.importorskip("jupyter_threejs_sage", reason="jupyter-threejs-sage is not installed")
    sol, path = motion
    expected = json.loads(json.dumps(sol.view().data))
    assert expected["solids"]
    monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(build, "_compiled", {})
    with pytest.raises(MechcError):
        mechc.open(path)  # nothing is compiled: no model is found
    assert mechc.open_view(path).data == expected
    page = tmp_path / "page.html"
    assert main(["open", str(path), "--view", str(page)]) == 0
    assert "inferred" in page.read_text("utf-8")
    assert str(page) in capsys.readouterr().out


def test_a_model_of_unknown_looks_has_the_picture_of_the_file(
    motion: tuple[mechc.Solution, Path],
) -> None:
    """As a scene in the cache is, which is found without its description."""
    pytest.importorskip("jupyter_threejs_sage", reason="jupyter-threejs-sage is not installed")
    sol, path = motion
    compiled = copy.copy(sol.model.system.drawn_by(_nothing))
    compiled.drawn = None
    again = mechc.open(path, Model.of_system(compiled))
    assert isinstance(again, mechc.Solution)
    assert again.view().data == json.loads(json.dumps(sol.view().data))


def _nothing(*_: Any, **__: Any) -> Any:
    raise AssertionError("its description is not known")


@pytest.mark.parametrize("content", [b'{"start": 1' + b"0" * 400 + b"}", b"[]" * 9])
def test_a_file_with_another_picture_is_refused_by_every_door(
    motion: tuple[mechc.Solution, Path], tmp_path: Path, content: bytes
) -> None:
    """``mechc verify`` called both sound, and the number ended in a traceback."""
    sol, _ = motion
    path = tmp_path / "other.nc"
    data = files.to_dataset(sol)
    data[files.VIEW] = ("b", np.frombuffer(zlib.compress(content), np.int8))
    data.assign_attrs(sha256=files.digest(data)).to_netcdf(path, engine="scipy")
    doors = (files.verify, mechc.open, mechc.open_view)
    for door in doors:
        with pytest.raises(MechcError, match="damaged"):
            door(path)
    assert main(["verify", str(path)]) == 2


def test_a_motion_with_its_model_is_opened_as_before(motion: tuple[mechc.Solution, Path]) -> None:
    sol, path = motion
    again = mechc.open(path, sol.model)
    assert isinstance(again, mechc.Solution)
    np.testing.assert_array_equal(again.y, sol.y)
    files.verify(path)


def test_files_of_the_library_hold_no_picture(tmp_path: Path) -> None:
    model = mechc.load("four_bar")
    path = model.simulate(0.1, model.assemble({"theta_0": 1.0})).save(tmp_path / "bar.nc")
    with pytest.raises(MechcError, match="holds no picture"):
        mechc.open_view(path)
