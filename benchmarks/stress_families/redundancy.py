"""Constraints that say the same twice: the motion is that of the linkage without them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from _scene import reference
from _stress_judge import METHODS, Row, attempt, limit_of, speeds_apart, verdict
from mechc_codegen.library.planar.redundant import spatial, two_rockers

import mechc
from stress_families.geometry import CONDITION, GROUNDS, RTOLS, START, T_END

TURNED = {"tilt_0": 0.3, "tilt_1": 0.7}
SCENES = {"two rockers": (two_rockers, {}), "in space": (spatial, TURNED)}


def redundant(quick: bool) -> Iterator[Row]:
    """Against the exact states of the planar four-bar; the second rocker moves as the first."""
    plain = mechc.load("four_bar")
    for which, (build, turned) in SCENES.items():
        model = mechc.compile(build())
        twin = [0, 1, 2, 2][: len(model.coordinates)]
        twin += [3 + k for k in twin]
        for name, ground in GROUNDS.items():
            y0 = plain.assemble({"theta_0": START}, params={"l_3": ground})[twin]
            states = reference(f"four_bar_{name}")["states"]
            exact = np.array(states[str(T_END)], float)[twin]
            scale = speeds_apart(exact, len(model.coordinates))
            for method in METHODS:
                for rtol in (1e-8,) if quick else RTOLS:
                    params = {"l_3": ground, **turned}
                    found = attempt(model, T_END, y0, params, rtol=rtol, method=method)
                    case = f"{which}, {name}, {method}, {rtol:g}"
                    yield verdict(case, found, exact, limit_of(rtol, CONDITION[name]), scale)
