"""Source -> Mechanism: the contents of a SymPy object, as a mechanism with names and values.

Input: a Source and the user's settings.  Output: a validated mechanism whose M, F and J are then
derived from bodies, loads and constraints.  Invariant: nothing is guessed; an error names the
information that the object does not contain.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from copy import copy
from dataclasses import replace
from math import inf
from typing import Any

from sympy import Derivative, Expr, Float, Integer, S, Symbol, expand, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, RigidBody, dynamicsymbols

from mechc_codegen.convert.added_inertia import split_accelerations
from mechc_codegen.convert.checks.accelerations import (
    origin_of,
    point_at_rest,
    refuse_other_accelerations,
)
from mechc_codegen.convert.checks.angular_velocities import refuse_other_angular_velocities
from mechc_codegen.convert.checks.gradients import refuse_without_gradient
from mechc_codegen.convert.checks.velocities import refuse_other_velocities
from mechc_codegen.convert.classify_constraints import (
    Rates,
    degrees_of_freedom,
    integrable,
    nonholonomic,
    satisfied_identically,
)
from mechc_codegen.convert.fingerprint import Fingerprint, fingerprint
from mechc_codegen.convert.kinematics import coordinate_rates
from mechc_codegen.convert.potential import gravity_apart, potential_of
from mechc_codegen.convert.reactions import (
    constraints_with_auxiliary,
    refuse_contributing,
    split_reactions,
)
from mechc_codegen.convert.stationary import Stationary
from mechc_codegen.description.drawing import Drawing
from mechc_codegen.description.joints.tree import Joint
from mechc_codegen.description.mechanism import (
    Constraint,
    Coordinate,
    Mechanism,
    Parameter,
    Quantity,
    Speed,
    State,
    printed_name,
)
from mechc_codegen.description.placement import reachable
from mechc_codegen.description.quantity import in_si, refuse_scaled
from mechc_codegen.description.source import ConversionSettings, Key, Source
from mechc_codegen.description.terms import is_rigid
from mechc_codegen.errors import MechanismError


def convert(
    source: Source, settings: ConversionSettings, read: Fingerprint | None = None
) -> Mechanism:
    """The mechanism that a Source describes."""
    _refuse_masses_of_speeds(source)
    if any(isinstance(key, Symbol) for key in settings.inputs):
        source, read = _with_bound_parameters(source, settings), None
    read = read or fingerprint(source)
    source, reactions = split_reactions(source, _reactions(source, settings, read))
    read = read.without({each.symbol for each in reactions})
    states = _states(source, settings, read)
    inputs = _inputs(source, settings, read, states)
    parameters = _parameter_symbols(source, settings, read, (*inputs.values(), *states.values()))
    kinematics = _kinematics(source, settings)
    specified = {f: expression for f, expression in inputs.items() if expression is not None}
    rates = Rates((source.q, source.u), kinematics, parameters, specified, source.auxiliary)
    source, added, held = split_accelerations(source, rates)
    configuration, motion, skipped = _constraints(source, settings, rates)
    stationary = Stationary(source.frame)
    bodies = tuple(b for b in source.bodies if not stationary.body(b))
    gravity, source = gravity_apart(source, bodies)
    speeds_held = _all_rates(source, rates, motion)
    refuse_other_angular_velocities(source, bodies, rates, speeds_held)
    refuse_other_velocities(source, bodies, rates, speeds_held)
    refuse_other_accelerations(source, bodies, rates, speeds_held)
    refuse_contributing(source, reactions, rates, speeds_held)
    origin = source.origin or origin_of(source, rates, speeds_held)
    potential = potential_of(source, bodies, origin, stationary, kinematics)
    given = _by_symbol(settings.units, "units", source, (*parameters, *states, *inputs))
    units = _symbol_units(source, read, kinematics, given)
    defaults = _by_symbol(settings.defaults, "defaults", source, (*parameters, *states))
    return Mechanism(
        name=settings.name or source.kind,
        title=settings.name or source.title,
        frame=source.frame,
        origin=origin or point_at_rest(replace(source, bodies=source.drawn)) or Point("O"),
        coordinates=tuple(Coordinate(q, Quantity(units.get(q, ""), "")) for q in source.q),
        speeds=tuple(Speed(u, Quantity(units.get(u, ""), "")) for u in source.u),
        kinematics=kinematics,
        parameters=_parameters(settings, parameters, units, states, defaults),
        bodies=bodies,
        loads=source.loads,
        configuration_constraints=_numbered_constraints("constraint", configuration),
        motion_constraints=_numbered_constraints("velocity constraint", motion),
        points=_points(bodies, origin),
        skipped=skipped,
        inputs=inputs,
        auxiliary=source.auxiliary,
        lagrangian=source.lagrangian,
        equations=source.equations,
        potential=potential.value,
        unknown_potentials=(*potential.unknown, *held),
        added_inertia=added,
        joints=_joints(source, bodies),
        states=tuple(
            State(x, rate, unit, start_of(x, defaults.get(x), unit))
            for x, rate in states.items()
            for unit in (Quantity(units.get(x, ""), ""),)
        ),
        input_units={f: str(given[f]) for f in inputs if f in given},
        reactions=reactions,
        auxiliary_constraints=constraints_with_auxiliary(source) if reactions else (),
        gravity=gravity,
        drawn=source.drawn,
        drawing=Drawing(muscles=source.muscles),
    )


# -- kinematics and constraints -------------------------------------------------------------------


def _kinematics(source: Source, settings: ConversionSettings) -> tuple[Expr, ...]:
    zero = dict.fromkeys(source.auxiliary, S.Zero)
    configuration = (*source.configuration, *map(sympify, settings.configuration_constraints or ()))
    equations = [e.xreplace(zero) for e in source.kinematics]
    return coordinate_rates(equations, source.q, configuration)


def _constraints(
    source: Source, settings: ConversionSettings, rates: Rates
) -> tuple[tuple[Expr, ...], tuple[Expr, ...], tuple[str, ...]]:
    """(configuration constraints, constraints on the speeds only, omitted constraints)."""
    added = tuple(sympify(e) for e in settings.configuration_constraints or ())
    configuration = tuple(dict.fromkeys((*source.configuration, *added)))
    motion = tuple(e.xreplace(rates.moving) for e in source.motion)
    _refuse_nonlinear(motion, source)
    refuse_without_gradient(_numbered_constraints("constraint", configuration), rates)
    given, motion = motion, nonholonomic(configuration, motion, rates, mixed=source.mixed)
    own = [e for e in source.configuration if e not in added]
    if source.mixed and own:
        _refuse_not_implied(own, given, rates, source)
    if motion and settings.configuration_constraints is None:
        _refuse_integrable(motion, rates, source)
    identities = [] if rates.are_speeds else satisfied_identically(configuration, rates)
    skipped = tuple(f"constraint {i + 1}, kept by the kinematics" for i in identities)
    configuration = tuple(e for i, e in enumerate(configuration) if i not in identities)
    return configuration, motion, skipped


def _all_rates(source: Source, rates: Rates, motion: Sequence[Expr]) -> tuple[Expr, ...]:
    """All constraints on the speeds, including the rates of configuration constraints."""
    if source.mixed:
        return tuple(e.xreplace(rates.moving) for e in source.motion)
    along = (e.diff(dynamicsymbols._t) for e in source.configuration)
    return (*(e.xreplace(rates.moving) for e in along), *motion)


def _refuse_nonlinear(motion: Sequence[Expr], source: Source) -> None:
    for i, row in enumerate(motion, start=1):
        slopes = [row.diff(u) for u in source.u]
        if any(slope.has(*source.u) and expand(slope).has(*source.u) for slope in slopes):
            raise MechanismError(
                f"velocity constraint {i} of this {source.kind} is not linear in the speeds, as "
                "the equations of motion need it: write what it means as constraints that are"
            )


def _refuse_masses_of_speeds(source: Source) -> None:
    """Refuse a mass matrix that contains speeds: that of a Lagrangian which is not quadratic in
    them, or of a body whose mass or inertia depends on them."""
    rates = {q.diff(dynamicsymbols._t): f"{printed_name(q)}'" for q in source.q}
    speeds = {**rates, **{u: printed_name(u) for u in source.u}}
    for what, entry in _mass_terms(source, tuple(rates)):
        held = sympify(entry).atoms(Derivative, AppliedUndef) & {*speeds}
        found = [speeds[each] for each in held if expand(entry).has(each)]
        if found:
            raise MechanismError(
                f"{what} contains the speed {min(found)}, and a mass matrix depends on "
                "coordinates, parameters and time alone. Solve the equations of motion for the "
                "accelerations, and give them to mechc.from_equations with the unit matrix as "
                "mass matrix"
            )


def _mass_terms(source: Source, rates: Sequence[Expr]) -> Iterator[tuple[str, Expr]]:
    """The terms of the mass matrix, and what they are."""
    if source.lagrangian is not None and _degree(source.lagrangian, {*rates}) > 2:
        words = f"the Lagrangian of this {source.kind} is not quadratic in the speeds: a second "
        for momentum in (source.lagrangian.diff(rate) for rate in rates):
            yield from ((f"{words}derivative", momentum.diff(rate)) for rate in rates)
    for body in source.bodies:
        yield f"the mass of {body.name}", body.mass
        for measure, _, _ in body.inertia[0].args if is_rigid(body) else ():
            yield f"the inertia of {body.name}", measure


def _degree(term: Expr, rates: Set[Expr]) -> float:
    """The degree of a polynomial of rates as it is written; infinite for other functions."""
    degrees = [_degree(each, rates) for each in term.args]
    if term in rates or not any(degrees):
        return float(term in rates)
    if term.is_Add or term.is_Mul:
        return max(degrees) if term.is_Add else sum(degrees)
    is_power = term.is_Pow and term.exp.is_Integer and term.exp > 0
    return degrees[0] * int(term.exp) if is_power else inf


def _refuse_not_implied(
    configuration: Sequence[Expr], motion: Sequence[Expr], rates: Rates, source: Source
) -> None:
    """Refuse constraints that SymPy's equations, made of velocity constraints, do not keep."""
    alone, both = degrees_of_freedom(configuration, motion, rates)
    if alone > both:
        raise MechanismError(
            f"the velocity constraints of this {source.kind} do not imply the rates of its "
            "configuration constraints, so its equations do not keep them: they have degrees of "
            f"freedom: {alone}, with these rates: {both}. Add the rates to the velocity "
            "constraints (with u_dependent); or give these configuration constraints to "
            "mechc.compile, configuration_constraints=[...], which derives the rates; or, for the "
            f"motion of its equations, make the {source.kind} without them"
        )


_TO_COMPILE = "or configuration_constraints=[...] to mechc.compile. configuration_constraints"
_POSITIONS = {  # where each object has its configuration constraints
    "KanesMethod": "configuration_constraints=[...] (with q_dependent) to the KanesMethod, "
    + _TO_COMPILE,
    "LagrangesMethod": f"hol_coneqs=[...] to the LagrangesMethod, {_TO_COMPILE}",
    "System": f"holonomic constraints to the System, {_TO_COMPILE}",
    "system of equations": "constraints=[...]. constraints",
}


def _refuse_integrable(motion: Sequence[Expr], rates: Rates, source: Source) -> None:
    if integrable(motion, rates):
        raise MechanismError(
            f"velocity constraints of this {source.kind} are rates of configuration constraints "
            "that were not given, so positions cannot be recovered from it: add "
            f"{_POSITIONS[source.kind]}=[] means that there are no others; positions then keep the "
            "closure that they start with"
        )


def _numbered_constraints(kind: str, expressions: Sequence[Expr]) -> tuple[Constraint, ...]:
    return tuple(Constraint(f"{kind} {i}", e, "") for i, e in enumerate(expressions, start=1))


# -- symbols --------------------------------------------------------------------------------------


def _symbol_units(
    source: Source, read: Fingerprint, kinematics: Sequence[Expr], given: Mapping[Expr, str]
) -> dict[Expr, str]:
    """The units that are given, rad for coordinates that turn frames, and those of rates.

    Raises :class:`MechanismError` for units that are not SI units: values are not converted.
    """
    for symbol, unit in given.items():
        refuse_scaled(printed_name(symbol), str(unit))
    turning = {
        q for angle in read.angles for q in source.q if angle.has(q) and angle.diff(q).is_Number
    }
    known = {**dict.fromkeys(turning, "rad"), **given}
    rates = zip(source.q, kinematics, strict=True)
    of_rates = {rate: f"{known[q]}/s" for q, rate in rates if known.get(q) and rate in source.u}
    return {symbol: str(unit) for symbol, unit in (of_rates | known).items()}


def _unknown_functions(source: Source, read: Fingerprint) -> list[AppliedUndef]:
    state = {*source.q, *source.u, *source.auxiliary}
    found = {x for x in read.leaves if isinstance(x, AppliedUndef)} - state
    return sorted(found, key=str)


def _reactions(source: Source, settings: ConversionSettings, read: Fingerprint) -> list[Expr]:
    own = {dynamicsymbols._t, *source.q, *source.u, *source.auxiliary}
    known = sorted(read.leaves - own, key=str)
    return [find_symbol(key, known, "reactions", "symbol") for key in settings.reactions]


def _states(
    source: Source, settings: ConversionSettings, read: Fingerprint
) -> dict[AppliedUndef, Expr]:
    """Functions of time with a given rate, used in the object or in another rate or input."""
    own = [key for key in settings.states if isinstance(key, AppliedUndef)]
    named = [*own, *functions_in((*settings.inputs.values(), *settings.states.values()))]
    known = list(dict.fromkeys([*_unknown_functions(source, read), *named]))
    return {
        find_symbol(key, known, "states", "function of time"): rate
        for key, rate in settings.states.items()
    }


def _inputs(
    source: Source,
    settings: ConversionSettings,
    read: Fingerprint,
    states: Mapping[AppliedUndef, Expr],
) -> dict[AppliedUndef, Expr | None]:
    """Every specified function of time; without an expression it is given at run time."""
    known = {*source.q, *source.u, *source.auxiliary, *states}
    found = _unknown_functions(source, read)
    found += functions_in((*settings.inputs.values(), *states.values()))
    functions = [f for f in found if f not in known]
    given = {k: value for k, value in settings.inputs.items() if not isinstance(k, Symbol)}
    return chosen_inputs(functions, given)


def chosen_inputs(
    functions: Iterable[AppliedUndef], given: Mapping[Key, Any]
) -> dict[AppliedUndef, Expr | None]:
    """These functions, each with the expression that is given for it, or with None.

    Raises
    ------
    MechanismError
        If one of another argument than time has no expression.
    """
    chosen = dict[AppliedUndef, Expr | None].fromkeys(functions)
    for key, value in given.items():
        function = find_symbol(key, list(chosen), "inputs", "specified function of time")
        chosen[function] = None if value is None else sympify(value)
    for function, value in chosen.items():
        if value is None and function.args != (dynamicsymbols._t,):
            raise MechanismError(
                f"{function} is a function of {', '.join(map(printed_name, function.args))}: give "
                f"it as an expression or as samples, inputs={{{function}: ...}}"
            )
    return chosen


def _with_bound_parameters(source: Source, settings: ConversionSettings) -> Source:
    """Loads with the expressions that are given for parameters in them."""
    bound = {k: sympify(x) for k, x in settings.inputs.items() if isinstance(k, Symbol)}
    if not bound:
        return source
    elsewhere = fingerprint(replace(source, loads=())).leaves
    for symbol, value in bound.items():
        if symbol in elsewhere:
            raise MechanismError(
                f"inputs: {symbol} is in more than loads, where it was differentiated as a "
                f"constant, so it cannot be {value}: make it a function of time (dynamicsymbols) "
                "or, where it follows other parameters, give it in defaults"
            )
    loads = tuple((place, vector.xreplace(bound)) for place, vector in source.loads)
    return replace(source, loads=loads)


def functions_in(expressions: Iterable[Any]) -> list[AppliedUndef]:
    """The functions of time in expressions, in order of their names."""
    found = {f for e in expressions if e is not None for f in sympify(e).atoms(AppliedUndef)}
    return sorted(found, key=str)


def start_of(state: AppliedUndef, given: Any, of: Quantity) -> float:
    value = number(0 if given is None else in_si(given, f"defaults: {printed_name(state)}", of))
    if value is None or not value.is_number:
        raise MechanismError(f"defaults: the state {printed_name(state)} starts from a number")
    return float(value)


def _parameter_symbols(
    source: Source, settings: ConversionSettings, read: Fingerprint, given: Iterable[Expr | None]
) -> list[Symbol]:
    found = {x for x in read.leaves if isinstance(x, Symbol)}
    for expression in given:
        found |= expression.free_symbols if expression is not None else set()
    for expression in settings.configuration_constraints or ():
        found |= sympify(expression).free_symbols
    for value in settings.defaults.values():
        found |= value.free_symbols if isinstance(value, Expr) else set()
    found |= _declared_symbols(settings, found)
    return sorted(found - {dynamicsymbols._t}, key=lambda s: (s.name, str(s.assumptions0)))


def _declared_symbols(settings: ConversionSettings, known: Iterable[Symbol]) -> set[Symbol]:
    """Symbols of the declared parameters; a text is the name of a known symbol or of a new one."""
    by_name = {symbol.name: symbol for symbol in known}
    found = {by_name.get(k) or Symbol(k) if isinstance(k, str) else k for k in settings.parameters}
    for key in found:
        if not isinstance(key, Symbol) or key == dynamicsymbols._t:
            raise MechanismError(f"parameters are symbols or their names, not {key!r}")
    return found


def _parameters(
    settings: ConversionSettings, symbols: Sequence[Symbol], units: Mapping[Expr, str],
    states: Iterable[AppliedUndef], defaults: Mapping[Expr, Any],
) -> tuple[Parameter, ...]:  # fmt: skip
    for symbol, value in defaults.items():
        held = value.atoms(AppliedUndef) if isinstance(value, Expr) else ()
        if held and symbol not in states:
            raise MechanismError(
                f"defaults: {printed_name(symbol)} follows {printed_name(min(held, key=str))}, but "
                "a parameter follows parameters only; an expression of time, coordinates and "
                f"speeds is given with inputs={{{printed_name(symbol)}: ...}}"
            )
    declared = _declared_symbols(settings, symbols)
    return tuple(
        Parameter(
            symbol, number(defaults.get(symbol)), Quantity(units.get(symbol, ""), ""),
            preset=symbol in declared,
        )
        for symbol in symbols
    )  # fmt: skip


def number(value: Any) -> Expr | None:
    """A value as an exact SymPy number: an integer, or the value of the double."""
    if value is None or isinstance(value, Expr):
        return value
    try:
        exact = float(value)
    except (TypeError, ValueError):
        raise MechanismError(f"{value!r} is not a number") from None
    if exact != exact or exact in (float("inf"), float("-inf")):
        raise MechanismError(f"{value!r} is not a finite number")
    return Integer(int(exact)) if exact == int(exact) and abs(exact) < 2**53 else Float(exact)


def _by_symbol(
    given: Mapping[Key, Any], what: str, source: Source, others: Sequence[Expr]
) -> dict[Expr, Any]:
    known: list[Expr] = [*source.q, *source.u, *others]
    return {find_symbol(key, known, what, "symbol"): value for key, value in given.items()}


def find_symbol(key: Key, known: Sequence[Any], argument: str, kind: str) -> Any:
    """The symbol with this printed name, or the symbol itself."""
    matches = [s for s in known if s == key or (isinstance(key, str) and printed_name(s) == key)]
    if len(matches) == 1:
        return matches[0]
    name = key if isinstance(key, str) else printed_name(key)
    if matches:
        raise MechanismError(
            f"{argument}: more than one {kind} is printed as {name!r}; give the symbol itself"
        )
    names = ", ".join(sorted({printed_name(s) for s in known})) or "none"
    raise MechanismError(f"{argument}: there is no {kind} {name!r} here; known: {names}")


# -- bodies and points ----------------------------------------------------------------------------


def _joints(source: Source, bodies: Sequence[RigidBody | Particle]) -> tuple[Joint, ...]:
    """The joints between moving bodies and with the ground, which all bodies at rest belong to."""
    still = {body for body in source.bodies if body not in bodies}
    joints = source.joints if source.lagrangian is None else ()
    moved = (joint.on_ground(still) for joint in joints)
    return tuple(joint for joint in moved if joint.parent is not joint.child)


def _points(bodies: Sequence[RigidBody | Particle], origin: Point | None) -> tuple[Point, ...]:
    """Mass centres whose position is known, each once and with different names."""
    if origin is None:
        return ()
    linked = set(reachable([origin]))
    named: dict[str, Point] = {}
    for point in dict.fromkeys(b.masscenter for b in bodies if b.masscenter in linked):
        name, count = point.name, 1
        while name in named:
            count += 1
            name = f"{point.name} ({count})"
        if count > 1:  # a copy: the user's own point keeps its name
            point = copy(point)
            point.name = name
        named[name] = point
    return tuple(named.values())
