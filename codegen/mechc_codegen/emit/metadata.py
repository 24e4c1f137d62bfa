"""The metadata of a scene: names, units, descriptions, drawing, operation counts.

Input: the mechanism and the program before and after optimisation.  Output: plain data for JSON.
Invariant: no SymPy object is left in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from sympy import Abs, Expr, Poly, S, Symbol, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import dynamicsymbols, find_dynamicsymbols

from mechc_codegen.derive.equations import Equations, Output
from mechc_codegen.description.joints.gimbals import gimbals
from mechc_codegen.description.joints.loops import cut_rows
from mechc_codegen.description.joints.quaternions import unit_quaternions
from mechc_codegen.description.mechanism import (
    Coordinate,
    Mechanism,
    Parameter,
    Speed,
    State,
    printed_name,
)
from mechc_codegen.description.piecewise import Floor, Step
from mechc_codegen.description.quantity import Quantity
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.description.tables import Lookup
from mechc_codegen.description.terms import entries_of
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.layout import TREE
from mechc_codegen.emit.row_blocks import orthogonal_operations
from mechc_codegen.emit.units.block_elimination import BlockElimination
from mechc_codegen.ir.program import (
    SWITCHING,
    Program,
    Series,
    equation_values,
    operations,
    slice_statements,
    symbols_in,
    symbols_of,
)

# What the indices of an output count: lists of the metadata whose names they may be, or axes.
AXES = {
    **dict.fromkeys(("linear_momenta", "angular_momenta"), ("bodies", "xyz")),
    **dict.fromkeys(("points", "point_velocities", "point_accelerations"), ("points", "xyz")),
    **dict.fromkeys(("reaction_forces", "reaction_torques"), ("joints", "xyz")),
    **dict.fromkeys(("constraints", "velocity_constraints", "multipliers"), ("constraints",)),
    "constraint_jacobian": ("constraints", "speeds"),
    "mass_matrix": ("speeds", "speeds"),
    "forcing": ("speeds",),
    "rates": ("coordinates speeds",),
}
UNITS = {
    **dict.fromkeys(("kinetic_energy", "potential_energy"), "J"),
    "linear_momenta": "kg m/s",
    "angular_momenta": "kg m^2/s",
    "points": "m",
    "point_velocities": "m/s",
    "point_accelerations": "m/s^2",
    "reaction_forces": "N",
    "reaction_torques": "N m",
}
MOST_SUMS_ALONE = 16  # of Taylor series that lead where one run has the lanes for itself


def scene_metadata(
    mechanism: Mechanism,
    parameters: Sequence[Parameter],
    lowered: Program,
    functions: SceneFunctions,
) -> dict[str, Any]:
    """The metadata, as data for JSON.

    ``parameters``: those not fixed; ``lowered``: the program before optimisation.
    """
    program, equations, request = functions.program, functions.equations, functions.request
    switched = SWITCHING in functions.outputs
    rows = (*mechanism.holonomic, *((c.name, c.unit) for c in mechanism.motion_constraints))
    return {
        "name": mechanism.name,
        "title": mechanism.title,
        "coordinates": described_quantities((*mechanism.coordinates, *mechanism.states)),
        "speeds": described_quantities(mechanism.speeds),
        "parameters": described_quantities(parameters),
        "points": [p.name for p in mechanism.points],
        "bodies": list(distinct(b.name for b in mechanism.bodies)),
        "joints": [j.name for j in mechanism.joints],
        "constraints": [{"name": name, "unit": unit} for name, unit in rows],
        **_cut_directions(mechanism),
        **_cut_rows(mechanism),
        "links": [[label, list(points)] for label, points in mechanism.drawing.links],
        "ground": list(mechanism.drawing.ground),
        "traced": list(mechanism.drawing.traced),
        **({"view": list(mechanism.drawing.view)} if mechanism.drawing.view else {}),
        "start": dict(mechanism.start),
        "shapes": {
            request.name_of(o.name): list(o.shape) for o in program.outputs if o.name != SWITCHING
        }
        | _solved_shapes(mechanism, len(parameters), request, program)
        | {request.name_of(label): [] for label in request.expressions},
        "axes": {name: list(axes) for name, axes in AXES.items()},
        "output_units": UNITS | {name: unit for name, (_, unit) in mechanism.outputs.items()},
        # Outputs that need accelerations or multipliers, which may be infinite at change points.
        "of_motion": [
            *(["multipliers"] if rows else []),
            *(
                request.name_of(o.name)
                for o in functions.listed_outputs()
                if functions.needs_motion(o)
            ),
        ],
        "own": [request.name_of(label) for label in request.expressions],
        **({"arrays": {n: list(s) for n, s in request.shapes.items()}} if request.shapes else {}),
        **_differentiated_outputs(program, request),
        "skipped": [*mechanism.skipped, *_outputs_left_out(request)],
        "fixed": {printed_name(symbol): float(value) for symbol, value in request.fixed.items()},
        "unavailable": _unavailable(mechanism, request),
        "left_out": {each: name for name in _outputs_left_out(request) for each in OUTPUTS[name]},
        **_inputs(mechanism, request, functions),
        **({"states": [float(s.start) for s in mechanism.states]} if mechanism.states else {}),
        **_contacts(mechanism, request),
        **_quaternions(mechanism),
        **_gimbals(mechanism),
        # Whether no equation has a corner or a jump; user-defined outputs are not considered.
        "smooth": not any(
            value.has(Abs, Step, Floor, Lookup)
            for value in equation_values(program, request.expressions)
        ),
        # Number of switching functions; none if they do not show every corner and jump.
        **({"switches": len(functions.outputs[SWITCHING].elements)} if switched else {}),
        **({"taylor": _series(program.series)} if program.series else {}),
        "lockstep": functions.fits_lanes,
        "identity_kinematics": equations.identity_kinematics,
        "closing": _closing(parameters, lowered, equations),
        "operations": operation_counts(lowered, functions),
        **_row_blocks(functions),
        "loads": _loads(mechanism, request),
        "walked": len(equations.tree.parents) if equations.tree else 0,
        "planar": equations.tree.planar if equations.tree else None,
    }


def _cut_directions(mechanism: Mechanism) -> dict[str, Any]:
    """The joint and the axes of every row of the output of this name."""
    found = [[name, str(one), str(other)] for name, one, other in mechanism.aligned_axes]
    return {"cut_directions": found} if found else {}


def _cut_rows(mechanism: Mechanism) -> dict[str, Any]:
    """Name of every constraint of a cut joint, whether it is omitted, and by the place of a joint
    the components of force and torque that it can add to."""
    found = [
        [row.name, row.omitted, [[joint, list(which)] for joint, which in row.components.items()]]
        for row in cut_rows(mechanism)
    ]
    return {"cut_rows": found} if found else {}


def _contacts(mechanism: Mechanism, request: OutputRequest) -> dict[str, Any]:
    """The contacts, each by the terms of its polynomials."""
    found = []
    for contact in mechanism.contacts:
        parts = {"gap": contact.gap, "slip": contact.slip}
        if contact.slip is not None:
            parts["force"] = sympify(contact.force)
        found.append({name: _terms(value.xreplace(dict(request.fixed)))
                      for name, value in parts.items() if value is not None})  # fmt: skip
    return {"contacts": found} if found else {}


def _terms(value: Expr) -> list[Any]:
    """The terms of a polynomial: each its coefficient, and the powers of what it is made of."""
    names = {printed_name(x): x for x in value.atoms(AppliedUndef) | value.atoms(Symbol)}
    names = {name: names[name] for name in sorted(names) if names[name] != dynamicsymbols._t}
    if not names:
        return [[_whole(float(value)), {}]]
    return [
        [_whole(float(coefficient)), {n: k for n, k in zip(names, powers, strict=True) if k}]
        for powers, coefficient in Poly(value, *names.values()).terms()
    ]


def _whole(value: float) -> int | float:
    return int(value) if value in (-1.0, 0.0, 1.0) else value


def _quaternions(mechanism: Mechanism) -> dict[str, Any]:
    """Places of quaternions' components: attitudes of joints, and quaternions of length one; those
    of these whose length a constraint of the description holds."""
    every = [joint.quaternion for joint in mechanism.joints if joint.quaternion]
    places = [[mechanism.q.index(x) for x in quaternion] for quaternion in every]
    kinds = {
        "quaternions": places,
        "unit_quaternions": (units := unit_quaternions(mechanism.frame, mechanism.q)),
        "held_quaternions": [
            unit
            for unit in units
            if any(
                set() < find_dynamicsymbols(row.expression) <= {mechanism.q[i] for i in unit}
                for row in mechanism.configuration_constraints
            )
        ],
    }
    return {kind: found for kind, found in kinds.items() if found}


def _gimbals(mechanism: Mechanism) -> dict[str, Any]:
    """Places of three angles that turn a body, of the middle one, and their determinant."""
    found = [
        {
            "frame": each.frame,
            "angles": [mechanism.q.index(angle) for angle in each.angles],
            "middle": mechanism.q.index(each.middle),
            "determinant": list(each.determinant),
        }
        for each in gimbals(mechanism)
    ]
    return {"gimbals": found} if found else {}


def _differentiated_outputs(program: Program, request: OutputRequest) -> dict[str, Any]:
    """The outputs, after user-defined ones, that have Jacobians, with their sizes."""
    values = program.named_values()
    sizes = [[name, len(values[name])] for name in request.differentiated_outputs(values)]
    return {"differentiated": sizes} if request.includes("sensitivities") else {}


TIME_ALONE = (  # computed without the speeds, or at other speeds than the state's
    *("constraints", "constraint_jacobian", "constraint_gradient", "velocity_bias"),
    *("mass_matrix", "augmented_mass_matrix", "kinematic_matrix", "preference", "cut_directions"),
    *("tree_offset", "tree_subspace", "tree_inertia", "tree_reference", "tree_cut"),
)


CLOSING = (  # what is needed to close the loops, and to find speeds on the constraints
    *("constraints", "constraint_gradient", "constraint_jacobian", "velocity_constraints"),
    *("velocity_bias", "preference", "kinematic_matrix", "coordinate_rates"),
    *("tree_offset", "tree_subspace", "tree_reference", "tree_cut", "cut_directions"),
)


def _closing(parameters: Sequence[Parameter], lowered: Program, equations: Equations) -> list[str]:
    """Names of the parameters that closing the loops needs, and of those that their defaults
    follow; in the program before its constants are moved out of it."""
    symbols, needed = lowered.symbols.parameters, _used(lowered, CLOSING)
    defaults = dict(zip(symbols, equations.parameter_defaults, strict=True))
    for _ in symbols:  # a default may follow one that follows another
        followed = (defaults[symbol] for symbol in symbols if symbol in needed)
        needed |= symbols_in(value for value in followed if value is not None)
    return [str(p.symbol) for s, p in zip(symbols, parameters, strict=True) if s in needed]


def _inputs(
    mechanism: Mechanism, request: OutputRequest, functions: SceneFunctions
) -> dict[str, Any]:
    """Inputs given at run time: the values needed of each, and the outputs without inputs.

    ``orders``: the derivatives, each a place in the array of values.
    """
    program = functions.program
    values = program.input_values()
    if not values:
        return {}
    of_time = _used(program, TIME_ALONE)
    units = mechanism.input_units
    quantities = [Quantity(units.get(f, ""), "") for f in mechanism.open_inputs]
    described = [
        {
            "name": printed_name(mechanism.open_inputs[number]),
            "unit": quantities[number].unit,
            "kind": str(quantities[number].kind),
            "orders": [value.order for value in values if value.input == number],
            "of_time": any(v.symbol in of_time for v in values if v.input == number),
        }
        for number in sorted({value.input for value in values})
    ]
    symbols = {value.symbol for value in values}
    names: dict[
        str, tuple[str, ...]
    ] = {  # accelerations and multipliers are those that inputs make
        o.name: (o.name,) for o in program.outputs if not functions.needs_motion(o)
    }
    if "tree_subspace" in names:  # the runtime makes these of the tree's data
        names |= dict.fromkeys(("mass_matrix", "constraint_jacobian"), ("constraints", *TREE))
    free = [
        request.name_of(name)
        for name, parts in names.items()
        if symbols.isdisjoint(_used(program, parts))
    ]
    return {"inputs": described, "free_of_inputs": free}


def _used(program: Program, names: Iterable[str]) -> set[Symbol]:
    """Every symbol that the outputs depend on."""
    needed = symbols_of(o for o in program.outputs if o.name in names)
    return needed | symbols_of(slice_statements(program.body, needed))


def _solved_shapes(
    mechanism: Mechanism, parameters: int, request: OutputRequest, program: Program
) -> dict[str, list[int]]:
    """Shapes of outputs that the runtime computes."""
    size, rows = len(mechanism.speeds), len(mechanism.holonomic) + len(mechanism.motion_constraints)
    states = len(mechanism.coordinates) + len(mechanism.states) + size
    shapes = {"mass_matrix": [size, size], "forcing": [size]}
    differentiated = _differentiated_outputs(program, request).get("differentiated", ())
    own = len(request.expressions) + sum(size for _, size in differentiated)
    widths = (states, parameters, len(program.input_values()))
    for by, columns in zip(("state", "parameter", "input"), widths, strict=True):
        shapes[f"{by}_jacobian"] = [states, columns]
        shapes[f"own_{by}_jacobian"] = [own, columns]
    return shapes | ({"constraint_jacobian": [rows, size], "multipliers": [rows]} if rows else {})


OUTPUTS = {
    "energy": ("kinetic_energy", "potential_energy"),
    "momenta": ("linear_momenta", "angular_momenta"),
    "points": ("points", "point_velocities"),
    "multipliers": ("multipliers",),
    "accelerations": ("point_accelerations",),
    "reactions": ("reaction_forces", "reaction_torques"),
    "state_jacobian": (
        *("state_jacobian", "own_state_jacobian", "velocity_gradient"),
        *("input_jacobian", "own_input_jacobian"),
    ),
    "parameter_jacobian": ("parameter_jacobian", "own_parameter_jacobian"),
    "sensitivities": ("sensitivities",),
}


def _outputs_left_out(request: OutputRequest) -> list[str]:
    return [name for name in OUTPUTS if not request.includes(name)]


def _unavailable(mechanism: Mechanism, request: OutputRequest) -> dict[str, str]:
    """A dict from each requested output that the mechanism does not determine to the reason."""
    reasons: dict[str, str] = {}
    if request.includes("energy") and mechanism.unknown_potentials:
        reasons["potential_energy"] = (
            f"whether {', '.join(mechanism.unknown_potentials)} has a potential cannot be seen "
            "from the load; give the bodies a potential_energy that has that of all loads. The "
            "balance of power holds in any case"
        )
    if request.includes("energy") and mechanism.equations and not mechanism.equations.energies:
        why = (
            "the equations were given without it: mechc.from_equations(..., kinetic_energy=, "
            "potential_energy=) takes both"
        )
        reasons |= dict.fromkeys(OUTPUTS["energy"], why)
    if request.includes("points") and not mechanism.points:
        why = "no position of a body from a point at rest in the inertial frame is known"
        reasons |= dict.fromkeys(OUTPUTS["points"], why)
    return reasons


def distinct(names: Iterable[str]) -> Iterator[str]:
    """The names, where each repeated one gets a number."""
    seen: dict[str, int] = {}
    taken = list(names)
    for name in taken:
        seen[name] = seen.get(name, 0) + 1
        different = name if seen[name] == 1 else f"{name} ({seen[name]})"
        while seen[name] > 1 and different in taken:
            different += "'"
        yield different


def described_quantities(
    things: Iterable[Coordinate | State | Speed | Parameter],
) -> list[dict[str, Any]]:
    """Names, units and bounds of quantities, in order."""

    def finite(bound: float) -> float | None:
        return bound if math.isfinite(bound) else None

    return [
        {
            "name": printed_name(thing.symbol),
            "unit": thing.quantity.unit,
            "kind": thing.quantity.kind,
            "description": thing.quantity.description,
            "lower": finite(thing.quantity.lower),
            "upper": finite(thing.quantity.upper),
            "closed": thing.quantity.closed,
        }
        for thing in things
    ]


def operation_counts(lowered: Program, functions: SceneFunctions) -> dict[str, Any]:
    """Numbers of operations, functions included, before and after optimisation.

    ``outputs``: of each separately.  ``stages``: of the two functions that a right-hand side is
    computed with.  ``zeros``: how many of an output's elements are zero for any state, and of how
    many.  ``once_per_run``: of parameters only, kept in so many ``constants``.
    """
    program, request = functions.program, functions.request
    outputs = {
        request.name_of(output.name): [
            _cost(lowered, [output]),
            _cost(program, [program.output(output.name)]),
        ]
        for output in lowered.outputs
    }
    return {
        "before": sum(before for before, _ in outputs.values()),  # nothing is shared there yet
        "after": _cost(program, program.outputs),
        "once_per_run": operations(program.hoisted),
        "constants": len(functions.constants),
        "outputs": outputs,
        "stages": _stages(functions),
        "zeros": {
            request.name_of(o.name): [o.elements.count(S.Zero), len(o.elements)]
            for o in program.outputs
        },
    }


def _stages(functions: SceneFunctions) -> dict[str, int]:
    """Operations of the configuration, and those added for the speeds."""
    program, present, layout = functions.program, functions.outputs, functions.layout
    first = [present[name] for name in layout.configuration if name in present]
    both = [*first, *(present[name] for name in layout.motion if name in present)]
    configuration = _cost(program, first)
    return {"configuration": configuration, "motion": _cost(program, both) - configuration}


def _row_blocks(functions: SceneFunctions) -> dict[str, Any]:
    """Rows and speeds of each block of constraint rows, and operations with and without blocks."""
    form = functions.blocks
    if form is None:
        return {}
    return {
        "row_blocks": {
            "blocks": [[len(b.rows), len(b.speeds)] for b in form.blocks],
            "by_block": BlockElimination(form).operations(),
            "together": orthogonal_operations(len(form.jacobian), len(form.mass)),
        }
    }


def _series(series: Series) -> dict[str, Any]:
    """How much work an order is, and whether that is so little that a run by itself is the faster
    by its Taylor series (``mechc bench default``): in lanes linear equations cost less."""
    few = series.sums <= MOST_SUMS_ALONE
    return {"sums": series.sums, "leads_alone": few and not series.couples_speeds}


def _loads(mechanism: Mechanism, request: OutputRequest) -> dict[str, int]:
    """The number of loads (uniform gravity is one), and the number of loads that vanish."""
    vectors = [load for _, load in mechanism.loads]
    vectors += [] if mechanism.gravity is None else [mechanism.gravity]
    fixed = dict(request.fixed)
    zero = [all(e.xreplace(fixed) == 0 for e in entries_of(v)) for v in vectors]
    return {"given": len(vectors), "zero": sum(zero)}


def _cost(program: Program, outputs: Iterable[Output]) -> int:
    outputs = list(outputs)
    elements = [element for output in outputs for element in output.elements]
    return operations(slice_statements(program.body, symbols_of(outputs)), elements)
