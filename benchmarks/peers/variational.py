"""Derivatives of ends of motions by other tools: heyoka's variational equations, and CVODES and
IDAS through CasADi, with forward sensitivities and adjoints.

All take the same equations with one number more for each derivative, theta_k, that is 0: parameters
are p + P theta, and the start has the derivatives S of mechc's, whose closing of loops is not timed
here.  heyoka's variational equations have no adjoint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..formulations.equations import Equations, consistent
from ..problems.problem import Array
from .casadi_sundials import MOST_STEPS, explicit_dae, index_one_dae
from .heyoka_taylor import FIRST_STEP, QUICKLY_UNROLLED, rates_of, unrolls

# Gradients by parameters are integrals, which SUNDIALS leaves out of its error control by default,
# and its other interpolation between checkpoints is of third order.
BACKWARDS = {"quad_err_con": True, "interpolation_type": "polynomial"}


class Run(NamedTuple):
    """A tool at a tolerance: derivatives of the end, (nx, k) forwards, (k,) of its first component
    backwards; None where it gave up."""

    tool: str
    way: str
    tol: float
    run: Callable[[], Array | None]


@dataclass(frozen=True)
class Differentiated:
    """A motion to t with its derivatives.

    Attributes
    ----------
    equations
        With all parameters symbols.
    start, slopes
        The first state (nx,), and its derivatives S (nx, k).
    values, directions
        Parameters (np,), and how they change, P (np, k).
    stiff
        Backward differentiation instead of Adams' formulas.
    """

    equations: Equations
    start: Array
    slopes: Array
    values: Array
    directions: Array
    t: float
    stiff: bool

    @property
    def count(self) -> int:
        """Of derivatives."""
        return int(self.slopes.shape[1])

    def parameters(self, thetas: Sequence[Any]) -> list[Any]:
        """p + P theta; numbers where none changes them."""
        return [
            value + sum(row[k] * thetas[k] for k in np.flatnonzero(row))
            for value, row in zip(self.values.tolist(), self.directions, strict=True)
        ]


def runs(motion: Differentiated, tolerances: Sequence[float]) -> Iterator[Run]:
    """Those of the tools that are installed."""
    for tool in (by_heyoka, by_casadi):
        try:
            yield from tool(motion, tolerances)
        except ImportError as error:
            print(f"left out: {error.name} is not installed")


# -- heyoka ---------------------------------------------------------------------------------------


def by_heyoka(motion: Differentiated, tolerances: Sequence[float]) -> Iterator[Run]:
    """Its variational equations; a state more makes every theta a parameter of the system."""
    import heyoka

    k = motion.count
    thetas = [heyoka.par[i] for i in range(k)]
    system, operations = rates_of(heyoka, motion.equations, motion.parameters(thetas))
    system.append((heyoka.expression("more"), heyoka.sum(thetas)))
    varied = heyoka.var_ode_sys(system, args=thetas)
    for tol in tolerances:
        compact = unrolls(operations * (1 + k), tol) > QUICKLY_UNROLLED
        taylor = heyoka.taylor_adaptive(
            varied, [*motion.start, 0.0], pars=[0.0] * k, tol=tol, compact_mode=compact
        )
        yield Run("heyoka", "forwards", tol, _taylor_run(taylor, motion))


def _taylor_run(taylor: Any, motion: Differentiated) -> Callable[[], Array | None]:
    width, k = len(motion.start), motion.count
    first = np.array(taylor.state)
    places = np.empty((width, k), int)
    for place in range(len(first)):
        component, *orders = taylor.get_mindex(place)
        if sum(orders) == 1 and component < width:
            places[component, orders.index(1)] = place
    first[places] = motion.slopes

    def run() -> Array | None:
        taylor.time = 0.0
        taylor.state[:] = first
        taylor.step(max_delta_t=FIRST_STEP * motion.t)
        outcome = taylor.propagate_until(motion.t, max_steps=MOST_STEPS)[0]
        return np.array(taylor.state)[places] if outcome.name == "time_limit" else None

    return run


# -- SUNDIALS through CasADi ----------------------------------------------------------------------


def by_casadi(motion: Differentiated, tolerances: Sequence[float]) -> Iterator[Run]:
    """CVODES on the explicit rates and IDAS on the index-one equations."""
    import casadi

    theta = casadi.SX.sym("theta", motion.count)
    parameters = motion.parameters(casadi.vertsplit(theta))
    arguments = np.concatenate([motion.start, motion.values])
    algebraic = np.concatenate(consistent(replace(motion.equations, start=arguments)))
    formulas = "bdf" if motion.stiff else "adams"
    for solver, form, start, own in (
        ("cvodes", explicit_dae, {}, {"linear_multistep_method": formulas}),
        ("idas", index_one_dae, {"z0": algebraic}, {"suppress_algebraic": True}),
    ):
        dae = {"p": theta, **form(casadi, motion.equations, parameters)}
        for tol in tolerances:
            options = {"abstol": tol, "reltol": tol, "max_num_steps": MOST_STEPS,
                       "disable_internal_warnings": True, **BACKWARDS, **own}  # fmt: skip
            plain = casadi.integrator("motion", solver, dae, 0.0, motion.t, options)
            given = {"x0": motion.start, "p": np.zeros(motion.count), **start}
            for way, run in _sundials_runs(plain, motion, given):
                yield Run(solver.upper(), way, tol, run)


def _sundials_runs(
    plain: Any, motion: Differentiated, given: dict[str, Any]
) -> Iterator[tuple[str, Callable[[], Array | None]]]:
    forwards, backwards = plain.forward(motion.count), plain.reverse(1)
    seeds = {"fwd_x0": motion.slopes, "fwd_p": np.eye(motion.count)}
    first = np.eye(len(motion.start))[0]
    (seeded,) = (name for name in backwards.name_in() if _is_seed(name))
    prefix = seeded.removesuffix("xf")

    def columns() -> Array | None:
        found = _called(forwards, given | seeds)
        return found and np.array(found["fwd_xf"])

    def gradient() -> Array | None:
        found = _called(backwards, given | {seeded: first})
        if found is None:
            return None
        by_start, by_theta = (np.array(found[prefix + end]).ravel() for end in ("x0", "p"))
        return np.asarray(by_start @ motion.slopes + by_theta)

    yield "forwards", columns
    yield "backwards", gradient


def _is_seed(name: str) -> bool:
    """Of the end, backwards: "adj1_xf", "adj2_xf"; "adj_xf" are those of a run forwards."""
    return (
        name.startswith("adj")
        and name[3].isdigit()
        and name.endswith("_xf")
        and (name.count("_") == 1)
    )


def _called(function: Any, given: dict[str, Any]) -> Any:
    """None where the integrator gives up."""
    try:
        return function(**given)
    except RuntimeError:
        return None
