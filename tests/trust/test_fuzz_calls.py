"""Public functions called with anything: a value that is right, or an error that was meant."""

import datetime
import decimal
import fractions
import warnings

import numpy as np
import pytest
from sympy import Symbol
from sympy.physics.mechanics import KanesMethod, dynamicsymbols

import mechc
from tests.support.pendulums import bob_on_a_rod
from tests.support.trust.fuzzing import of_a_line_of_mechc, run_cases

pytestmark = [pytest.mark.slow, pytest.mark.thorough]

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
        mechc.open_view(path)
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
        ended = run_cases(
            seed,
            thorough,
            4_000,
            100_000,
            lambda draw: draw.choice(kinds)(draw),
            of_a_line_of_mechc,
        )
    assert ended["a value"] > 100


# -- one argument, or two, of every public method ---------------------------------------------


@pytest.fixture(scope="module")
def pushed():
    """A pendulum with a torque that is given with a run, and derivatives."""
    q, u, torque = dynamicsymbols("q_0 u_0 F")
    m, l, g = (Symbol(name) for name in "mlg")
    r, e, _, bob = bob_on_a_rod(q, u, m, l, g)
    method = KanesMethod(r, [q], [u], [q.diff(dynamicsymbols._t) - u])
    method.kanes_equations([bob], [(bob.point, -m * g * r.y), (e, torque * r.z)])
    given = {"m": 1.3, "l": 0.8, "g": 9.81}
    return mechc.compile(
        method, name="pushed", defaults=given, outputs=("energy", "points", "sensitivities")
    )


def good_calls(bar, pushed, folder):
    """(function, arguments that are right), of the methods of models, solutions and the rest."""
    y, push = bar.assemble({"theta_0": 1.4}), pushed.with_inputs({"F": 0.5})
    start = np.array([0.1, 0.2])
    sol, pulled = bar.simulate(0.02, y), push.simulate(0.1, start)
    stepper = push.stepper(start)
    times = np.linspace(0.0, 0.1, 5)
    data = {"t": times, "q_0": 0.1 + times}
    state = {"y": start, "params": None, "t": 0.0}
    names = [
        "energy", "kinetic_energy", "potential_energy", "points", "rhs", "state_jacobian",
        "parameter_jacobian", "input_jacobian", "momenta",
    ]  # fmt: skip
    yield from ((getattr(push, name), dict(state)) for name in names)
    closed = ("constraints", "velocity_constraints", "constraint_jacobian", "multipliers")
    yield from ((getattr(bar, name), {**state, "y": y}) for name in closed)
    yield from [
        (push.output, {**state, "name": "energy"}),
        (push.array_elements, {"name": "points"}),
        (push.c_function, {"output": "rates", "params": None}),
        (push.integrand, {"output": "energy", "along": "q_0", "y": start, "component": 0}),
        (push.ode, {"params": None}),
        (push.state_index, {"name": "q_0"}),
        (bar.assemblies, {"coordinates": {"theta_0": 1.4}, "speeds": None, "params": None,
                          "t": 0.0}),
        (bar.equilibria, {"params": None, "t": 0.0}),
        (bar.limits, {"coordinate": "theta_0", "params": None}),
        (bar.redundant_constraints, {"params": None, "t": 0.0}),
        (bar.sweep_positions, {"driven": "theta_0", "values": [1.4, 1.5], "coordinates": None,
                               "guess": None, "params": None, "t": 0.0}),
        (bar.linearize, {"y": y, "params": None, "t": 0.0, "inputs": (), "outputs": None,
                         "independent": None}),
        (push.inverse_dynamics, {"y": start, "accelerations": [0.1], "params": None,
                                 "inputs": ["F"], "t": 0.0}),
        (push.linearize, {"y": start, "inputs": ["F"], "outputs": ["energy"]}),
        (push.fit, {"measurements": data, "free": {"m": (0.5, 2.0)}, "measured": ["q_0"],
                    "y0": {"q_0": 0.1, "u_0": 0.2}, "guess": None,
                    "inputs": None, "t0": None, "shared": (), "starts": 1, "refined": 1,
                    "loss": "linear", "f_scale": 1.0, "confidence": 0.9, "rtol": 1e-6,
                    "method": "auto", "tol": 1e-3, "max_evaluations": 2, "seed": 0}),
        (push.jvp, {"t": times[1:], "y0": start, "params": None, "along": {"m": 1.0}, "t0": 0.0,
                    "inputs": None, "rtol": 1e-6, "method": "auto"}),
        (push.vjp, {"t": times[1:], "y0": start, "params": None, "by": ["m"], "t0": 0.0,
                    "inputs": None, "rtol": 1e-6, "method": "auto"}),
        (push.vjp(0.1, start, by=["m"])[1], {"cotangent": start}),
        (pushed.with_inputs, {"inputs": {"F": 0.5}}),
        (push.stepper, {"y0": start, "params": None, "t": 0.0, "inputs": {"F": 1.0}, "rtol": 1e-6,
                        "atol": None, "method": "auto", "max_step": 0.1, "max_steps": 100,
                        "on_change_point": "stop", "events": ()}),
        (stepper.step, {"dt": 0.01, "inputs": {"F": 0.1}}),
        (stepper.set, {"y": start, "t": 0.0, "params": None}),
        (stepper.restore, {"saved": stepper.save()}),
        (sol, {"t": 0.01}),
        (sol.__getitem__, {"name": "theta_0"}),
        (sol.continue_to, {"t_end": 0.03, "max_steps": 50, "on_change_point": None,
                           "progress": None}),
        (pulled.gradient, {"end": start, "integral": None, "by": ["m"]}),
        (pulled.gradient, {"end": None, "integral": "energy", "by": ["m"]}),
        (pulled.sensitivity_of, {"output": "energy", "name": "m", "t": None}),
        (sol.params_at, {"t": 0.01}),
        (sol.values_along, {"t": [0.01]}),
        (sol.work_until, {"times": [0.01]}),
        (sol.animate, {"fps": 30.0}),
        (sol.view, {"fps": 30.0}),
        (mechc.Signal, {"times": times, "values": times, "kind": "cubic", "outside": "refuse",
                        "breaks": "kinks"}),
        (mechc.Table, {"x": times, "kind": "cubic", "outside": "extend"}),
        (opened, {"path": folder / "none"}),
        (mechc.from_urdf, {"path": folder / "none", "symbolic": (), "driven": (), "name": None}),
        (mechc.from_sdf, {"path": folder / "none", "symbolic": (), "driven": (), "name": None}),
        (mechc.from_mjcf, {"path": folder / "none", "symbolic": (), "driven": (), "name": None}),
        (mechc.Quantity, {"unit": "m", "description": "x", "lower": 0.0, "upper": 1.0}),
    ]  # fmt: skip

    def within(make, **good):
        """What a constructor makes has to be right for a run, too."""

        def call(**given):
            push.simulate(0.02, start, events=make(**given), max_steps=50)

        return call, good

    def with_input(make, **good):
        def call(**given):
            pushed.simulate(0.02, start, inputs={"F": make(**given)}, max_steps=50)

        return call, good

    reset = {"u_0": "-u_0"}
    yield within(mechc.Event, function="q_0", direction=1.0, terminal=False, reset=reset)
    yield within(lambda **by: mechc.Event("q_0 - 0.105", reset=by), u_0="-u_0", m=1.1)
    yield within(mechc.Stop, gap="q_0", restitution=0.5, terminal=False, friction=0.1, slip="u_0",
                 static=None, law="newton")  # fmt: skip
    yield within(mechc.DryFriction, slip="u_0", mu=0.1, normal=1.0, static=None)
    yield with_input(mechc.Sampled, controller=lambda t, y: 0.1, period=0.01, delay=0.0, jitter=0.0,
                     seed=0, initial=0.0)  # fmt: skip
    yield with_input(mechc.Signal, times=times, values=times, kind="linear", outside="hold",
                     breaks="kinks")  # fmt: skip

    def batch(**given):
        push.simulate_batch(0.02, [start, start], max_steps=50, progress=False, **given)

    yield batch, {
        "params": {"m": [1.0, 1.1]}, "inputs": {"F": [0.1, 0.2]}, "events": "q_0 > 1",
        "sensitivities": ["m"], "reduce": "max(q_0)", "t_eval": [0.01], "until": "q_0 > 1",
        "lockstep": False, "method": "auto", "rtol": 1e-6, "atol": None, "max_step": 0.1,
    }  # fmt: skip


def test_one_argument_is_anything(model, pushed, seed, thorough, tmp_path, monkeypatch):
    """53 kinds of raw errors were found so, in methods that the calls above leave out."""
    monkeypatch.chdir(tmp_path)
    calls = list(good_calls(model, pushed, tmp_path))

    def case(draw):
        function, good = draw.choice(calls)
        given = dict(good)
        for name in draw.sample(sorted(good), min(len(good), draw.choice([1, 1, 1, 2]))):
            given[name] = draw.choice(
                [anything, mapping, array, lambda d: array(d, 2), lambda d: [anything(d)] * 2]
            )(draw)
        if function == mechc.Table:
            return lambda: function(*([given.pop("x")] if "x" in given else []), **given)
        if getattr(function, "__name__", "") in ("__getitem__", "pull") or function is calls[0]:
            return lambda: function(*given.values())
        return lambda: function(**given)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ended = run_cases(seed, thorough, 4_000, 100_000, case, of_a_line_of_mechc)
    assert ended["a value"] > 100
