"""The reference notebook's four-bar, and its sibling without change points.

``accelerations`` is written for any arithmetic (SymPy, heyoka, CasADi, floats), in the fewest
operations we know.  With absolute angles the rates of the closed loop, turned by -theta_2 and by
-theta_1, give the accelerations of coupler and rocker from the crank's, sum of
l_k (i a_k - w_k^2) e^(i theta_k) = 0; what is left is one equation of motion along that freedom.
It divides by sin(theta_1 - theta_2), which vanishes at change points.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from mechc_codegen import shipped_mechanism

import mechc

from .data import four_bar_state
from .problem import Formulation, Problem, whole_state

T_END = 20.0


def regular() -> Problem:
    return _four_bar("regular", {"l_3": 3.5}, "the crank turns back before the links come in line")


def change_point() -> Problem:
    note = "at 180 degrees all links are in line and the configuration curve crosses itself"
    return _four_bar("change_point", {"l_3": 4.0}, note)


def _four_bar(which: str, params: dict[str, float], note: str) -> Problem:
    model = mechc.load("four_bar")
    start = model.assemble({"theta_0": np.radians(85)}, params=params)
    return Problem(
        name=f"four_bar_{which}",
        title=f"Four-bar, {which.replace('_', ' ')}",
        mechanism=lambda: shipped_mechanism("four_bar"),
        start=start,
        t_end=T_END,
        quantities=(*model.coordinates, *model.speeds),
        exact=four_bar_state(which, T_END),
        wrong=0.5,  # errors of the start grow up to 80 times; on another branch it is radians
        formulation=Formulation(
            lambda: shipped_mechanism("four_bar"), start, whole_state, accelerations
        ),
        params=params,
        shipped="four_bar",
        note=note,
    )


def accelerations(q: Any, u: Any, values: Mapping[str, Any], sin: Any, cos: Any) -> list[Any]:
    """The three angular accelerations, of parameters by name."""
    (l, m, I), g = ([values[f"{x}_{k}"] for k in range(3)] for x in "lmI"), values["g"]
    s01, c01 = sin(q[0] - q[1]), cos(q[0] - q[1])
    s02, c02 = sin(q[0] - q[2]), cos(q[0] - q[2])
    s12, c12 = sin(q[1] - q[2]), cos(q[1] - q[2])
    w = [x * x for x in u]

    # a_1 = n_1 a_0 + b_1 and a_2 = n_2 a_0 + b_2
    n1, n2 = -(l[0] * s02) / (l[1] * s12), (l[0] * s01) / (l[2] * s12)
    b1 = -(l[0] * w[0] * c02 + l[1] * w[1] * c12 + l[2] * w[2]) / (l[1] * s12)
    b2 = (l[0] * w[0] * c01 + l[1] * w[1] + l[2] * w[2] * c12) / (l[2] * s12)

    M00 = I[0] + l[0] ** 2 * (m[0] / 4 + m[1] + m[2])
    M11 = I[1] + l[1] ** 2 * (m[1] / 4 + m[2])
    M22 = I[2] + l[2] ** 2 * m[2] / 4
    k01, k02 = l[0] * l[1] * (m[1] / 2 + m[2]), l[0] * l[2] * m[2] / 2
    k12 = l[1] * l[2] * m[2] / 2
    F0 = -k01 * w[1] * s01 - k02 * w[2] * s02 - g * l[0] * (m[0] / 2 + m[1] + m[2]) * cos(q[0])
    F1 = k01 * w[0] * s01 - k12 * w[2] * s12 - g * l[1] * (m[1] / 2 + m[2]) * cos(q[1])
    F2 = k02 * w[0] * s02 + k12 * w[1] * s12 - g * l[2] * m[2] / 2 * cos(q[2])
    M01, M02, M12 = k01 * c01, k02 * c02, k12 * c12

    force = F0 - M01 * b1 - M02 * b2 + n1 * (F1 - M11 * b1 - M12 * b2)
    force = force + n2 * (F2 - M12 * b1 - M22 * b2)
    mass = M00 + n1 * (2 * M01 + n1 * M11 + 2 * n2 * M12) + n2 * (2 * M02 + n2 * M22)
    a0 = force / mass
    return [a0, n1 * a0 + b1, n2 * a0 + b2]
