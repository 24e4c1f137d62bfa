"""What is derived for random mechanisms is the textbook's, to 30 digits and after every pass."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.derive.equations import Equations
from mechc_codegen.derive.kane import derive
from mechc_codegen.derive.tree.recursion import derive_tree
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.ir.lower import lower
from mechc_codegen.ir.passes.optimize import PASSES
from mechc_codegen.ir.program import Program
from mpmath import mpf
from sympy import Symbol

from tests.support import scenes
from tests.support.linkages.linkage_objects import by_lagrangian, mechanism
from tests.support.linkages.random_mechanisms import Linkage, examples, linkages, states, values
from tests.support.linkages.textbook import DIGITS, Textbook

ONLY_ENERGY_AND_MULTIPLIERS = OutputRequest(outputs=frozenset({"energy", "multipliers"}))
TINY = mpf(10) ** -30
Values = dict[str, list[mpf]]


@pytest.fixture(scope="module", autouse=True)
def digits() -> Iterator[None]:
    with mpmath.workdps(DIGITS):
        yield


class Case:
    """A linkage at a state: what the textbook says there, and what a program gives."""

    def __init__(self, linkage: Linkage, state: tuple[float, list[float], list[float]]) -> None:
        self.linkage, self.book = linkage, Textbook(linkage, values(linkage))
        self.t = mpf(state[0])
        self.q, self.u = ([mpf(x) for x in part] for part in state[1:])

    def inputs(self, equations: Equations, made: Mechanism) -> dict[Symbol, mpf]:
        symbols = equations.symbols
        names = [p.symbol.name for p in made.parameters]
        known = dict(zip(symbols.parameters, (self.book.values[n] for n in names), strict=True))
        known |= dict(zip((*symbols.q, *symbols.u), (*self.q, *self.u), strict=True))
        return known | {symbols.time: self.t}

    def expected(self) -> Values:
        book, q, u = self.book, self.q, self.u
        said = {
            "mass_matrix": list(book.mass_matrix(q).flat),
            "forcing": book.forcing(q, u, self.t),
            "kinetic_energy": [book.kinetic(q, u)],
            "potential_energy": [book.potential(q)],
        }
        if self.linkage.loop is not None:
            said["constraints"] = list(book.gaps(q))
            said["constraint_jacobian"] = list(book.jacobian(q).flat)
            said["gamma"] = list(book.gamma(q, u))
        return said

    def rolls_on(self) -> None:
        """Change the speeds to ones that the loop allows; loops that lock are left out."""
        if self.linkage.loop is None:
            return
        rows = self.book.jacobian(self.q)
        assume(np.linalg.svd(rows.astype(float), compute_uv=False).min() > 0.05)
        square = mpmath.matrix((rows @ rows.T).tolist())
        pushed = mpmath.lu_solve(square, mpmath.matrix(list(rows @ np.array(self.u))))
        self.u = list(np.array(self.u) - rows.T @ np.array(list(pushed)))


@st.composite
def cases(draw: st.DrawFn, most: int) -> Case:
    linkage = draw(linkages(most))
    return Case(linkage, draw(states(len(linkage.links))))


def same(found: Values, expected: Values) -> None:
    for name, said in expected.items():
        if name in found:
            scale = 1 + max(map(abs, said))
            pairs = zip(found[name], said, strict=True)
            assert max(abs(a - b) for a, b in pairs) < TINY * scale, name


def stages(equations: Equations) -> Iterator[Program]:
    """The program as it is lowered, and after each pass."""
    program = lower(equations)
    yield program
    for apply in PASSES:
        program = apply(program).verify()
        yield program


def check(case: Case, make: Callable[[Linkage], Mechanism], derived: Any) -> Sequence[Values]:
    """What each stage gives is the textbook's; what the textbook does not know stays the same."""
    made = make(case.linkage)
    equations = differentiate(derived(made, ONLY_ENERGY_AND_MULTIPLIERS))
    inputs, expected = case.inputs(equations, made), case.expected()
    found = [scenes.run_program(program, inputs) for program in stages(equations)]
    for after in found:
        same(after, expected)
        same(after, found[0])
    return found


@pytest.mark.slow
@examples(8)
@given(case=cases(4))
def test_equations_written_out_are_the_textbooks_after_every_pass(case: Case) -> None:
    names = set(check(case, mechanism, derive)[-1])
    assert names >= {"mass_matrix", "forcing", "kinetic_energy", "potential_energy"}
    assert case.linkage.loop is None or names >= {"constraints", "constraint_jacobian", "gamma"}


@examples(5)
@given(case=cases(3))
@pytest.mark.thorough
def test_lagranges_equations_are_the_textbooks_after_every_pass(case: Case) -> None:
    """M, F and the energies from L alone: Kane's and Lagrange's method agree."""
    assert {"mass_matrix", "forcing"} <= set(check(case, by_lagrangian, derive)[-1])


@pytest.mark.slow
@examples(15)
@given(case=cases(6))
def test_equations_by_links_are_the_textbooks_after_every_pass(case: Case) -> None:
    """Energies, gaps and their derivatives; M and F come of the tree at run time."""
    names = set(check(case, mechanism, derive_tree)[-1])
    assert names >= {"kinetic_energy", "potential_energy"}


@pytest.mark.thorough
@examples(8)
@given(case=cases(6))
def test_matrices_written_out_by_links_are_the_textbooks_after_every_pass(case: Case) -> None:
    """M of composite bodies, F by inverse dynamics at rest."""
    assume(case.linkage.loop is None)
    names = set(check(case, mechanism, partial(derive_tree, written=True))[-1])
    assert names >= {"mass_matrix", "forcing"}


@examples(8)
@given(case=cases(4))
@pytest.mark.thorough
def test_energy_changes_by_the_power_of_the_loads_without_potential(case: Case) -> None:
    """d(T + V)/dt along the motion; the loop's forces have no power."""
    case.rolls_on()
    made = mechanism(case.linkage)
    equations = differentiate(derive(made, ONLY_ENERGY_AND_MULTIPLIERS))
    program = lower(equations)
    found = scenes.run_program(program, case.inputs(equations, made))
    accelerations = _solved(found, len(case.u))
    power = mpmath.fdot(case.book.other_forces(case.q, case.u, case.t), case.u)
    h = mpf(10) ** -20
    start, energies = (case.q, case.u), []
    for step in (h, -h):
        case.q, case.u = (
            [a + step * b for a, b in zip(of, along, strict=True)]
            for of, along in zip(start, (start[1], accelerations), strict=True)
        )
        moved = scenes.run_program(program, case.inputs(equations, made))
        energies.append(moved["kinetic_energy"][0] + moved["potential_energy"][0])
    change = (energies[0] - energies[1]) / (2 * h)
    assert abs(change - power) < TINY * (1 + abs(power) + abs(energies[0]))


def _solved(found: Values, size: int) -> list[mpf]:
    """u' of M u' + J^T lambda = F, J u' = gamma."""
    gamma = found.get("gamma", [])
    rows = len(gamma)
    whole = mpmath.zeros(size + rows)
    for i in range(size):
        for j in range(size):
            whole[i, j] = found["mass_matrix"][i * size + j]
        for r in range(rows):
            whole[i, size + r] = whole[size + r, i] = found["constraint_jacobian"][r * size + i]
    return list(mpmath.lu_solve(whole, mpmath.matrix([*found["forcing"], *gamma])))[:size]
