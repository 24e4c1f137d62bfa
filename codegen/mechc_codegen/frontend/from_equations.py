"""Equations that were derived by hand -> Mechanism: :func:`from_equations`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from sympy import Derivative, Eq, Expr, Matrix, Symbol, eye
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import ReferenceFrame, dynamicsymbols

from mechc_codegen.convert.algebra import evaluator, random_point
from mechc_codegen.convert.convert import convert, find_symbol
from mechc_codegen.description.given_equations import GivenEquations
from mechc_codegen.description.mechanism import Mechanism, as_mapping
from mechc_codegen.description.source import ConversionSettings, Source
from mechc_codegen.description.terms import as_expression, printed_name
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.read import with_speeds

SAME: Final = 1e-9  # of two entries


def from_equations(
    coordinates: Any,
    speeds: Any,
    mass_matrix: Any,
    forcing: Any,
    *,
    kinematics: Any = None,
    constraints: Iterable[Any] | None = None,
    velocity_constraints: Iterable[Any] = (),
    kinetic_energy: Any = None,
    potential_energy: Any = None,
    name: str = "equations",
    defaults: Mapping[Any, Any] | None = None,
    units: Mapping[Any, str] | None = None,
    inputs: Any = None,
    states: Mapping[Any, Any] | None = None,
    parameters: Iterable[Any] = (),
) -> Mechanism:
    """The mechanism of equations M u' + J^T lambda = F that are given, for :func:`mechc.compile`.

    M and F are those of the open tree, over all speeds; the constraints' J and the rates of its
    rows are derived, and redundant rows are allowed.  Symbols in the equations are parameters;
    functions of time that are neither coordinates nor speeds are inputs.

    Parameters
    ----------
    coordinates : (nq,)
        Functions of time (``dynamicsymbols``).
    speeds : (nu,)
        Likewise, or the coordinates' derivatives ``q.diff(t)``; None: these.
    mass_matrix : (nu, nu)
        M, symmetric, of coordinates, time, inputs and parameters: implicit equations.  None:
        explicit ones, u' = ``forcing``, which take no constraints.
    forcing : (nu,)
        F, of coordinates, speeds, time, inputs and parameters.
    kinematics
        The coordinates' rates: ``{q: expression}``, linear in the speeds, or expressions and
        equations linear in q' and the speeds, those zero.  By default each rate is the speed at the
        same place.
    constraints
        Configuration constraints, expressions that are zero.  ``[]`` declares that there are none
        where velocity constraints look like the rates of some.
    velocity_constraints
        Nonholonomic constraints, expressions that are zero, linear in the speeds; not the rates of
        ``constraints``.
    kinetic_energy, potential_energy
        T and V in J, as outputs and for the balance of energy; both or neither, V = 0 where no load
        has a potential.
    name
        Of the model.
    defaults, units, inputs, states, parameters
        As for :func:`mechc.compile`.

    Raises
    ------
    MechanismError
        For shapes that do not fit, a mass matrix that is not symmetric, accelerations in M or F,
        and what :func:`mechc.compile` refuses of constraints and symbols.
    """
    q = _functions("coordinates", coordinates)
    u = tuple(x.diff(dynamicsymbols._t) for x in q) if speeds is None else _each("speeds", speeds)
    if kinematics is not None and any(isinstance(x, Derivative) for x in u):
        raise MechanismError(f"{name}: speeds that are the coordinates' rates take no kinematics")
    configuration = _each("constraints", () if constraints is None else constraints)
    motion = _each("velocity_constraints", velocity_constraints)
    mass, explicit = _mass_matrix(mass_matrix, len(u))
    if explicit and (configuration or motion):
        raise MechanismError(
            f"{name}: constraints act through the mass matrix, and explicit equations have none: "
            "give mass_matrix and forcing without the forces of the constraints"
        )
    force = _each("forcing", forcing)
    if len(force) != len(u):
        raise MechanismError(
            f"{name}: forcing has {len(force)} entries for {len(u)} speeds: give one for each of "
            f"{', '.join(map(printed_name, u))}"
        )
    equations = GivenEquations(mass, force, _energies(kinetic_energy, potential_energy))
    source = Source(
        kind="system of equations",
        frame=ReferenceFrame("N"),
        q=q,
        u=u,
        kinematics=_kinematics(kinematics, q, u),
        configuration=configuration,
        motion=motion,
        equations=equations,
    )
    _refuse_accelerations(name, equations, source)
    _refuse_unsymmetric(name, mass)
    settings = ConversionSettings(
        name=name,
        defaults=dict(defaults or {}),
        units=dict(units or {}),
        inputs=as_mapping(inputs or {}),
        states=dict(states or {}),
        configuration_constraints=() if constraints is not None and not configuration else None,
        parameters=tuple(parameters),
    )
    return convert(with_speeds(source), settings)


def _functions(what: str, given: Any) -> tuple[AppliedUndef, ...]:
    found = _each(what, given)
    for each in found:
        if not isinstance(each, AppliedUndef) or each.args != (dynamicsymbols._t,):
            raise MechanismError(f"{what} are functions of time (dynamicsymbols), not {each}")
    return found


def _each(what: str, given: Any) -> tuple[Any, ...]:
    """The expressions of a sequence, of a matrix with one column, or one by itself."""
    several = isinstance(given, Iterable) or getattr(given, "is_Matrix", False)
    single = isinstance(given, (str, Expr)) or not several
    entries = [given] if single else list(given)
    return tuple(as_expression(each, f"{what}[{k}]") for k, each in enumerate(entries))


def _mass_matrix(given: Any, size: int) -> tuple[tuple[tuple[Expr, ...], ...], bool]:
    """The rows of M, and whether the equations are explicit."""
    if given is None:
        return _rows(eye(size)), True
    try:
        found = given.as_explicit() if hasattr(given, "as_explicit") else Matrix(given)
    except (TypeError, ValueError) as error:
        raise MechanismError(f"mass_matrix is no matrix: {error}") from None
    if found.shape != (size, size):
        raise MechanismError(
            f"mass_matrix has the shape {found.shape}; {size} speeds need ({size}, {size}). Rows "
            "of constraints do not belong in it: give these as constraints= or "
            "velocity_constraints="
        )
    return _rows(found), False


def _rows(matrix: Any) -> tuple[tuple[Expr, ...], ...]:
    return tuple(
        tuple(as_expression(matrix[i, j], f"mass_matrix[{i}, {j}]") for j in range(matrix.cols))
        for i in range(matrix.rows)
    )


def _energies(kinetic: Any, potential: Any) -> tuple[Expr, Expr] | None:
    if (kinetic is None) != (potential is None):
        missing = "kinetic_energy" if kinetic is None else "potential_energy"
        raise MechanismError(
            f"{missing} is missing: the energies are given together, potential_energy=0 where no "
            "load has a potential"
        )
    if kinetic is None:
        return None
    return as_expression(kinetic, "kinetic_energy"), as_expression(potential, "potential_energy")


def _refuse_accelerations(name: str, equations: GivenEquations, source: Source) -> None:
    time = dynamicsymbols._t
    speeds = {*source.u, *(x.diff(time) for x in source.q)}
    accelerations = {each.diff(time) for each in speeds}
    for place, expression in equations.terms():
        held = expression.atoms(Derivative) & accelerations
        if held:
            raise MechanismError(
                f"{name}: {place} contains the acceleration {min(map(str, held))}: move its factor "
                "into mass_matrix"
            )
        held = expression.atoms(Derivative, AppliedUndef) & speeds
        if held and place.startswith("mass_matrix"):
            raise MechanismError(
                f"{name}: {place} contains the speed {min(map(str, held))}; a mass matrix depends "
                "on coordinates, time and parameters"
            )


def _refuse_unsymmetric(name: str, mass: Sequence[Sequence[Expr]]) -> None:
    """Refuse a matrix with entries that differ from their mirror images at a random state."""
    pairs = [(i, j) for i in range(len(mass)) for j in range(i) if mass[i][j] != mass[j][i]]
    both = [entry for i, j in pairs for entry in (mass[i][j], mass[j][i])]
    leaves = sorted({x for e in both for x in e.atoms(Symbol, AppliedUndef)}, key=str)
    point = random_point(None, len(leaves), seed=8) or []
    values = evaluator(leaves, both)(*point) if both else []
    for (i, j), one, other in zip(pairs, values[::2], values[1::2], strict=True):
        if abs(one - other) > SAME * (abs(one) + abs(other)):
            raise MechanismError(
                f"{name}: mass_matrix[{i}, {j}] = {mass[i][j]} differs from "
                f"mass_matrix[{j}, {i}] = {mass[j][i]}, and a mass matrix is symmetric. Where rows "
                "were scaled or combined, and there are no constraints, give explicit equations: "
                "mass_matrix=None, forcing=M.LUsolve(F)"
            )


def _kinematics(given: Any, q: Sequence[AppliedUndef], u: Sequence[Expr]) -> tuple[Expr, ...]:
    """Expressions of q, q' and u that are zero; by default each rate is the speed at its place."""
    rates = [x.diff(dynamicsymbols._t) for x in q]
    if given is None:
        return tuple(rate - speed for rate, speed in zip(rates, u, strict=False))
    if isinstance(given, Mapping):
        named = dict(zip((*q, *rates), (*rates, *rates), strict=True))
        pairs = (
            (named[find_symbol(key, list(named), "kinematics", "coordinate")], value)
            for key, value in given.items()
        )
        given = [rate - as_expression(value, f"kinematics: {rate}") for rate, value in pairs]
    return _each("kinematics", [x.lhs - x.rhs if isinstance(x, Eq) else x for x in given])
