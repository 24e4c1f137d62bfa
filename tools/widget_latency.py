"""What lies between a slider and its motion in `model.widget`: `python tools/widget_latency.py`.

Prints, as the least and the median of 200 values, milliseconds of the run alone, and of the run
with the data that goes to the page.  Neither the notebook's connection nor its browser is in it.
"""

from __future__ import annotations

import statistics
import time

import mechc

SCENES = {
    "four_bar": (5.0, {"theta_0": 1.5}, {"l_3": 3.5}, ("l_3", 3.3, 4.4)),
    "flyball_governor": (5.0, None, {}, None),
}


def milliseconds(use, values):
    found = []
    for value in values:
        begun = time.perf_counter()
        use(value)
        found.append(1e3 * (time.perf_counter() - begun))
    return f"{min(found):7.2f} {statistics.median(found):7.2f}"


def measure(name, t_end, y0, params, slider):
    model = mechc.load(name)
    start = dict(model.start) if y0 is None else y0
    chosen, low, high = slider or _first(model)
    widget = model.widget(t_end, start, params, sliders={chosen: (low, high)})
    values = [low + (high - low) * k / 200 for k in range(1, 200)]
    alone = milliseconds(lambda x: model.simulate(t_end, start, {**params, chosen: x}), values)
    whole = milliseconds(lambda x: setattr(widget, "values", {chosen: x}), values)
    print(f"{name:18} {chosen:6} {alone}   {whole}")


def _first(model):
    name, value = next((n, v) for n, v in model.defaults.items() if v > 0)
    return name, 0.8 * value, 1.2 * value


if __name__ == "__main__":
    print(f"{'':18} {'by':6} run: least, median   with the page's data")
    for name, scene in SCENES.items():
        measure(name, *scene)
