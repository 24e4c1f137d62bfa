"""Exudyn: bodies in redundant coordinates, kinematic trees, a Lie group node for the top.

Open trees go to its explicit Runge-Kutta methods, loops and rolling wheels to its implicit ones as
in its own models: the trapezoidal rule, constraints on velocities, and generalized-alpha.  ``tol``
of a case is the tolerance of DOPRI5 and the step (s) of everything else.  The build without range
checks is used, as its documentation says to for speed, and nothing is written or printed.
"""

from __future__ import annotations

import contextlib
import io
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...formulations.rigid_scenes import rigid_bodies
from ...problems.problem import Array, Problem
from ...timing.cases import Case
from .. import Built

if TYPE_CHECKING:
    from .parts import Assembled

TOOLS = ("Exudyn",)
STEPS = tuple(250 * 4**k for k in range(6))  # 250 ... 256,000
LONGEST = 250_000  # evaluations times bodies in a run: two to three seconds
LARGEST_STEPS = 100  # what the steps of DOPRI5 cannot be larger than, as a part of the run
TIGHTEST = 9e-13  # beyond it DOPRI5 takes rounding for errors, and its steps vanish
SMALLEST_STEPS = 1e-6  # of the run, where DOPRI5 goes on whatever its estimate
SPARSE = 10  # bodies from which on the sparse linear solver takes less time


@dataclass(frozen=True)
class Method:
    """``cost`` of a step counts in evaluations of an explicit method."""

    name: str
    solver: str
    cost: int
    adaptive: bool = False
    spectral_radius: float = 0.9


EXPLICIT = (
    Method("RK44, h", "RK44", 4),
    Method("RK67, h", "RK67", 7),
    Method("DOPRI5", "DOPRI5", 7, adaptive=True),
)
# The trapezoidal rule with constraints on velocities (index 2), and generalized-alpha with them on
# positions (index 3) and the spectral radius of Exudyn's own model of the four-bar windows.
TRAPEZOIDAL = Method("trapezoid, h", "TrapezoidalIndex2", 2)
ALPHA = Method("gen-alpha, h", "GeneralizedAlpha", 2, spectral_radius=0.95)
IMPLICIT = (TRAPEZOIDAL, ALPHA)


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """Cases of the methods that suit the problem, over steps or tolerances.

    Raises
    ------
    ImportError
        If Exudyn is not installed.
    NotExpressibleError
        If the problem is not one of rigid bodies on joints.
    """
    _import_quietly()
    _ = problem.values  # mechc compiles its model for them, which is none of Exudyn's time
    start = time.perf_counter()
    system, count, methods = _assembled(problem)
    compiled = time.perf_counter() - start
    followed = [tol for tol in tolerances if tol > TIGHTEST]
    cases = [
        _case(problem, system, count, method, tol)
        for method in methods
        for tol in (followed if method.adaptive else _steps(problem, method, count, quick))
    ]
    return Built(cases, {"Exudyn": {"derive": 0.0, "compile": compiled}})


def _import_quietly() -> None:
    """Exudyn as compiled for speed; it tells of its own import on the standard output."""
    sys.exudynFast = True  # type: ignore[attr-defined]
    with contextlib.redirect_stdout(io.StringIO()):
        import exudyn
    exudyn.config.printToConsole = False


def _assembled(problem: Problem) -> tuple[Assembled, int, tuple[Method, ...]]:
    """The problem in the coordinates that suit it, how many bodies, and the methods for them."""
    from .bicycle import BODIES, bicycle
    from .plane import plane_bodies
    from .space import body_on_a_point, tree

    if problem.name == "bicycle":
        return bicycle(problem), len(BODIES), IMPLICIT
    bodies = rigid_bodies(problem)
    count = len(bodies.bodies)
    if bodies.loops:
        return plane_bodies(bodies, problem), count, IMPLICIT
    if bodies.bodies[0].joint == "ball":
        return body_on_a_point(bodies, problem), count, EXPLICIT
    methods = (*EXPLICIT, TRAPEZOIDAL) if problem.stiff else EXPLICIT
    return tree(bodies, problem), count, methods


def _steps(problem: Problem, method: Method, count: int, quick: bool) -> Iterator[float]:
    """Sizes of steps (s) whose runs end in time."""
    numbers = [steps for steps in STEPS if steps * method.cost * count <= LONGEST]
    return (problem.t_end / steps for steps in (numbers[1:3] if quick else numbers))


def _case(problem: Problem, system: Assembled, count: int, method: Method, tol: float) -> Case:
    settings = _settings(problem.t_end, method, tol)
    if count >= SPARSE:
        _solve_sparsely(settings)

    def run() -> None:
        system.mbs.SolveDynamic(settings, storeSolver=False, showCausingItems=False)

    def state(_: Any) -> Array:
        return problem.observe(system.state())

    return Case("Exudyn", method.name, tol, run, state)


def _settings(t_end: float, method: Method, tol: float) -> Any:
    """No files, no sensors; the rest is Exudyn's default unless said."""
    import exudyn as exu

    settings = exu.SimulationSettings()
    settings.solution.file.write = settings.solution.sensors.active = False
    time_integration = settings.timeIntegration
    time_integration.endTime, time_integration.verboseMode = t_end, 0
    time_integration.solverType = getattr(exu.DynamicSolverType, method.solver)
    time_integration.automaticStepSize = method.adaptive
    # Accelerations of the state that is stepped to would be one more evaluation a step.
    time_integration.explicit.computeEndOfStepAccelerations = False
    time_integration.generalizedAlpha.spectralRadius = method.spectral_radius
    if method.adaptive:
        time_integration.relativeTolerance = time_integration.absoluteTolerance = tol
        time_integration.numberOfSteps = LARGEST_STEPS
        time_integration.minimumStepSize = SMALLEST_STEPS * t_end
    else:
        time_integration.numberOfSteps = round(t_end / tol)
        # Where Newton's method fails steps are halved; without a bound a run takes minutes.
        time_integration.minimumStepSize = tol / 64
    return settings


def _solve_sparsely(settings: Any) -> None:
    import exudyn as exu

    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
