"""The verbs of a model that close its loops: one state, or all of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from mechc.assembly import positions
from mechc.assembly.initial_values import (
    checked_numbers,
    closed_freedoms,
    filled_start,
    guess_of_start,
)
from mechc.errors import AssemblyError, UnknownNameError
from mechc.system.names import by_name
from mechc.system.parameters import Array, Parameters, one_double
from mechc.system.units import SECONDS

if TYPE_CHECKING:
    from mechc.outputs import Outputs

ONE_SET = "takes one set of parameters at a time"


def assemble(
    model: Outputs,
    coordinates: Mapping[str, float] | None = None,
    speeds: Mapping[str, float] | None = None,
    guess: Mapping[str, float] | None = None,
    params: Parameters = None,
    t: float = 0.0,
) -> Array:
    """One state that closes the loops to rounding.

    Parameters
    ----------
    coordinates
        Values to keep (rad, m); the other coordinates are solved for, as angles in (-pi, pi].
        By default those of the mechanism's start (``model.start``), with its speeds too as far
        as there are degrees of freedom besides ``speeds``.
    speeds
        Values to keep (rad/s, m/s); the others are made consistent, the least ones where the
        constraints leave a choice.
    guess
        Some coordinates near the configuration wanted; of several assemblies the nearest is
        taken, with angles within half a turn of the guess.  By default the mechanism's
        preferred one (the elbow-up configuration of a planar loop), or the one nearest to the
        start where none is preferred.  At a change point also some speeds, near those of the
        branch wanted.  Of a collapsed sheet, where the mechanism is folded onto itself and has
        more freedoms, a configuration is taken only if there is no other, with a
        :class:`CollapsedSheetWarning`, or if all coordinates are given or guessed.
    params
        As in every output of the model; those that stand in no constraint need no value.
    t
        The time in s, for constraints that depend on it.

    Returns
    -------
    y0 : (nq + nu,)

    Raises
    ------
    AssemblyError
        If nothing is found that closes the loops (with the least gap met), if the coordinates
        given do not determine the others and there is no guess, if the speeds contradict each
        other, or if the configuration is a change point and the speeds are possible on several
        branches.
    """
    given, pace, near = checked_names(model, coordinates, speeds, guess)
    if coordinates is None:
        given, pace, near = filled_start(model.system, {}, pace, near)
    elif guess is None and len(given) >= closed_freedoms(model.system, given):
        near = guess_of_start(model.system, given)
    given, pace = _checked_start(model, given, pace)
    near = checked_numbers(model, near, (*model.coordinates, *model.speeds), "coordinate")
    if both := sorted(set(near) & set(given)):
        raise AssemblyError(f"{both[0]} is both given and guessed; omit it in one of them")
    p = model._one_set_for_closing(params, f"assembly {ONE_SET}")
    return positions.assemble(
        model.system, given, pace, near, p, one_double(t, "the time", SECONDS)
    )


def assemblies(
    model: Outputs,
    coordinates: Mapping[str, float],
    speeds: Mapping[str, float] | None = None,
    params: Parameters = None,
    t: float = 0.0,
) -> Array:
    """The states (n, nq + nu) that close the loops with the coordinates given.

    The mechanism's preferred assembly comes first; at a change point there is one state for
    every branch on which the speeds are possible.  Configurations of a collapsed sheet, which
    are points of a continuum, are left out unless there are no others, with a
    :class:`CollapsedSheetWarning`.  Arguments and errors as in :meth:`assemble`.
    """
    given, pace, _ = checked_names(model, coordinates, speeds, None)
    given, pace = _checked_start(model, given, pace)
    p = model._one_set_for_closing(params, f"assembly {ONE_SET}")
    return positions.assemblies(model.system, given, pace, p, one_double(t, "the time", SECONDS))


def checked_names(model: Outputs, *given: Mapping[str, float] | None) -> list[Mapping[str, float]]:
    """Coordinates, speeds and guesses by name, each empty where there are none."""
    names = (model.coordinates, model.speeds, model.coordinates)
    examples = [f"{{{known[0]!r}: 0.5}}" if known else "{}" for known in names]
    kinds = ("coordinates", "speeds", "guesses")
    named: list[Mapping[str, float]] = [
        {} if values is None else by_name(values, kind, example)
        for values, kind, example in zip(given, kinds, examples, strict=True)
    ]
    for argument, values in zip(("coordinates", "speeds", "guess"), named, strict=True):
        _refuse_elsewhere(model, argument, values)
    return named


def _refuse_elsewhere(model: Outputs, argument: str, values: Mapping[str, float]) -> None:
    """Names that belong to another argument: the error says which."""
    homes = {"coordinates": model.coordinates, "speeds": model.speeds, "params": model.parameters}
    known = homes.get(argument, (*model.coordinates, *model.speeds))
    for name in values:
        for home, names in homes.items():
            if name not in known and name in names:
                raise UnknownNameError.misplaced(name, argument, home, values[name])


def _checked_start(
    model: Outputs, coordinates: Mapping[str, float], speeds: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, float]]:
    return (
        checked_numbers(model, coordinates, model.coordinates, "coordinate"),
        checked_numbers(model, speeds, model.speeds, "speed"),
    )
