"""Sweeps: what varies, how it is sampled, and the resulting batch.

A variation is ``NAME=LOW:HIGH[:COUNT]``; each number may have a unit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mechc.assembly.initial_values import Assembly, filled_start
from mechc.batch.reductions import Reduction, read_reduction
from mechc.batch.results import Batch
from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.system.description import Description
from mechc.system.parameters import Array, one_double
from mechc.system.quantity import NamedQuantity, shown_in
from mechc.system.system import System
from mechc.system.units import in_si, split_assignment

SAMPLINGS = ("grid", "random", "sobol", "lhs")
MOST = 100_000_000
DRAWN = 1024  # members where no count is given


@dataclass(frozen=True)
class Variation:
    """A coordinate, speed or parameter from ``low`` to ``high``; ``count`` values in a grid."""

    name: str
    low: float
    high: float
    count: int | None


@dataclass(frozen=True)
class Plan:
    """The members of a sweep: how many, and the shape of the grid if it is one."""

    variations: tuple[Variation, ...]
    count: int
    shape: tuple[int, ...] | None
    sampling: str
    seed: int

    def __len__(self) -> int:
        return self.count

    @cached_property
    def columns(self) -> Mapping[str, Array]:
        """Values (n,) of what varies, by name; made when they are first asked for."""
        if self.shape is None:
            points = drawn_points(self.sampling, len(self.variations), self.count, self.seed)
            return {
                v.name: v.low + (v.high - v.low) * points[:, i]
                for i, v in enumerate(self.variations)
            }
        axes = [
            np.linspace(v.low, v.high, n) for v, n in zip(self.variations, self.shape, strict=True)
        ]
        grids = np.meshgrid(*axes, indexing="ij")
        return {v.name: grid.reshape(-1) for v, grid in zip(self.variations, grids, strict=True)}


def read_variation(model: Description, text: str) -> Variation:
    """Parse ``l_3=3.4:4.6:1001``.

    Raises :class:`MechcError`, :class:`UnknownNameError` if it is not of that form, or the model
    has no such name.
    """
    name, values = split_assignment(text)
    parts = values.split(":")
    if len(parts) not in (2, 3):
        raise MechcError(f"{text!r} should read NAME=LOW:HIGH:COUNT, for instance l_3=3.4:4.6:101")
    return variation(model, name, parts)


def variation(model: Description, name: str, given: Any) -> Variation:
    """A variation from ``(low, high)`` or ``(low, high, count)``, numbers or texts with units.

    Raises :class:`MechcError`, :class:`UnknownNameError` as :func:`read_variation`.
    """
    if name not in model.quantities:
        raise UnknownNameError("coordinate, speed or parameter", name, model.quantities)
    if not isinstance(given, (tuple, list)) or len(given) not in (2, 3):
        raise ValueOutOfBoundsError(
            f"{name} varies over (low, high) or, in a grid, (low, high, count), not {brief(given)}"
        )
    low, high = (
        one_double(in_si(end, model.quantities[name]), f"an end of {name}") for end in given[:2]
    )
    count = _checked_count(name, given[2]) if len(given) == 3 else None
    if not (math.isfinite(low) and math.isfinite(high)):
        raise MechcError(f"{name}: {low} and {high} must be finite")
    if name in model.parameters:
        model.quantities[name].check(np.array([low, high]))
    return Variation(name, low, high, count)


def _checked_count(name: str, given: Any) -> int:
    try:
        count = int(given)
    except (TypeError, ValueError, OverflowError):
        count = 0
    if not 1 <= count <= MOST:
        raise MechcError(f"{name}: {given!r} is not a count of values")
    return count


def plan(
    variations: Sequence[Variation], sampling: str = "grid", count: int | None = None, seed: int = 0
) -> Plan:
    """The plan of a sweep: every combination, or ``count`` members drawn over the ranges.

    Raises :class:`MechcError`, :class:`UnknownNameError` if a count is missing or out of place, a
    name is varied twice, or the sampling unknown.

    Parameters
    ----------
    sampling
        ``"grid"``, ``"random"``, ``"sobol"`` (scrambled) or ``"lhs"`` (Latin hypercube).
    seed
        Of the random numbers: the same seed gives the same members.
    """
    names = [variation.name for variation in variations]
    if not names:
        raise MechcError("nothing varies: give a name and its range, as l_3=3.4:4.6:101")
    if len(set(names)) < len(names):
        raise MechcError(f"{next(n for n in names if names.count(n) > 1)} varies twice")
    if sampling not in SAMPLINGS:
        raise UnknownNameError("sampling", sampling, SAMPLINGS)
    chosen = tuple(variations)
    if sampling == "grid":
        return _grid(chosen, count, seed)
    return _drawn(chosen, sampling, DRAWN if count is None else count, seed)


def _grid(variations: tuple[Variation, ...], count: int | None, seed: int) -> Plan:
    if count is not None:
        raise MechcError("a grid takes its counts from the ranges: omit the count")
    for each in variations:
        if each.count is None:
            raise MechcError(f"{each.name}: a grid needs a count, as in {each.name}=LOW:HIGH:101")
    shape = tuple(each.count or 1 for each in variations)
    if math.prod(shape) > MOST:
        raise MechcError(f"{math.prod(shape)} members are too many; {MOST} at most")
    return Plan(variations, math.prod(shape), shape, "grid", seed)


def _drawn(variations: tuple[Variation, ...], sampling: str, count: int, seed: int) -> Plan:
    for each in variations:
        if each.count is not None:
            raise MechcError(f"{each.name}: only a grid has counts there; give one count of all")
    if not 1 <= count <= MOST:
        raise MechcError(f"a count of {count} must be between 1 and {MOST}")
    return Plan(variations, count, None, sampling, seed)


def drawn_points(sampling: str, size: int, count: int, seed: int) -> Array:
    """Points (count, size) in the unit cube."""
    generator = np.random.default_rng(seed)
    if sampling == "random":
        return generator.random((count, size))
    from scipy.stats import qmc

    if sampling == "lhs":
        return np.asarray(qmc.LatinHypercube(size, rng=generator).random(count))
    # balanced in powers of two; the surplus is dropped
    whole = qmc.Sobol(size, rng=generator).random_base2(math.ceil(math.log2(count)))
    return np.asarray(whole[:count])


def members(
    system: System,
    chosen: Plan,
    params: Mapping[str, float],
    start: Mapping[str, float],
    guess: Mapping[str, float],
) -> tuple[Assembly, dict[str, Any]]:
    """Starts and parameters of a plan's members: what varies, and what is the same for all.

    Raises :class:`MechcError` if something both varies and is fixed.
    """
    for name in chosen.columns:
        if name in params or name in start or name in guess:
            raise MechcError(f"{name} both varies and is fixed; omit one of them")
    given = {**start, **{n: c for n, c in chosen.columns.items() if n not in system.parameters}}
    varied = {n: c for n, c in chosen.columns.items() if n in system.parameters}
    return Assembly(*filled_start(system, *system.coordinates_and_speeds(given), guess)), {
        **params,
        **varied,
    }


def sweep_json(batch: Batch, chosen: Plan, seconds: float) -> dict[str, Any]:
    """The output of ``mechc sweep --json``, in SI units."""
    return {
        "mechanism": batch.system.name,
        "members": len(batch),
        "sampling": chosen.sampling,
        "seed": chosen.seed,
        "shape": None if chosen.shape is None else list(chosen.shape),
        "vary": {v.name: [v.low, v.high] for v in chosen.variations},
        "t_end": batch.recipe.span[1],
        "rtol": batch.recipe.policy.rtol,
        "method": batch.recipe.policy.method_of_users,
        "outcomes": batch.counts,
        "change_point_members": int(np.count_nonzero(batch["change_points"])),
        "reductions": {text: _extremes(batch, text) for text in batch.recipe.reductions},
        "complete": batch.complete,
        "wall_s": seconds,
        "members_per_s": len(batch) / seconds if seconds > 0 else None,
    }


def _extremes(batch: Batch, text: str) -> dict[str, Any]:
    """Least, mean and largest over the members that reached the end, and where."""
    values = np.where(batch.ok, batch[text], np.nan)
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return {"members": 0}
    low, high = known[np.argmin(values[known])], known[np.argmax(values[known])]
    return {
        "members": len(known),
        "min": float(values[low]),
        "mean": float(values[known].mean()),
        "max": float(values[high]),
        "min_at": {name: float(c[low]) for name, c in batch.recipe.varying_columns().items()},
        "max_at": {name: float(c[high]) for name, c in batch.recipe.varying_columns().items()},
    }


def sweep_summary(batch: Batch, chosen: Plan, seconds: float) -> str:
    """The output of ``mechc sweep`` for people."""
    told = sweep_json(batch, chosen, seconds)
    shape = " x ".join(map(str, chosen.shape)) if chosen.shape else chosen.sampling
    lines = [f"{len(batch)} members ({shape}) in {seconds:.3g} s, {told['members_per_s']:,.0f}/s"]
    lines += [f"  {what:22} {count}" for what, count in batch.counts.items()]
    if told["change_point_members"]:
        lines.append(f"  {'crossed change points':22} {told['change_point_members']}")
    for text, found in told["reductions"].items():
        if found["members"]:
            reduction = read_reduction(batch.system, text)
            low, high = (_as_read(found[end], reduction) for end in ("min", "max"))
            lines.append(f"{text}: {low} ... {high}")
            lines += [f"  largest at {_where(batch.system, found['max_at'])}"]
            lines += [f"  least at   {_where(batch.system, found['min_at'])}"]
        else:
            lines.append(f"{text}: no member has it")
    return "\n".join(lines)


def _where(system: System, place: Mapping[str, float]) -> str:
    return ", ".join(
        f"{name} = {_as_read(value, system.quantities[name])}" for name, value in place.items()
    )


def _as_read(value: float, meaning: NamedQuantity | Reduction) -> str:
    """A number with its unit; angles in degrees."""
    shown, factor = shown_in(meaning.kind, meaning.unit)
    gap = "" if shown.startswith("°") else " "
    return f"{value * factor:.6g}{gap}{shown}".rstrip()
