"""The four-bar in the tools that can integrate it, each used as its documentation recommends.

Every builder takes a scene and tolerances and gives its cases and how long it took to derive and
to compile.  All integrate the index-reduced equations without projection, which is what these
tools offer; ``accelerations`` is the cheapest form of them known to us.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from _four_bar_forms import accelerations
from _timing import Array, Case

T_END = 20.0
TIGHTEST = {"RK45": 9e-9, "Radau": 9e-7}  # beyond these one run takes seconds
Built = tuple[list[Case], dict[str, float]]


@dataclass(frozen=True)
class Scene:
    """What is integrated: all parameters in the model's order, and the start."""

    p: Array
    y0: Array
    params: dict[str, float]


def scipy_cse(scene: Scene, tols: Sequence[float]) -> Built:
    """solve_ivp on the cheapest form, lambdified with cse for floats (numpy takes longer)."""
    fast, seconds = _lambdified(scene)
    return _solve_ivp("SciPy, cse", lambda t, y: fast(*y.tolist()), scene, tols), seconds


def _lambdified(scene: Scene) -> tuple[Callable[..., list[float]], dict[str, float]]:
    """The cheapest form as a function of six floats, and the seconds it took."""
    import sympy

    start = time.perf_counter()
    q, u = sympy.symbols("q0:3"), sympy.symbols("u0:3")
    p = [sympy.Float(x) for x in scene.p]
    rates = accelerations(q, u, p, sympy.sin, sympy.cos)
    derived = time.perf_counter()
    fast = sympy.lambdify([*q, *u], [*u, *rates], cse=True, modules="math")
    compiled = time.perf_counter()
    return fast, {"derive": derived - start, "compile": compiled - derived}


def _solve_ivp(
    tool: str,
    rates: Callable[[float, Array], Any],
    scene: Scene,
    tols: Sequence[float],
    methods: Sequence[str] = ("RK45", "DOP853", "LSODA", "Radau"),
) -> list[Case]:
    from scipy.integrate import solve_ivp

    def run(method: str, tol: float) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return solve_ivp(rates, (0, T_END), scene.y0, method=method, rtol=tol, atol=tol)

    return [
        Case(
            tool, method, tol,
            lambda method=method, tol=tol: run(method, tol),  # type: ignore[misc]
            lambda s: s.y[:, -1] if s.success else None,
            lambda s: "finished" if s.success else s.message,
        )
        for method in methods
        for tol in tols
        if tol >= TIGHTEST.get(method, 0.0)
    ]  # fmt: skip


def heyoka_taylor(scene: Scene, tols: Sequence[float]) -> Built:
    """heyoka's scalar Taylor integrator; only propagate_until is timed."""
    import heyoka as hy

    start = time.perf_counter()
    q, u = [hy.make_vars(*[f"{x}{k}" for k in range(3)]) for x in "qu"]
    rates = accelerations(q, u, scene.p.tolist(), hy.sin, hy.cos)
    system = [*zip(q, u, strict=True), *zip(u, rates, strict=True)]
    derived = time.perf_counter()
    cases = []
    for tol in tols:
        taylor = hy.taylor_adaptive(
            system, scene.y0.tolist(), tol=tol, high_accuracy=False, compact_mode=False
        )
        cases.append(_taylor_case(taylor, scene, tol))
    compiled = (time.perf_counter() - derived) / len(tols)
    return cases, {"derive": derived - start, "compile": compiled}


def _taylor_case(taylor: Any, scene: Scene, tol: float) -> Case:
    def reset() -> None:
        taylor.time = 0.0
        taylor.state[:] = scene.y0

    def word(value: Any) -> str:
        return "finished" if value[0].name == "time_limit" else str(value[0].name)

    def state(value: Any) -> Array | None:
        return np.array(taylor.state) if word(value) == "finished" else None

    run = lambda: taylor.propagate_until(T_END)  # noqa: E731
    return Case("heyoka", "Taylor", tol, run, state, word, reset)


def casadi_cvodes(scene: Scene, tols: Sequence[float]) -> Built:
    """CasADi's expressions in its virtual machine, integrated by SUNDIALS CVODES."""
    import casadi as ca

    start = time.perf_counter()
    q, u = ca.SX.sym("q", 3), ca.SX.sym("u", 3)
    rates = accelerations(
        [q[k] for k in range(3)], [u[k] for k in range(3)], scene.p.tolist(), ca.sin, ca.cos
    )
    ode = {"x": ca.vertcat(q, u), "ode": ca.vertcat(u, *rates)}
    derived = time.perf_counter()
    cases = []
    for scheme in ("adams",):  # bdf takes longer at every error
        for tol in tols:
            policy = {"abstol": tol, "reltol": tol, "linear_multistep_method": scheme,
                      "max_num_steps": 1_000_000}  # fmt: skip
            solver = ca.integrator("solver", "cvodes", ode, 0, T_END, policy)
            cases.append(
                Case(
                    "CasADi + CVODES", scheme, tol,
                    lambda solver=solver: solver(x0=scene.y0),  # type: ignore[misc]
                    lambda value: np.array(value["xf"]).ravel(),
                )
            )  # fmt: skip
    compiled = (time.perf_counter() - derived) / len(cases)
    return cases, {"derive": derived - start, "compile": compiled}


def sundae_cvode(scene: Scene, tols: Sequence[float]) -> Built:
    """SUNDIALS CVODE through scikit-sundae, on the lambdified (cse) right-hand side."""
    from sksundae.cvode import CVODE

    fast, seconds = _lambdified(scene)

    def rhsfn(t: float, y: Array, yp: Array) -> None:
        yp[:] = fast(*y.tolist())

    span = np.array([0.0, T_END])
    cases = []
    for scheme in ("Adams",):  # BDF takes longer at every error
        for tol in tols:
            solver = CVODE(rhsfn, method=scheme, rtol=tol, atol=tol, max_num_steps=1_000_000)
            cases.append(
                Case(
                    "scikit-sundae CVODE", scheme, tol,
                    lambda solver=solver: solver.solve(span, scene.y0),  # type: ignore[misc]
                    lambda s: s.y[-1] if s.success else None,
                    lambda s: "finished" if s.success else str(s.message),
                )
            )  # fmt: skip
    return cases, seconds


PEERS: dict[str, Callable[[Scene, Sequence[float]], Built]] = {
    "heyoka": heyoka_taylor,
    "scipy": scipy_cse,
    "casadi": casadi_cvodes,
    "sksundae": sundae_cvode,
}
