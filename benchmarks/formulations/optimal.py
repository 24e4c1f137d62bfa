"""Optimal motions with known costs: how near, how many iterations, how many seconds.

    mechc bench optimal [--only NAME ...] [--solver ipopt|slsqp] [--most N]

Each is found twice, with the exact derivatives of its motions and with differences of these: by
the same solver, with a motion of every interval for each group of unknowns that no condition has in
common.  The error is that of the cost, over the one that is known.

What second derivatives would save: the crane's equations in CasADi, by Runge and Kutta's steps,
with the exact Hessian and with one of limited memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy.optimize._numdiff import approx_derivative, group_columns
from scipy.sparse import csr_matrix, lil_matrix

from mechc.optimal import solvers
from mechc.optimal.evaluate import Evaluation, evaluate, slopes_of_evaluation
from mechc.optimal.problem import Choice
from mechc.system.parameters import Array

from ..problems.optimal import LOAD, PROBLEMS, ROPE, SECONDS, TROLLEY, WAY, G
from ..timing.results import command_parser

ROW = "{:18} {:12} {:>10} {:>10} {:>9} {:>9} {:>9}"


STEP = 1e-7  # of the sizes; the motions are good to some ten digits


def differenced(one: Evaluation) -> tuple[Array, csr_matrix]:
    """The gradient of an evaluation, and differences of motions in place of its Jacobian."""
    problem, x = one.choice.problem, _unknowns_of(one.choice)
    pattern = _pattern(problem)
    found = approx_derivative(
        lambda x: evaluate(problem, x).rows, x, f0=one.rows,
        abs_step=STEP * problem.unknowns.size, sparsity=pattern,
    )  # fmt: skip
    rows, columns = np.array(pattern[0].nonzero())
    values = np.asarray(found[rows, columns]).ravel()
    return slopes_of_evaluation(one)[0], csr_matrix((values, (rows, columns)), found.shape)


def _unknowns_of(choice: Choice) -> Array:
    """The vector of unknowns that a choice was read from."""
    unknowns, x = choice.problem.unknowns, np.zeros(choice.problem.unknowns.count)
    x[unknowns.blocks["controls"]], x[unknowns.blocks["nodes"]] = choice.samples, choice.nodes
    x[unknowns.blocks["parameters"]] = [choice.params[name] for name in unknowns.parameters]
    x[unknowns.blocks["start"]] = [choice.start[name] for name in unknowns.start]
    x[unknowns.blocks["duration"]] = choice.duration
    return x


_patterns: dict[int, Any] = {}


def _pattern(problem: Any) -> Any:
    """The places of the derivatives that are not zero, and groups of columns that share no row."""
    key = id(problem.unknowns)
    if key not in _patterns:
        blocks, sizes = problem.unknowns.blocks, problem.unknowns
        count, nx = blocks["nodes"].shape
        m, last = problem.along.count, problem.end.count
        found = lil_matrix((count * (nx + m) + last, sizes.count), dtype=bool)
        numbers = np.concatenate([blocks["parameters"], blocks["start"], blocks["duration"]])
        late = 1 + (problem.kind == "linear")
        for k in range(count):
            local = np.concatenate([
                blocks["controls"][k : k + late].ravel(), numbers,
                *blocks["nodes"][max(k - 1, 0) : k + 1],
            ])  # fmt: skip
            rows = [
                *range(k * nx, (k + 1) * nx),
                *range(count * nx + k * m, count * nx + (k + 1) * m),
            ]
            found[np.ix_(rows, local)] = True
            if k == count - 1 and last:
                found[np.ix_(range(count * (nx + m), count * (nx + m) + last), local)] = True
        whole = csr_matrix(found)
        _patterns[key] = whole, group_columns(whole)
    return _patterns[key]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("optimal", __doc__)
    parser.add_argument("--only", nargs="*", choices=PROBLEMS, default=[*PROBLEMS])
    parser.add_argument("--solver", default="auto")
    parser.add_argument("--most", type=int, default=300, metavar="N", help="iterations [300]")
    chosen = parser.parse_args(arguments)
    print(ROW.format("", "derivatives", "cost", "error", "solver", "iterations", "seconds"))
    for name in chosen.only:
        problem = PROBLEMS[name]()
        problem.model.wait_compiled()
        known = problem.known()
        problem.optimise(solver=chosen.solver, max_iterations=1)  # what is compiled at first use
        for told, slopes in (("exact", slopes_of_evaluation), ("differences", differenced)):
            solvers.slopes_of_evaluation = slopes
            found = problem.optimise(solver=chosen.solver, max_iterations=chosen.most)
            solvers.slopes_of_evaluation = slopes_of_evaluation
            error = f"{found.cost / known - 1.0:.1e}" if found.converged else "none"
            print(ROW.format(
                name, told, f"{found.cost:.6g}", error, found.solver, found.iterations,
                f"{found.seconds:.2f}",
            ), flush=True)  # fmt: skip
    if find_spec("casadi") and "crane" in chosen.only:
        limited = {"hessian_approximation": "limited-memory"}
        for told, options in (("exact Hessian", {}), ("limited", limited)):
            cost, count = _crane_in_casadi(options)
            row = "crane in CasADi", told, f"{cost:.6g}", "", "ipopt", count, ""
            print(ROW.format(*row), flush=True)
    return 0


def _crane_in_casadi(options: dict[str, str]) -> tuple[float, int]:
    """The least cost, and the iterations; 20 intervals of 10 steps each."""
    import casadi as ca

    count, steps = 20, 10
    h = SECONDS / count / steps
    y, force, last = ca.MX.sym("y", 4), ca.MX.sym("force", 2), [WAY, 0, 0, 0]

    def rates(y: Any, push: Any) -> Any:
        pull = ROPE * y[3] ** 2 * ca.sin(y[1])
        mass = TROLLEY + LOAD * ca.sin(y[1]) ** 2
        v = (push + LOAD * (pull + G * ca.sin(y[1]) * ca.cos(y[1]))) / mass
        return ca.vertcat(y[2], y[3], v, -(v * ca.cos(y[1]) + G * ca.sin(y[1])) / ROPE, push**2)

    z = ca.vertcat(y, 0)
    for k in range(steps):
        one, half, two = (force[0] + (k + c) / steps * (force[1] - force[0]) for c in (0, 0.5, 1))
        k1 = rates(z, one)
        k2 = rates(z + 0.5 * h * k1, half)
        k3 = rates(z + 0.5 * h * k2, half)
        z = z + h / 6.0 * (k1 + 2.0 * (k2 + k3) + rates(z + h * k3, two))
    step = ca.Function("step", [y, force], [z[:4], z[4]])
    nodes, samples = ca.MX.sym("nodes", 4, count), ca.MX.sym("samples", count + 1)
    before = ca.horzcat(np.zeros(4), nodes[:, :-1])
    after, cost = step.map(count)(before, ca.horzcat(samples[:-1], samples[1:]).T)
    gaps = ca.vertcat(ca.vec(after - nodes), nodes[:, -1] - last)
    problem = {"x": ca.vertcat(samples, ca.vec(nodes)), "f": ca.sum2(cost), "g": gaps}
    quiet = {"ipopt": {"print_level": 0, "sb": "yes", **options}, "print_time": False}
    solver = ca.nlpsol("crane", "ipopt", problem, quiet)
    line = np.outer(np.arange(1, count + 1) / count, last).ravel()
    found = solver(x0=np.concatenate([np.zeros(count + 1), line]), lbg=0, ubg=0)
    return float(found["f"]), int(solver.stats()["iter_count"])


if __name__ == "__main__":
    raise SystemExit(main())
