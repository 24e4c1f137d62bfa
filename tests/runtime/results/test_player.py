"""The player in a real browser, in the plane and in space: every control does what it says."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from mechc.results.animation import animate
from mechc.results.player.page import Page
from mechc.results.view.page import view
from tests.support import fake_linkage
from tests.support.fake_linkage import FakeChangePoint, FakeSolution
from tests.support.trust.browser import OpenPage

pytestmark = pytest.mark.slow
IN_SPACE = pytest.mark.skipif(
    find_spec("jupyter_threejs_sage") is None, reason="jupyter-threejs-sage is not installed"
)


@pytest.fixture(
    scope="module", params=[animate, pytest.param(view, marks=IN_SPACE)], ids=["plane", "space"]
)
def made(request: pytest.FixtureRequest) -> Page:
    run = fake_linkage.run(2.0)
    page: Page = request.param(FakeSolution(run.system, run.t, (FakeChangePoint(0.5),)))
    return page


@pytest.fixture(scope="module")
def page_file(made: Page, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("page") / "page.html"
    file.write_text(made.html, "utf-8")
    return file


def seconds(page: OpenPage) -> float:
    return float(page.text("#clock").removesuffix(" s"))


def test_it_plays_and_pauses(opened: OpenPage) -> None:
    assert opened.text("#play") == "Play"  # with reduced motion it waits
    before = opened.picture()
    opened.page.keyboard.press(" ")
    opened.wait_for("parseFloat(document.getElementById('clock').textContent) > 0.2")
    opened.page.click("#play")
    paused = seconds(opened)
    assert opened.text("#said").startswith("Paused. Time ")
    opened.settle()
    assert seconds(opened) == paused > 0.2
    assert opened.picture() != before


def test_time_is_stepped_sought_and_marked(opened: OpenPage) -> None:
    press = opened.page.keyboard.press
    press("ArrowRight")
    assert seconds(opened) == pytest.approx(2.0 / 239, abs=1e-3)
    opened.page.click("#back")
    assert seconds(opened) == 0.0
    press("Shift+ArrowRight")
    assert seconds(opened) == pytest.approx(0.1, abs=1e-3)
    press("End")
    assert seconds(opened) == 2.0
    opened.page.click("#ticks i")
    assert seconds(opened) == 0.5
    assert opened.page.get_attribute("#ticks i", "title") == "change point, 0.500 s"
    box = opened.page.locator(".panel canvas").first.bounding_box()
    opened.page.mouse.click(box["x"] + box["width"] - 7, box["y"] + 20)
    assert seconds(opened) == pytest.approx(2.0, abs=0.02)
    assert "θ₀" in opened.text("#said") or "Time" in opened.text("#said")


def test_speed_loop_theme_and_plots(opened: OpenPage) -> None:
    page = opened.page
    page.click("#speeds button:text-is('2×')")
    assert page.get_attribute("#speeds button:text-is('2×')", "aria-pressed") == "true"
    page.keyboard.press("-")
    assert opened.text("#said") == "Speed 1."
    page.keyboard.press("l")
    assert page.get_attribute("#loop", "aria-pressed") == "false"
    light = opened.picture()
    page.keyboard.press("t")
    assert page.get_attribute("html", "data-theme") == "dark"
    opened.settle()
    assert opened.picture() != light
    page.keyboard.press("p")
    assert not page.is_visible("#plots")
    page.keyboard.press("p")
    shown = opened.picture(".panel canvas")
    page.click(".legend button")
    assert page.get_attribute(".legend button", "aria-pressed") == "false"
    assert opened.picture(".panel canvas") != shown
    page.click("#whole")
    opened.wait_for("document.fullscreenElement !== null")


def test_the_same_times_lie_below_each_other_and_nothing_beside_the_plots(opened: OpenPage) -> None:
    page, clocks = opened.page, set()
    for canvas in page.locator(".panel canvas[role=img]").all():
        canvas.click(position={"x": 120, "y": 30})
        clocks.add(opened.text("#clock"))
    assert len(page.locator(".panel").all()) > 1
    assert len(clocks) == 1
    side = page.locator("#side")
    assert side.evaluate("side => side.scrollWidth - side.clientWidth") == 0


def test_it_stops_at_the_end_or_begins_again(opened: OpenPage) -> None:
    for loops in (True, False):
        if not loops:
            opened.page.click("#loop")
        opened.page.keyboard.press("End")
        opened.page.keyboard.press("Shift+ArrowLeft")
        opened.page.click("#play")
        if loops:
            opened.wait_for("parseFloat(document.getElementById('clock').textContent) < 1.8")
        else:
            opened.wait_for("document.getElementById('play').textContent === 'Play'")
            assert seconds(opened) == 2.0


def test_it_opens_at_a_time_and_plays_where_motion_is_wanted(browser: Any, page_file: Path) -> None:
    found = OpenPage(browser, page_file, reduced_motion="no-preference")
    assert found.text("#play") == "Pause"
    found.page.evaluate("location.hash = '#t=1.5'")
    found.settle()
    assert (found.text("#play"), seconds(found)) == ("Play", 1.5)
    assert found.messages == []
    found.context.close()


def test_a_notebook_shows_it_in_a_frame(browser: Any, made: Page, tmp_path: Path) -> None:
    cell = tmp_path / "cell.html"
    cell.write_text(f"<!DOCTYPE html><html><body>{made._repr_html_()}</body></html>", "utf-8")
    found = OpenPage(browser, cell)
    found.settle()
    frame = found.page.frames[1]
    frame.click("#play")
    found.settle()
    frame.click("#play")
    assert float(str(frame.text_content("#clock")).removesuffix(" s")) > 0.0
    frame.click("#whole")
    assert found.messages == []
    found.context.close()


@pytest.mark.parametrize("width", [1400, 360])
def test_nothing_is_wider_than_the_window(browser: Any, page_file: Path, width: int) -> None:
    found = OpenPage(
        browser, page_file, viewport={"width": width, "height": 700}, color_scheme="dark"
    )
    found.settle()
    assert found.page.evaluate("document.documentElement.scrollWidth") <= width
    assert found.page.locator("#canvas").bounding_box()["height"] >= 140
    assert found.page.get_attribute("html", "data-theme") == "dark"
    assert found.messages == []
    found.context.close()
