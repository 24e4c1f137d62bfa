"""Stage 4c: Program -> Program that holds the switching functions of the equations.

Input: an optimised program.  Output: the same with one more output, the functions at whose zeros an
equation has a corner or a jump: the arguments of Abs and Step, and sin(pi x) for Floor(x).
Invariant: the program is as before where there is none, and where an equation has a table, which
has corners that no function of these shows.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from sympy import Abs, Expr, pi, sin

from mechc_codegen.derive.equations import Output
from mechc_codegen.description.piecewise import Floor, Step
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.description.tables import Lookup
from mechc_codegen.ir.program import SWITCHING, Program, equation_values, targets_of


def add_switching(program: Program, request: OutputRequest) -> Program:
    """Add the output of the switching functions; user-defined outputs are not looked at."""
    values = list(equation_values(program, request.expressions))
    found = switching_functions(program, values)
    if not found or any(value.has(Lookup) for value in values):
        return program
    labels = tuple(f"switch {i}" for i in range(len(found)))
    equation = "functions at whose zeros the equations change their form"
    output = Output(SWITCHING, equation, found, (len(found),), labels)
    return replace(program, outputs=(*program.outputs, output)).verify()


def switching_functions(program: Program, values: Iterable[Expr]) -> tuple[Expr, ...]:
    """The switching functions of expressions, each with one sign; none of parameters alone."""
    fixed = {*program.symbols.parameters, *targets_of(program.hoisted)}
    found = dict[Expr, None]()
    for value in values:
        for corner in sorted(value.atoms(Abs, Step, Floor), key=str):
            x = corner.args[0]
            function = sin(pi * x) if isinstance(corner, Floor) else x
            if not function.free_symbols <= fixed and -function not in found:
                found[function] = None
    return tuple(found)
