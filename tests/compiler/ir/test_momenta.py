"""The form by momenta against the program's own M and F, whose derivatives are complex steps."""

import mpmath
import numpy as np
import pytest
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.description.request import DEFAULT_REQUEST
from mechc_codegen.ir.momenta import add, harmonic, multiply, products_of
from mechc_codegen.library.chains.pendulum import pendulum
from mechc_codegen.library.spatial.heavy_top import heavy_top

from tests.support.scenes import run_statements, value

STEP = mpmath.mpf("1e-30")


def program_of(mechanism):
    return optimised_scene(mechanism, DEFAULT_REQUEST, Stopwatch()).functions.program


@pytest.fixture(scope="module")
def double():
    return program_of(pendulum(2))


def evaluated(program, state):
    """The symbols' values at a state; each parameter has another."""
    symbols = program.symbols
    known = {p: mpmath.mpf(10 + k) / 10 for k, p in enumerate(symbols.parameters)}
    return run_statements(program, known | dict(zip((*symbols.q, *symbols.u), state, strict=True)))


def output(program, name, known):
    return np.array([value(e, known) for e in program.output(name).elements])


def parts(numbers):
    """Real parts, and imaginary ones over the step."""
    found = [mpmath.mpmathify(x) for x in numbers]
    return np.array([[float(x.real), float(x.imag / STEP)] for x in found]).T


def values(series, known, state):
    """Of the operations needed."""
    found = {}
    for n in series.needed_operations:
        operation = series.operations[n]
        args = [found[a] for a in operation.args if a in found]
        factors = [value(f, known) for f in operation.factors]
        match operation.kind:
            case "state":
                found[n] = state[n]
            case "constant":
                found[n] = value(operation.value, known)
            case "sum":
                found[n] = mpmath.fdot(factors, args)
            case "product":
                found[n] = args[0] * args[1]
            case _:
                found[n] = {"sine": mpmath.sin, "cosine": mpmath.cos}[operation.kind](args[0])
    return found


@pytest.mark.parametrize("links", [2, 3])
def test_the_forces_are_those_with_what_the_mass_gains(links, double):
    program = double if links == 2 else program_of(pendulum(links))
    series, random = program.series, np.random.default_rng(links)
    assert series.momenta
    q, u = random.normal(size=(2, links))
    known = evaluated(program, [*q, *u])
    moved = evaluated(program, [*(q + u * mpmath.mpc(0, STEP)), *u])
    mass, gained = parts(output(program, "mass_matrix", moved))
    wanted = parts(output(program, "forcing", known))[0] + gained.reshape(links, links) @ u
    found = values(series, known, [*q, *u])
    np.testing.assert_allclose(parts(found[n] for n in series.forcing)[0], wanted, rtol=1e-12)
    np.testing.assert_allclose(parts(found[n] for n in series.mass)[0], mass, rtol=1e-14)


def test_sines_are_integrated_by_their_rates(double):
    state = np.array([0.4, -0.9, 1.3, 0.7])
    moved = state + np.array([1.3, 0.7, 0.0, 0.0]) * mpmath.mpc(0, STEP)
    series, known = double.series, evaluated(double, state)
    found, ahead = values(series, known, state), values(series, known, moved)
    assert len(series.integrals) == 6
    changes = parts(ahead[n] for n, _ in series.integrals)[1]
    rates = parts(found[rate] for _, rate in series.integrals)[0]
    np.testing.assert_allclose(changes, rates, rtol=1e-14)


def test_products_that_are_needed_anyway_are_taken(double):
    """Two of each angle with the vertical, two of M u, which give the rate of the sine between the
    links, two of the cosine's, and one of the forces."""
    assert len(products_of(double.series)) == 9


def test_rates_that_are_no_speeds_stay_as_they_are():
    series = program_of(heavy_top()).series
    assert not series.momenta
    assert not series.integrals


@pytest.mark.parametrize("one", ["sine", "cosine"])
@pytest.mark.parametrize("other", ["sine", "cosine"])
def test_products_of_sines_are_sums(one, other):
    angles = np.array([0.3, 1.1])
    function = {"sine": np.sin, "cosine": np.cos}
    for a, b in [((1, 0), (0, 1)), ((1, -1), (1, 0)), ((2, 1), (2, 1)), ((-1, 0), (1, 2))]:
        found = multiply(harmonic(one, a), harmonic(other, b))
        total = sum(
            float(factor) * (function[term.turn](angles @ term.angle) if term.turn else 1.0)
            for term, factor in found.items()
        )
        wanted = function[one](angles @ np.array(a)) * function[other](angles @ np.array(b))
        assert total == pytest.approx(wanted, rel=1e-14)
        assert add(found, multiply({next(iter(harmonic("cosine", (0, 0)))): -1}, found)) == {}
