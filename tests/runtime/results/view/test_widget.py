"""The widget: messages in and out without a browser, and its sliders in a real one."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from tests.runtime.results.test_animation import Page
from tests.support.page_data import floats
from tests.support.trust.browser import TWO_FRAMES, OpenPage

pytest.importorskip("anywidget", reason="anywidget is not installed")
pytest.importorskip("jupyter_threejs_sage", reason="jupyter-threejs-sage is not installed")

SLIDERS = {"l_3": (2.5, 4.5), "theta_0": (1.2, 2.0)}


@pytest.fixture
def widget() -> Any:
    return mechc.load("four_bar").widget(1.0, {"theta_0": 1.5}, {"l_3": 3.5}, sliders=SLIDERS)


@pytest.fixture
def sent(widget: Any, monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """The states that go to the notebook's page, one after another."""
    found: list[dict[str, Any]] = []
    monkeypatch.setattr(
        widget.comm, "send", lambda data, *_, **__: found.append(data.get("state", {}))
    )
    return found


def receive(widget: Any, **state: Any) -> None:
    """A message of the notebook's page that sets traits."""
    content = {"data": {"method": "update", "state": state, "buffer_paths": []}}
    widget._handle_msg({"content": content, "buffers": []})


def crank(motion: dict[str, Any]) -> Any:
    return np.deg2rad(floats(motion["panels"][0]["lines"][0]["values"]))


def test_values_come_in_and_their_motion_goes_out(widget: Any, sent: list[Any]) -> None:
    receive(widget, values={"l_3": 3.7, "theta_0": 1.6})
    sol = mechc.load("four_bar").simulate(1.0, {"theta_0": 1.6}, {"l_3": 3.7})
    motion = next(state["motion"] for state in sent if "motion" in state)
    t = floats(motion["times"]).astype(float)
    np.testing.assert_allclose(crank(motion), sol(t)[:, 0], rtol=1e-6)
    np.testing.assert_array_equal(widget.solution.y, sol.y)


def test_values_set_in_python_move_the_sliders(widget: Any, sent: list[Any]) -> None:
    widget.values = {"l_3": 3.6}
    assert {"values": {"l_3": 3.6, "theta_0": 1.5}} in sent
    assert any("motion" in state for state in sent)
    with pytest.raises(mechc.UnknownNameError, match="l_9"):
        widget.values = {"l_9": 1.0}


def test_values_of_a_page_stay_within_their_ranges(widget: Any) -> None:
    receive(widget, values={"l_3": 1e9})
    assert widget.values["l_3"] == 4.5
    assert widget.values["theta_0"] == 1.5
    receive(widget, values={"l_3": float("nan")})  # is logged
    assert widget.values["l_3"] == 4.5


def test_what_follows_a_value_follows_it_until_it_is_moved_itself() -> None:
    """The inertia of a uniform rod, m l^2 / 12, by its slider, its motion, and after a reset."""
    ranges = {"m_1": (0.5, 6.0), "I_1": (0.01, 1.8), "l_3": (3.0, 4.0)}
    widget = mechc.load("four_bar").widget(1.0, {"theta_0": 1.5}, {"l_3": 3.5}, sliders=ranges)
    receive(widget, values={"m_1": 5.0})
    heavy = {"m_1": 5.0, "I_1": 5.0 * 2.0**2 / 12}
    assert widget.values == pytest.approx({**heavy, "l_3": 3.5})
    sol = mechc.load("four_bar").simulate(1.0, {"theta_0": 1.5}, {"l_3": 3.5, **heavy})
    np.testing.assert_allclose(widget.solution.y[-1], sol.y[-1], atol=1e-12)
    receive(widget, values={"m_1": 5.0, "I_1": 0.3})
    receive(widget, values={"m_1": 4.0, "I_1": 0.3})
    assert widget.values["I_1"] == 0.3
    receive(widget, values=dict(widget.first))
    receive(widget, values={"m_1": 6.0})  # its inertia, 2, is beyond the slider's end
    assert widget.values == {"m_1": 6.0, "I_1": 1.8, "l_3": 3.5}
    assert widget.solution.params[8] == pytest.approx(2.0)


def test_frames_a_second() -> None:
    """So many does the first motion have, and the one of other values."""
    frames = []
    for fps in (300.0, 500.0):
        widget = mechc.load("four_bar").widget(1.0, {"theta_0": 1.5}, sliders=SLIDERS, fps=fps)
        shown = json.loads(Page(widget.page).scripts[0])["frames"]
        widget.values = {"l_3": 3.6}
        frames.append((shown, widget.motion["frames"]))
    assert frames == [(301, 301), (501, 501)]


def test_without_a_motion_the_last_one_stays_and_the_reason_is_told(
    widget: Any, sent: list[Any]
) -> None:
    before = widget.solution
    widget._variation.function.policy["max_step"] = -1.0
    receive(widget, values={"l_3": 3.6})
    assert widget.solution is before
    assert "max_step" in widget.note
    assert not any("motion" in state for state in sent)
    widget._variation.function.policy.clear()
    receive(widget, values={"l_3": 3.7})
    assert widget.note == ""
    assert widget.solution is not before


# -- in a browser -----------------------------------------------------------------------------

CELL = """<!DOCTYPE html><html><style>%s</style><body><div id="cell"></div><script type="module">
const state = %s, heard = {}, esm = new Blob([%s], { type: "text/javascript" });
const model = {
  get(name) { return state[name]; },
  set(name, value) { state[name] = value; },
  on(name, use) { heard[name] = use; },
  off(name) { delete heard[name]; },
  async save_changes() {
    const found = JSON.parse(await window.inPython(JSON.stringify(state.values)));
    for (const name of Object.keys(found)) {
      state[name] = found[name];
      if (heard["change:" + name]) { heard["change:" + name](); }
    }
    window.answers = (window.answers || 0) + 1;
  }
};
const module = await import(URL.createObjectURL(esm));
window.finish = module.default.render({ model: model, el: document.getElementById("cell") });
window.heard = heard;
</script></body></html>"""


@pytest.fixture
def cell(widget: Any, browser: Any, tmp_path: Path) -> Iterator[OpenPage]:
    """The widget's own script in a page that passes its traits to Python and back."""
    names = ("page", "sliders", "first", "values", "motion", "note")

    def in_python(values: str) -> str:
        receive(widget, values=json.loads(values))
        return json.dumps({name: getattr(widget, name) for name in ("values", "motion", "note")})

    texts = [widget._css, json.dumps({n: getattr(widget, n) for n in names})]
    texts.append(json.dumps(widget._esm))
    file = tmp_path / "cell.html"
    file.write_text(CELL % tuple(text.replace("<", "\\u003c") for text in texts), "utf-8")
    found = OpenPage(
        browser,
        file,
        before=lambda page: page.expose_function("inPython", in_python),
        viewport={"width": 1000, "height": 760},
    )
    found.wait_for("document.querySelectorAll('input[type=range]').length === 2")
    found.page.frame_locator("iframe").locator(".legend span").first.wait_for()
    press(found, "Home")  # it may play: a frame learns late of reduced motion
    yield found
    assert found.messages == []
    found.context.close()


def press(cell: OpenPage, key: str) -> None:
    """A key in the frame; one of the keyboard is lost while the frame has no focus."""
    frame = cell.page.frames[1]
    frame.dispatch_event("body", "keydown", {"key": key})
    frame.evaluate(TWO_FRAMES)
    cell.settle()


def as_it_was(cell: OpenPage, before: bytes) -> bool:
    """Whether the page looks as before, once messages to the frame have arrived."""
    for _ in range(40):
        if cell.picture("iframe") == before:
            return True
        cell.settle()
    return False


def clock_panel(cell: OpenPage) -> str:
    return str(cell.page.frames[1].text_content(".legend"))


@pytest.mark.slow
def test_a_dragged_slider_moves_the_mechanism(cell: OpenPage, widget: Any) -> None:
    page = cell.page
    before, told = cell.picture("iframe"), clock_panel(cell)
    box = page.locator("input").first.bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.7 * box["width"], middle, steps=8)
    cell.settle()  # still held
    cell.wait_for("window.answers > 1")
    assert 3.7 < widget.solution.params[3] < 4.1
    page.mouse.up()
    cell.settle()
    cell.settle()
    assert cell.picture("iframe") != before
    assert page.text_content("output") == f"{widget.values['l_3']:.2f}\u2009m"
    page.click("button:text-is('Reset')")
    cell.wait_for("document.querySelector('output').textContent.startsWith('3.50')")
    assert as_it_was(cell, before)
    assert clock_panel(cell) == told
    assert page.evaluate("(window.finish(), Object.keys(window.heard).length)") == 0


@pytest.mark.slow
def test_the_motion_goes_on_and_choices_stay_while_values_change(cell: OpenPage) -> None:
    frame = cell.page.frames[1]
    for name in ("Grid", "Traces"):
        frame.click(f"#shows button:text-is('{name}')")
    press(cell, "End")
    without = cell.picture("iframe")
    cell.page.locator("input").nth(1).press("ArrowRight")
    cell.wait_for("window.answers > 0")
    cell.settle()
    cell.settle()
    assert frame.text_content("#clock") == "1.000 s"
    assert frame.get_attribute("#shows button:text-is('Grid')", "aria-pressed") == "false"
    assert frame.evaluate("document.getElementById('scale').hidden")
    assert cell.picture("iframe") != without
