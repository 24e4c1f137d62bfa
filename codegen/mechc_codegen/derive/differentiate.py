"""Stage 2: Equations -> Equations with Jacobians and directional derivatives.

Input: constraints and kinematics.  Output: in addition the constraint Jacobian J over the speeds,
the velocity constraints J u + b, and gamma of J u' = gamma.  Invariant: the chain rule runs through
the kinematics, so speeds need not be rates of coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from sympy import Add, Expr, S

from mechc_codegen.derive.equations import Equations, Output, Symbols
from mechc_codegen.derive.outputs import (
    constraint_gradient,
    kinematic_matrix,
    rates_of_constraints,
)
from mechc_codegen.description.derivatives import Derivatives
from mechc_codegen.errors import MechanismError


def differentiate(equations: Equations) -> Equations:
    """Add ``velocity_constraints``, ``constraint_jacobian`` and ``gamma`` to the outputs."""
    if equations.tree is not None:  # its derivation has added them
        return equations
    symbols = equations.symbols
    rates = equations.outputs["coordinate_rates"].elements
    holonomic = equations.outputs["constraints"]
    _refuse_states(equations, holonomic)
    motion = equations.outputs["motion_constraints"]
    values = {x for chain in symbols.inputs for x in chain}
    known = Derivatives({*symbols.q, *symbols.u, symbols.time, *values})
    along = [directional(e, symbols, rates, known) for e in holonomic.elements]
    velocity = (*along, *motion.elements)
    rows = [[known.of(e, u) for u in symbols.u] for e in velocity]
    gamma = tuple(-directional(e, symbols, rates, known) for e in velocity)
    names = (*(f"rate of {label}" for label in holonomic.labels), *motion.labels)
    along_speeds, accelerated = rates_of_constraints(velocity, gamma, names)
    added = [
        along_speeds,
        Output(
            "constraint_jacobian",
            "J: derivative of the velocity constraints by the speeds",
            tuple(entry for row in rows for entry in row),
            (len(velocity), len(symbols.u)),
            tuple(f"J[{name}, {speed}]" for name in names for speed in equations.speed_names),
        ),
        accelerated,
        constraint_gradient(
            [[known.of(e, q) for q in symbols.q] for e in holonomic.elements], holonomic.labels
        ),
        kinematic_matrix(rates, symbols.u, len(equations.movable_coordinates)),
    ]
    outputs = {**equations.outputs, **{output.name: output for output in added}}
    outputs |= {o.name: o for o in _with_mass_for_all(outputs, equations.mass_scale)}
    return replace(equations, outputs=outputs)


def _refuse_states(equations: Equations, holonomic: Output) -> None:
    """Refuse states in configuration constraints, which are satisfied by moving coordinates."""
    states = set(equations.symbols.q) - set(equations.movable_coordinates)
    for label, expression in zip(holonomic.labels, holonomic.elements, strict=True):
        if expression.free_symbols & states:
            raise MechanismError(
                f"the configuration constraint {label!r} contains a state: replace it by an "
                "input, or by a coordinate with a speed"
            )


def _with_mass_for_all(outputs: Mapping[str, Output], scale: Expr) -> tuple[Output, ...]:
    """M and F with ``s J^T J`` and ``s J^T gamma`` added, where a speed moves no mass.

    Where J u' = gamma both give the same accelerations and multipliers, but the solver needs a mass
    for every speed, as the metric of the rows.  ``s`` is of the size of M.
    """
    mass, forcing = outputs["mass_matrix"], outputs["forcing"]
    rows, gamma = outputs["constraint_jacobian"], outputs["gamma"].elements
    size = len(forcing.elements)
    if not gamma or all(mass.elements[i * (size + 1)] != 0 for i in range(size)):
        return ()
    jacobian = [rows.elements[i * size : (i + 1) * size] for i in range(len(gamma))]
    added = [sum((r[i] * r[j] for r in jacobian), S.Zero) for i in range(size) for j in range(size)]
    pushed = [
        sum((r[i] * g for r, g in zip(jacobian, gamma, strict=True)), S.Zero) for i in range(size)
    ]
    return (
        _augmented_output(mass, added, scale, "M + s J^T J"),
        _augmented_output(forcing, pushed, scale, "F + s J^T gamma"),
    )


def _augmented_output(output: Output, added: Sequence[Expr], scale: Expr, equation: str) -> Output:
    elements = tuple(e + scale * a for e, a in zip(output.elements, added, strict=True))
    return replace(output, name=f"augmented_{output.name}", equation=equation, elements=elements)


def directional(
    expression: Expr, symbols: Symbols, rates: Sequence[Expr], known: Derivatives
) -> Expr:
    """Time derivative of an expression of t and q (speeds held) along the coordinates' rates."""
    terms = [known.of(expression, q) * rate for q, rate in zip(symbols.q, rates, strict=True)]
    driven = symbols.rates_of_inputs(expression)
    terms += [known.of(expression, value) * rate for value, rate in driven]
    return Add(*terms, known.of(expression, symbols.time))
