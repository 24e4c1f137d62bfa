"""The verb of a model that finds its parameters from what has to be done."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.assembly.initial_values import checked_numbers
from mechc.errors import AssemblyError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.progress import Notice
from mechc.simulation.settings import checked_count, checked_positive
from mechc.system.names import by_name, name_of
from mechc.system.parameters import Parameters, doubles, one_double
from mechc.system.quantities import outputs_in
from mechc.system.quantity import ANGULAR, Kind, NamedQuantity
from mechc.system.units import SECONDS, in_si

if TYPE_CHECKING:
    from mechc.outputs import Outputs
    from mechc.synthesis.conditions import Conditions
    from mechc.synthesis.designs import Designs
    from mechc.synthesis.targets import Targets


def synthesize(
    model: Outputs,
    targets: Mapping[Any, Any],
    free: Mapping[Any, Any],
    driven: Any = None,
    *,
    params: Parameters = None,
    coordinates: Mapping[Any, float] | None = None,
    tolerances: Mapping[Any, Any] | None = None,
    span: tuple[Any, Any] | None = None,
    turns: bool = False,
    one_assembly: bool = True,
    ordered: bool = True,
    transmission_angle: Sequence[Any] | None = None,
    box: Sequence[tuple[float, float]] | None = None,
    samples: int = 2048,
    refined: int = 24,
    most: int = 10,
    tol: float = 1e-10,
    seed: int = 0,
    t: float = 0.0,
    progress: Callable[[float, str], None] | None = None,
) -> Designs:
    """Parameters of linkages whose points, angles or bodies are where they have to be.

    ``model.synthesize({"C": points}, {"l_0": (0.1, 1), "x_C": (-1, 1)}, turns=True)``

    Parameters
    ----------
    targets
        What has which values at the positions: a point -> (n, 2) or (n, 3) in m, a coordinate
        or a user-defined output -> (n,).  NaN where nothing is asked for.  Values of the driven
        coordinate, where these are given (prescribed timing); else they are found.  A pose is a
        point and an angle, or several points of a body.
    free
        What is found, with its bounds ``(lower, upper)`` in SI units or with one: parameters;
        and coordinates of which the zero is found that their targets are counted from.
    driven
        The coordinate that drives the linkage; by default the first.
    params, coordinates
        Parameters and coordinates that have one value.
    tolerances
        Target -> the divisor of its deviations; by default the extent of its values, 1 rad.
    span
        The range of the driven coordinate in which the search for positions begins; by default
        a turn.
    turns
        The driven coordinate has to turn fully.
    one_assembly, ordered
        All positions have to lie on one assembly, with no change point between them, and be
        passed in their order.
    transmission_angle
        ``(before, joint, behind, least)``, or several such: three points and the least angle at
        the joint over the turn, or between the positions, as of
        :meth:`mechc.PositionSweep.transmission_angle`.
    box
        ``((x0, x1), (y0, y1))``, and z: where all points have to stay, m.
    samples, refined, most, seed
        How many linkages are drawn between the bounds, refined by least squares, and returned.
    tol
        When a refinement ends: SciPy's ``ftol = xtol = gtol``.
    t
        The time in s, for constraints that depend on it.
    progress
        Called now and then with the fraction done and a note.

    Returns
    -------
    Designs
        The best first; those that miss a condition come last, with a warning each.

    Raises
    ------
    AssemblyError
        If none of the linkages drawn closes at the positions, or the constraints do not
        determine a configuration.
    UnknownNameError, ValueOutOfBoundsError
        For names, bounds, units or shapes that there cannot be.
    UnavailableOutputError
        If the model cannot be compiled with sensitivities: its description is not at hand.

    Notes
    -----
    Linkages are drawn at random, closed and followed by compiled code.  All of them are then
    relaxed together (:mod:`mechc.synthesis.relaxed`): Levenberg and Marquardt's method in which
    loops may open.  The best are closed again and refined by ``scipy.optimize.least_squares``,
    with derivatives through the closed loops by the implicit function theorem.
    """
    from mechc.synthesis.designs import Designs
    from mechc.synthesis.problem import SynthesisProblem
    from mechc.synthesis.search import Effort, search
    from mechc.synthesis.targets import checked_targets

    began = time.perf_counter()
    asked = by_name(targets, "targets", "{'C': [(0.1, 0.2), (0.3, 0.1)]}")
    name = model.coordinates[0] if driven is None else name_of(driven)
    if name not in model.coordinates:
        raise UnknownNameError("coordinate", name, model.coordinates)
    system = model.system.differentiable("points", *outputs_in(asked))
    checked = checked_targets(
        system, asked, name, by_name(tolerances or {}, "tolerances", "{'C': 0.001}")
    )
    bounds = _bounds(system, checked, name, free)
    fixed = by_name({} if params is None else params, "params", "{'l_3': 1.0}")
    fixed = {k: float(system.parameter_set.values_of(k, v)) for k, v in fixed.items()}
    if both := sorted({*fixed} & {*bounds}):
        raise ValueOutOfBoundsError(f"{both[0]} is both free and given; omit it in one of them")
    given = by_name(coordinates or {}, "coordinates", "{'theta_1': 0.5}")
    kept = checked_numbers(model, given, model.coordinates, "coordinate")
    if name in kept:
        raise ValueOutOfBoundsError(f"{name} drives the linkage: omit it in coordinates")
    if turns and system.quantities[name].kind is not Kind.ANGLE:
        raise ValueOutOfBoundsError(f"turns=True needs a driven angle, and {name} is none")
    low, high = np.array([*bounds.values()]).T
    problem = SynthesisProblem(
        system, name, tuple(bounds), low, high, fixed, kept, checked,
        _conditions(system, checked, turns, one_assembly, ordered, transmission_angle, box),
        one_double(t, "the time", SECONDS),
    )  # fmt: skip
    settings = Effort(
        checked_count("samples", samples), checked_count("refined", refined),
        checked_count("most", most), checked_positive("tol", tol), seed,
        _span(system, checked, name, bounds, span),
    )  # fmt: skip
    with nullcontext() if progress else Notice(f"searching linkages of {model.name} ..."):
        drawn, found = search(problem, settings, progress or (lambda _, __: None))
    if not found:
        raise AssemblyError(
            f"none of {samples} linkages drawn closes at all positions: widen the bounds of "
            f"{', '.join(bounds)}, or the span of {name}, or draw more samples"
        )
    seconds = time.perf_counter() - began
    return Designs.of(model, problem, found, drawn.tried, len(drawn.z), seconds)


def _bounds(
    system: Any, targets: Targets, driven: str, free: Any
) -> dict[str, tuple[float, float]]:
    """Finite bounds of all that is free: parameters, and zeros of coordinates with targets."""
    from mechc.questions.unknowns import checked_bounds

    zeros = [one.name for one in targets.each if one.is_coordinate]
    zeros += [driven] if targets.driven is not None else []
    found = {}
    for name, ends in by_name(free, "free", "{'l_1': (0.1, 2.0)}").items():
        if name not in (*system.parameters, *zeros):
            known = (*system.parameters, *zeros)
            raise UnknownNameError("parameter, or coordinate with targets,", name, known)
        angle = name in zeros and system.quantities[name].kind is Kind.ANGLE
        turn = (-np.pi, np.pi) if angle and ends is None else ends
        found[name] = checked_bounds(system, name, turn)
        if not np.isfinite(found[name]).all():
            raise ValueOutOfBoundsError(f"{name} is free: give both its bounds, not {ends}")
    if not found:
        raise ValueOutOfBoundsError("nothing is free: give free={'l_1': (0.1, 2.0)}")
    return found


def _conditions(
    system: Any, targets: Targets, turns: bool, one_assembly: bool, ordered: bool,
    transmission_angle: Any, box: Any,
) -> Conditions:  # fmt: skip
    from mechc.synthesis.conditions import Conditions

    walls, every = None, [] if transmission_angle is None else list(transmission_angle)
    if every and not isinstance(every[0], (list, tuple)):
        every = [every]
    joints = tuple(_joint(system, one) for one in every)
    if box is not None:
        walls = doubles(box, "the box").T
        shaped = walls.ndim == 2 and walls.shape[0] == 2 and walls.shape[1] <= 3
        if not (shaped and (walls[0] < walls[1]).all()):
            raise ValueOutOfBoundsError(f"box is ((x0, x1), (y0, y1)), not {brief(box)}")
    size = max((one.tolerance for one in targets.each if one.kind is Kind.LENGTH), default=1.0)
    return Conditions(bool(turns), bool(one_assembly), bool(ordered), joints, walls, size)


def _joint(system: Any, given: Any) -> tuple[tuple[int, int, int], float]:
    """The places of three points, and the least transmission angle at the second of them."""
    names = system.point_names
    try:
        before, joint, behind, angle = given
        places = names.index(before), names.index(joint), names.index(behind)
    except (TypeError, ValueError):
        raise ValueOutOfBoundsError(
            f"transmission_angle is (before, joint, behind, least) with three of the points "
            f"{', '.join(names)}, not {brief(given)}"
        ) from None
    angular = NamedQuantity("the transmission angle", "rad", "", 0.0, np.pi, False, Kind.ANGLE)
    least = checked_positive("the least transmission angle", in_si(angle, angular))
    if least > 0.5 * np.pi:
        raise ValueOutOfBoundsError(
            f"no transmission angle is above 90 deg, but the least is {np.degrees(least):.6g} deg: "
            "give it in rad, or with a unit, '40deg'"
        )
    return places, least


def _span(
    system: Any, targets: Targets, driven: str, bounds: Mapping[str, Any], given: Any
) -> tuple[float, float]:
    """The range of the driven coordinate in which positions are looked for."""
    quantity = system.quantities[driven]
    if given is not None:
        ends = given if isinstance(given, str) or not np.iterable(given) else list(given)
        ends = doubles(in_si(ends, quantity), f"the span of {driven}")
        if ends.shape != (2,) or not ends[0] < ends[1]:
            raise ValueOutOfBoundsError(f"the span of {driven} must rise, not {brief(given)}")
        return float(ends[0]), float(ends[1])
    if quantity.kind in ANGULAR:
        return -np.pi, np.pi
    if targets.driven is None:
        raise ValueOutOfBoundsError(f"{driven} is no angle: give the span in which it moves")
    low, high = bounds.get(driven, (0.0, 0.0))
    return float(targets.driven.min() + low), float(targets.driven.max() + high)
