"""Descriptions that contradict themselves are refused, or have the rates of SymPy's own equations.

Random bodies in a plane whose velocities, angular velocities, accelerations, constraints and rates
of constraints are right, wrong or missing.  SymPy's matrices are evaluated by mpmath at states that
satisfy the constraints of its object.
"""

from __future__ import annotations

import itertools
import random
from collections import Counter
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sm
import sympy.physics.mechanics as me
from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.derive.kane import derive
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from sympy.matrices.exceptions import NonInvertibleMatrixError

from tests.support import scenes
from tests.support.sympy_objects import ball_on_disc

t = me.dynamicsymbols._t
l, m, inertia = sm.symbols("l m I")
SINGULAR = 1e-5  # of the largest singular value: beside it rates are rounding of the state


def described(thing: Any, **settings: Any) -> Any:
    options = CompileOptions(ConversionSettings(**settings))
    return CompileRequest(thing, options).description()[0]


class Rates:
    """The rates of all coordinates and speeds, by mechc's equations and by SymPy's."""

    def __init__(self, method: Any, made: Any) -> None:
        equations = differentiate(derive(made, OutputRequest(frozenset({"multipliers"}))))
        names = ("mass_matrix", "forcing", "constraint_jacobian", "gamma", "coordinate_rates")
        self._own, self._size = scenes.exact(equations, *names), len(made.u)
        self.method, self.q, self.u = method, list(made.q), list(made.u)
        speeds = {q.diff(t): u for q, u in zip(made.q, made.u, strict=True)}
        is_kane = isinstance(method, me.KanesMethod)
        states = [*method.q, *method.u]
        self.order = [states.index(x) if is_kane else k for k, x in enumerate([*made.q, *made.u])]
        self.parameters = [p.symbol for p in made.parameters]
        arguments = [t, *states, *self.parameters]
        if not is_kane:  # whose speeds are rates
            arguments = [t, *made.q, *made.u, *self.parameters]
        replaced = {} if is_kane else speeds
        matrices = [
            sm.Matrix(each).xreplace(replaced)
            for each in (method.mass_matrix_full, method.forcing_full)
        ]
        self._theirs = sm.lambdify(arguments, matrices, modules="mpmath", cse=True)
        if is_kane:
            rows = method._k_nh * method.u + method._f_nh if len(method._f_nh) else ()
            held = [*method._f_h, *rows]
        else:
            held = [*method._hol_coneqs, *method.coneqs]
        self._held = sm.lambdify(
            arguments, [sm.sympify(e).xreplace(replaced) for e in held], cse=True
        )

    def state(self, generator: random.Random) -> list[float] | None:
        """Time, a state in SymPy's order on the constraints of its object, and parameters."""
        fixed = [generator.uniform(0.2, 1.5)]
        given = [generator.uniform(0.5, 1.5) for _ in self.parameters]
        y = np.array([generator.uniform(-1.2, 1.2) for _ in self.order])
        for _ in range(60):
            gap = np.array(self._held(*fixed, *y, *given), float)
            if not len(gap) or np.abs(gap).max() < 1e-13:
                return [*fixed, *y, *given]
            sides = [
                [self._held(*fixed, *(y + step), *given) for step in side * np.eye(len(y))]
                for side in (1e-7, -1e-7)
            ]
            slope = np.subtract(*sides).astype(float).T / 2e-7
            y = y - np.linalg.lstsq(slope, gap, rcond=1e-9)[0]
        return None

    def sympys(self, state: list[float]) -> np.ndarray | None:
        with mpmath.workdps(30):
            matrix, right = self._theirs(*map(mpmath.mpf, state))
            sizes = np.linalg.svd(np.array(matrix.tolist(), float), compute_uv=False)
            if not sizes[-1] > SINGULAR * sizes[0]:
                return None
            found = mpmath.lu_solve(matrix, right)
        values = np.array([float(x) for x in found])[: len(self.order)]
        return values[self.order]

    def mechcs(self, state: list[float]) -> np.ndarray:
        count = len(self.order)
        y = [state[1 + k] for k in self.order]
        with mpmath.workdps(30):
            parts = self._own(*map(mpmath.mpf, [state[0], *y, *state[1 + count :]]))
        mass, force, rows, gamma, kinematics = (np.array(each, float) for each in parts)
        n, held = self._size, len(gamma)
        whole = np.zeros((n + held, n + held))
        whole[:n, :n], whole[n:, :n] = mass.reshape(n, n), rows.reshape(held, n)
        whole[:n, n:] = whole[n:, :n].T
        found = np.linalg.lstsq(whole, np.concatenate([force, gamma]), rcond=1e-11)[0]
        return np.concatenate([kinematics, found[:n]])


class Draw:
    """A random description; ``flaws`` names what is wrong or missing in it."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.flaws: list[str] = []
        self.q = me.dynamicsymbols("x y theta")
        self.u = me.dynamicsymbols("u1 u2 u3")
        self.method = self._lagrange() if self.random.random() < 0.25 else self._kane()

    def _wrong(self, what: str, share: float = 0.15) -> bool:
        if self.random.random() >= share:
            return False
        self.flaws.append(what)
        return True

    def _share(self, what: str, share: float) -> int:
        """1 where something is wrong, else 0."""
        return int(self._wrong(what, share))

    def _configuration(self) -> list[Any]:
        x, y, theta = self.q
        pool = [
            x**2 + y**2 - l**2, x - l * sm.cos(theta), y - l * sm.sin(theta), x + y - l * theta,
            theta - sm.sin(t), x * y - l * theta,
        ]  # fmt: skip
        rows = self.random.sample(pool, self.random.choice((0, 1, 1, 2)))
        if rows and self._wrong("distance", 0.08):
            rows[0] = self.random.choice((rows[0] ** 2, sm.sqrt(rows[0] ** 2), sm.Abs(rows[0])))
        return rows

    def _velocity(self, configuration: list[Any], rates: dict[Any, Any]) -> list[Any]:
        """Rates of the configuration constraints, and other rows, over the speeds."""
        x, y, theta = self.q
        found = []
        for row in configuration:
            if self._wrong("missing rate", 0.12):
                continue
            rate = row.diff(t)
            found.append(
                rate + self.random.choice(self.q).diff(t) * self._share("other rate", 0.12)
            )
        if len(found) < 2 and self.random.random() < 0.3:
            rows = [sm.sin(theta) * x.diff(t) - sm.cos(theta) * y.diff(t)]
            if self._wrong("integrable", 0.4):
                rows = [x * x.diff(t) + y * y.diff(t), x.diff(t) - l * theta.diff(t)]
            found.append(self.random.choice(rows))
        return [row.xreplace(rates) for row in found]

    def _kane(self) -> Any:
        (x, y, theta), u = self.q, self.u
        turned = self.random.random() < 0.5
        c, s = sm.cos(theta), sm.sin(theta)
        along = [u[0] * c - u[1] * s, u[0] * s + u[1] * c] if turned else u[:2]
        rates = dict(zip([q.diff(t) for q in self.q], [*along, u[2]], strict=True))
        frame, origin = me.ReferenceFrame("N"), me.Point("O")
        origin.set_vel(frame, 0)
        body = frame.orientnew("A", "Axis", (theta, frame.z))
        spin = u[2] * (2 if self._wrong("spin") else 1) + u[0] * self._share("spin too", 0.05)
        body.set_ang_vel(frame, spin * frame.z)
        centre = origin.locatenew("C", x * frame.x + y * frame.y)
        factor = sm.Rational(3, 2) if self._wrong("velocity", 0.1) else 1
        centre.set_vel(frame, factor * along[0] * frame.x + along[1] * frame.y)
        tip = centre.locatenew("P", l * body.x)
        if self._wrong("velocity of the tip", 0.1):
            tip.set_vel(frame, along[0] * frame.x)
        else:
            tip.v2pt_theory(centre, frame, body)
        if self.random.random() < 0.2:
            own = centre.vel(frame).diff(t, frame)
            own = sum((own.dot(e).xreplace(rates) * e for e in (frame.x, frame.y)), me.Vector(0))
            centre.set_acc(frame, own * (2 if self._wrong("acceleration", 0.5) else 1))
        configuration = self._configuration()
        velocity = self._velocity(configuration, rates)
        rod = me.RigidBody("rod", centre, body, m, (me.inertia(body, 0, 0, inertia), centre))
        bodies = [rod, me.Particle("tip", tip, m)]
        loads = [(centre, -m * frame.y), (tip, -m * frame.y + l * frame.x)]
        orders = list(itertools.permutations(u))
        self.random.shuffle(orders)
        for speeds in orders:  # SymPy inverts the rows' part for the dependent speeds
            first, second = len(self.q) - len(configuration), len(speeds) - len(velocity)
            try:
                method = me.KanesMethod(
                    frame, self.q[:first], speeds[:second], [a - b for a, b in rates.items()],
                    q_dependent=self.q[first:], u_dependent=speeds[second:],
                    configuration_constraints=configuration, velocity_constraints=velocity,
                )  # fmt: skip
                method.kanes_equations(bodies, loads)
            except NonInvertibleMatrixError:
                continue
            return method
        return None

    def _lagrange(self) -> Any:
        x, y, theta = self.q
        configuration = self._configuration()
        others = self._velocity([], {})
        if configuration and self._wrong("other rate", 0.2):
            others = [configuration[0].diff(t) + theta.diff(t)]
        energy = m * (x.diff(t) ** 2 + y.diff(t) ** 2) / 2 + inertia * theta.diff(t) ** 2 / 2
        tilt = m * theta.diff(t) * (x.diff(t) * sm.cos(theta) + y.diff(t) * sm.sin(theta)) / 3
        method = me.LagrangesMethod(
            energy + tilt - m * y - l * theta**2, list(self.q), hol_coneqs=configuration,
            nonhol_coneqs=others,
        )  # fmt: skip
        method.form_lagranges_equations()
        return method


def outcome(seed: int) -> tuple[str, list[str]]:
    """The verdict and the flaws; SymPy may have no description, or no numbers."""
    draw = Draw(seed)
    if draw.method is None:
        return "no description", draw.flaws
    try:
        made = described(draw.method)
    except MechanismError:
        return "refused", draw.flaws
    rates, generator, seen = Rates(draw.method, made), random.Random(seed), 0
    for _ in range(4):
        state = rates.state(generator)
        theirs = None if state is None else rates.sympys(state)
        if state is None or theirs is None:
            continue
        seen += 1
        size = max(1.0, np.abs(theirs).max())  # speeds are about 1, or 0 where nothing can move
        if not np.abs(rates.mechcs(state) - theirs).max() < 1e-7 * size:
            return "WRONG", draw.flaws
    return "same" if seen else "no numbers", draw.flaws


@pytest.mark.slow
def test_a_ball_on_a_spinning_disc_has_sympys_rates_or_is_refused() -> None:
    with pytest.raises(MechanismError, match="degrees of freedom: 3, with these rates: 1"):
        described(ball_on_disc(with_positions=True))
    method = ball_on_disc(with_positions=False)
    rates, generator = Rates(method, described(method)), random.Random(1)
    for _ in range(3):
        state = rates.state(generator)
        assert state is not None
        theirs = rates.sympys(state)
        assert theirs is not None
        np.testing.assert_allclose(rates.mechcs(state), theirs, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_descriptions_are_refused_or_move_as_sympy_has_it(seed: int, thorough: bool) -> None:
    count = 300 if thorough else 40
    found = {number: outcome(number) for number in range(1000 * seed, 1000 * seed + count)}
    assert {k: flaws for k, (what, flaws) in found.items() if what == "WRONG"} == {}
    kinds = Counter((what, bool(flaws)) for what, flaws in found.values())
    assert kinds["same", False] > 0.2 * count
    assert kinds["refused", True] > 0.2 * count
    assert kinds["refused", False] < 0.05 * count
