"""The energy of a run as a balance with the work that is done on it.

dE/dt along the equations of motion is the power of everything that has no potential: loads,
dampers, inputs, prescribed motions.  So E(t1) - E(t0) = integral of dE/dt holds of the exact
motion, whatever acts, and what is missing is the error of the integration.  For a warning at the
end of a run, energies at both ends alone tell in conservative scenes; elsewhere the integral is
taken over some of the steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from mechc.simulation.record import Record
from mechc.simulation.settings import Policy
from mechc.system.parameters import Array
from mechc.system.system import System

NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)
# Central differences of eighth and sixth order, the latter as an estimate of what the former omits
# (Fornberg, Math. Comp. 51 (1988) 699), at -4 ... -1 and 1 ... 4.
EIGHTH = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SIXTH = np.array([0, -1 / 60, 3 / 20, -3 / 4, 3 / 4, -3 / 20, 1 / 60, 0])
PLACES = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
# Between neighbouring states of the differences, at most: of each component's scale; of a step of
# the run; likewise where the energy depends on time, so that no difference leaves the step.
DIFFERENCE, OF_A_STEP, WITHIN_A_STEP = 0.02, 0.05, 0.003
UNDOUBTED = 100.0  # times its own error: a power that is not rounding
ROWS = 4096  # states taken together

# Of the warning:
NEAR = 1e3  # times the tolerance, of the largest kinetic energy: nothing more is examined
FAR = 100.0  # times what changes of the size of the tolerance do to the energy, ...
MANY = 1000  # ... for so many steps, and in proportion beyond
FINEST = 1e-9  # tolerances below it are taken for it: differences of energies have rounding
MOST_STEPS = 24  # of either kind, over which the work is integrated
WORTH = 2000  # evaluations of the rates, of a run that is long enough to look at its energy, ...
ENOUGH = 20_000  # ... and at its work


# -- the work done -----------------------------------------------------------------------------


class Power(NamedTuple):
    """dE/dt along the motion (n,), W, and a bound of its rounding and truncation errors (n,)."""

    value: Array
    error: Array


def work_along(system: System, record: Record, times: Array, conservative: bool) -> Array:
    """Work done between the start of a motion and each of these times, J (nt,).

    ``times`` are in the order of the run; of two equal ones at a jump the first is before it.
    ``conservative``: only jumps change the energy.  Where a contact lasts, its work is not known
    otherwise: what the energy changes by is all the work there.
    """
    t, y = record.states()
    grown = np.diff(system.energy(y, record.params_along(t), t))
    contact = record.in_contact()
    jumps = (np.diff(t) == 0.0) | contact
    done = np.where(jumps, grown, 0.0)
    if conservative:
        return _at(t, np.append(0.0, np.cumsum(done)), times)[0]
    smooth = np.flatnonzero(~jumps)
    done[smooth] = integral(system, record, t[smooth], t[smooth + 1])
    begun, rows = _at(t, np.append(0.0, np.cumsum(done)), times)
    between = times != t[rows]
    known = between & np.append(contact, False)[rows]
    rest = np.flatnonzero(between & ~known)
    begun[rest] += integral(system, record, t[rows[rest]], times[rest])
    along, p = record.interpolate(times[known]), record.params_along(times[known])
    begun[known] += system.energy(along, p, times[known])
    begun[known] -= system.energy(y[rows[known]], p, t[rows[known]])
    return begun


def _at(t: Array, done: Array, times: Array) -> tuple[Array, Any]:
    """The work at the last step at or before each time, and that step's number."""
    sign = 1.0 if t[-1] >= t[0] else -1.0
    rows = np.searchsorted(sign * t, sign * times, side="right") - 1
    before = np.flatnonzero(times[1:] == times[:-1])
    rows[before] = np.searchsorted(sign * t, sign * times[before], side="left")
    return done[rows], rows


def conserves_energy(system: System, t: Array, y: Array, values: Array) -> bool:
    """Whether no power acts at any of these states, but for rounding."""
    if system.driven is not None:
        return False
    if len(t) < 2:
        return True
    lengths = np.abs(np.gradient(t))
    lengths[lengths == 0.0] = np.abs(t[-1] - t[0])
    for part in _parts(len(t)):
        p = values if values.ndim == 1 else values[part]
        power = power_at(system, p, t[part], y[part], lengths[part])
        if not np.all(np.abs(power.value) <= UNDOUBTED * power.error):
            return False
    return True


def integral(system: System, record: Record, begin: Array, end: Array) -> Array:
    """The work done in each of these intervals, which contain no jump, J (n,)."""
    middle, half = 0.5 * (begin + end), 0.5 * (end - begin)
    done = np.empty_like(middle)
    for part in _parts(len(middle), ROWS // len(NODES)):
        t = (middle[part, None] + half[part, None] * NODES).ravel()
        lengths = np.repeat(np.abs(2 * half[part]), len(NODES))
        p = record.params_along(t)
        power = power_at(system, p, t, record.interpolate(t), lengths).value
        done[part] = half[part] * (power.reshape(-1, len(NODES)) @ WEIGHTS)
    return done


def power_at(system: System, values: Array, t: Array, y: Array, lengths: Array) -> Power:
    """dE/dt at times (n,) and states (n, nq + nu) of steps of these lengths, s (n,); parameters
    (np,), or (n, np)."""
    rates = system.rates(y, values, t)
    size = system.scale(_first(values)).copy()
    speeds = slice(len(system.coordinates), None)
    size[speeds] = np.maximum(size, np.abs(y).max(axis=0, initial=0.0))[speeds]
    most = (WITHIN_A_STEP if _of_time(system, values, t, y) else OF_A_STEP) * lengths
    step = DIFFERENCE / np.maximum(np.abs(rates / size).max(axis=1), DIFFERENCE / most)
    moved = y[:, None] + (PLACES * step[:, None])[:, :, None] * rates[:, None]
    at = t[:, None] + PLACES * step[:, None]
    p = values if values.ndim == 1 else values[:, None]
    kinetic = system.kinetic_energy(moved, p, at)
    potential = system.potential_energy(moved, p, at)
    energy, largest = kinetic + potential, (np.abs(kinetic) + np.abs(potential)).max(axis=1)
    value, lower = energy @ EIGHTH / step, energy @ SIXTH / step
    width = len(system.coordinates)
    turned = np.maximum(np.abs(y[:, :width] / size[:width]).max(axis=1, initial=0.0), 1.0)
    rounding = np.finfo(float).eps * turned * largest  # coordinates that have grown have it too
    return Power(value, np.abs(value - lower) + rounding / step)


def _first(values: Array) -> Array:
    return values if values.ndim == 1 else values[0]


def _of_time(system: System, values: Array, t: Array, y: Array) -> bool:
    """Whether the energy depends on time, other than through the state."""
    if len(t) < 2:
        return True
    return not np.array_equal(system.energy(y, values, t), system.energy(y, values, t[::-1]))


def _parts(count: int, size: int = ROWS) -> Iterator[slice]:
    return (slice(first, first + size) for first in range(0, count, size))


# -- a warning ---------------------------------------------------------------------------------


def energy_note(system: System, record: Record, policy: Policy) -> tuple[str, ...]:
    """A warning where the energy of a finished run is far off."""
    stats = record.stats
    if stats["rhs_evaluations"] < WORTH or not system.knows_energy:
        return ()
    if policy.checkpoints is not None or any(piece.lasts for piece in record.pieces):
        return ()
    asked = max(policy.rtol, stats["rounding"], FINEST)
    ends = record.ends()
    if _alike(system, *ends, record.params_along(ends[0]), NEAR * asked):
        return ()
    t, y = record.states()
    p = record.params_along(t)
    looked_at = stats["rhs_evaluations"] >= ENOUGH or stats["examined"] > 0
    if not (looked_at and system.data.get("smooth", True)):
        return ()
    missing, kinetic = imbalance(system, record), system.kinetic_energy(y, p, t).max()
    if not missing > energy_of_errors(system, t, y, p, policy, asked):
        return ()
    return (
        f"The energy is off by {missing:.2g} J, {missing / kinetic:.1g} of the largest "
        f"kinetic energy, which rtol = {policy.rtol:g} does not explain: the motion is not to be "
        "trusted. Compare it with another method, and look at sol.stats['least_singular']: near "
        "zero the constraints are nearly dependent",
    )


def _alike(system: System, t: Array, y: Array, values: Array, part: float) -> bool:
    """Whether the energies of two states differ by less than this part of the kinetic ones."""
    y, p = np.ascontiguousarray(y), np.ascontiguousarray(np.atleast_2d(values))
    t = np.ascontiguousarray(t)
    (a,), (b,) = system.scene.evaluate("kinetic_energy", t, y, p).tolist()
    (c,), (d,) = system.scene.evaluate("potential_energy", t, y, p).tolist()
    return bool(abs(b + d - a - c) <= part * (a + b))


def energy_of_errors(
    system: System, t: Array, y: Array, values: Array, policy: Policy, asked: float
) -> float:
    """The change of the energy, J, by errors that are a large multiple of the tolerance."""
    count = len(t)
    some = np.unique(np.linspace(0, len(t) - 1, MOST_STEPS).astype(int))
    scale = system.scale(_first(values))
    size = np.maximum(scale, np.abs(y).max(axis=0))
    t, y = t[some], y[some]
    values = values if values.ndim == 1 else values[some]
    speeds = slice(len(system.coordinates), None)
    reached = np.sqrt(np.abs(system.rates(y, values, t)).max(axis=0) * scale)
    size[speeds] = np.maximum(np.abs(y).max(axis=0), reached)[speeds]
    moved = np.diag(asked * size if policy.atol is None else asked * size + policy.atol)
    energy = system.energy(y, values, t)
    p = values if values.ndim == 1 else values[:, None]
    changed = system.energy(y[:, None] + moved, p, np.repeat(t[:, None], len(moved), axis=1))
    far = FAR * max(1.0, count / MANY)
    return far * float(np.abs(changed - energy[:, None]).max(axis=0).sum())


def imbalance(system: System, record: Record) -> float:
    """The energy that the work does not explain, J: the larger of what is missing in some steps
    spread evenly, scaled up to all, and in those whose energies change unlike their neighbours'."""
    t, y = record.states()
    steps = np.flatnonzero(np.diff(t))  # resets are none
    begin, end = t[steps], t[steps + 1]
    gained = np.diff(system.energy(y, record.params_along(t), t))[steps]
    count, most = len(gained), min(MOST_STEPS, len(gained))
    even = np.unique(np.linspace(0, count - 1, most).astype(int))
    neighbours = np.convolve(np.pad(gained, 1, mode="edge"), [0.5, 0.0, 0.5], mode="valid")
    odd = np.sort(np.argsort(np.abs(gained - neighbours))[-most:])
    chosen = np.concatenate([even, odd])
    missing = gained[chosen] - integral(system, record, begin[chosen], end[chosen])
    spread = np.abs(np.cumsum(missing[: len(even)])).max() * count / len(even)
    return float(max(spread, np.abs(np.cumsum(missing[len(even) :])).max()))
