"""What tolerances do to results of a motion: the nominal motion with derivatives, and a batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechc.assembly.initial_values import checked_numbers
from mechc.batch.reductions import Reduction, read_reduction
from mechc.batch.simulate import reduction_texts
from mechc.batch.spec import system_for_results
from mechc.batch.sweeps.sweep import drawn_points
from mechc.batch.tolerances.result import DISTRIBUTIONS, Tolerances
from mechc.batch.tolerances.slopes import slopes_of_reduction
from mechc.errors import MechcError, ValueOutOfBoundsError
from mechc.questions.motion import Arguments, MotionFunction, params_by_name
from mechc.questions.unknowns import kinds_of, named_free, read_unknown
from mechc.simulation.settings import checked_count, checked_positive, checked_span
from mechc.system.names import by_name
from mechc.system.parameters import Array
from mechc.system.system import System
from mechc.system.units import in_si


def tolerances(
    model: Any, given: Any, of: Any, span: Any, y0: Any, params: Any, *, guess: Any,
    inputs: Any, count: int, distribution: str, seed: int, policy: Mapping[str, Any],
) -> Tolerances:  # fmt: skip
    """See :meth:`mechc.Model.tolerances`."""
    if distribution not in DISTRIBUTIONS:
        raise ValueOutOfBoundsError(
            f"distribution = {distribution!r} is one of {', '.join(map(repr, DISTRIBUTIONS))}"
        )
    texts = reduction_texts(of)
    if not texts:
        raise ValueOutOfBoundsError("of which results? Give of=['max(theta_2)']")
    motion, widths = _question(model, given, texts, y0, params, guess, inputs, policy)
    span = checked_span(span)
    names = [one.name for one in motion.unknowns]
    x = np.array([one.first for one in motion.unknowns])
    drawn = DISTRIBUTIONS[distribution].of_unit(
        drawn_points("random", len(x), checked_count("count", count), seed)
    )
    points = np.vstack([x, x + widths * drawn])
    nominal = motion.simulate(x, span)
    if not nominal.status.ok:
        raise MechcError(f"the nominal motion does not reach its end: {nominal.status}")
    batch = motion.batch(points, span, reduce=texts)
    reductions = [read_reduction(motion.model.system, text) for text in texts]
    slopes, notes = _slopes(motion, x, span, reductions, batch, names)
    return Tolerances(
        model, names, x, widths, reductions, slopes, batch, points, distribution, seed, notes
    )


def _question(
    model: Any, given: Any, texts: Sequence[str], y0: Any, params: Any, guess: Any, inputs: Any,
    policy: Mapping[str, Any],
) -> tuple[MotionFunction, Array]:  # fmt: skip
    """The motion as a function of what has tolerances, and these (k,)."""
    driven = by_name(inputs or {}, "inputs")
    asked = {one: in_si_of(model.system, one, value) for one, value in named_free(
        by_name(given, "tolerances", "{'l_1': '0.05 mm'}"), kinds_of(model.system, driven)
    ).items()}  # fmt: skip
    if not asked:
        raise ValueOutOfBoundsError("nothing has a tolerance: give {'l_1': '0.05 mm'}")
    system = system_for_results(model.system, (), texts, None, [*asked])
    values = params_by_name(system, params)
    near = checked_numbers(system, by_name(guess or {}, "guess"), system.coordinates, "coordinate")
    arguments = Arguments(values, _start(system, y0), driven, near)
    nominal = dict(zip(system.parameters, system.parameter_set.resolve(values), strict=True))
    kinds = kinds_of(system, driven)
    unknowns = [
        read_unknown(
            system, name, kinds[name], None, arguments.values_of(kinds[name]),
            default=nominal.get(name),
        )
        for name in asked
    ]  # fmt: skip
    wide = type(model).of_system(system)
    return MotionFunction(wide, unknowns, arguments, policy), np.array([*asked.values()])


def in_si_of(system: System, name: str, value: Any) -> float:
    """A tolerance in SI units, as a positive number."""
    quantity = system.quantities.get(name)
    number = value if quantity is None else in_si(value, quantity)
    return checked_positive(f"the tolerance of {name}", number)


def _start(system: System, y0: Any) -> dict[str, float] | None:
    """The start by names, so that it is assembled with each member's lengths."""
    if y0 is None:
        return None
    states = (*system.coordinates, *system.speeds)
    if isinstance(y0, Mapping):
        return checked_numbers(system, by_name(y0, "y0"), states, "coordinate or speed")
    if system.scene.rows or np.shape(y0) != (len(states),):
        raise ValueOutOfBoundsError(
            "y0 is a mapping of coordinates and speeds, {'theta_0': 1.0}: loops of other lengths "
            "close in other states"
        )
    return dict(zip(states, map(float, y0), strict=True))


def _slopes(
    motion: MotionFunction, x: Array, span: Any, reductions: Sequence[Reduction], batch: Any,
    names: Sequence[str],
) -> tuple[Array, list[str]]:  # fmt: skip
    """Derivatives (m, k) of the reductions; NaN where there is none, and why."""
    found, notes = np.full((len(reductions), len(names)), np.nan), []
    try:
        sol = motion.simulate(x, span, names)
    except MechcError as error:  # contacts that last: the nominal motion itself was computed
        return found, [f"no first order: {error}"]
    for row, one in zip(found, reductions, strict=True):
        try:
            row[:] = slopes_of_reduction(sol, one, float(batch[one.text][0]), names)
        except MechcError as error:
            notes.append(f"{one.text}: no first order, {error}")
    if np.isnan(found).any():
        notes += [f"no first order {note}" for note in sol.sensitivity.notes]
    return found, notes
