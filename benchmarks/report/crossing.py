"""The picture of the README: a four-bar through its change points, by mechc and by SciPy.

    mechc bench crossing --out docs/pictures/change_point.png

The links of 1, 2, 3 and 4 m start at rest with the crank at 85 degrees.  The exact motion is that
of the closure curve, which has no constraint and shares nothing with mechc.  SciPy's ``solve_ivp``
gets the equations as most scripts have them: the constraints differentiated twice, and lambdified.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

import mechc

from ..formulations.equations import equations_of
from ..peers.scipy_ivp import without_cse
from ..problems.data import four_bar_state
from ..problems.four_bar import change_point
from ..problems.problem import Array
from ..references.closure_curve import Geometry
from ..timing.results import command_parser

T_END, RTOL = 5.0, 1e-9  # s; mechc's default
TIMES = np.linspace(0, T_END, 501)
MECHC, EXACT = "mechc", "exact motion"
SCIPY = {"RK45": "#d55e00", "DOP853": "#cc79a7", "LSODA": "#e69f00"}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("crossing", __doc__)
    parser.add_argument("--out", type=Path, required=True, metavar="PICTURE", help=".png or .svg")
    chosen = parser.parse_args(arguments)
    picture(motions()).savefig(chosen.out, dpi=120)
    print(chosen.out)
    return 0


def motions() -> dict[str, Array]:
    """The angle of the crank in degrees at ``TIMES``, by who computed it."""
    problem = change_point()
    model, rates = mechc.load("four_bar"), without_cse(equations_of(problem))
    sol = model.simulate(T_END, problem.start, problem.params, rtol=RTOL)
    found = {MECHC: sol(TIMES)[:, 0], EXACT: exact()}
    for method in SCIPY:
        run = solve_ivp(
            rates, (0, T_END), problem.start, method, t_eval=TIMES, rtol=RTOL, atol=RTOL
        )
        found[method] = run.y[0]
    return {name: np.degrees(angle) for name, angle in found.items()}


def exact() -> Array:
    """The angle of the crank in rad at ``TIMES``: a motion along the closure curve, from rest."""
    curve = Geometry(
        np.array([[1.0, 2.0, 3.0, 4.0]]), np.array([[-1.0, 1.0, 1.0]]),
        np.array([[1.0, 2.0, 3.0]]), np.array([False]),
    )  # fmt: skip
    start = np.exp(1j * four_bar_state("change_point", 0.0)[:3])

    def apart(psi: float) -> float:
        angles = curve.state(np.array([[psi], [0.0]]))[0, :3]
        return float((np.abs(np.exp(1j * angles) - start) ** 2).sum())

    near = min(np.linspace(0, 2 * np.pi, 400), key=apart)
    psi = minimize_scalar(apart, bounds=(near - 0.02, near + 0.02), options={"xatol": 1e-12}).x
    along = curve.integrate(np.array([[psi], [0.0]]), TIMES)
    angle: Array = np.unwrap([curve.state(each)[0, 0] for each in along])
    return angle


def picture(found: Mapping[str, Array]) -> Figure:
    """The angles over time; links are in line at 180 and 540 degrees."""
    figure = Figure(figsize=(8.0, 3.8), layout="constrained")
    axes = figure.add_subplot()
    for line in (180, 540):
        axes.axhline(line, color="#9ca3af", lw=0.8)
        axes.text(0.03, line + 8, "all links in line", color="#6b7280", fontsize=8)
    axes.plot(TIMES, found[MECHC], color="#0072b2", lw=5, label=MECHC)
    axes.plot(TIMES, found[EXACT], color="black", lw=1.2, ls=(0, (5, 3)), label=EXACT)
    for method, colour in SCIPY.items():
        axes.plot(TIMES, found[method], color=colour, lw=1.6, label=f"SciPy, {method}")
    axes.set(xlim=(0, T_END), yticks=range(-180, 900, 180), xlabel="time (s)")
    axes.set_ylabel("angle of the crank (°)")
    figure.legend(fontsize=9, loc="outside upper center", ncols=5, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return figure
