"""The reference notebook's four-bar, and its sibling without change points."""

from __future__ import annotations

import numpy as np
from _problem import Problem
from _scene import reference
from mechc_codegen import shipped_mechanism

import mechc

T_END = 20.0


def regular() -> Problem:
    return _four_bar("regular", {"l_3": 3.5}, "the crank turns back before the links come in line")


def change_point() -> Problem:
    note = "at 180 degrees all links are in line and the configuration curve crosses itself"
    return _four_bar("change_point", {"l_3": 4.0}, note)


def _four_bar(which: str, params: dict[str, float], note: str) -> Problem:
    model = mechc.load("four_bar")
    states = reference(f"four_bar_{which}")["states"]
    return Problem(
        name=f"four_bar_{which}",
        title=f"Four-bar, {which.replace('_', ' ')}",
        mechanism=lambda: shipped_mechanism("four_bar"),
        start=model.assemble({"theta_0": np.radians(85)}, params=params),
        t_end=T_END,
        quantities=(*model.coordinates, *model.speeds),
        exact=np.array(states[str(T_END)], float),
        observe=lambda y: y,
        params=params,
        shipped="four_bar",
        note=note,
    )
