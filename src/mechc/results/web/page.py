"""The module around a mechanism's WebAssembly, and the page that simulates with it.

Input: the WebAssembly, and the data of its mechanism.  Output: texts.  Invariant: both load nothing
from elsewhere; user text is in them only as escaped JSON and an escaped title.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from string import Template
from typing import Any, Final

from mechc.results.player.motion import speed_choices
from mechc.results.player.page import json_for_script, player_page, template
from mechc.results.player.plots import MOST_LINES, by_unit
from mechc.results.player.sliders import slider_data
from mechc.results.sampling import ShownUnit, clean_text, pretty_name, shown_as
from mechc.system.quantity import Kind

STEP: Final = 1.0 / 60.0  # s between frames
SPAN: Final = 10.0  # s that are simulated at first
ENERGIES: Final = {
    "kinetic": ["kinetic_energy"],
    "potential": ["potential_energy"],
    "total": ["kinetic_energy", "potential_energy"],
}

Ranges = Mapping[str, Sequence[float] | None]
Panel = tuple[str, str, list[dict[str, Any]]]


def module_text(wasm: bytes, about: Mapping[str, Any]) -> str:
    """The ES module: a class around the WebAssembly, which is in it as base64."""
    values = {"about": json_for_script(about), "wasm": base64.b64encode(wasm).decode("ascii")}
    return Template(template("web", "module.js")).substitute(values)


def live_page(module: str, about: Mapping[str, Any], ranges: Ranges) -> str:
    """A page that simulates with a module while it plays, with sliders of these ranges."""
    scripts = [module, template("player", "plane.js"), template("web", "simulated.js")]
    return player_page(_motion_without_frames(about, ranges), scripts, source="'wasm-unsafe-eval'")


def _motion_without_frames(about: Mapping[str, Any], ranges: Ranges) -> dict[str, Any]:
    """The data that the player reads before there are frames; each curve says what it shows."""
    starts = [*about["coordinates"], *about["speeds"]]
    known = [*starts, *about["parameters"]]
    units = {each["name"]: shown_as(Kind(each["kind"]), each["unit"]) for each in known}
    units = dict.fromkeys(about["inputs"], shown_as(Kind.PURE, "")) | units
    words = {each["name"]: each["description"] for each in known}
    suffixes = {each["name"]: " at the start" for each in starts}
    drawing = about["drawing"]
    return {
        "title": clean_text(about["title"], 100),
        "notes": [],
        "start": 0.0,
        "step": STEP,
        "frames": 1,
        "points": [pretty_name(name) for name in drawing["points"]],
        "tracks": "",
        "links": [{"label": clean_text(name), "points": line} for name, line in drawing["links"]],
        "ground": drawing["ground"],
        "traced": drawing["traced"],
        "marks": [],
        "panels": [
            {"title": title, "unit": unit, "lines": lines[:MOST_LINES],
             "untold": max(0, len(lines) - MOST_LINES)}
            for title, unit, lines in [*_coordinates(about, units), *_energies(about)]
        ],
        "sliders": [
            slider_data(name, units[name], ends, words.get(name, ""), suffixes.get(name, ""))
            for name, ends in ranges.items()
        ],
        **speed_choices(SPAN),
    }  # fmt: skip


def _coordinates(about: Mapping[str, Any], units: Mapping[str, ShownUnit]) -> Iterator[Panel]:
    shown = {each["name"]: units[each["name"]] for each in about["coordinates"]}
    for title, unit, names in by_unit(shown):
        yield title, unit, [_curve(pretty_name(n), factor=units[n].factor, state=n) for n in names]


def _energies(about: Mapping[str, Any]) -> Iterator[Panel]:
    if {*ENERGIES["total"]} <= {output["name"] for output in about["outputs"]}:
        yield "Energy", "J", [_curve(name, outputs=names) for name, names in ENERGIES.items()]


def _curve(name: str, *, factor: float = 1.0, state: str = "", outputs: Any = ()) -> dict[str, Any]:
    more = {"factor": factor, "state": state, "outputs": outputs}
    return {"name": name, "values": "", "dash": [], **more}
