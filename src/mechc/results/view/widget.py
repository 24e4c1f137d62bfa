"""The page in space with sliders, as a widget of a notebook: each value is simulated anew.

Input: a Variation.  Output: a widget.  Python and the notebook's page exchange its traits: values
come from the sliders, a motion goes back as the data of a page.  The notebook keeps one message on
its way at a time and only the newest value waiting, so that a slow motion delays no slider.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from mechc.errors import MechcError, UnknownNameError, install_command, package
from mechc.results.player.page import template
from mechc.results.sampling import clean_text
from mechc.results.view.page import space_page, view_data
from mechc.results.view.variation import Variation

for _each in ("anywidget", "traitlets"):
    package(_each, f"sliders in a notebook are those of anywidget: {install_command('notebook')}")

import anywidget  # noqa: E402  after words on it where it cannot be imported
import traitlets  # noqa: E402


class MotionWidget(anywidget.AnyWidget):  # type: ignore[misc]  # it has no types here
    """A motion in space with sliders; the last value of a notebook's cell displays itself.

    Attributes
    ----------
    values
        Name -> value, SI units; those that are set are simulated, and the sliders move.
    solution
        The :class:`mechc.Solution` that is shown.
    note
        Why there is no motion for the values, or nothing.
    """

    _esm = template("player", "controls.js") + template("view", "widget.js")
    _css = template("player", "sliders.css") + template("view", "widget.css")
    page = traitlets.Unicode().tag(sync=True)
    sliders: Any = traitlets.List().tag(sync=True)
    first = traitlets.Dict().tag(sync=True)
    values = traitlets.Dict().tag(sync=True)
    motion = traitlets.Dict().tag(sync=True)
    note = traitlets.Unicode().tag(sync=True)

    def __init__(self, variation: Variation, fps: float) -> None:
        self._variation, self._fps = variation, fps
        self.solution, self._now = variation.first, variation.values
        self._chosen: dict[str, float] = {}  # others follow these, as the inertia of a rod its mass
        shown = {**view_data(self.solution, fps=fps), "live": True}
        super().__init__(
            page=space_page(shown), sliders=variation.sliders(), first=variation.values,
            values=variation.values,
        )  # fmt: skip

    @traitlets.validate("values")
    def _all_values(self, proposal: Any) -> dict[str, float]:
        """The values of all sliders, within their ranges."""
        ranges = self._variation.ranges
        for name in proposal["value"]:
            if name not in ranges:
                raise UnknownNameError("slider", name, ranges)
        return {**self._now, **self._all_within(proposal["value"])}

    @traitlets.observe("values")
    def _simulate_anew(self, change: Mapping[str, Any]) -> None:
        if change["new"] == self._now:
            return  # those it begins with
        self._choose(change["new"])
        try:
            found = self._variation.simulate(self._chosen)
            motion = view_data(found, fps=self._fps)
        except (MechcError, ValueError) as error:
            self.note = clean_text(str(error), 300)
            return
        self.solution = found
        self._now = self._all_within(self._variation.values_of(found) | self._chosen)
        with self.hold_sync():
            self.motion, self.note, self.values = motion, "", self._now

    def _all_within(self, values: Mapping[str, Any]) -> dict[str, float]:
        ranges = self._variation.ranges
        return {name: _within(value, *ranges[name]) for name, value in values.items()}

    def _choose(self, values: dict[str, float]) -> None:
        """Note which values were moved; one that is as at first follows others again."""
        first = self._variation.values
        moved = {name: value for name, value in values.items() if value != self._now[name]}
        chosen = {**self._chosen, **moved}
        self._chosen = {name: value for name, value in chosen.items() if value != first[name]}
        self._now = values


def _within(value: Any, low: float, high: float) -> float:
    number = float(value)
    if math.isnan(number):
        raise traitlets.TraitError("a slider's value is a number")
    return min(max(number, low), high)
