"""The page in space in a real browser: its camera, its bodies, what is shown of them."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from mechc.results.player.page import base64_floats, template
from mechc.results.sampling import pretty_name
from mechc.results.view.page import View, view, view_data
from tests.support import fake_linkage
from tests.support.fake_linkage import FakeChangePoint, FakeSolution, Faster
from tests.support.trust.browser import OpenPage

pytest.importorskip("jupyter_threejs_sage", reason="jupyter-threejs-sage is not installed")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = fake_linkage.run(2.0)
    sol = FakeSolution(made.system, made.t, (FakeChangePoint(0.5),))
    return view(sol).save(tmp_path_factory.mktemp("view") / "view.html")


def test_the_camera_turns_comes_nearer_and_goes_to_views(opened: OpenPage) -> None:
    seen = {opened.picture()}
    for name in ("Top", "Side", "Isometric", "Front"):
        opened.page.click(f"#views button:text-is('{name}')")
        opened.settle()
        assert opened.text("#said") == f"Seen from: {name.lower()}."
        seen.add(opened.picture())
    assert len(seen) == 4  # the front view is the first again
    box = opened.page.locator("#canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    opened.page.mouse.move(x, y)
    opened.page.mouse.down()
    opened.page.mouse.move(x + 90, y + 40, steps=4)
    opened.page.mouse.up()
    opened.settle()
    turned = opened.picture()
    assert turned not in seen
    opened.page.mouse.wheel(0, -300)
    opened.settle()
    nearer = opened.picture()
    assert nearer not in {turned, *seen}
    opened.page.focus("#canvas")
    opened.page.keyboard.press("ArrowLeft")
    opened.settle()
    assert opened.text("#clock") == "0.000 s"  # on the canvas arrows turn the view
    assert opened.picture() != nearer


def test_the_fit_leaves_room_for_the_toolbars(browser: Any, page_file: Path) -> None:
    found = OpenPage(browser, page_file, viewport={"width": 1600, "height": 500})
    found.settle()
    for key in "gr":  # the grid and traces may lie under them
        found.page.keyboard.press(key)
    for bar in ("#views", "#shows"):
        found.page.evaluate(f"document.querySelector('{bar}').style.visibility = 'hidden'")
    found.page.evaluate("document.querySelector('#views').style.right = '0'")
    found.settle()
    for bar in ("#views", "#shows"):
        picture = found.page.screenshot(clip=found.page.locator(bar).bounding_box())
        under = np.asarray(Image.open(BytesIO(picture)).convert("RGB"))
        assert (under == under[0, 0]).all(), f"{bar} covers what moves"
    found.context.close()


def test_names_are_told_on_hover(opened: OpenPage) -> None:
    box = opened.page.locator("#canvas").bounding_box()
    names = set()
    for part in range(8, 93, 3):
        x, y = box["x"] + box["width"] * part / 100, box["y"] + 0.6 * box["height"]
        opened.page.mouse.move(x, y)
        opened.settle()
        if opened.page.is_visible("#tip"):
            names.add(opened.text("#tip"))
    assert names & {"crank", "coupler", "rocker"}


@pytest.mark.parametrize("given", [True, False], ids=["of the dense output", "of frames"])
def test_fast_paths_are_smooth_curves(browser: Any, given: bool) -> None:
    """In lines as short as they bend; pages of earlier versions have frames alone."""
    made = fake_linkage.run(2.0)
    sol = Faster(made.system, np.array([0.0, 1.0, 2.0]))
    data = {key: value for key, value in view(sol).data.items() if given or key != "paths"}
    page = browser.new_page()
    page.set_content(f'<script type="application/json" id="motion">{json.dumps(data)}</script>')
    script = template("player", "data.js") + "\nreturn [Array.from(pathTimes), Array.from(paths)];"
    t, values = page.evaluate("() => {" + script + "}")
    page.close()
    points = np.reshape(values, (len(t), -1, 3)) + data["origin"]
    names = sol.system.point_names
    traced = [[pretty_name(n) for n in names].index(data["points"][k]) for k in data["traced"]]
    middle = np.add(t[1:], t[:-1]) / 2
    true = sol.system.points(sol(middle))[:, traced]
    size = np.ptp(true, axis=0).max()
    near = 0.0015 if given else 0.003
    assert np.abs((points[1:] + points[:-1]) / 2 - true).max() < near * size


def test_traces_and_following_are_switched(opened: OpenPage) -> None:
    opened.page.click("#shows button:text-is('Traces')")
    assert opened.text("#said") == "Traces hidden."
    opened.page.select_option("#follow", "1")
    assert opened.text("#said") == "Follow crank."


def with_all_kinds() -> View:
    """A view with every kind of solid, a spring, a damper and an arrow."""
    data = view_data(fake_linkage.run(1.0))
    sizes = {"ball": [0.3], "box": [0.4, 0.2, 0.3], "disc": [0.3, 0.1], "wheel": [0.5], "mass": []}
    solids = [{"kind": k, "label": k, "name": k, "sizes": s} for k, s in sizes.items()]
    triangle = base64_floats(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 1]]))
    mesh = {"kind": "mesh", "label": "part", "name": "part", "sizes": [1], "triangles": triangle}
    solids += [mesh, {**solids[1], "inferred": True}, {**solids[2], "inferred": True}]
    rows = np.zeros((data["frames"], len(solids), 7))
    rows[..., 1], rows[..., 6] = 0.2 * np.arange(len(solids)), 1.0  # above each other
    force = base64_floats(np.ones((data["frames"], 3)))
    foot = base64_floats(0 * rows[:, 0, :3])
    arrow = {"label": "reaction", "at": foot, "force": force, "usual": 1.0}
    struts = [
        {"kind": "spring", "label": "spring", "points": [0, 2]},
        {"kind": "damper", "label": "damper", "points": [1, 3]},
    ]
    load = {**arrow, "label": "load", "force": base64_floats(-np.ones((data["frames"], 3)))}
    more = {"solids": solids, "placed": base64_floats(rows), "struts": struts, "arrows": [arrow]}
    more["loads"] = [load]
    more["guides"] = [{"label": "slider", "points": [0, 1, 2], "block": True}]
    return View({**data, **more})


def test_every_kind_of_solid_is_drawn(browser: Any, tmp_path: Path) -> None:
    found = OpenPage(browser, with_all_kinds().save(tmp_path / "view.html"))
    found.settle()
    seen = [found.picture()]
    scale = found.text("#scale")
    assert "reactions: " in scale
    assert "loads: " not in scale
    words = {"b": "Bodies hidden", "v": "Reactions hidden", "g": "Grid hidden", "o": "Loads shown"}
    for key, told in words.items():
        found.page.keyboard.press(key)
        found.settle()
        assert found.text("#said") == f"{told}."
        seen.append(found.picture())
    assert len(set(seen)) == len(seen)
    assert found.text("#scale").startswith("loads: ")
    assert found.messages == []
    found.context.close()
