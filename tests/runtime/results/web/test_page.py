"""The page that simulates: escaped, alone; in a browser every control does what it says."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import mechc
from mechc.compilation import toolchain
from mechc.results.web.page import live_page, module_text
from tests.compiler.export.test_standalone import cart
from tests.runtime.results.test_animation import Page
from tests.support.trust.browser import OpenPage


def test_names_are_data_without_markup() -> None:
    hostile = "</script><script>alert(1)</script>"
    listed = [{"name": hostile, "kind": "length", "unit": hostile, "description": hostile}]
    drawing = {"points": [hostile], "links": [[hostile, [0, 0]]], "ground": [], "traced": []}
    about = {
        "title": hostile, "coordinates": listed, "speeds": [], "parameters": [], "outputs": [],
        "inputs": [hostile], "drawing": drawing | {"view": None}, "held": [],
    }  # fmt: skip
    module = module_text(b"\0asm", about)
    page = live_page(module, about, {hostile: None})
    assert hostile not in page
    parsed = Page(page)
    assert parsed.tags.count("script") == 2
    slider = json.loads(parsed.scripts[0])["sliders"][0]
    assert slider["name"] == hostile
    assert slider["label"].startswith(f"{hostile}, </script>")
    text = module.split("export const about = ")[1].split(";\n")[0]
    assert json.loads(text)["title"] == hostile


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if toolchain.packaged_compiler() is None:
        pytest.skip("the package ziglang is not installed")
    y0 = mechc.load("four_bar").assemble({"theta_0": 1.1}, params={"l_3": 3.5})
    folder = tmp_path_factory.mktemp("live")
    return mechc.export_wasm(
        "four_bar", folder, y0=y0, params={"l_3": 3.5}, sliders=("l_3", "theta_0", "m_1", "I_1")
    )[2]


@pytest.fixture
def opened(browser: Any, page_file: Path) -> Iterator[OpenPage]:
    found = OpenPage(browser, page_file)
    found.wait_for("document.querySelectorAll('.legend span').length > 1")
    yield found
    assert found.messages == []
    assert found.requests == [page_file.as_uri()]
    found.context.close()


def readouts(page: OpenPage) -> dict[str, str]:
    rows = page.page.locator(".legend button").all()
    return {str(r.locator("b").text_content()): str(r.locator("span").text_content()) for r in rows}


def slide(page: OpenPage, number: int, value: float) -> None:
    page.page.evaluate(
        """([number, value]) => {
            const input = document.querySelectorAll("#sliders input")[number];
            input.value = value;
            input.dispatchEvent(new Event("input"));
        }""",
        [number, value],
    )


@pytest.mark.slow
def test_it_plays_and_pauses(opened: OpenPage) -> None:
    assert opened.text("#play") == "Play"  # with reduced motion it waits
    before, energy = opened.picture(), readouts(opened)["total"]
    opened.page.click("#play")
    opened.wait_for("parseFloat(document.getElementById('clock').textContent) > 0.3")
    opened.page.click("#play")
    paused = readouts(opened)
    assert paused["total"] == energy
    opened.settle()
    assert readouts(opened) == paused
    assert opened.picture() != before
    opened.page.click("button:text-is('Start again')")
    assert opened.text("#clock") == "0.00 s"


@pytest.mark.slow
def test_it_goes_on_beyond_what_was_simulated_unless_it_loops(opened: OpenPage) -> None:
    for loops in (False, True):
        opened.page.keyboard.press("End")
        end = float(opened.text("#clock").removesuffix(" s"))
        opened.page.click("#play")
        passes = f"parseFloat(document.getElementById('clock').textContent) {'<' if loops else '>'}"
        opened.wait_for(f"{passes} {end}")
        opened.page.click("#play")
        opened.page.click("#loop")


@pytest.mark.slow
def test_sliders_simulate_anew_and_what_cannot_close_is_told(opened: OpenPage) -> None:
    before = opened.picture()
    slide(opened, 1, 1.4)
    assert readouts(opened)["θ₀"] == "80.2"
    assert opened.picture() != before
    slide(opened, 0, 6.5)
    assert "cannot be closed" in opened.text("#notes")
    assert readouts(opened)["θ₀"] == "80.2"
    opened.page.click("button:text-is('Reset values')")
    assert opened.text("#notes") == ""
    assert readouts(opened)["θ₀"] == "63.0"


@pytest.mark.slow
def test_what_follows_a_slider_moves_with_it_also_after_values_were_reset(opened: OpenPage) -> None:
    """The inertia of a uniform rod of 2 m is a third of its mass."""
    shown = "[...document.querySelectorAll('#sliders output')].slice(2).map(e => e.textContent)"
    for _ in range(2):
        slide(opened, 2, 1.5)
        mass, inertia = (float(text.split()[0]) for text in opened.page.evaluate(shown))
        assert (mass, inertia) == (1.5, 0.5)
        slide(opened, 3, 1.0)
        slide(opened, 2, 1.8)
        assert float(opened.page.evaluate(shown)[1].split()[0]) == 1.0
        opened.page.click("button:text-is('Reset values')")


@pytest.mark.slow
def test_an_input_counts_from_the_time_that_is_shown(browser: Any, tmp_path: Path) -> None:
    if toolchain.packaged_compiler() is None:
        pytest.skip("the package ziglang is not installed")
    kane, _, names, _ = cart()
    params = dict(zip(map(str, names), (1.2, 9.81, 0.7, 0.3), strict=True))
    y0 = [0.1, 0.8, -0.4, 2.0]
    file = mechc.export_wasm(
        kane, tmp_path, name="cart", y0=y0, params=params, sliders={"F": (-5, 5)}
    )[2]
    found = OpenPage(browser, file)
    found.wait_for("document.getElementById('clock').textContent === '0.00 s'")
    assert "inputs" in found.text("#notes")
    values = {}
    for key in ("End", "Shift+ArrowLeft"):
        found.page.keyboard.press(key)
        values[key] = readouts(found)["x"]
    shown = found.text("#clock")
    slide(found, 0, 4.0)
    assert found.text("#clock") == shown
    assert readouts(found)["x"] == values["Shift+ArrowLeft"]
    found.page.keyboard.press("End")
    assert readouts(found)["x"] != values["End"]
    assert found.messages == []
    found.context.close()


@pytest.mark.slow
@pytest.mark.parametrize("width", [1400, 360])
def test_nothing_is_wider_than_the_window(browser: Any, page_file: Path, width: int) -> None:
    found = OpenPage(browser, page_file, viewport={"width": width, "height": 700})
    found.wait_for("document.querySelectorAll('#sliders input').length === 4")
    assert found.page.evaluate("document.documentElement.scrollWidth") <= width
    assert found.page.locator("#canvas").bounding_box()["height"] >= 140
    assert found.messages == []
    found.context.close()
