"""The division of a scene's equations into functions: what each computes, and into which array.

Expanded equations: configuration() gives constraints and mass matrix, motion() forcing.  For a tree
these are functions of the runtime, and the scene gives their data.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate

from mechc_codegen.derive.equations import Equations, Tree
from mechc_codegen.emit.elimination_order import plan_rows, walks_moving_cuts
from mechc_codegen.ir.program import SWITCHING

INTERNAL = ("residual", "velocity_bias", "gamma", "augmented_mass_matrix", "augmented_forcing")
# Jacobian -> arrays it is solved from: of the motion, of user-defined outputs, of q'.
JACOBIANS = {
    "state_jacobian": ("residual_by_state", "own_by_state", "rate_by_state"),
    "parameter_jacobian": ("residual_by_parameters", "own_by_parameters", "rate_by_parameters"),
    "input_jacobian": ("residual_by_inputs", "own_by_inputs", "rate_by_inputs"),
}
RESIDUALS, OWN, _RATES = zip(*JACOBIANS.values(), strict=True)
ADJOINT = "residual_adjoint"
UNLISTED = (*RESIDUALS, *OWN, *_RATES, ADJOINT, SWITCHING)  # parts of others, or of the runtime's
TREE = ("tree_offset", "tree_subspace", "tree_inertia", "tree_reference", "tree_cut")
SIZES_OF_TREES = (
    *("links", "planar", "columns", "speeds_shared", "carried", "factors", "moving_cuts"),
    *("pairs", "moments", "several_loops"),
)
TREE_MOTION = ("tree_bias", "tree_wrench")
ROWS = {"constraints": "gap", "constraint_jacobian": "jacobian", "velocity_bias": "bias"}


@dataclass(frozen=True)
class FunctionLayout:
    """The outputs of each of the two functions, with the argument that each is written to.

    ``tables``: whole numbers of the scene that the runtime reads; ``sizes``: their extents;
    ``solved``: outputs that are functions of the runtime's, with their widths; ``kept``: numbers
    that the configuration passes on besides the program's values; ``storage`` of the functions.
    """

    configuration: Mapping[str, str]
    motion: Mapping[str, str]
    sizes: Mapping[str, int]
    prefix: str = ""
    tables: Mapping[str, Sequence[int]] = field(default_factory=dict)
    solved: tuple[tuple[str, int], ...] = ()
    kept: int = 0
    storage: str = "MECHC_INLINE"


def layout(equations: Equations, present: Collection[str]) -> FunctionLayout:
    """The layout for equations with these outputs."""
    if equations.tree is None:
        return _written_out(present)
    return _tree_layout(equations, equations.tree)


def _written_out(present: Collection[str]) -> FunctionLayout:
    def solved_with(name: str) -> str:
        augmented = f"augmented_{name}"
        return augmented if augmented in present else name

    return FunctionLayout(
        {**ROWS, solved_with("mass_matrix"): "mass"},
        {solved_with("forcing"): "forcing", "gamma": "gamma"},
        dict.fromkeys(SIZES_OF_TREES, 0),
    )


def _tree_layout(equations: Equations, tree: Tree) -> FunctionLayout:
    columns = [speed for own in tree.columns for speed in own]
    first = [0, *accumulate(len(own) for own in tree.columns)]
    size, rows = len(equations.symbols.u), len(tree.rows)
    kept = [name for name in TREE if name in equations.outputs]
    plan = plan_rows(tree)
    solved = [("mass_matrix", size**2), ("forcing", size)]
    if rows:
        solved.append(("constraint_jacobian", rows * size))
    of_rows = (
        {}
        if plan is None
        else {
            "first_row": plan.first,
            "cut_place": plan.cut_place,
            "handed_to": plan.passed_to,
            "row_taken": plan.pivot,
            "first_factor": plan.first_factor,
        }
    )
    tables = {
        "parent": tree.parents,
        "first_column": first,
        "column_speed": columns,
        **(_pairs_of_rows(tree) if rows else {}),
        **of_rows,
    }
    return FunctionLayout(
        {
            "constraints": "gap",
            **({"velocity_bias": "bias"} if rows else {}),
            **{name: name.removeprefix("tree_") for name in kept},
        },
        {"tree_bias": "bias", "tree_wrench": "wrench", "gamma": "gamma"},
        {
            "links": len(tree.parents),
            "planar": int(tree.planar),
            "carried": plan.first[-1] if plan else 0,
            "factors": plan.first_factor[-1] if plan else 0,
            "columns": len(columns),
            "speeds_shared": int(tree.shared),
            "moving_cuts": int(plan is None and walks_moving_cuts(tree)),
            "pairs": sum(map(len, tree.rows)),
            "moments": int(tree.moments),
            "several_loops": int(tree.several_loops),
        },
        "tree_",
        tables,
        tuple(solved),
        sum(len(equations.outputs[name].elements) for name in kept),
        "MECHC_ONCE",
    )


def _pairs_of_rows(tree: Tree) -> dict[str, Sequence[int]]:
    """The links of each pair, and the first pair of each row, with one more for the end."""
    return {
        "cut": [link for row in tree.rows for pair in row for link in pair],
        "first_pair": [0, *accumulate(map(len, tree.rows))],
    }
