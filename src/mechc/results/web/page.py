"""The module around a mechanism's WebAssembly, and the page that simulates with it.

Input: the WebAssembly, and the data of its mechanism.  Output: texts.  Invariant: both load nothing
from elsewhere; user text is in them only as escaped JSON and an escaped title.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from string import Template
from typing import Any, Final

from mechc.results.player.motion import speed_choices
from mechc.results.player.page import json_for_script, player_page, template
from mechc.results.player.plots import MOST_LINES, by_unit
from mechc.results.player.sliders import slider_data
from mechc.results.sampling import ShownUnit, clean_text, pretty_name, shown_as
from mechc.system.kinds import Kind

FRAMES_A_SECOND: Final = 60.0
USUAL_SPAN: Final = 10.0  # s
ENERGIES: Final = {
    "kinetic": ["kinetic_energy"],
    "potential": ["potential_energy"],
    "total": ["kinetic_energy", "potential_energy"],
}

Ranges = Mapping[str, Sequence[float] | None]


def module_text(wasm: bytes, about: Mapping[str, Any]) -> str:
    """The ES module: a class around the WebAssembly, which is in it as base64."""
    values = {"about": json_for_script(about), "wasm": base64.b64encode(wasm).decode("ascii")}
    return Template(template("web", "module.js")).substitute(values)


def live_page(module: str, about: Mapping[str, Any], ranges: Ranges) -> str:
    """A page that simulates with a module while it plays, with sliders of these ranges."""
    scripts = [module, template("player", "plane.js"), template("web", "simulated.js")]
    return player_page(_page_data(about, ranges), scripts, source="'wasm-unsafe-eval'")


def _page_data(about: Mapping[str, Any], ranges: Ranges) -> dict[str, Any]:
    """A motion without frames, as the player reads it, and what its frames are computed from."""
    kinds = ("coordinates", "speeds", "parameters")
    told = {kind: [each["name"] for each in about[kind]] for kind in kinds}
    units = {
        each["name"]: shown_as(Kind(each["kind"]), each["unit"])
        for kind in kinds
        for each in about[kind]
    }
    drawing = about["drawing"]
    return {
        "title": clean_text(about["title"], 100),
        "notes": [],
        "start": 0.0,
        "step": 1.0 / FRAMES_A_SECOND,
        "frames": 1,
        "points": [pretty_name(name) for name in drawing["points"]],
        "tracks": "",
        "links": [{"label": clean_text(label), "points": line} for label, line in drawing["links"]],
        "ground": drawing["ground"],
        "traced": drawing["traced"],
        "view": drawing["view"],
        "marks": [],
        "panels": _panels(about, {name: units[name] for name in told["coordinates"]}),
        "inputs": about["inputs"],
        "sliders": [_slider(name, ends, units, told) for name, ends in ranges.items()],
        **speed_choices(USUAL_SPAN),
    }


def _slider(
    name: str,
    ends: Sequence[float] | None,
    units: Mapping[str, ShownUnit],
    names: Mapping[str, Sequence[str]],
) -> dict[str, Any]:
    """A slider, and what it moves: a parameter, an input, or a value of the start."""
    kind = "parameter" if name in names["parameters"] else "start" if name in units else "input"
    unit = units.get(name, shown_as(Kind.PURE, ""))
    return {"kind": kind, **slider_data(name, unit, ends, " at the start" * (kind == "start"))}


def _panels(about: Mapping[str, Any], units: Mapping[str, ShownUnit]) -> list[dict[str, Any]]:
    """Panels of curves, each with the state or the outputs that it shows."""
    panels = [
        _panel(title, unit, [_curve(pretty_name(n), units[n].factor, n) for n in names])
        for title, unit, names in by_unit(units)
    ]
    if {*ENERGIES["total"]} <= {output["name"] for output in about["outputs"]}:
        energies = [_curve(name, 1.0, "", outputs) for name, outputs in ENERGIES.items()]
        panels.append(_panel("Energy", "J", energies))
    return panels


def _panel(title: str, unit: str, curves: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    untold = max(0, len(curves) - MOST_LINES)
    return {"title": title, "unit": unit, "lines": curves[:MOST_LINES], "untold": untold}


def _curve(name: str, factor: float, state: str, outputs: Sequence[str] = ()) -> dict[str, Any]:
    more = {"factor": factor, "state": state, "outputs": outputs}
    return {"name": name, "values": "", "dash": [], **more}
