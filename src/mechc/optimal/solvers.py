"""Minima under conditions: IPOPT, where CasADi is installed, else SciPy's SLSQP.

Unknowns are counted in units of their sizes.  First derivatives are exact, second ones are gathered
from them on the way (quasi-Newton).
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from mechc.errors import AssemblyError, MechcError
from mechc.optimal.evaluate import Evaluation, evaluate, slopes_of_evaluation
from mechc.optimal.problem import OptimalProblem, Unknowns
from mechc.simulation.settings import checked_count, checked_positive
from mechc.system.names import checked_word
from mechc.system.parameters import Array

IPOPT, SLSQP = "ipopt", "slsqp"
FAR = 1e3  # of conditions where a motion does not exist
SMALL = 1e-2  # of their units: with a cost or inputs that are less, the units are taken anew
MORE = 50  # iterations of the search with these
MEETS = 1e-6  # of the sizes: conditions that are missed by less are met
_ENDED = {"Solve_Succeeded": "converged", "Solved_To_Acceptable_Level": "converged roughly"}


@dataclass(frozen=True)
class SearchSettings:
    """The solver, its tolerance, its most iterations, and how many first values are tried."""

    solver: str
    tol: float
    most: int
    starts: int
    seed: int

    @classmethod
    def of(cls, solver: Any, tol: Any, most: Any, starts: Any, seed: Any) -> SearchSettings:
        """Settings as a user gives them: IPOPT where CasADi is installed, if none is named."""
        word = checked_word("solver", solver, ("auto", IPOPT, SLSQP))
        if word == "auto":
            word = IPOPT if find_spec("casadi") else SLSQP
        return cls(
            word, checked_positive("tol", tol), checked_count("max_iterations", most),
            checked_count("starts", starts), int(seed),
        )  # fmt: skip


class SearchEnd(NamedTuple):
    """The end of a search: unknowns, the motions there, the largest violation of a condition,
    whether it converged, how it ended in words, iterations, seconds."""

    x: Array
    evaluation: Evaluation
    violation: float
    converged: bool
    message: str
    iterations: int
    seconds: float

    @property
    def cost(self) -> float:
        return self.evaluation.cost

    @property
    def rank(self) -> tuple[bool, float]:
        """Where it stands among others: the least cost first, else what misses least."""
        return not self.converged, self.cost if self.converged else self.violation


class ScaledProblem:
    """A problem in units of the sizes, its cost in a unit; the last evaluation is kept, and its
    derivatives."""

    def __init__(self, problem: OptimalProblem, unit: float) -> None:
        self.problem, self.size = problem, problem.unknowns.size
        self.row_size, self.unit = problem.row_sizes(), unit
        self.lower, self.upper = (each / self.row_size for each in problem.row_bounds())
        self._last: tuple[Array, Evaluation] | None = None
        self._slopes: tuple[Array, csr_matrix] | None = None
        self._nearest: tuple[float, Array | None] = (np.inf, None)
        self.error: BaseException | None = None
        self.iterations = 0

    def at(self, z: Array) -> Evaluation:
        """The evaluation at unknowns over their sizes."""
        if self._last is None or not np.array_equal(self._last[0], z):
            self._last, self._slopes = None, None
            self._last = z.copy(), evaluate(self.problem, z * self.size)
        return self._last[1]

    def value(self, z: Array) -> tuple[float, Array]:
        """Cost and rows; NaN where a motion does not exist."""
        try:
            one = self.at(z)
            cost, rows = one.cost / self.unit, one.rows / self.row_size
        except AssemblyError:
            return np.nan, np.full(len(self.lower), np.nan)
        missed = self.violation(rows)
        if missed < self._nearest[0]:
            self._nearest = missed, z.copy()
        return cost, rows

    def slopes(self, z: Array) -> tuple[Array, csr_matrix]:
        """Their derivatives."""
        one = self.at(z)
        if self._slopes is None:
            gradient, rows = slopes_of_evaluation(one)
            # in place: a product would leave out places where it is zero
            rows.data *= self.size[rows.indices] / np.repeat(self.row_size, np.diff(rows.indptr))
            self._slopes = gradient * self.size / self.unit, rows
        return self._slopes

    def violation(self, rows: Array) -> float:
        """By how much the worst condition is missed; infinite where a motion does not exist."""
        missed = np.maximum(self.lower - rows, rows - self.upper).max(initial=0.0)
        return float(missed) if np.isfinite(rows).all() else np.inf

    def nearest(self, z: Array) -> Array:
        """The unknowns that missed least so far; z where there are none."""
        return z if self._nearest[1] is None else self._nearest[1]

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the unknowns over their sizes."""
        return self.problem.unknowns.lower / self.size, self.problem.unknowns.upper / self.size

    def end_at(
        self, z: Array, converged: bool, message: str, iterations: int, began: float
    ) -> SearchEnd:
        """The end of a search at z; where no motion exists there, at what missed least before."""
        cost, rows = self.value(z)
        if not np.isfinite(cost):
            z, converged = self.nearest(z), False
            cost, rows = self.value(z)
        seconds, missed = time.perf_counter() - began, self.violation(rows)
        return SearchEnd(
            z * self.size, self.at(z), missed, converged and missed < MEETS, message,
            iterations, seconds,
        )  # fmt: skip


def minimise(problem: OptimalProblem, x: Array, search: SearchSettings) -> SearchEnd:
    """The minimum near x.

    Raises :class:`AssemblyError` where a motion does not exist at x, :class:`MechcError` where a
    derivative does not.
    """
    first = evaluate(problem, x)
    slopes_of_evaluation(first)  # compiles what is not yet, before the clock is read
    unit = max(1.0, abs(first.cost))
    ended = _search(ScaledProblem(problem, unit), x, search, search.most)
    unknowns = problem.unknowns
    size = np.where(
        np.isfinite(unknowns.upper - unknowns.lower), unknowns.size, _levels(ended.x, unknowns)
    )
    small = ended.converged and 0.0 < abs(ended.cost) < SMALL * unit
    off = np.maximum(size / unknowns.size, unknowns.size / size).max() > 1.0 / SMALL
    rest = search.most - ended.iterations
    if not (small or off) or rest <= 0:
        return ended
    problem = replace(problem, unknowns=replace(unknowns, size=size))
    unit, most = abs(ended.cost) or 1.0, min(rest, ended.iterations + MORE)
    again = _search(ScaledProblem(problem, unit), ended.x, search, most)
    total = ended.iterations + again.iterations, ended.seconds + again.seconds
    return min(
        again, ended, key=lambda one: 0.0 if one.converged else 1.0 + one.violation
    )._replace(iterations=total[0], seconds=total[1])


def _levels(x: Array, unknowns: Unknowns) -> Array:
    """Sizes of the unknowns, those of inputs their largest samples in x (n,)."""
    size = unknowns.size.copy()
    for places in unknowns.blocks["controls"].T:
        size[places] = np.abs(x[places]).max() or 1.0
    return size


def _search(scaled: ScaledProblem, x: Array, search: SearchSettings, most: int) -> SearchEnd:
    method, began = _by_ipopt if search.solver == IPOPT else _by_slsqp, time.perf_counter()
    z = np.clip(x / scaled.size, *scaled.bounds)
    try:
        return method(scaled, z, search.tol, most)
    except MechcError as error:  # of a derivative that does not exist there, or of a motion
        told, count = f"it came to where {error}", scaled.iterations
        return scaled.end_at(scaled.nearest(z), False, told, count, began)


def _by_ipopt(scaled: ScaledProblem, z: Array, tol: float, most: int) -> SearchEnd:
    from mechc.differentiable.casadi_function import library, numeric_function

    casadi, began = library(), time.perf_counter()
    pattern = scaled.slopes(z)[1]

    def value(x: Array) -> Any:
        nothing = np.nan, np.full(len(scaled.lower), np.nan)
        return _without_errors(scaled, lambda: scaled.value(x), nothing)

    def slopes(x: Array) -> Any:
        nothing = np.full((1, len(x)), np.nan), csr_matrix(pattern * np.nan)
        found = _without_errors(scaled, lambda: scaled.slopes(x), nothing)
        return [[found[0].reshape(1, -1)], [found[1]]]

    every = csr_matrix(np.ones((1, len(z))))
    sizes = [len(z)], [1, len(scaled.lower)]
    function = numeric_function("problem", *sizes, value, slopes, [[every], [pattern]])
    x = casadi.MX.sym("x", len(z))
    cost, rows = function(x)
    quiet = {"print_level": 0, "sb": "yes", "hessian_approximation": "limited-memory",
             "tol": tol, "max_iter": most, "limited_memory_max_history": 30,
             "constr_viol_tol": 0.1 * MEETS, "bound_relax_factor": 0.0}  # fmt: skip
    solver = casadi.nlpsol("search", "ipopt", {"x": x, "f": cost, "g": rows}, {
        "ipopt": quiet, "print_time": False, "show_eval_warnings": False, "calc_lam_x": False,
        "error_on_fail": False,
    })  # fmt: skip
    lower, upper = scaled.bounds
    found = solver(x0=z, lbx=lower, ubx=upper, lbg=scaled.lower, ubg=scaled.upper)
    status, stats = solver.stats()["return_status"], solver.stats()
    scaled.iterations = int(stats["iter_count"])
    if scaled.error is not None:
        raise scaled.error
    told = _ENDED.get(status, status.replace("_", " ").lower())
    at = np.array(found["x"]).ravel()
    return scaled.end_at(at, status in _ENDED, told, scaled.iterations, began)


def _without_errors(scaled: ScaledProblem, call: Any, nothing: Any) -> Any:
    """The result of a call from within IPOPT, which no error may leave: it is kept, and the search
    finds numbers nowhere then."""
    if scaled.error is not None:
        return nothing
    try:
        return call()
    except BaseException as error:
        scaled.error = error
        return nothing


def _by_slsqp(scaled: ScaledProblem, z: Array, tol: float, most: int) -> SearchEnd:
    from scipy.optimize import minimize

    began = time.perf_counter()
    equal = scaled.lower == scaled.upper
    below, above = (np.isfinite(each) & ~equal for each in (scaled.lower, scaled.upper))

    def rows(x: Array) -> Array:
        return np.nan_to_num(scaled.value(x)[1], nan=FAR)

    def conditions(sign: float, which: Array, bound: Array) -> dict[str, Any]:
        return {
            "type": "eq" if which is equal else "ineq",
            "fun": lambda x: sign * (rows(x) - bound)[which],
            "jac": lambda x: sign * scaled.slopes(x)[1].toarray()[which],
        }

    def count(_: Array) -> None:
        scaled.iterations += 1

    asked = (1.0, equal, scaled.lower), (1.0, below, scaled.lower), (-1.0, above, scaled.upper)
    done = minimize(
        lambda x: np.nan_to_num(scaled.value(x)[0], nan=FAR), z,
        jac=lambda x: scaled.slopes(x)[0], method="SLSQP",
        bounds=np.column_stack(scaled.bounds),
        constraints=[conditions(*each) for each in asked if each[1].any()],
        options={"ftol": tol, "maxiter": most}, callback=count,
    )  # fmt: skip
    found, told = bool(done.success), done.message
    if not found and int(done.nit) < most and _is_stationary(scaled, done.x):
        found, told = True, "converged as far as rounding allows"
    return scaled.end_at(done.x, found, told, int(done.nit), began)


def _is_stationary(scaled: ScaledProblem, z: Array) -> bool:
    """Whether the cost's gradient is made of those of conditions and bounds that hold it, each by a
    force of the sign that it can have (Karush, Kuhn, Tucker): no step near z lowers the cost.

    Judges where the solver ended by a step that lowers nothing: beside a minimum rounding decides.
    """
    from scipy.optimize import lsq_linear

    cost, rows = scaled.value(z)
    if not scaled.violation(rows) < MEETS:
        return False
    gradient, slopes = scaled.slopes(z)
    values = np.concatenate([rows, z])
    lower, upper = (np.concatenate(pair) for pair in zip(
        (scaled.lower, scaled.upper), scaled.bounds, strict=True
    ))  # fmt: skip
    below, above = values - lower <= MEETS, upper - values <= MEETS
    holds = below | above
    normals = np.vstack([slopes.toarray(), np.eye(len(z))])[holds].T
    forces = np.zeros(0)
    if holds.any():
        least, most = np.where(above[holds], -np.inf, 0.0), np.where(below[holds], np.inf, 0.0)
        forces = lsq_linear(normals, gradient, (least, most)).x
    left = np.abs(gradient - normals @ forces).max()
    size = max(np.abs(gradient).max(), (np.abs(normals) @ np.abs(forces)).max())
    unseen = np.sqrt(np.finfo(float).eps) * abs(cost)  # a slope that rounding of the cost hides
    return bool(left <= max(MEETS * size, unseen))
