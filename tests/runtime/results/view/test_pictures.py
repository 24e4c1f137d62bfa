"""A view as PNG, GIF and MP4: what the page shows, at the times that were asked for."""

from __future__ import annotations

import shutil
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from mechc.errors import MissingPackageError, ValueOutOfBoundsError
from mechc.results.view import browser, pictures
from mechc.results.view.page import View, view
from tests.support import fake_linkage

pytest.importorskip("jupyter_threejs_sage", reason="jupyter-threejs-sage is not installed")
needs_browser = pytest.mark.skipif(
    not any(map(shutil.which, browser.NAMES)), reason="no Chromium on PATH"
)


@pytest.fixture(scope="module")
def made() -> View:
    return view(fake_linkage.run(1.0))


def dots(path: Path) -> Any:
    return np.asarray(Image.open(path).convert("RGB"), dtype=int)


@pytest.mark.slow
@needs_browser
def test_pictures_are_of_their_times_and_themes(made: View, tmp_path: Path) -> None:
    first = dots(made.save(tmp_path / "first.png", size=(320, 200)))
    assert first.shape == (200, 320, 3)
    later = dots(made.save(tmp_path / "later.png", size=(320, 200), t=0.6, theme="dark"))
    assert first.mean() > 200  # on light ground
    assert later.mean() < 90
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 100  # shaded solids


@pytest.mark.slow
@needs_browser
def test_a_film_has_its_frames_and_moves(made: View, tmp_path: Path) -> None:
    path = made.save(tmp_path / "film.gif", size=(160, 120), fps=5.0)
    frames = []
    with Image.open(path) as film:
        assert (film.n_frames, film.info["duration"], film.info["loop"]) == (6, 200, 0)
        for k in range(film.n_frames):
            film.seek(k)
            frames.append(np.asarray(film.convert("RGB"), dtype=int))
    assert all(np.abs(b - a).max() > 50 for a, b in pairwise(frames))


@pytest.mark.slow
@needs_browser
def test_an_mp4_is_one(made: View, tmp_path: Path) -> None:
    if shutil.which("ffmpeg") is None:
        pytest.importorskip("imageio_ffmpeg", reason="neither ffmpeg nor imageio-ffmpeg")
    film = made.save(tmp_path / "film.mp4", size=(161, 121), fps=5.0).read_bytes()
    assert film[4:8] == b"ftyp"
    assert b"avc1" in film


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"t": 1.5}, "no time"),
        ({"size": (10, 100)}, "64 to 4096"),
        ({"size": (100.5, 100)}, "64 to 4096"),
        ({"camera": "below"}, "front, back, top"),
        ({"theme": "red"}, "light, dark"),
    ],
)
def test_what_cannot_be_is_refused(made: View, tmp_path: Path, wrong: Any, words: str) -> None:
    with pytest.raises(ValueOutOfBoundsError, match=words):
        made.save(tmp_path / "picture.png", **wrong)


def test_times_of_a_film() -> None:
    assert pictures.film_times(1.0, 4.0, 1.0) == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert pictures.film_times(1.0, 4.0, 2.0) == [0.0, 0.5, 1.0]
    for fps, speed in ((0.0, 1.0), (1.0, -1.0), (float("nan"), 1.0)):
        with pytest.raises(ValueOutOfBoundsError, match="positive"):
            pictures.film_times(1.0, fps, speed)
    with pytest.raises(ValueOutOfBoundsError, match="900 pictures at most"):
        pictures.film_times(1e30, 25.0, 1.0)


def test_without_a_browser_the_error_says_what_to_install(
    made: View, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(browser, "NAMES", ("no_such_browser",))
    with pytest.raises(MissingPackageError, match="Chromium"):
        made.save(tmp_path / "picture.png")
