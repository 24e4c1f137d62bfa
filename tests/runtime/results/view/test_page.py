"""Promises of sol.view(): one page, closed to the network and to markup, true to the motion."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from typing import Any

import numpy as np
import pytest

from mechc.errors import MissingPackageError, ValueOutOfBoundsError
from mechc.results.player.motion import MOST_FRAMES, MOST_POSITIONS
from mechc.results.view import page as pages
from mechc.results.view import three_js
from tests.runtime.results.test_animation import Page, evil_run
from tests.support import fake_linkage
from tests.support.fake_linkage import FakeChangePoint, FakeSolution
from tests.support.page_data import floats

pytest.importorskip("jupyter_threejs_sage", reason="jupyter-threejs-sage is not installed")


def data_of(text: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(Page(text).scripts[0])
    return found


def run(t_end: float = 2.0, marks: tuple[FakeChangePoint, ...] = ()) -> FakeSolution:
    made = fake_linkage.run(t_end)
    return FakeSolution(made.system, made.t, marks)


def test_the_page_moves_as_the_run_does() -> None:
    sol = run()
    data = data_of(pages.view(sol).html)
    t = np.linspace(0.0, 2.0, data["frames"])
    tracks = floats(data["tracks"]).reshape(len(t), -1, 3) + np.array(data["origin"])
    np.testing.assert_allclose(tracks, sol.system.points(sol(t)), atol=1e-6)
    crank, times = floats(data["panels"][0]["lines"][0]["values"]), floats(data["times"])
    np.testing.assert_allclose(crank, np.rad2deg(sol(times.astype(float))[:, 0]), rtol=1e-6)
    energies = {line["name"]: floats(line["values"]) for line in data["panels"][-1]["lines"]}
    np.testing.assert_allclose(
        energies["kinetic"] + energies["potential"], energies["total"], atol=1e-4
    )


def test_change_points_are_on_the_time_line() -> None:
    marks = data_of(pages.view(run(marks=(FakeChangePoint(0.5),))).html)["marks"]
    assert marks == [{"t": 0.5, "kind": "change", "label": "change point"}]


def test_the_policy_names_all_that_runs_and_nothing_comes_from_elsewhere() -> None:
    text = pages.view(run()).html
    parsed = Page(text)
    policy = next(v for k, v in parsed.attributes if k == "content" and v and "default-src" in v)
    for script in parsed.scripts[1:]:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy
    style = re.search(r"<style>(.*?)</style>", text, re.S)
    assert style is not None
    digest = base64.b64encode(hashlib.sha256(style[1].encode()).digest()).decode()
    assert f"style-src 'sha256-{digest}'" in policy
    assert "unsafe" not in policy
    assert "connect-src" not in policy  # default-src 'none' closes it
    assert not {k for k, _ in parsed.attributes} & {"src", "href", "style", "onclick", "onload"}


def test_texts_of_users_are_no_markup() -> None:
    text = pages.view(evil_run()).html
    parsed = Page(text)
    assert "img" not in parsed.tags
    assert parsed.tags.count("script") == 3
    assert "<img" in json.dumps(data_of(text), ensure_ascii=False)


def test_a_long_run_of_many_points_has_fewer_frames() -> None:
    assert data_of(pages.view(run(120.0)).html)["frames"] == MOST_FRAMES
    many = fake_linkage.run(120.0)
    assert MOST_POSITIONS // len(many.system.point_names) > MOST_FRAMES


@pytest.mark.parametrize("fps", [0.0, -1.0, float("nan"), float("inf")])
def test_frames_a_second_are_positive(fps: float) -> None:
    with pytest.raises(ValueOutOfBoundsError, match="positive"):
        pages.view(run(), fps=fps)


def test_it_is_saved_as_a_page_and_displayed_in_a_frame(tmp_path: Any) -> None:
    view = pages.view(run())
    assert view.save(tmp_path / "made" / "view.html").read_text("utf-8") == view.html
    with pytest.raises(ValueOutOfBoundsError, match=r"\.html, \.png"):
        view.save(tmp_path / "view.txt")
    assert 'sandbox="allow-scripts"' in view._repr_html_()
    assert "<script" not in view._repr_html_()  # all of it is escaped in srcdoc


def test_without_three_js_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(three_js, "PACKAGE", "no_such_package")
    with pytest.raises(MissingPackageError, match=r"pip install .\.\[view\]. in the clone"):
        pages.view(run())
