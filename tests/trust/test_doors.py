"""Every door with every kind of input, event, contact and parameter: the same motion, or a refusal.

The rows are motions of one mass on a spring, each computed once more by hand; the columns are the
doors of `tests/support/trust/doors.py`.  Where a door takes the steps of `simulate` its states are
the same to the last bit; else they agree to the tolerance of the run.
"""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from sympy import sin

import mechc
from tests.support.trust import by_hand
from tests.support.trust.by_hand import Mass, follow, passed, softened, stuck_or_back, turned
from tests.support.trust.doors import DOORS, EXACT, SLOW, Motion, far, k, q, simulate, t, u

KNOTS, VALUES = [0.0, 0.42, 0.91, 1.3, 3.0], [1.0, 9.0, -4.0, 6.0, 2.0]
PERIOD, DELAY = 0.11, 0.02  # s, of the controller
ATOL = 2e-8


def signal(kind):
    return mechc.Signal(KNOTS, VALUES, kind)


def pushed(time):
    return 4.0 * np.sin(3.0 * time)


def controlled(time, x, v):
    return 3.0 - 8.0 * x[0] - 2.0 * v[0]


def by_value(time, x, v):
    return 3.0 - 8.0 * x - 2.0 * v


class Held:
    """The force of the controller by hand: read at its instants, applied after the delay."""

    def __init__(self):
        self.value, self.read = 0.0, None

    def __call__(self, time, x, v):
        return self.value


def held():
    """The motion with the controller: a reading and an applied value at a time."""
    force = Held()
    mass = Mass(force)

    def reads(mass, time, y):
        force.read = by_value(time, *y)
        return y

    def applies(mass, time, y):
        force.value = force.read
        return y

    instants = PERIOD * np.arange(1, 20)
    force.read = by_value(0.0, *by_hand.Y0)
    watches = [(lambda t, y, s=s: t - s, 1.0, reads) for s in instants]
    watches += [(lambda t, y, s=s: t - s, 1.0, applies) for s in [DELAY, *(instants + DELAY)]]
    return follow(mass, watches)


def smooth(force, breaks=()):
    return lambda: follow(Mass(force), breaks=breaks)


def watched(*watch, **mass):
    return lambda: follow(Mass(**mass), [watch])


def interpolated(how):
    return lambda time, x, v: float(how(time))


def stepped():
    """Each piece of the signal with its own constant."""
    force = Held()
    force.value = VALUES[0]

    def to(value):
        def after(mass, time, y):
            force.value = value
            return y

        return after

    watches = [(lambda t, y, s=s: t - s, 1.0, to(x))
               for s, x in zip(KNOTS[1:4], VALUES[1:4], strict=True)]  # fmt: skip
    return follow(Mass(force), watches)


linear = interpolated(lambda time: np.interp(time, KNOTS, VALUES))
cubic = interpolated(CubicSpline(KNOTS, VALUES))
bounce = by_hand.WALL
python = mechc.Event(lambda time, y: y[0] - 0.3, direction=1,
                     reset=lambda time, x, v: (x, -0.6 * v))  # fmt: skip

ROWS = {
    "a number": (Motion(), lambda: follow(Mass())),
    "a linear signal": (Motion({"F": signal("linear")}), smooth(linear, KNOTS[1:4])),
    "a signal of steps": (Motion({"F": signal("previous")}), stepped),
    "a cubic signal": (Motion({"F": signal("cubic")}), smooth(cubic, KNOTS[1:4])),
    "an expression": (Motion({}, force=4 * sin(3 * t)), smooth(lambda s, x, v: pushed(s))),
    "a function of time": (Motion({"F": pushed}), smooth(lambda s, x, v: pushed(s))),
    "a function of the state": (Motion({"F": controlled}), smooth(by_value)),
    "a controller": (
        Motion({"F": mechc.Sampled(controlled, period=PERIOD, delay=DELAY)}), held),
    "an event as text": (Motion(events=["q > far"]), watched(*bounce, passed)),
    "an event of SymPy": (Motion(events=[mechc.Event(q - far)]), lambda: follow(Mass())),
    "an event of Python": (
        Motion(events=[mechc.Event(lambda s, y: y[0] - 0.3)]), lambda: follow(Mass())),
    "a reset as text": (
        Motion(events=[mechc.Event("q > far", reset={"u": "-0.6*u"})]),
        watched(*bounce, turned(0.6))),
    "a reset of SymPy": (
        Motion(events=[mechc.Event(q - far, direction=1, reset={u: -3 * u / 5})]),
        watched(*bounce, turned(0.6))),
    "a reset of Python": (Motion(events=[python]), watched(*bounce, turned(0.6))),
    "a reset of a parameter": (
        Motion(events=[mechc.Event(u, direction=1, reset={k: k / 4})]),
        watched(by_hand.at(0.0, 1), 1.0, softened)),
    "a reset under a signal": (
        Motion({"F": signal("linear")}, [mechc.Event("q > far", reset={"u": "-0.6*u"})]),
        lambda: follow(Mass(linear), [(*bounce, turned(0.6))], KNOTS[1:4])),
    "a stop": (
        Motion({"F": 0.5}, [mechc.Stop("far - q", 0.6)]),
        watched(by_hand.at(by_hand.FAR), 1.0, turned(0.6), force=lambda s, x, v: 0.5)),
    "a stop under a signal": (
        Motion({"F": signal("linear")}, [mechc.Stop("far - q", 0.6)]),
        lambda: follow(Mass(linear), [(*bounce, turned(0.6))], KNOTS[1:4])),
    "a stop that is pressed": (
        Motion({"F": 20.0}, [mechc.Stop(far - q, 0.3)]),
        watched(*bounce, turned(0.3), force=lambda s, x, v: 20.0)),
    "dry friction": (
        Motion(events=[mechc.DryFriction("u", 0.25, "4")]),
        watched(by_hand.at(0.0, 1), 0.0, stuck_or_back, rub=1.0)),
    "a parameter that others follow": (
        Motion(params={"k": 20.0}), lambda: follow(Mass(k=20.0, c=0.4))),
    "a parameter that no longer follows": (
        Motion(params={"m": 3.0, "c": 0.1}), lambda: follow(Mass(m=3.0, c=0.1))),
}  # fmt: skip
WITH_RUN = "given with a run|give it with each run"
IN_PROCESS = "exist in this process only: omit out="
REFUSED = {
    ("streamed", "a function of time"): IN_PROCESS,
    ("streamed", "a function of the state"): IN_PROCESS,
    ("streamed", "a controller"): IN_PROCESS,
    ("streamed", "an event of Python"): IN_PROCESS,
    ("streamed", "a reset of Python"): IN_PROCESS,
    ("opened", "a function of time"): r"does not hold the inputs .* give mechc.open\(path, model",
    (
        "opened",
        "a function of the state",
    ): r"does not hold the inputs .* give mechc.open\(path, model",
    ("unit", "an event of Python"): "exported as expressions",
    ("unit", "a reset of Python"): "exported as expressions",
    ("unit", "a reset of a parameter"): "make them states, whose rates are zero",
}
SIGNALS = [row for row in ROWS if "signal" in row]
FUNCTIONS = ["a function of time", "a function of the state"]
EVENTS = [row for row, (motion, _) in ROWS.items() if motion.events]
for door in ("unit", "plain C", "page"):
    REFUSED |= {(door, row): WITH_RUN for row in [*SIGNALS, "a controller"]}
    if door != "plain C":  # a program gives it there: model.drive
        REFUSED |= {(door, row): WITH_RUN for row in FUNCTIONS}
    if door != "unit":
        REFUSED |= {(door, row): "no events, stops or dry friction" for row in EVENTS}


@pytest.fixture(scope="module")
def known():
    """What each row's motion is by hand, computed once."""
    found = {}

    def states(row):
        if row not in found:
            found[row] = ROWS[row][1]()
        return found[row]

    return states


def cell(door, row):
    slow = door in SLOW and (door, row) not in REFUSED
    marks = [pytest.mark.slow(cases=len(ROWS) * len(DOORS))] * slow
    return pytest.param(door, row, marks=marks, id=f"{door}-{row}")


@pytest.mark.parametrize(("door", "row"), [cell(door, row) for door in DOORS for row in ROWS])
def test_the_same_motion_or_a_refusal_in_words(door, row, known, tmp_path):
    motion = ROWS[row][0]
    words = REFUSED.get((door, row))
    if words is not None:
        with pytest.raises(mechc.MechcError, match=words):
            DOORS[door](motion, tmp_path)
        return
    found = DOORS[door](motion, tmp_path)
    np.testing.assert_allclose(found, known(row), rtol=0, atol=ATOL)
    if door in EXACT and not (door == "opened" and motion.events):  # begins anew after jumps
        np.testing.assert_array_equal(found, simulate(motion, tmp_path))
