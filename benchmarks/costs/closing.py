"""What does it take to close loops?

    mechc bench closing [--quick]

Microseconds of ``model.assemble``, the least of many calls: the four-bar's preferred configuration
and the nearest to a guess, a Stewart platform's (21 coordinates, 15 constraints) from the exact
guess and from rough ones, and a batch's per member.  ``--quick`` leaves out the platform, whose
derivation takes half a minute.  Exits with 1 where a limit is missed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

import mechc

from ..problems.stewart import pose, stewart
from ..timing.figures import Figure
from ..timing.processes import least_of_rounds
from ..timing.results import command_parser

ROUNDS = 200
MEMBERS = 2000
ROUGH = 0.1  # rad and m


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("closing", __doc__)
    parser.add_argument("--quick", action="store_true", help="without the Stewart platform")
    quick = parser.parse_args(arguments).quick
    missed = 0
    for figure in (*four_bar(), *(() if quick else platform())):
        print(figure.line())
        missed += figure.kept is False
    return 1 if missed else 0


def four_bar() -> Iterator[Figure]:
    model = mechc.load("four_bar")
    guess = {"theta_1": 0.5, "theta_2": -0.7}
    preferred = least(lambda: model.assemble({"theta_0": 1.2}))
    yield Figure("four-bar, the preferred one", preferred, "us", 50.0)
    near = least(lambda: model.assemble({"theta_0": 1.2}, guess=guess))
    yield Figure("four-bar, the nearest to a guess", near, "us", 50.0)
    every = least(lambda: model.assemblies({"theta_0": 1.2}))
    yield Figure("four-bar, both assemblies, every start", every, "us")
    turn = np.linspace(0, 2 * np.pi, 361)
    curve = least(lambda: model.sweep_positions("theta_0", turn, params={"l_3": 3.5}).points)
    yield Figure("four-bar, 361 positions of a coupler curve", curve, "us", 1000.0)
    start = mechc.Assembly({"theta_0": np.linspace(0.3, 3.0, MEMBERS)})
    whole = least(lambda: model.simulate_batch(0.0, start, {"l_3": 3.5}, threads=1), 5)
    yield Figure("four-bar, a member of a batch that only starts", whole / MEMBERS, "us")


def platform() -> Iterator[Figure]:
    """Its pose from the lengths of its legs."""
    model = mechc.compile(stewart())
    whole = pose()
    given = {f"s_{k}": whole[f"s_{k}"] for k in range(6)}
    exact = {name: value for name, value in whole.items() if name not in given}
    found = model.assemble(given, guess=exact)
    miss = np.abs(model.constraints(found)).max()
    print(f"{model!r}: the loops are closed to {miss:.1e} m")
    closed = least(lambda: model.assemble(given, guess=exact), 20)
    yield Figure("Stewart platform, the exact guess", closed, "us", 5000.0)
    draw = np.random.default_rng(1)
    rough = {name: value + ROUGH * draw.uniform(-1, 1) for name, value in exact.items()}
    again = model.assemble(given, guess=rough)
    assert np.abs(again - found).max() < 1e-9
    told = f"Stewart platform, a guess off by {ROUGH:g} rad and m"
    yield Figure(told, least(lambda: model.assemble(given, guess=rough), 20), "us", 5000.0)


def least(call: Callable[[], object], rounds: int = ROUNDS) -> float:
    """Microseconds of the fastest call."""
    return 1e6 * least_of_rounds(rounds, call)[0]
