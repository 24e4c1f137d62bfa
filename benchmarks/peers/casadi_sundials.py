"""SUNDIALS through CasADi: CVODES on explicit rates, IDAS on the index-one equations.

CVODES is given q' and u' with the elimination written out, which takes fewer operations than
CasADi's own ``solve`` of the matrices.  IDAS is given u' and the multipliers as algebraic
variables, M u' + J^T lambda = F and J u' = gamma, as its manual has semi-explicit equations;
Jacobians are CasADi's own.  Methods called "jit" have the functions compiled by the machine's C
compiler, where there is one, and "compile" is then what one of them takes; the others run in
CasADi's virtual machine, which needs no compilation.
"""

from __future__ import annotations

import re
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import chdir
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..formulations.equations import Equations, consistent, equations_of
from ..problems.problem import Array, Problem
from ..timing.cases import Case
from . import Built, with_tighter

TOOLS = ("CasADi, CVODES", "CasADi, IDAS")
MOST_STEPS = 200_000  # right runs take some ten thousand at the tightest tolerance
CODE = re.compile(r'"((?:CV|IDA)_\w+)"')  # what SUNDIALS returned, in CasADi's message


@dataclass(frozen=True)
class Given:
    """A form of the equations for one of its solvers: their expressions, and where they start."""

    tool: str
    solver: str
    dae: dict[str, Any]
    start: dict[str, Array]
    methods: tuple[str, ...]
    policy: dict[str, Any]


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """CVODES by Adams' and by backward differentiation formulas, and IDAS; ``quick``: no jit."""
    import casadi

    equations = equations_of(problem)
    built = Built([])
    for form in (explicit, index_one):
        began = time.perf_counter()
        given = form(casadi, equations, problem)
        derived = equations.seconds + time.perf_counter() - began
        cases, compiled = _cases(casadi, given, problem, with_tighter(tolerances), jit=not quick)
        built.cases += cases
        built.setup[given.tool] = {"derive": derived, "compile": compiled}
    return built


def explicit(casadi: Any, equations: Equations, problem: Problem) -> Given:
    """The rates of the state."""
    dae = explicit_dae(casadi, equations)
    methods = ("bdf", "adams") if problem.stiff else ("adams", "bdf")
    return Given(TOOLS[0], "cvodes", dae, {"x0": equations.start}, methods, {})


def index_one(casadi: Any, equations: Equations, problem: Problem) -> Given:
    """The rates of the state by way of u' and the multipliers, and what determines these.

    Algebraic variables are left out of the error test: with them the tightest tolerances, relative
    to large multipliers, are never met.  The start is consistent as it is given.
    """
    dae = index_one_dae(casadi, equations)
    start = {"x0": equations.start, "z0": np.concatenate(consistent(equations))}
    rates = equations.rates().function("math")(*equations.start.tolist())
    policy = {"suppress_algebraic": True, "calc_ic": False, "init_xdot": list(map(float, rates))}
    return Given(TOOLS[1], "idas", dae, start, ("bdf",), policy)


def explicit_dae(
    casadi: Any, equations: Equations, parameters: Sequence[Any] = ()
) -> dict[str, Any]:
    """CasADi's expressions of the rates of the state."""
    y = casadi.SX.sym("y", len(equations.state))
    rates = equations.rates().function(casadi)(*casadi.vertsplit(y), *parameters)
    return {"x": y, "ode": casadi.vertcat(*rates)}


def index_one_dae(
    casadi: Any, equations: Equations, parameters: Sequence[Any] = ()
) -> dict[str, Any]:
    """CasADi's expressions of the index-one equations."""
    nq, n, m = len(equations.q), len(equations.u), len(equations.velocity)
    y, z = casadi.SX.sym("y", nq + n), casadi.SX.sym("z", n + m)
    states, unknown = casadi.vertsplit(y), casadi.vertsplit(z)
    still = [0.0] * nq  # q' = 0 leaves -q_rates
    residual = equations.residual().function(casadi)
    rows = residual(*states, *unknown[n:], *still, *unknown[:n], *parameters)
    return {
        "x": y, "z": z,
        "ode": casadi.vertcat(*(-row for row in rows[:nq]), *unknown[:n]),
        "alg": casadi.vertcat(*rows[nq:]),
    }  # fmt: skip


def _cases(
    casadi: Any, given: Given, problem: Problem, tolerances: Sequence[float], *, jit: bool
) -> tuple[list[Case], float]:
    """A solver for each method and tolerance, and the most that setting one up took."""
    cases, longest = [], 0.0
    with tempfile.TemporaryDirectory() as folder, chdir(folder):  # its sources go where one is
        for method, policy in _methods(given, jit=jit):
            for tol in tolerances:
                began = time.perf_counter()
                cases.append(_case(casadi, given, problem, method, tol, policy))
                longest = max(longest, time.perf_counter() - began)
    return cases, longest


def _methods(given: Given, *, jit: bool) -> Iterator[tuple[str, dict[str, Any]]]:
    """Names and options of the methods; the first of CVODES also compiled.

    IDAS is not: its time goes into linear algebra.
    """
    for method in given.methods:
        formulas = {"linear_multistep_method": method} if given.solver == "cvodes" else {}
        yield method, formulas
        if jit and formulas and method == given.methods[0] and shutil.which("gcc"):
            compiler = {"compiler": "gcc", "flags": ["-O3"], "cleanup": False}
            compiled = {"jit": True, "compiler": "shell", "jit_options": compiler}
            yield f"{method}, jit", {**formulas, **compiled, "jit_cleanup": False}


def _case(
    casadi: Any, given: Given, problem: Problem, method: str, tol: float, policy: dict[str, Any]
) -> Case:
    options = {"abstol": tol, "reltol": tol, "max_num_steps": MOST_STEPS,
               "disable_internal_warnings": True, **given.policy, **policy}  # fmt: skip
    solver = casadi.integrator("solver", given.solver, given.dae, 0, problem.t_end, options)

    def run() -> Any:
        try:
            return solver(**given.start)
        except RuntimeError as error:
            found = CODE.search(str(error))
            return found[1] if found else str(error).splitlines()[-1]

    def state(value: Any) -> Array | None:
        ended = isinstance(value, str)
        return None if ended else problem.given.observe(np.array(value["xf"]).ravel())

    def word(value: Any) -> str:
        return value if isinstance(value, str) else "finished"

    return Case(given.tool, method, tol, run, state, word)
