"""Problems of the benchmarks, shortened or made of a mechanism, and what peers make of them."""

from dataclasses import replace

import numpy as np

from benchmarks.problems.data import four_bar_state
from benchmarks.problems.problem import Problem
from benchmarks.timing.cases import Effort, measure


def shortened(problem, t_end):
    """A four-bar problem that ends earlier, at a time whose state is known."""
    exact = four_bar_state(problem.name.removeprefix("four_bar_"), t_end)
    return replace(problem, t_end=t_end, exact=exact)


def described(mechanism, start):
    """A problem with the defaults of its mechanism, which mechc need not compile."""
    n = len(mechanism.q)
    problem = Problem(
        name=mechanism.name, title=mechanism.title, mechanism=lambda: mechanism,
        start=np.array(start, float), t_end=0.5, quantities=(), exact=np.zeros(2 * n),
        observe=lambda y: y,
    )  # fmt: skip
    problem.__dict__["values"] = {p.symbol.name: float(p.default) for p in mechanism.parameters}
    return problem


def judged(cases, problem):
    return measure(cases, problem.error, Effort(longest=np.inf, rounds=0))


def errors(cases, tool, method):
    """By tolerance, the loosest first."""
    found = [case for case in cases if (case.tool, case.method) == (tool, method)]
    return [case.error for case in sorted(found, key=lambda case: -case.tol)]
