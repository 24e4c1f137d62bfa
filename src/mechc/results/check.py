"""What a reviewer would do with a motion: it is computed again, and its equations are judged.

Input: a solution with dense output.  Output: a :class:`Check`.  Invariant: nothing of the solution
changes.
"""

from __future__ import annotations

import platform
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from mechc.errors import MechcError
from mechc.simulation.settings import MOST_STEPS, TIGHTEST
from mechc.simulation.simulate import run
from mechc.simulation.trajectory import Trajectory
from mechc.system.judged import Judged
from mechc.system.parameters import Array

STRICTER = 0.01  # of rtol and atol, for the motion again
TIGHT = 1e-13  # the least rtol of it: a tighter one is below the rounding of a step
STATES = 40  # at which the equations are judged
STEP = 0.05  # of a step of the run: the differences by which they are
ROUNDING = 16 * np.finfo(float).eps  # of a state, in a difference
ALIKE = 1e-6  # of the largest acceleration: rates that differ by more are not those of the scene
MANY = 1000.0  # times the tolerance: an error that the tolerance does not explain
EXPLICIT = ("dopri5", "dop853")
Judge = Callable[..., list[Judged]]


@dataclass(frozen=True)
class Passages:
    """How often a motion passed something, how often the other did, and how far apart in s."""

    what: str
    count: int
    again: int
    apart: float


@dataclass(frozen=True)
class Check:
    """How far a motion is to be trusted; ``print`` shows it as a table.

    Attributes
    ----------
    names, units
        Of the components of a state.
    error, error_at_end : (nq + nu,)
        Estimates of the error: the largest difference from the motion by another method at a
        hundredth of the tolerances, and that at the end with its sign.  Times between an event and
        the same one of the other motion are left out.
    method, rtol
        Of the motion.
    others
        Method and rtol of the other motions: the first is the one that errors are estimated by,
        the last one is by another method than this motion.
    closure, velocity_closure
        Largest gaps of the constraints along the dense output, and their rates.
    energy
        The energy that the work does not explain, over the largest kinetic energy; None where it
        is not known.
    rates
        Largest difference of y' from what the description's kinematics and Newton's and Euler's
        equations give for its bodies, joints and loads, evaluated with numbers alone, over the
        largest rate of the same unit; None: not compared, see ``notes``.
    states
        The number of states at which they were compared.
    passages
        Of change points and of events, in this motion and in the one by another method.
    warnings
        What is wrong, or may be; empty if nothing was found.
    notes
        What was not checked, and why.
    recipe
        Versions, key of the compiled scene, options.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    error: tuple[float, ...]
    error_at_end: tuple[float, ...]
    method: str
    rtol: float
    others: tuple[tuple[str, float], ...]
    closure: float
    velocity_closure: float
    energy: float | None
    rates: float | None
    states: int
    passages: tuple[Passages, ...]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    recipe: dict[str, Any]

    @property
    def ok(self) -> bool:
        """Whether nothing was found that is wrong or may be."""
        return not self.warnings

    def to_dict(self) -> dict[str, Any]:
        """All of it as data for JSON."""
        return asdict(self)

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        errors = zip(self.names, self.units, self.error, self.error_at_end, strict=True)
        found = []
        for name, unit, most, end in errors:
            both = (f"{value:.1e} {unit}".rstrip() for value in (most, end))
            found.append((f"error of {name}", ", at the end ".join(both)))
        others = " and ".join(f"{method} at rtol {rtol:g}" for method, rtol in self.others)
        found.append(("by", f"{others}; the motion: {self.method} at rtol {self.rtol:g}"))
        found += [(p.what, f"{p.count}, by {self.others[-1][0]} {p.again}, times alike to "
                   f"{p.apart:.1e} s") for p in self.passages]  # fmt: skip
        found.append(("closure", f"{self.closure:.1e}, rates {self.velocity_closure:.1e}"))
        if self.energy is not None:
            found.append(("energy balance", f"{self.energy:.1e} of the largest kinetic energy"))
        if self.rates is not None:
            told = f"rates alike to {self.rates:.1e} at {self.states} states"
            found.append(("Newton and Euler", told))
        found += [("not checked", note) for note in self.notes]
        found += [("made by", ", ".join(f"{k} {v}" for k, v in self.recipe.items()))]
        return found + ([("WARNING", each) for each in self.warnings] or [("result", self._sound)])

    @property
    def _sound(self) -> str:
        left = ", ".join(note.partition(":")[0] for note in self.notes)
        return f"sound as far as checked; not checked: {left}" if left else "sound"

    def __str__(self) -> str:
        rows = self.rows()
        width = max(len(label) for label, _ in rows)
        return "\n".join(f"{label.ljust(width)}  {value}" for label, value in rows)

    def __repr__(self) -> str:
        return f"<mechc.Check: {self._sound if self.ok else '; '.join(self.warnings)}>"

    def _repr_html_(self) -> str:
        from mechc.results.summary import html_table

        return html_table(("", ""), self.rows())


def check(sol: Trajectory, judge: Judge) -> Check:
    """See :meth:`mechc.Solution.check`; ``judge`` compares rates with the description's."""
    if not sol.policy.dense:
        raise MechcError("this run kept no dense output: simulate with dense=True")
    if sol.events and sol._run_events is None:
        raise MechcError("a file has the times of events, not the events themselves")
    if sol.joined:
        raise MechcError("this motion was joined of several runs: check each of them")
    system, warnings, notes = sol.system, list[str](), list[str]()
    if not sol.status.ok:
        warnings.append(f"the motion ended early ({sol.status.headline})")
    others = [_again(sol, method) for method in _methods(sol)]
    for other in others:
        if sol.status.ok and other.status.code != sol.status.code:
            warnings.append(f"the motion by {other.method} ends otherwise: {other.status}")
    passages = _passages(sol, others[-1])
    warnings += [f"{each.what}: {each.count}, in the motion by {others[-1].method} {each.again}"
                 for each in passages if each.count != each.again]  # fmt: skip
    times = _times(sol)
    found = [_errors(sol, other, times) for other in others]
    size = np.maximum(system.scale(sol.params), np.abs(sol.record.states()[1]).max(axis=0))
    relative, *apart = (float((most / size).max(initial=0.0)) for most, _ in found)
    if relative > MANY * sol.policy.rtol:
        since = _departure(sol, others[0], times, MANY * sol.policy.rtol * size)
        jumps = "".join(f", or {name} jumps there, which a mechc.Signal can tell mechc"
                        for name in _functions(sol))  # fmt: skip
        warnings.append(
            f"the error is {relative:.1e} of the motion's size, {relative / sol.policy.rtol:.0f} "
            f"times rtol, and large from t = {since:.6g} s on: errors grow along this motion, or "
            f"one of the motions is wrong{jumps}"
        )
    elif max(apart, default=0.0) > MANY * sol.policy.rtol:
        warnings.append(
            f"the motion by {others[-1].method} differs by {max(apart):.1e} of the motion's size "
            "from both that agree: its errors grow, or these two are wrong together"
        )
    if others[0].policy.rtol > STRICTER * sol.policy.rtol:
        notes.append("errors below some 1e-13 of the motion's size: all motions have roundings")
    states, p = sol(times), sol.values_along(times)
    drift = sol.energy_drift
    if drift != drift:
        notes.append("the energy, which is not known")
    elif drift > _energy_of_errors(sol):
        warnings.append(f"the energy is off by {drift:.1e} of the largest kinetic energy")
    rates, count = _rates(sol, judge, warnings, notes)
    names = (*system.coordinates, *system.speeds)
    return Check(
        names=names,
        units=tuple(system.units[name] for name in names),
        error=tuple(found[0][0].tolist()),
        error_at_end=tuple(found[0][1].tolist()),
        method=sol.method,
        rtol=sol.policy.rtol,
        others=tuple((other.method, other.policy.rtol) for other in others),
        closure=_largest(system.constraints(states, p, times)),
        velocity_closure=_largest(system.velocity_constraints(states, p, times)),
        energy=None if drift != drift else drift,
        rates=rates,
        states=count,
        passages=passages,
        warnings=tuple(warnings),
        notes=tuple(notes),
        recipe=_recipe(sol),
    )


def _methods(sol: Trajectory) -> tuple[str, ...]:
    """The methods of the other motions: the most exact one; another where this motion has that."""
    own = sol.method.split()[0]
    smooth = sol.system.data.get("smooth", True) and not _functions(sol)
    best, other = ("gauss8", "dop853") if own == "radau5" or smooth else ("dop853", "dopri5")
    if own != best:
        return (best,)
    return (best, other) if sol.policy.rtol > TIGHT else (other,)  # itself again tells nothing


def _functions(sol: Trajectory) -> tuple[str, ...]:
    """Inputs that are functions of Python."""
    driven = sol.system.driven
    return () if driven is None else driven.functions


def _again(sol: Trajectory, method: str) -> Trajectory:
    """The motion at stricter tolerances."""
    policy, system = sol.policy, sol.system
    stricter = policy._replace(
        rtol=max(STRICTER * policy.rtol, min(TIGHT, policy.rtol)), method=method, first_step=0.0,
        atol=None if policy.atol is None else STRICTER * policy.atol, lockstep=False,
        stiff_switch=method in EXPLICIT, limits=None, checkpoints=None,
        max_steps=max(policy.max_steps, MOST_STEPS),
    )  # fmt: skip
    state = sol.record.ends()[1][0]
    return run(Trajectory, system, sol.span, state, sol.params, stricter, None, sol._run_events)


def _times(sol: Trajectory) -> Array:
    """Accepted times and the middles between them."""
    t = np.unique(sol.record.times())
    return np.union1d(t, (t[1:] + t[:-1]) / 2)


def _compared(sol: Trajectory, other: Trajectory, times: Array) -> Array:
    """Of these times those that both motions reach, without those between an event in one and the
    same in the other, where states may jump."""
    low, high = sorted(other.span)
    kept = (times >= low) & (times <= high)
    for one, two in zip(sol.events, other.events, strict=True):
        for a, b in zip(one.t, two.t, strict=False):
            kept &= (times < min(a, b)) | (times > max(a, b))
    found: Array = times[kept]
    return found


def _errors(sol: Trajectory, other: Trajectory, times: Array) -> tuple[Array, Array]:
    """The largest difference of each component, and the one at the end with its sign."""
    times = _compared(sol, other, times)
    apart = np.abs(sol(times) - other(times))
    ends = [each.record.ends()[1][1] for each in (sol, other)]
    if other.status.code != sol.status.code:  # it ends at another time
        at = min(sol.span[1], other.span[1], key=lambda t: abs(t - sol.span[0]))
        ends = [sol(at), other(at)]
    end = ends[0] - ends[1]
    return np.maximum(apart.max(axis=0, initial=0.0), np.abs(end)), end


def _departure(sol: Trajectory, other: Trajectory, times: Array, allowed: Array) -> float:
    """The first time from which on the motions differ by more than is allowed."""
    times = _compared(sol, other, times)
    off = (np.abs(sol(times) - other(times)) > allowed).any(axis=1)
    along = times[off] if sol.span[1] >= sol.span[0] else times[off][::-1]
    return float(along[0]) if len(along) else float(other.span[1])


def _passages(sol: Trajectory, other: Trajectory) -> tuple[Passages, ...]:
    """Change points and zeros of events in both motions, where there are any."""
    first, second = (np.array([c.t for c in each.change_points]) for each in (sol, other))
    kinds = [("change points", first, second)]
    pairs = zip(sol.event_titles, sol.events, other.events, strict=True)
    kinds += [(f"zeros of {title}", one.t, two.t) for title, one, two in pairs]
    found = []
    for what, one, two in kinds:
        count = min(len(one), len(two))
        apart = float(np.abs(one[:count] - two[:count]).max(initial=0.0))
        found.append(Passages(what, len(one), len(two), apart))
    return tuple(each for each in found if each.count or each.again)


def _energy_of_errors(sol: Trajectory) -> float:
    """The energy drift, over the largest kinetic energy, that tolerance and rounding explain."""
    t, y = sol.record.states()
    p, system = sol.values_along(t), sol.system.with_output("energy")
    values = system.values_of(sol.system, p)
    kinetic, potential = (f(y, values, t) for f in (system.kinetic_energy, system.potential_energy))
    most = float(kinetic.max(initial=0.0))
    exchanged = max(most, float(np.ptp(potential)))
    rounding = ROUNDING * (most + float(np.abs(potential).max())) * np.sqrt(len(t))
    return float((MANY * max(sol.policy.rtol, TIGHTEST) * exchanged + rounding) / (most or 1.0))


def _rates(
    sol: Trajectory, judge: Judge, warnings: list[str], notes: list[str]
) -> tuple[float | None, int]:
    """The largest relative difference of the rates, and the number of states judged."""
    t = np.unique(sol.record.times())
    if len(t) < 2:
        notes.append("the equations of motion: the motion has no step")
        return None, 0
    steps = np.unique(np.linspace(0, len(t) - 2, STATES).astype(int))
    times, h = (t[steps] + t[steps + 1]) / 2, STEP * (t[steps + 1] - t[steps])
    y, system = sol(times), sol.system
    p = np.broadcast_to(sol.values_along(times), (len(times), len(sol.params)))
    try:
        wide, narrow = judge(times, y, p, (h, h / 4), sol.record.contact_forces(times, y))
    except MechcError as error:
        notes.append(f"the equations of motion: {error}")
        return None, 0
    count = len(system.coordinates)
    scale = _scale(system, wide)
    lacks = [np.hstack([each.kinematics, np.abs(each.accelerations)]) for each in (wide, narrow)]
    size = np.maximum(system.scale(p[0]), np.abs(y).max(axis=0)).max()
    unsure = np.abs(lacks[0] - lacks[1])  # what differences do not tell
    unsure[:, count:] += (ROUNDING * size / (h / 4) * (1 + 1 / (h / 4)))[:, None]
    off = np.minimum(*lacks) / scale
    sure = ((off <= ALIKE) | (unsure / scale < off / 10)).all(axis=1)
    clear = np.logical_and.reduce([wide.clear, narrow.clear, sure])
    judged = int(clear.sum())
    if judged < len(times):
        notes.append(f"the equations at {len(times) - judged} of {len(times)} states: near a "
                     "singular configuration, or in steps too short for differences")  # fmt: skip
    if not judged:
        return None, 0
    off = np.where(clear[:, None], off, 0.0)
    state, worst = np.unravel_index(int(off.argmax()), off.shape)
    if off[state, worst] > ALIKE:
        name = (*system.coordinates, *system.speeds)[worst]
        warnings.append(
            f"at t = {times[state]:.6g} s the rate of {name} is not that of the description: they "
            f"differ by {lacks[1][state, worst]:.3g} {system.units[name]}/s, "
            f"{off[state, worst]:.1e} of the largest"
        )
    return float(off.max(initial=0.0)), judged


def _scale(system: Any, found: Judged) -> Array:
    """The largest rate of the components that have the unit of each (nq + nu,)."""
    count = len(system.coordinates)
    largest = np.abs(found.rates).max(axis=0)
    largest[count:] = np.maximum(largest[count:], found.felt.max(axis=0))
    units = [system.units[name] for name in (*system.coordinates, *system.speeds)]
    alike = [[a == b and (i < count) == (j < count) for j, b in enumerate(units)]
             for i, a in enumerate(units)]  # fmt: skip
    scale = np.array([largest[row].max() for row in np.array(alike)])
    scale[scale == 0] = 1.0
    return scale


def _largest(residuals: Array) -> float:
    return float(np.abs(residuals).max(initial=0.0))


def _recipe(sol: Trajectory) -> dict[str, Any]:
    key = sol.system.reference.binary_identity
    return {
        "mechc": version("mechc"), "numpy": np.__version__, "python": platform.python_version(),
        "scene": key[:16], "instruction set": sol.system.instruction_set,
    }  # fmt: skip
