"""Pinocchio: forward dynamics in compiled code, integrated by SciPy.

It has no integrator of error control; its documentation has one write one's own around ``aba``
(open trees) or ``constraintDynamics`` (loops, held by proximal iterations), which is what SciPy's
``solve_ivp`` does here.  A spring's or motor's torque is computed in Python and handed over.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..problems.problem import Array, Formulation, Problem
from . import Built
from .pinocchio_models import Tree, tree_of
from .scipy_ivp import IMPLICIT, Rates, cases

TOOLS = ("Pinocchio",)
# Proximal iterations end at rounding; planar loops hold one direction twice, which needs mu > 0.
ACCURACY, MU, ITERATIONS = 1e-14, 1e-8, 20


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """RK45 and DOP853; on stiff problems SciPy's implicit methods.

    Raises
    ------
    ImportError
        Without Pinocchio.
    NotExpressibleError
        For rolling wheels and constraints that depend on time.
    """
    problem.values  # noqa: B018 - compiled by mechc, which is not Pinocchio's time
    start = time.perf_counter()
    tree = tree_of(problem)
    rates = closed(tree) if tree.loops else opened(tree)
    seconds = time.perf_counter() - start
    observe = lambda x: problem.observe(tree.back(x))  # noqa: E731
    own = Formulation(problem.mechanism, tree.into(problem.start), observe)
    methods = IMPLICIT if problem.stiff else ("RK45", "DOP853")
    found = cases(TOOLS[0], rates, replace(problem, formulation=own), tolerances, methods)
    return Built(found, {TOOLS[0]: {"derive": 0.0, "compile": seconds}})


def opened(tree: Tree) -> Rates:
    """[q', v'] by the articulated-body algorithm."""
    import pinocchio

    model, data, n = tree.model, tree.model.createData(), tree.model.nv

    def rates(time: float, x: Array) -> Array:
        q, v = x[:n], x[n:]
        return np.concatenate([v, pinocchio.aba(model, data, q, v, tree.torque(q, v))])

    return rates


def closed(tree: Tree) -> Rates:
    """[q', v'] with the loops' constraints at the level of accelerations."""
    import pinocchio

    model, data, n = tree.model, tree.model.createData(), tree.model.nv
    loops = pinocchio.StdVec_RigidConstraintModel()
    of_loops = pinocchio.StdVec_RigidConstraintData()
    for loop in tree.loops:
        loops.append(loop)
        of_loops.append(loop.createData())
    pinocchio.initConstraintDynamics(model, data, loops, of_loops)
    settings: Any = pinocchio.ProximalSettings(ACCURACY, MU, ITERATIONS)

    def rates(time: float, x: Array) -> Array:
        q, v = x[:n], x[n:]
        a = pinocchio.constraintDynamics(
            model, data, q, v, tree.torque(q, v), loops, of_loops, settings
        )
        return np.concatenate([v, a])

    return rates
