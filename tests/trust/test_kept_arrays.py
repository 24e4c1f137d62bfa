"""Arrays and mappings that a caller writes to after a call, or during it, change nothing."""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import interp1d
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems import optimal as problems
from tests.support.pendulums import pushed_mass

GARBAGE = 0.123
TIMES = np.linspace(0.0, 0.5, 6)
FORCES = np.array([0.0, 3.0, -2.0, 1.0, 2.0, -1.0])
ANGLES, LENGTHS = np.radians([80.0, 85.0, 90.0]), np.array([3.4, 3.5, 3.6])
STARTS = np.array([[0.1, 0.0], [0.2, 0.1], [0.3, -0.1]])


class Arguments:
    """The arrays and mappings that a call was given."""

    def __init__(self):
        self._arrays, self._mappings = [], []

    def __call__(self, values):
        """An array or a mapping of such, which :meth:`overwrite` writes to."""
        if isinstance(values, Mapping):
            self._mappings.append({name: self(each) for name, each in values.items()})
            return self._mappings[-1]
        self._arrays.append(np.array(values, dtype=float))
        return self._arrays[-1]

    def overwrite(self):
        for array in self._arrays:
            array[...] = GARBAGE
        for mapping in self._mappings:
            mapping.update(dict.fromkeys(mapping, GARBAGE))


@pytest.fixture(scope="module")
def models():
    kane, power = pushed_mass(), {"power": dynamicsymbols("F") * dynamicsymbols("u")}
    outputs, defaults = ("energy", power), {"m": 2.0, "k": 0.0}
    return SimpleNamespace(
        linkage=mechc.load("four_bar"),
        swing=mechc.load("pendulum", outputs=("energy", "points", "sensitivities")),
        slider=mechc.compile(kane, name="slider", defaults=defaults, outputs=outputs),
    )


# -- doors: each makes a call and returns what reads its results afterwards -----------------------


def run(models, give, _):
    values = [1.0, 1.2, 9.5]
    sol = models.swing.simulate(
        0.5, give([0.8, 0.3]), give(values), atol=give([1e-4, 1e-3]), t_eval=give(TIMES), rtol=1e-3
    )
    by = ["l_0", "y0"]
    return lambda: [
        sol.t, sol.y, sol.params, sol.continue_to(2.0).y, *sol.gradient("theta_0", by=by).values()
    ]  # fmt: skip


def run_by_names(models, give, tmp_path):
    sol = models.swing.simulate(
        0.5, give({"theta_0": 0.8, "omega_0": 0.3}), give({"l_0": 1.2}), atol=give([1e-4, 1e-3])
    )

    def observe():
        again = mechc.open(sol.save(tmp_path / "run.nc")).continue_to(2.0)
        gradient = sol.gradient("theta_0", by=["l_0", "theta_0"])
        return [again.y, again.policy.atol, *gradient.values(), sol.check().ok]

    return observe


def run_driven(models, give, _):
    forces = {"F": (give(TIMES), give(FORCES))}
    sol = models.slider.simulate(0.25, give([0.1, 0.0]), inputs=forces, sensitivities=["F[3]"])
    return lambda: [sol.y, sol.output("power"), sol.continue_to(0.5).y, sol.sensitivity["F[3]"]]


def signal(models, give, _):
    kinds = ("previous", "linear", "cubic")
    made = [mechc.Signal(give(TIMES), give(FORCES), kind) for kind in kinds]
    lines = interp1d(give(TIMES), give(FORCES), copy=False)
    driven = [models.slider.with_inputs({"F": each}) for each in (*made, lines)]
    return lambda: [m.simulate(0.5, STARTS[0]).y for m in driven] + [s(TIMES) for s in made]


def number(models, give, _):
    driven = models.slider.with_inputs(give({"F": np.array(2.0)}))
    return lambda: [driven.simulate(0.5, STARTS[0]).y, driven.simulate_batch(0.5, STARTS[:1])["y"]]


def several_inputs(models, give, _):
    """Samples of a tuple of inputs."""
    driven = models.slider.with_inputs({("F",): (give(TIMES), give(FORCES[:, None]))})
    return lambda: [driven.simulate(0.5, STARTS[0]).y]


def sampled(models, give, _):
    held = mechc.Sampled(lambda t: -1.0, 0.1, delay=0.3, initial=give([2.0]))
    return lambda: [models.slider.simulate(0.5, STARTS[0], inputs={"F": held}).y]


def table(models, give, _):
    curve = mechc.Table(give(TIMES), give(FORCES))
    surface = mechc.Table(give(TIMES), give(TIMES), give(np.eye(6)))
    return lambda: [curve(TIMES + 0.01), surface(TIMES + 0.01, TIMES)]


def batch(models, give, tmp_path):
    found = models.linkage.simulate_batch(
        0.5, mechc.Assembly(give({"theta_0": ANGLES}), guess=give({"theta_1": 0.3})),
        give({"l_3": LENGTHS}), t_eval=give(TIMES), atol=give([1e-6] * 6), threads=1,
        reduce=["max(theta_2)"],
    )  # fmt: skip
    return lambda: [
        found["y"], found["y_eval"], found[1].y, found[1].params, found.to_xarray()["l_3"].values,
        found.to_xarray()["t"].values, found[2].continue_to(1.0).y,
    ]  # fmt: skip


def batch_of_states(models, give, _):
    values = np.array([[2.0, 1.0], [2.0, 2.0], [1.0, 3.0]])
    found = models.slider.simulate_batch(
        0.5, give(STARTS), give(values), inputs=give({"F": FORCES[:3]}), sensitivities=["k", "F"]
    )
    return lambda: [found["y"], found[1].y, found["sensitivity_final"], found[2].params]


def batch_by_names(models, give, tmp_path):
    found = models.slider.simulate_batch(
        0.5, give({"q": STARTS[:, 0], "u": 0.1}), give({"k": FORCES[1]}),
        inputs={"F": (give(TIMES), give(FORCES))}, out=tmp_path / "batch", chunk=2,
    )  # fmt: skip
    return lambda: [found["y"], found[1].y, found[0].continue_to(0.5).y]


def sweep(models, give, _):
    found = models.slider.sweep(
        0.5, {"k": (1.0, 3.0, 3)}, give({"m": 1.5}), start=give({"q": 0.4}), inputs=give({"F": 1.0})
    )
    return lambda: [found["max(q)"], found.batch[1].y]


def stepper(models, give, _):
    found = models.slider.stepper(
        give([0.1, 0.0]), give([2.0, 5.0]), inputs=give({"F": np.array(1.0)}), atol=give([1e-5] * 2)
    )
    found.step(0.1)
    found.set(give([0.2, 0.1]), params=give([2.0, 6.0]))
    saved = found.save()

    def observe():
        states = [found.step(0.1), found.params, *found.outputs("power").values()]
        found.restore(saved)
        return [*states, found.step(0.1)]

    return observe


def assembled(models, give, _):
    y = models.linkage.assemble(give({"theta_0": 1.4}), params=give({"l_3": 3.5}))
    q = models.linkage.assemblies(give({"theta_0": 1.4}), params=give(models.linkage.defaults))
    return lambda: [y, *q]


def positions(models, give, _):
    found = models.linkage.sweep_positions("theta_0", give(ANGLES), params=give({"l_3": LENGTHS}))
    return lambda: [found.q, found.values, found.ratios, found.points]


def linear(models, give, _):
    y, values = give([0.1, 0.0]), give([2.0, 5.0])
    driven = models.slider.with_inputs({"F": 0.0})
    found = driven.linearize(y, values)
    rates, function = driven.ode(values), driven.c_function("rates", values)
    return lambda: [found.A, rates(0.0, STARTS[1]), function.ctypes and np.zeros(1)]


def product(models, give, _):
    out = []
    for times in (TIMES[1:], TIMES[-1:]):
        start, values = give({"theta_0": 0.8, "omega_0": 0.0}), give({"l_0": 1.2})
        y, pull = models.swing.vjp(give(times), start, values, by=["l_0", "theta_0"])
        out.append((y, pull))
    return lambda: [each for y, pull in out for each in (y, *pull(np.ones_like(y)).values())]


def fit(models, give, _):
    true = models.swing.simulate(0.5, [0.8, 0.3], {"l_0": 1.3}, t_eval=TIMES)["theta_0"]
    found = models.swing.fit(
        (give(TIMES), give(true)), {"l_0": (0.5, 2.0)}, ["theta_0"], params=give({"g": 9.81}),
        y0=give([0.8, 0.3]),
    )  # fmt: skip
    return lambda: [
        *found.values.values(), *found.residuals, found.solutions[0].y,
        found.problem.recordings[0].t,
    ]  # fmt: skip


def cycle(models, give, _):
    found = models.swing.periodic(
        give([-1.0, 0.0]), 2.2, give({"l_0": 1.2}), hold=["theta_0", "omega_0"][:1]
    )
    return lambda: [found.y0, found.period, found.solution.y, found.params]


def optimum(models, give, _):
    found = problems.double_integrator().model.optimise(
        (1.0, 9.0), give([0.0, 0.0]), {"F": give([-1.5, 1.5])}, give({"m": 1.0}), final="duration",
        end=give({"x": 1.0, "v": 0.0}), solver="slsqp", intervals=4,
    )  # fmt: skip
    return lambda: [found.cost, found.solution.y, found.nodes[1], *found.values.values()]


def designs(models, give, _):
    true = models.linkage.sweep_positions("theta_0", ANGLES)
    found = models.linkage.synthesize(
        give({"theta_0": ANGLES, "theta_2": true.q[:, 2]}), {"l_1": give([1.5, 2.5])},
        params=give({"l_3": 4.0}), box=give([[-9.0, 9.0], [-9.0, 9.0]]), samples=8, refined=1,
    )  # fmt: skip
    return lambda: [found[0].deviations["theta_2"], found[0].params]


AFTER = [
    run, run_by_names, run_driven, signal, number, several_inputs, sampled, table, batch,
    batch_of_states, batch_by_names, sweep, stepper, assembled, positions, linear, product, fit,
    cycle, optimum, designs,
]  # fmt: skip


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("door", AFTER, ids=lambda door: door.__name__)
def test_what_is_written_after_a_call_changes_nothing(door, models, tmp_path):
    given, untouched = Arguments(), Arguments()
    observe = door(models, given, tmp_path)
    given.overwrite()
    wanted = door(models, untouched, tmp_path)()
    for found, right in zip(observe(), wanted, strict=True):
        np.testing.assert_array_equal(found, right)


# -- what is written while a call runs ------------------------------------------------------------


class Writer:
    """A force of time that writes to the arguments when it is first called."""

    def __init__(self, given):
        self.given = given

    def __call__(self, t):
        self.given.overwrite()
        return float(np.sin(t))


def batch_during(model, give, force):
    found = model.simulate_batch(
        0.5, give(STARTS), give({"k": LENGTHS}), inputs={"F": force}, atol=give([1e-6, 1e-6]),
        t_eval=give(TIMES),
    )  # fmt: skip
    return [found["y"], found["y_eval"], found.to_xarray()["k"].values]


def assembled_batch_during(model, give, force):
    columns = give({"q": STARTS[:, 0]}), give({"u": STARTS[:, 1]})
    found = model.simulate_batch(0.5, mechc.Assembly(*columns), inputs={"F": force})
    return [found["y"]]


def run_during(model, give, force):
    sol = model.simulate(
        0.5, give([0.1, 0.0]), give([2.0, 5.0]), inputs={"F": force}, atol=give([1e-5, 1e-5]),
        t_eval=give(TIMES), sensitivities=["k", "y0"],
    )  # fmt: skip
    return [sol.t, sol.y, sol.sensitivity["k"], sol.sensitivity["y0"]]


@pytest.mark.parametrize(
    "door", [batch_during, assembled_batch_during, run_during], ids=lambda door: door.__name__
)
def test_what_is_written_during_a_call_changes_nothing(door, models):
    given, untouched = Arguments(), Arguments()
    found = door(models.slider, given, Writer(given))
    wanted = door(models.slider, untouched, Writer(Arguments()))
    for one, right in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(one, right)
