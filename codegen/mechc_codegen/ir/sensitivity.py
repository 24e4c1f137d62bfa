"""Stage 4b: Program -> Program that holds derivatives of the motion by the state or parameters.

Input: an optimised program.  Output: the same with the derivatives of what the motion is solved
from, R = M u' + J^T lambda - F and S = J u' - gamma, at the accelerations and multipliers of the
motion; the runtime solves M du' + J^T dlambda = -dR, J du' = -dS for the motion's own.  Invariant:
forward differentiation from statement to statement, each in the derivatives of those before it, so
that nothing is expanded; the statements that were there stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from sympy import Add, Expr, S, Symbol

from mechc_codegen.derive.equations import Output
from mechc_codegen.description.derivatives import Derivatives, slope
from mechc_codegen.description.piecewise import is_of_sizes
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.ir.passes.rewrite import with_common_named
from mechc_codegen.ir.program import (
    Assign,
    Program,
    Statement,
    in_order_of_use,
    slice_statements,
    symbols_in,
    symbols_of,
)

Gradient = Mapping[int, Expr]


def add_sensitivities(
    program: Program, request: OutputRequest, defaults: Sequence[Expr | None],
    derivatives: Derivatives,
) -> Program:  # fmt: skip
    """Add the derivatives that the requested Jacobians are solved from.

    ``defaults``: of the parameters; sensitivities follow them.
    """
    if not request.includes_jacobian:
        return program
    own = [*request.expressions, *request.differentiated_outputs(program.named_values())]
    if request.includes("state_jacobian"):
        state = (*program.symbols.q, *program.symbols.u)
        program = _by(program, own, ("state", "q and u"), state, "d", derivatives)
    if request.includes("parameter_jacobian") and program.symbols.parameters:
        values = program.symbols.parameters
        program = _by(program, own, ("parameters", "parameters"), values, "e", derivatives)
        program = _with_slopes(program, defaults)
    if request.includes("state_jacobian") and program.input_values():
        inputs = [value.symbol for value in program.input_values()]
        program = _by(program, own, ("inputs", "inputs"), inputs, "f", derivatives)
    return program.verify()


def _by(
    program: Program, own: Sequence[str], titles: tuple[str, str], others: Sequence[Symbol],
    prefix: str, derivatives: Derivatives,
) -> Program:  # fmt: skip
    """Add derivatives by the state, by parameters, or by all values of inputs at run time and their
    rates; ``titles``: of these in names and in words."""
    by, words = titles
    forward = _Forward(program, others, prefix, derivatives)
    added = [forward.output(f"residual_by_{by}", f"dR and dS by {words}", residual(program))]
    added += forward.of(f"rate_by_{by}", f"derivative of q' by {words}", "coordinate_rates")
    if by == "state":
        equation = "derivative of J u + b by q"
        gradient = forward.of("velocity_gradient", equation, "velocity_constraints")
        added += [_first_columns(output, len(program.symbols.q)) for output in gradient]
    for name in ("constraints", "velocity_constraints") if by != "state" else ():
        added += forward.of(f"{name}_by_{by}", f"derivative of the {name} by {by}", name)
    added += _of_own(f"own_by_{by}", program, forward, own)
    kept, named = with_common_named(forward.statements, added, f"{prefix}{{}}x", "none")
    return with_statements(replace(program, outputs=(*program.outputs, *named)), kept)


def _with_slopes(program: Program, defaults: Sequence[Expr | None]) -> Program:
    """Add the derivatives of defaults by the parameters that they depend on."""
    values = program.symbols.parameters
    slopes = [S.Zero if d is None else slope(d, p) for d in defaults for p in values]
    if not any(slopes):
        return program
    size = len(values)
    labels = tuple(f"default {i} by {k}" for i in range(size) for k in range(size))
    equation = "derivative of the defaults by the parameters"
    added = Output("default_slopes", equation, tuple(slopes), (size, size), labels)
    return replace(program, outputs=(*program.outputs, added))


def _of_own(name: str, program: Program, forward: _Forward, own: Sequence[str]) -> list[Output]:
    """Derivatives of user-defined outputs at a given motion, then by u' and lambda."""
    if not own:
        return []
    values = program.named_values()
    elements = [e for each in own for e in values[each]]
    explicit = forward.output(name, "derivatives at a given u' and lambda", elements)
    prefix, motion = f"{forward.prefix}m", program.symbols.motion
    of_motion = _Forward(program, motion, prefix, forward.derivatives)
    along = of_motion.output(name, "derivatives by u' and lambda", elements)
    forward.statements += of_motion.statements
    (_, width), (_, more) = explicit.shape, along.shape
    entries, labels = list[Expr](), list[str]()
    for i in range(len(elements)):
        entries += explicit.elements[i * width : (i + 1) * width]
        entries += along.elements[i * more : (i + 1) * more]
        labels += [f"{name}[{i}, {k}]" for k in range(width + more)]
    shape = (len(elements), width + more)
    return [Output(name, explicit.equation, tuple(entries), shape, tuple(labels))]


def residual(program: Program) -> list[Expr]:
    """R and S, which vanish at the motion's accelerations and multipliers.

    A tree has them among its outputs; elsewhere they are formed from M, F, J and gamma.
    """
    names = {o.name for o in program.outputs}
    if "residual" in names:
        return list(program.output("residual").elements)

    def elements(name: str) -> tuple[Expr, ...]:
        used = f"augmented_{name}" if f"augmented_{name}" in names else name
        return program.output(used).elements if used in names else ()

    a, multipliers = program.symbols.accelerations, program.symbols.multipliers
    size, mass, rows = len(a), elements("mass_matrix"), elements("constraint_jacobian")
    balance = [
        sum((mass[i * size + j] * a[j] for j in range(size)), -force)
        + sum((rows[k * size + i] * x for k, x in enumerate(multipliers)), S.Zero)
        for i, force in enumerate(elements("forcing"))
    ]
    gamma = elements("gamma")
    kept = [
        sum((rows[k * size + j] * a[j] for j in range(size)), -gamma[k])
        for k in range(len(multipliers))
    ]
    return [*balance, *kept]


class _Forward:
    """Gradients of a program's statements by some of its inputs, as statements of their own."""

    def __init__(
        self,
        program: Program,
        inputs: Sequence[Symbol],
        prefix: str,
        derivatives: Derivatives,
    ) -> None:
        self.program, self.inputs, self.prefix = program, inputs, prefix
        self.derivatives = derivatives
        self.gradients: dict[Symbol, Gradient] = {x: {k: S.One} for k, x in enumerate(inputs)}
        self.statements: list[Assign] = []
        self._named: dict[Expr, Symbol] = {}
        self._sizes = sizes_of((*program.hoisted, *program.body))
        self._done: set[Symbol] = set(self._sizes)

    def output(self, name: str, equation: str, elements: Iterable[Expr]) -> Output:
        """The derivatives of the elements, row by row."""
        values = list(elements)
        self._reach(values)
        rows = [self._gradient(value) for value in values]
        width = len(self.inputs)
        entries = tuple(row.get(k, S.Zero) for row in rows for k in range(width))
        labels = tuple(f"{name}[{i}, {k}]" for i in range(len(rows)) for k in range(width))
        return Output(name, equation, entries, (len(rows), width), labels)

    def of(self, name: str, equation: str, differentiated: str) -> list[Output]:
        """The derivatives of an output, if the program has it; q' = u has none."""
        found = [o for o in self.program.outputs if o.name == differentiated]
        listed = [o for o in found if o.elements and o.elements != self.program.symbols.u]
        return [self.output(name, equation, o.elements) for o in listed]

    def _reach(self, values: Iterable[Expr]) -> None:
        """Gradients of every statement that the values depend on."""
        needed = symbols_in(values)
        body = slice_statements(self.program.body, needed)
        hoisted = slice_statements(self.program.hoisted, needed | symbols_of(body))
        for statement in (*hoisted, *body):
            if statement.targets[0] not in self._done:
                self._done.update(statement.targets)
                gradient = self._gradient(statement.value)
                if isinstance(statement, Assign):
                    self._keep(statement.target, gradient)
                    continue
                sine, cosine = statement.targets
                self._keep(sine, {k: cosine * d for k, d in gradient.items()})
                self._keep(cosine, {k: -sine * d for k, d in gradient.items()})

    def _keep(self, symbol: Symbol, gradient: Gradient) -> None:
        named = {k: self._name(value) for k, value in gradient.items()}
        if named:
            self.gradients[symbol] = named

    def _name(self, value: Expr) -> Expr:
        """A symbol for the value, or the value itself where that is as short."""
        if value.is_Atom or (-value).is_Atom:
            return value
        if value not in self._named:
            self._named[value] = Symbol(f"{self.prefix}{len(self.statements)}", real=True)
            self.statements.append(Assign(self._named[value], value))
        return self._named[value]

    def _gradient(self, value: Expr) -> dict[int, Expr]:
        """The gradient of a value, by the chain rule over its symbols."""
        found: dict[int, list[Expr]] = {}
        value = value.xreplace(self._sizes)
        partials = self.derivatives.all_of(value)
        for symbol in sorted(partials.keys() & self.gradients.keys(), key=str):
            for k, along in self.gradients[symbol].items():
                found.setdefault(k, []).append(partials[symbol] * along)
        sums = {k: Add(*terms) for k, terms in found.items()}
        return {k: total for k, total in sums.items() if total != 0}


def sizes_of(statements: Iterable[Statement]) -> dict[Symbol, Expr]:
    """The statements of powers of absolute values, which are differentiated where they are used."""
    found: dict[Symbol, Expr] = {}
    for statement in statements:
        if isinstance(statement, Assign):
            value = statement.value.xreplace(found)
            if is_of_sizes(value):
                found[statement.target] = value
    return found


def _first_columns(output: Output, count: int) -> Output:
    rows, width = output.shape
    places = [i * width + k for i in range(rows) for k in range(count)]
    return replace(
        output,
        elements=tuple(output.elements[i] for i in places),
        shape=(rows, count),
        labels=tuple(output.labels[i] for i in places),
    )


def with_statements(program: Program, added: Sequence[Statement]) -> Program:
    """The program with added statements, hoisted where they depend on parameters alone."""
    parameters = {*program.symbols.parameters, *(x for s in program.hoisted for x in s.targets)}
    fixed, running = list[Statement](program.hoisted), list[Statement](program.body)
    for statement in in_order_of_use(added):
        if statement.symbols <= parameters:
            fixed.append(statement)
            parameters.update(statement.targets)
        else:
            running.append(statement)
    return replace(program, hoisted=tuple(fixed), body=tuple(running))
