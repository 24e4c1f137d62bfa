"""The doors: ways that lead to a scene's numbers, each beside another."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from mechc.native import _codes

from ..judge import Case, Told
from . import derivatives, exported, motions, rates

Door = Callable[[Case], Iterator[Told]]
DOORS: dict[str, tuple[float, Door]] = {  # with the share of cases that each is tried on
    "rhs": (1.0, rates.rates),
    "rhs of many states": (0.3, rates.many),
    "mass matrix and forcing": (0.5, rates.matrices),
    "SciPy": (1.0, motions.in_python),
    "ends": (1.0, motions.ends),
    "auto": (1.0, motions.single("auto")),
    "batch auto": (1.0, motions.batch("auto")),
    **{method: (0.6, motions.single(method)) for method in motions.METHODS},
    **{f"batch {method}": (0.4, motions.batch(method)) for method in motions.METHODS},
    "dense output": (0.5, motions.between_steps),
    "back in time": (0.4, motions.back),
    "stepper": (0.5, motions.stepped),
    "saved and opened": (0.2, motions.saved),
    "linearize": (0.25, derivatives.linear),
    "sensitivities": (0.25, derivatives.of_motions),
    "exported C": (0.15, exported.as_c),
}
assert set(motions.METHODS) <= set(_codes.METHODS)
