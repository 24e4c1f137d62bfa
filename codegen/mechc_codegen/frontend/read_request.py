"""The user's options -> OutputRequest."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from sympy import Derivative, Expr, Integer, S, Symbol
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import dynamicsymbols

from mechc_codegen.convert.convert import find_symbol, number
from mechc_codegen.derive.joint_reactions import refuse_unknown_reactions
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.placement import reachable
from mechc_codegen.description.quantity import in_si
from mechc_codegen.description.request import OPTIONAL, OutputRequest, default_outputs
from mechc_codegen.description.source import Key
from mechc_codegen.description.terms import Multiplier, as_expression, printed_name
from mechc_codegen.errors import MechanismError

RESERVED = frozenset(
    (
        *(*OPTIONAL, "rates", "mass_matrix", "forcing", "constraints", "velocity_constraints"),
        *("constraint_jacobian", "kinetic_energy", "potential_energy", "linear_momenta"),
        *("angular_momenta", "point_velocities", "point_accelerations", "own_state_jacobian"),
        *("own_parameter_jacobian", "velocity_gradient", "preference", "coordinate_rates"),
        *("kinematic_matrix", "input_jacobian", "own_input_jacobian", "reaction_forces"),
        *("reaction_torques", "default_slopes", "constraints_by_parameters"),
        *("velocity_constraints_by_parameters", "constraints_by_inputs"),
        *("velocity_constraints_by_inputs", "cut_directions"),
    )
)


def read_request(
    mechanism: Mechanism,
    fix: Mapping[Key, Any],
    outputs: tuple[Any, ...] | None,
    *,
    of_object: bool,
    shapes: Mapping[str, tuple[int, ...]] | None = None,
) -> OutputRequest:
    """The request for a mechanism, each name checked against it.

    Without ``outputs`` the default ones, or only the energy if the mechanism comes from a SymPy
    object.  ``shapes``: of outputs whose elements are among ``outputs``.

    Raises
    ------
    MechanismError
        For parameters and outputs that do not exist, and for positions that are not known.
    """
    quantities = {p.symbol: p.quantity for p in mechanism.parameters}
    fixed: dict[Symbol, Expr] = {}
    for key, value in fix.items():
        symbol = find_symbol(key, [*quantities], "fix", "parameter")
        exact = number(in_si(value, f"fix: {symbol}", quantities[symbol]))
        if exact is None or not exact.is_number:
            raise MechanismError(f"fix: {symbol} must be a number, not {value!r}")
        fixed[symbol] = exact
    if outputs is None:
        outputs = default_outputs(of_object=of_object or not mechanism.bodies)
    names, own = _outputs(outputs)
    for reaction in (each.symbol for each in mechanism.reactions):
        own.setdefault(printed_name(reaction), reaction)
    for name, (expression, _) in mechanism.outputs.items():
        own.setdefault(name, expression)
    for name in shapes or ():
        _refuse_name(name, own)
    placed = {"momenta", "points", "accelerations", "reactions"} & set(names)
    if placed and (of_object or not mechanism.bodies):
        _refuse_unplaced(mechanism, placed)
    if "reactions" in names:
        refuse_unknown_reactions(mechanism)
    for name, expression in own.items():
        _refuse_unknown(name, expression, mechanism)
    labels = {f"own_{k}": name for k, name in enumerate(own)}
    expressions = {label: own[name] for label, name in labels.items()}
    return OutputRequest(frozenset(names), fixed, expressions, labels, dict(shapes or {}))


def _refuse_unknown(name: str, expression: Expr, mechanism: Mechanism) -> None:
    """Refuse symbols in a user-defined output that the mechanism does not have."""
    time = dynamicsymbols._t
    known = {time, *mechanism.q, *mechanism.x, *mechanism.u, *mechanism.inputs}
    known |= {p.symbol for p in mechanism.parameters}
    known |= {reaction.symbol for reaction in mechanism.reactions}
    accelerations = {u.diff(time) for u in mechanism.u}
    plain = expression.xreplace(mechanism.second_rates).xreplace(mechanism.rates)
    _refuse_rows(name, plain, mechanism)
    plain = plain.xreplace(dict.fromkeys(plain.atoms(Multiplier), S.Zero))
    held = (
        plain.atoms(Derivative) - accelerations
        or (plain.free_symbols | plain.atoms(AppliedUndef)) - known
    )
    if held:
        raise MechanismError(
            f"outputs: {name!r} contains {str(min(held, key=str))!r}; allowed are time, "
            "coordinates and speeds, their rates, mechc.multiplier(row), inputs and parameters of "
            "the mechanism"
        )


def _refuse_rows(name: str, expression: Expr, mechanism: Mechanism) -> None:
    known = {*map(Integer, range(len(mechanism.rows))), *map(Symbol, mechanism.rows)}
    unknown = {m.args[0] for m in expression.atoms(Multiplier)} - known
    if unknown:
        raise MechanismError(
            f"outputs: {name!r} contains the multiplier of {str(min(unknown, key=str))!r}; the "
            f"rows are {', '.join(f'{k} ({n})' for k, n in enumerate(mechanism.rows)) or 'none'}"
        )


def _refuse_unplaced(mechanism: Mechanism, names: Collection[str]) -> None:
    needing = f"outputs: {', '.join(sorted(names))} need"
    linked = set(reachable([mechanism.origin]))
    for body in mechanism.bodies:
        if body.masscenter not in linked:
            raise MechanismError(
                f"{needing} positions, and that of {body.name} from a "
                "point at rest in the inertial frame is not known; locate its mass centre "
                "with set_pos or locatenew, from a point with set_vel(frame, 0)"
            )
    if not mechanism.bodies:
        raise MechanismError(f"{needing} bodies; there are none")


def _outputs(requested: Iterable[Any]) -> tuple[list[str], dict[str, Expr]]:
    names: list[str] = []
    expressions: dict[str, Expr] = {}
    for item in requested:
        if isinstance(item, Mapping):
            for name, value in item.items():
                _refuse_name(name, expressions)
                expressions[name] = as_expression(value, f"outputs: {name!r}")
        elif item in OPTIONAL:
            names.append(item)
        else:
            raise MechanismError(
                f"outputs: {item!r} is not one of {', '.join(OPTIONAL)}; an expression of your "
                "own is requested as {name: expression}"
            )
    return names, expressions


def _refuse_name(name: Any, taken: Iterable[str]) -> None:
    """Refuse the name of another output; any other text is allowed."""
    if not isinstance(name, str) or not name or "\0" in name:
        raise MechanismError(f"outputs: {name!r} is not a name: use text without null characters")
    if name in RESERVED or name in taken:
        raise MechanismError(f"outputs: {name!r} is the name of another output; choose another")
