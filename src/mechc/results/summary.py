"""Summaries of models and solutions in words and tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

import numpy as np

from mechc.simulation.trajectory import Trajectory
from mechc.system.quantity import ANGULAR, Kind
from mechc.system.system import System

MOST_TOLD = 1000  # change points in JSON


def model_html(system: System) -> str:
    """The model for a notebook: title, coordinates, speeds, parameters."""
    defaults = system.defaults
    rows = [
        (name, q.description, q.unit, f"{defaults[name]:g}" if name in defaults else "")
        for name, q in system.quantities.items()
    ]
    head = ("name", "meaning", "unit", "default")
    about = f"{escape(system.title)}</b> {escape(f'mechc.Model {system.headline}')}"
    return f"<b>{about}{html_table(head, rows)}"


def html_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    def cells(row: Sequence[str], tag: str) -> str:
        return "".join(f"<{tag} style='text-align:left'>{escape(c)}</{tag}>" for c in row)

    body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows)
    return f"<table><tr>{cells(head, 'th')}</tr>{body}</table>"


def solution_html(sol: Trajectory) -> str:
    """The solution for a notebook: how it ended and a summary."""
    rows = [(label, value) for label, value in summary_rows(sol)]
    return f"<b>{escape(sol.system.title)}</b>: {escape(str(sol.status))}" + html_table(
        ("", ""), rows
    )


def summary(sol: Trajectory) -> str:
    """The output of ``mechc run``: one fact per line."""
    rows = summary_rows(sol)
    width = max(len(label) for label, _ in rows)
    return "\n".join(f"{label.ljust(width)}  {value}" for label, value in rows)


def summary_rows(sol: Trajectory) -> list[tuple[str, str]]:
    """(label, value) pairs of a finished run, in degrees, metres, joules."""
    system, stats = sol.system, sol.stats
    names = (*system.coordinates, *system.speeds)
    end = [
        (f"{name} at the end", _shown(system, name, sol.y[-1, i])) for i, name in enumerate(names)
    ]
    swing = [
        (f"{name} between", f"{_shown(system, name, low)} and {_shown(system, name, high)}")
        for name, low, high in zip(system.coordinates, *extremes(sol), strict=True)
    ]
    work, departure = _energy_balance(sol)
    drift = f"{departure:.1e} of the largest kinetic energy"
    if not sol.has_energy:
        checks = [("energy change", "the energy is not known")]
    elif math.isnan(work):
        checks = [("energy balance", "not known: work is done, and no dense output was kept")]
    elif work == 0.0:
        checks = [("energy change", drift)]
    else:  # the difference from the work done
        checks = [("energy balance", f"{drift}, besides the work done, {work:.6g} J")]
    if system.constraint_names:
        unit = system.gap_unit
        gap, rate = f"{sol.closure.max():.1e} {unit}".rstrip(), f"{sol.velocity_closure.max():.1e}"
        checks.append(("closure", f"{gap}, {rate} {f'{unit}/s' if unit else 'per second'}"))
    passages = _passages(sol)
    changed = [
        f"{name} = {value:g} {system.units[name]}".rstrip()
        for name, value in zip(system.parameters, sol.params, strict=True)
        if value != system.defaults.get(name)
    ]
    return [
        ("outcome", str(sol.status)),
        ("parameters", ", ".join(changed) or "all by default"),
        *swing,
        *end,
        *passages,
        *checks,
        (
            "cost",
            f"{stats['steps']} steps, {stats['rhs_evaluations']} evaluations, "
            f"{1e3 * stats['wall_s']:.2f} ms ({stats['method']}, rtol {sol.policy.rtol:g})",
        ),
    ]


def _energy_balance(sol: Trajectory) -> tuple[float, float]:
    """The work done in the whole run, J, and the energy's drift; NaN of a model without energy: a
    summary compiles nothing."""
    if not sol.has_energy:
        return math.nan, math.nan
    return float(sol.work_until(sol.span[1])), sol.energy_drift


def _passages(sol: Trajectory) -> list[tuple[str, str]]:
    """The first change points, and their number."""
    points = sol.change_points
    rows = []
    for c in points[:3]:
        pairs = zip(sol.system.coordinates, c.q, strict=True)
        place = ", ".join(f"{n} = {_shown(sol.system, n, v)}" for n, v in pairs)
        rows.append(("change point", f"{c.t:.9g} s, {place}"))
    return [*rows, ("", f"and {len(points) - 3} more")] if len(points) > 3 else rows


def extremes(sol: Trajectory) -> tuple[Any, Any]:
    """Least and greatest value of every coordinate, on the dense output where there is one."""
    if not sol.policy.dense or sol.span[0] == sol.span[1]:
        return sol.q.min(axis=0), sol.q.max(axis=0)
    count = range(len(sol.system.coordinates))
    least, greatest = (np.array([_extreme(sol, i, sign) for i in count]) for sign in (-1, 1))
    return least, greatest


def _extreme(sol: Trajectory, component: int, sign: int) -> float:
    """Greatest value of ``sign`` times a component: the best of a grid, which is refined."""
    low, high = min(sol.span), max(sol.span)
    grid = np.linspace(low, high, 4001)
    for _ in range(4):
        values = sign * sol(grid)[:, component]
        best = int(values.argmax())
        near = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        grid = np.linspace(*near, 65)
    return float(sign * values[best])


def _shown(system: System, name: str, value: float) -> str:
    quantity = system.quantities[name]
    if quantity.kind in ANGULAR:
        shown = round(math.degrees(value), 6) + 0.0  # no minus zero
        return f"{shown:.6f} {'deg' if quantity.kind is Kind.ANGLE else 'deg/s'}"
    return f"{value:.9g} {quantity.unit}".rstrip()


def json_summary(sol: Trajectory) -> dict[str, Any]:
    """The output of ``--json``; angles in rad; the first 1000 change points."""
    stats = sol.stats
    width = len(sol.system.coordinates)
    work, drift = _energy_balance(sol)
    return {
        "mechanism": sol.system.name,
        "t_end": float(sol.status.t),
        "rtol": sol.policy.rtol,
        "method": sol.method,
        "coordinates": list(sol.system.coordinates),
        "speeds": list(sol.system.speeds),
        "q_end": sol.y[-1, :width].tolist(),
        "u_end": sol.y[-1, width:].tolist(),
        "energy_drift": _number(drift),
        "work": _number(work),
        "closure_max": float(sol.closure.max()),
        "velocity_closure_max": float(sol.velocity_closure.max()),
        "steps": stats["steps"],
        "rejected": stats["rejected"],
        "rhs_evaluations": stats["rhs_evaluations"],
        "wall_s": stats["wall_s"],
        "change_point_count": len(sol.change_points),
        "change_points": [{"t": c.t, "q": list(c.q)} for c in sol.change_points[:MOST_TOLD]],
        "status": sol.status.code,
        "message": str(sol.status),
        "parameters": dict(zip(sol.system.parameters, sol.params.tolist(), strict=True)),
    }


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value
