"""The reference notebook's four-bar, and its sibling without change points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from _four_bar_forms import accelerations
from _problem import Array, Formulation, Problem
from _scene import reference
from mechc_codegen import shipped_mechanism

import mechc

T_END = 20.0
ORDER = (*(f"l_{k}" for k in range(4)), *(f"{x}_{k}" for x in "mI" for k in range(3)), "g")


def regular() -> Problem:
    return _four_bar("regular", {"l_3": 3.5}, "the crank turns back before the links come in line")


def change_point() -> Problem:
    note = "at 180 degrees all links are in line and the configuration curve crosses itself"
    return _four_bar("change_point", {"l_3": 4.0}, note)


def _four_bar(which: str, params: dict[str, float], note: str) -> Problem:
    model = mechc.load("four_bar")
    start = model.assemble({"theta_0": np.radians(85)}, params=params)
    states = reference(f"four_bar_{which}")["states"]
    return Problem(
        name=f"four_bar_{which}",
        title=f"Four-bar, {which.replace('_', ' ')}",
        mechanism=lambda: shipped_mechanism("four_bar"),
        start=start,
        t_end=T_END,
        quantities=(*model.coordinates, *model.speeds),
        exact=np.array(states[str(T_END)], float),
        observe=whole_state,
        wrong=0.5,  # errors of the start grow up to 80 times; on another branch it is radians
        formulation=Formulation(
            lambda: shipped_mechanism("four_bar"), start, whole_state, _accelerations
        ),
        params=params,
        shipped="four_bar",
        note=note,
    )


def whole_state(y: Array) -> Array:
    return y


def _accelerations(q: Any, u: Any, values: Mapping[str, Any], sin: Any, cos: Any) -> list[Any]:
    return accelerations(q, u, [values[name] for name in ORDER], sin, cos)
