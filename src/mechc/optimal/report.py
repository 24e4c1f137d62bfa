"""An optimal motion in words and in pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.results.answer import shown_quantity, value_lines
from mechc.results.figures import new_figure
from mechc.results.mathtext import plain, typeset
from mechc.results.panels import COLOURS, QUIET
from mechc.simulation.events.expressions import as_written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SAMPLES = 800
SAME_COST = 1e-5  # of it: by how much it may differ along the whole motion without a word


def in_words(result: Any) -> str:
    """Cost, duration, values, what lies at its bound, and what the search took."""
    problem = result.problem
    ended = "found" if result.converged else "not found"
    lines = [
        f"motion of {problem.model.name} with the least {_cost(problem)}: {ended}",
        f"  cost         {result.cost:14.9g}",
        *([] if problem.unknowns.free else [f"  duration     {result.duration:14.9g} s"]),
        *value_lines(result, {}),
        *(f"  {name} is {told}" for name, told in result.active.items()),
        f"{result.solver}: {result.message}, {result.iterations} iterations, "
        f"{result.seconds:.3g} s, {result.motions} motions of an interval, "
        f"{result.derivatives} with derivatives",
        f"conditions are met to {result.violation:.1g}, the whole motion is within "
        f"{result.deviation:.1g} of its parts",
        *_judgement(result),
    ]
    if len(result.ends) > 1:
        costs = ", ".join(f"{cost:.6g}" if good else "none" for cost, good in result.ends)
        lines.append(f"the starts led to: {costs}")
    if not result.converged:
        lines.append(
            f"what is told here was nearest; missed most is {result.worst}. Give other first "
            "values (inputs, params, y0), several starts, more iterations, or wider bounds"
        )
    return "\n".join(lines)


def _judgement(result: Any) -> list[str]:
    """The cost along the whole motion, if it is another, and bounds that it exceeds."""
    if result.solution.span[1] < result.nodes[0][-1]:
        return []
    model, cost = result.problem.model, result.cost_of_solution
    told = []
    if abs(cost - result.cost) > SAME_COST * abs(cost):
        told.append(f"along the whole motion the cost is {cost:.9g}: take more intervals")
    for name, (excess, t) in result.excess.items():
        unit, factor = shown_quantity(model, name)
        told.append(
            f"{name} is beyond its bound by {excess * factor:.2g} {unit}".rstrip()
            + f" at t = {t:.4g} s: bounds are held at the ends of intervals, take more"
        )
    return told


def _cost(problem: Any) -> str:
    parts = [f"integral of {title}" for title in problem.integral.titles]
    return " plus ".join([*parts, *problem.final.titles])


def draw_optimum(result: Any, names: Any) -> Figure:
    """Rows of a figure: the inputs that were found with their bounds, then what is named."""
    problem, model, sol = result.problem, result.problem.model, result.solution
    controls = problem.unknowns.controls
    asked = list(names) or list(model.coordinates)
    rows = len(controls) + len(asked)
    t = np.linspace(sol.span[0], sol.span[1], SAMPLES)
    with new_figure((6.8, 0.6 + 1.5 * rows)) as figure:
        panels = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
        for axes, name in zip(panels, controls, strict=False):
            _draw_control(axes, result, name)
        for axes, one, line in zip(
            panels[len(controls) :], asked, result.along(*asked, t=t).T, strict=True
        ):
            unit, factor = shown_quantity(model, one if isinstance(one, str) else as_written(one))
            axes.plot(t, factor * line, color=COLOURS[0])
            axes.set_ylabel(_label(model, one, unit))
        panels[-1].set_xlabel("time (s)")
    return figure


def _draw_control(axes: Any, result: Any, name: str) -> None:
    """The samples of an input as they are joined, and its bounds."""
    problem, signal = result.problem, result.signals[name]
    unit, factor = shown_quantity(problem.model, name)
    places = problem.unknowns.blocks["controls"][:, problem.unknowns.controls.index(name)]
    for bound in (problem.unknowns.lower[places[0]], problem.unknowns.upper[places[0]]):
        if np.isfinite(bound):
            axes.axhline(factor * bound, color=QUIET, linewidth=0.8, linestyle=":")
    joined = "steps-post" if signal.kind == "previous" else "default"
    axes.plot(signal.times, factor * signal.values, color=COLOURS[1], drawstyle=joined)
    axes.set_ylabel(_label(problem.model, name, unit))


def _label(model: Any, one: Any, unit: str) -> str:
    """A name, or an expression as it was written, with its unit."""
    written = as_written(one)
    known = (*model.coordinates, *model.speeds, *model.inputs)
    return (typeset(written) if written in known else plain(written)) + plain(
        f" ({unit})" if unit else ""
    )
