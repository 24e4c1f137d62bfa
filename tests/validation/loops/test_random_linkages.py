"""Random mechanisms, compiled: the textbook's numbers, however they are described and derived."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mechc_codegen.derive import derive_equations

import mechc
from tests.support.linkages.linkage_objects import formed, mechanism, system
from tests.support.linkages.random_mechanisms import Linkage, examples, linkages, states, values
from tests.support.linkages.textbook import DIGITS, Textbook

EPS = float(np.finfo(float).eps)
OUTPUTS = ("energy", "multipliers")
BY_LINKS, WRITTEN_OUT = 1, 99  # the least number of speeds that are derived link by link
EIGHTH_ORDER = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}  # central differences


def compiled(
    thing: Any, least_tree: int = derive_equations.LEAST_TREE, **asked: Any
) -> mechc.Model:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derive_equations, "LEAST_TREE", least_tree)
        written = min(least_tree, derive_equations.LEAST_WRITTEN)
        patch.setattr(derive_equations, "LEAST_WRITTEN", written)
        name = f"least_{least_tree}"  # the cache does not know the least number
        return mechc.compile(thing, outputs=OUTPUTS, name=name, **asked)


class Case:
    """A linkage at a state, with the textbook's numbers as doubles."""

    def __init__(self, linkage: Linkage, state: tuple[float, list[float], list[float]]) -> None:
        self.linkage, self.t = linkage, state[0]
        self.q, self.u = (np.array(part) for part in state[1:])
        with mpmath.workdps(DIGITS):
            book = Textbook(linkage, values(linkage))
            q = [mpmath.mpf(x) for x in self.q.tolist()]
            if linkage.loop is not None:
                self._roll_on(book.jacobian(q).astype(float))
            u, t = [mpmath.mpf(x) for x in self.u.tolist()], mpmath.mpf(self.t)
            motion, multipliers = book.motion(q, u, t)
            self.motion, self.multipliers = np.array(motion, float), np.array(multipliers, float)
            self.mass = book.mass_matrix(q).astype(float)
            self.jacobian = book.jacobian(q).astype(float) if len(multipliers) else None
            self.energy = float(book.kinetic(q, u) + book.potential(q))
            self.power = float(mpmath.fdot(book.other_forces(q, u, t), u))

    def _roll_on(self, rows: Any) -> None:
        """Speeds that the loop allows; loops that lock are left out."""
        assume(np.linalg.svd(rows, compute_uv=False).min() > 0.05)
        for _ in range(2):
            self.u = self.u - np.linalg.lstsq(rows, rows @ self.u, rcond=None)[0]

    @property
    def y(self) -> Any:
        return np.concatenate([self.q, self.u])

    @property
    def condition(self) -> float:
        """Of the matrix by which accelerations and multipliers are solved for."""
        if self.jacobian is None:
            return float(np.linalg.cond(self.mass))
        nothing = np.zeros((len(self.jacobian),) * 2)
        whole = np.block([[self.mass, self.jacobian.T], [self.jacobian, nothing]])
        return float(np.linalg.cond(whole))


@st.composite
def cases(draw: st.DrawFn, most: int) -> Case:
    linkage = draw(linkages(most))
    return Case(linkage, draw(states(len(linkage.links))))


def check(case: Case, model: mechc.Model) -> None:
    """Motion, multipliers and energy are the textbook's; M is symmetric and positive definite."""
    size, y, t = len(case.q), case.y, case.t
    rates = model.rhs(t, y)
    scale = max(1.0, np.abs(case.motion).max(), np.abs(case.multipliers).max(initial=0.0))
    allowed = 32 * EPS * case.condition * scale
    np.testing.assert_array_equal(rates[:size], case.u)
    np.testing.assert_allclose(rates[size:], case.motion, rtol=0, atol=allowed)
    found = model.multipliers(y, t=t)
    np.testing.assert_allclose(found, case.multipliers, rtol=0, atol=allowed)
    mass = model.mass_matrix(y, t=t)
    np.testing.assert_array_equal(mass, mass.T)
    np.testing.assert_allclose(mass, case.mass, rtol=0, atol=64 * EPS * np.abs(case.mass).max())
    assert np.linalg.eigvalsh(mass).min() > 0


def check_power(case: Case, model: mechc.Model) -> None:
    """d(T + V)/dt along the motion, by differences of eighth order."""
    assert model.energy(case.y, t=case.t) == pytest.approx(case.energy, abs=1e-12)
    rates, h = model.rhs(case.t, case.y), 2e-3
    change = sum(
        c / h * (model.energy(case.y + n * h * rates) - model.energy(case.y - n * h * rates))
        for n, c in EIGHTH_ORDER.items()
    )
    fastest = np.abs(rates).max()
    assume(fastest < 50)  # the differences' own error
    assert change == pytest.approx(case.power, abs=1e-9 * max(1.0, abs(case.energy)) * fastest)


@pytest.mark.thorough
@examples(6)
@given(case=cases(6))
def test_what_is_derived_by_links_moves_as_the_textbook_says(case: Case) -> None:
    model = compiled(mechanism(case.linkage), BY_LINKS)
    assert model.system.data["walked"]
    check(case, model)
    check_power(case, model)


@examples(4)
@given(case=cases(4))
@pytest.mark.thorough
def test_what_is_written_out_moves_as_the_textbook_says(case: Case) -> None:
    model = compiled(mechanism(case.linkage), WRITTEN_OUT)
    assert not model.system.data["walked"]
    check(case, model)
    check_power(case, model)


@examples(4)
@given(case=cases(3))
@pytest.mark.thorough
def test_a_system_of_joints_moves_as_the_textbook_says(case: Case) -> None:
    check(case, compiled(system(case.linkage), defaults=defaults(case)))


@examples(3)
@given(case=cases(3))
@pytest.mark.thorough
def test_kanes_and_lagranges_method_move_alike(case: Case) -> None:
    """One System of joints, formed by SymPy's KanesMethod, and by its LagrangesMethod."""
    for speeds in (True, False):
        thing = formed(system(case.linkage, speeds=speeds))
        check(case, compiled(thing.eom_method, defaults=defaults(case)))


def defaults(case: Case) -> dict[str, float]:
    """Values of the parameters that the linkage has."""
    links = case.linkage.links
    used = {"k": any(x.spring for x in links), "d": any(x.damper for x in links)}
    used["tau"] = any(x.driven for x in links)
    return {n: v for n, v in values(case.linkage).items() if used.get(n, True)}
