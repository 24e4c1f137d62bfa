"""Size of the page of `sol.view()`, and its frames a second in a browser that draws in software.

python tools/view_frame_rate.py [bodies] [--size 1280x760]   (needs mechc[view], playwright, Chromium)

A chain of that many rods, each with a translucent box and its own coordinate in the plots, moves for
three seconds; frames are counted by requestAnimationFrame while the page draws one in each.  A page
that does not play, or that writes an error, is refused.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Page, sync_playwright

from mechc.results.player.page import base64_floats
from mechc.results.view.page import space_page
from mechc.results.view.recorded import unpacked_view

COUNT = """new Promise(done => {
  let frames = 0;
  const begun = performance.now();
  requestAnimationFrame(function next() {
    frames += 1;
    const passed = performance.now() - begun;
    if (passed > 3000) { done(1000 * frames / passed); } else { requestAnimationFrame(next); }
  });
})"""


def chain(bodies: int, frames: int = 240, step: float = 1 / 60) -> dict[str, Any]:
    """The page's data of a swinging chain, checked as those of a file are."""
    t = step * np.arange(frames)[:, None]
    angles = 0.6 * np.sin(2.0 * t + 0.15 * np.arange(bodies)) - np.pi / 2
    arms = np.stack([np.cos(angles), np.sin(angles), 0.3 * np.sin(angles + t)], axis=-1)
    points = np.concatenate([np.zeros((frames, 1, 3)), np.cumsum(arms, axis=1)], axis=1)
    middles = (points[:, 1:] + points[:, :-1]) / 2
    turns = np.stack([0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)], axis=-1)
    names = [f"p{k}" for k in range(bodies + 1)]
    line = [
        {"name": f"q{k}", "values": base64_floats(angles[:, k]), "dash": []}
        for k in range(min(24, bodies))
    ]
    box = {"kind": "box", "sizes": [0.7, 0.2, 0.2], "inferred": True}
    data = {
        "title": f"A chain of {bodies} rods", "notes": [], "start": 0.0, "step": step,
        "frames": frames, "points": names, "origin": [0, 0, 0], "tracks": base64_floats(points),
        "links": [{"label": f"rod {k}", "points": [k, k + 1]} for k in range(bodies)],
        "ground": [0], "traced": [bodies], "right": [1, 0, 0], "up": [0, 1, 0], "flat": False,
        "solids": [{**box, "label": f"rod {k}", "name": f"rod {k}"} for k in range(bodies)],
        "placed": base64_floats(np.concatenate([middles, turns], axis=-1)), "struts": [], "marks": [],
        "arrows": [], "loads": [],
        "panels": [{"title": "Angles", "unit": "rad", "lines": line, "untold": 0}],
        "speeds": [1.0], "speed": 1.0,
    }  # fmt: skip
    return unpacked_view(zlib.compress(json.dumps(data).encode()))


def measured(opened: Page, file: Path) -> list[float]:
    """Frames a second, three times, of a page that plays."""
    errors: list[str] = []
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.goto(file.as_uri())
    opened.evaluate("new Promise(done => setTimeout(done, 500))")
    rates = [opened.evaluate(COUNT) for _ in range(3)]
    if errors or opened.text_content("#play") != "Pause":
        raise SystemExit(f"the page does not play {' '.join(errors)}")
    return rates


def main() -> None:
    """Print size and frame rate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bodies", nargs="?", type=int, default=100)
    parser.add_argument("--size", default="1280x760")
    chosen = parser.parse_args()
    width, height = map(int, chosen.size.split("x"))
    text = space_page(chain(chosen.bodies))
    empty = len(space_page(chain(1, frames=2)))
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--ignore-gpu-blocklist"]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        file = Path(folder, "view.html")
        file.write_text(text, encoding="utf-8")
        found = shutil.which("chromium") or shutil.which("google-chrome")
        browser = driver.chromium.launch(executable_path=found, args=flags)
        rates = measured(browser.new_page(viewport={"width": width, "height": height}), file)
        browser.close()
    print(
        f"page without motion {empty / 1e6:.2f} MB, with {chosen.bodies} bodies {len(text) / 1e6:.2f} MB"
    )
    print(f"frames a second at {width}x{height}: best of three {max(rates):.0f}, all {rates}")


if __name__ == "__main__":
    main()
