"""Public functions called with anything: a value that is right, or an error that was meant."""

import datetime
import decimal
import fractions
import warnings

import numpy as np
import pytest

import mechc
from tests.support.trust.fuzzing import run_cases

pytestmark = pytest.mark.slow

NUMBERS = [
    0, -1, 1.0, 2.5, -0.0, 1e-320, 1e308, -1e308, float("nan"), float("inf"), 10**400, -(10**30),
    True, np.float32(1.5), np.int8(3), np.longdouble(1), fractions.Fraction(1, 3),
    decimal.Decimal("1.5"), 1j,
]  # fmt: skip
OTHERS = [
    None, "", "1", "theta_0", b"x", [], (), {}, [[]], [None], ["a"], {"a": 1}, {1: 2}, {None: None},
    object(), type, len, lambda: 1, lambda *_: None, range(3), {1, 2}, Ellipsis, NotImplemented,
    datetime.timedelta(1), np.array("x"), np.array(None), np.zeros(0), np.zeros((2, 3)),
    np.array([1j]), np.ma.masked, "x" * 5000, "\0", "\ud800", "\x1b[2J", iter([1.0]),
]  # fmt: skip
NAMES = ["theta_0", "theta_1", "theta_2", "omega_0", "l_0", "l_3", "m_1", "g", "I_0", "wheel", ""]
OUTPUTS = ["rates", "energy", "kinetic_energy", "points", "multipliers", "mass_matrix", "nothing"]


@pytest.fixture(scope="module")
def model():
    return mechc.load("four_bar")


def number(draw):
    return draw.choice(NUMBERS) if draw.random() < 0.5 else draw.uniform(-4, 4)


def anything(draw):
    return number(draw) if draw.random() < 0.4 else draw.choice(OTHERS)


def mapping(draw, names=NAMES):
    if draw.random() < 0.15:
        return anything(draw)
    return {
        draw.choice(names) if draw.random() < 0.9 else anything_hashable(draw): (
            number(draw) if draw.random() < 0.8 else anything(draw)
        )
        for _ in range(draw.randrange(4))
    }


def anything_hashable(draw):
    found = anything(draw)
    try:
        hash(found)
    except TypeError:
        return None
    return found


def array(draw, width=6):
    if draw.random() < 0.15:
        return anything(draw)
    shape = draw.choice(
        [(width,), (width,), (3, width), (0, width), (2, 2, width), (width + 1,), ()]
    )
    values = np.random.default_rng(draw.randrange(2**32)).normal(size=shape)
    if draw.random() < 0.2 and values.size:
        values.reshape(-1)[draw.randrange(values.size)] = draw.choice([np.nan, np.inf, 1e300])
    made = draw.choice([np.asarray, np.asfortranarray, lambda a: a.tolist(), np.flip])
    if draw.random() < 0.2:
        values = values.astype(draw.choice([np.float32, np.int64, object, complex, "U8", bool]))
    return made(values)


def parameters(draw):
    return draw.choice([None, mapping(draw), array(draw, 11)])


def option(draw, good):
    return good if draw.random() < 0.7 else anything(draw)


def opened(path):
    """A file that is not there is Python's own error."""
    try:
        mechc.open(path)
    except FileNotFoundError as error:
        raise ValueError from error


def _asks_nothing(value):
    """What would have a variant compiled, which takes long."""
    return isinstance(value, (list, tuple, dict, set, range)) and not value


@pytest.fixture(scope="module")
def kinds(model):
    """Functions to draw a call of."""
    good = model.assemble({"theta_0": 1.4})

    def output(draw):
        name, y, params, t = draw.choice(OUTPUTS), array(draw), parameters(draw), number(draw)
        return lambda: model.output(name, y, params, t)

    def rates(draw):
        t, y, params = number(draw), array(draw), parameters(draw)
        out = array(draw) if draw.random() < 0.3 else None

        def call():
            found = model.rhs(t, y, params, out)
            again = model.rhs(float(t), np.array(y, float), params)
            if out is None or out.dtype == float:
                assert np.array_equal(found, np.broadcast_to(again, found.shape), equal_nan=True)

        return call

    def assemble(draw):
        given = [mapping(draw), mapping(draw), mapping(draw), parameters(draw), number(draw)]
        given = given[: draw.randrange(1, 6)]
        which = draw.choice([model.assemble, model.assemblies])

        def call():
            found = which(*given) if which is model.assemble else which(*given[:1])
            assert np.isfinite(found).all()

        return call

    def simulate(draw):
        span = draw.choice(
            [0.01, (0, 0.01), (0.01, 0), 0, (0,), anything(draw), (number(draw), 0.1)]
        )
        start = good if draw.random() < 0.7 else array(draw)
        policy = {
            name: option(draw, value)
            for name, value in {
                "rtol": 1e-6, "atol": None, "t_eval": [0.0], "method": "dop853", "dense": True,
                "first_step": None, "max_step": 0.1, "events": (), "on_change_point": "stop",
                "inputs": None, "progress": None,
            }.items()
            if draw.random() < 0.3
        }  # fmt: skip
        return lambda: model.simulate(span, start, parameters(draw), max_steps=50, **policy)

    def policy(draw):
        name = draw.choice(["max_steps", "rtol", "atol", "t_eval", "method", "events", "inputs"])
        value = anything(draw)
        return lambda: model.simulate(1e-3, good, **{name: value})

    def batch(draw):
        start = draw.choice(
            [good, array(draw), mechc.Assembly({"theta_0": [1.0, 1.4]}), anything(draw)]
        )
        asked = {
            name: option(draw, value)
            for name, value in {
                "t_eval": [0.0], "outputs": ["points"], "reduce": "max(theta_2)", "chunk": 2,
                "until": "theta_0 > 1", "threads": 1, "states": False,
            }.items()
            if draw.random() < 0.3
        }  # fmt: skip
        params = parameters(draw) if draw.random() < 0.5 else None
        return lambda: model.simulate_batch(
            0.01, start, params, max_steps=50, progress=False, **asked
        )

    def assembly(draw):
        start = mapping(draw), mapping(draw), mapping(draw)
        return lambda: model.simulate_batch(0.01, mechc.Assembly(*start), max_steps=50)

    def dense(draw):
        sol = model.simulate(0.01, good, max_steps=50)
        t = anything(draw)
        return lambda: sol(t)

    def load(draw):
        name = draw.choice(["four_bar", "nothing", *OTHERS])
        asked = draw.choice(["fix", "outputs", "backend", "instruction_set", "wheel", "friction"])
        value = draw.choice([v for v in OTHERS if v is not None and not _asks_nothing(v)])
        return lambda: mechc.load(name, **{asked: value})

    def files(draw):
        sol, path = model.simulate(0.01, good, max_steps=50), anything(draw)
        return draw.choice([lambda: sol.save(path), lambda: opened(path)])

    return [output, rates, rates, assemble, simulate, policy, batch, assembly, dense, load, files]


def test_calls_with_anything(model, kinds, seed, thorough, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # NumPy's, of numbers that overflow
        ended = run_cases(seed, thorough, 4_000, 100_000, lambda draw: draw.choice(kinds)(draw))
    assert ended["a value"] > 100
