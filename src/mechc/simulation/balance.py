"""Does the energy of a finished run change by the work that is done on it?

dE/dt along the equations of motion is the power of everything that does work: loads, inputs,
dampers, prescribed motions.  So E(t1) - E(t0) = integral of dE/dt holds of the exact motion,
whatever acts, and what is missing is the error of the integration.  In conservative scenes the
energies at both ends alone tell; elsewhere the integral is taken over some of the steps.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechc.simulation.settings import Policy
from mechc.simulation.work import NODES, WEIGHTS, power_at
from mechc.system.parameters import Array
from mechc.system.system import System

NEAR = 1e3  # times the tolerance, of the largest kinetic energy: below it nothing more is checked
FAR = 100.0  # times what changes of the size of the tolerance do to the energy, ...
MANY = 1000  # ... for so many steps, and in proportion beyond
FINEST = 1e-9  # tolerances below it are taken for it: differences of energies have rounding
MOST_STEPS = 24  # of either kind, over which the work is integrated
WORTH = 2000  # evaluations of the rates from which on a run's energy is checked, ...
ENOUGH = 20_000  # ... and its work


def energy_note(
    system: System, run: Any, values: Array, policy: Policy, stats: dict[str, Any]
) -> tuple[str, ...]:
    """A warning where the energy of a finished run has a large error."""
    if stats["rhs_evaluations"] < WORTH or not system.knows_energy:
        return ()
    t, y = run.states()
    asked = max(policy.rtol, stats["rounding"], FINEST)
    if _alike(system, t[:: len(t) - 1], y[:: len(t) - 1], values, NEAR * asked):
        return ()
    looked_at = stats["rhs_evaluations"] >= ENOUGH or stats["examined"] > 0
    if not (looked_at and system.data.get("smooth", True)):
        return ()
    missing, kinetic = imbalance(system, run, values), system.kinetic_energy(y, values, t).max()
    if not missing > explained(system, t, y, values, policy, asked):
        return ()
    return (
        f"The energy is off by {missing:.2g} J, {missing / kinetic:.1g} of the largest "
        f"kinetic energy, which rtol = {policy.rtol:g} does not explain: the motion is not to be "
        "trusted. Compare it with another method, and look at sol.stats['least_singular']: near "
        "zero the constraints are nearly dependent",
    )


def _alike(system: System, t: Array, y: Array, values: Array, part: float) -> bool:
    """Whether the energies of two states differ by less than this part of the kinetic ones."""
    y, p = np.ascontiguousarray(y), values[None]
    t = np.ascontiguousarray(t)
    (a,), (b,) = system.scene.evaluate("kinetic_energy", t, y, p).tolist()
    (c,), (d,) = system.scene.evaluate("potential_energy", t, y, p).tolist()
    return bool(abs(b + d - a - c) <= part * (a + b))


def explained(
    system: System, t: Array, y: Array, values: Array, policy: Policy, asked: float
) -> float:
    """What errors within the tolerance, far multiplied, do to the energy, J."""
    count = len(t)
    some = np.unique(np.linspace(0, len(t) - 1, MOST_STEPS).astype(int))
    size = np.maximum(system.scale(values), np.abs(y).max(axis=0))
    t, y = t[some], y[some]
    speeds = slice(len(system.coordinates), None)
    reached = np.sqrt(np.abs(system.rates(y, values, t)).max(axis=0) * system.scale(values))
    size[speeds] = np.maximum(np.abs(y).max(axis=0), reached)[speeds]
    moved = np.diag(asked * size if policy.atol is None else asked * size + policy.atol)
    energy = system.energy(y, values, t)
    changed = system.energy(y[:, None] + moved, values, np.repeat(t[:, None], len(moved), axis=1))
    far = FAR * max(1.0, count / MANY)
    return far * float(np.abs(changed - energy[:, None]).max(axis=0).sum())


def imbalance(system: System, run: Any, values: Array) -> float:
    """The energy that the work does not explain, J: the larger of what is missing in some steps
    spread evenly, scaled up to all, and in those whose energies change unlike their neighbours'."""
    t, y = run.states()
    gained = np.diff(system.energy(y, values, t))
    count, most = len(gained), min(MOST_STEPS, len(gained))
    even = np.unique(np.linspace(0, count - 1, most).astype(int))
    neighbours = np.convolve(np.pad(gained, 1, mode="edge"), [0.5, 0.0, 0.5], mode="valid")
    odd = np.sort(np.argsort(np.abs(gained - neighbours))[-most:])
    chosen = np.concatenate([even, odd])
    middle, half = 0.5 * (t[chosen] + t[chosen + 1]), 0.5 * (t[chosen + 1] - t[chosen])
    inner = (middle[:, None] + half[:, None] * NODES).ravel()
    lengths = np.repeat(np.abs(2.0 * half), len(NODES))
    power = power_at(system, values, inner, run.interpolate(inner), lengths).value
    missing = gained[chosen] - half * (power.reshape(len(chosen), -1) @ WEIGHTS)
    spread = np.abs(np.cumsum(missing[: len(even)])).max() * count / len(even)
    return float(max(spread, np.abs(np.cumsum(missing[len(even) :])).max()))
