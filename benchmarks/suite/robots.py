"""Every robot of example-robot-data: differences from Pinocchio, and times.

    mechc bench robots [--quick | NAME ...] [--floating] [--list]

Each robot is compiled in a process of its own with an empty cache: ``compile_s`` is the wait from
the file to the first rates, processor time where the machine had other work, without what runs need
besides, which `mechc.compile` begins to compile in the background.  Then microseconds of a call of
``model.ode()`` and of ``pinocchio.aba`` from Python, turn by turn, the least of many, and of a
state in the lanes (``model.rhs`` of many states).  Motors give no torque.  Pinocchio's algorithm
knows no mimics: of robots with some its time is that of a tree in which they move by themselves.

The largest differences at random states, of the largest component of each state: accelerations,
mass matrix, inverse dynamics (M u' - F), origins of the links; and the largest condition of the
mass matrix, by which rounding of the accelerations grows.  A robot that is refused is listed with
the reason.  ``NAME`` is a part of the file's path; ``--floating`` frees the roots.  Exits with 1
where a difference is above rounding.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..timing.machine import about
from ..timing.processes import (
    answer,
    least_of_a_call,
    least_of_rounds,
    module_command,
    processor_seconds,
)
from ..timing.results import command_parser, write

QUICK = ("double_pendulum.urdf", "ur5_robot", "panda.urdf", "solo12")
STATES, LANE_STATES = 10, 512
CALLS, ROUNDS = 50, 200
ROUNDING = 1e-13  # some hundred operations; a solution multiplies it by the matrix's condition
FIGURES = {
    "joints": "d", "speeds": "d", "compile_s": ".1f", "ode_us": ".2f", "aba_us": ".2f",
    "ode_ratio": ".2f", "lane_us": ".3f", "lane_ratio": ".3f", "condition": ".0e",
}  # fmt: skip
GAPS = ("accelerations", "mass_matrix", "torques", "places")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("robots", __doc__)
    parser.add_argument("--quick", action="store_true", help=f"only {', '.join(QUICK)}")
    parser.add_argument("--floating", action="store_true", help="free the roots")
    parser.add_argument("--list", action="store_true", help="the files, and nothing else")
    parser.add_argument("names", nargs="*", metavar="NAME", help="a part of a path")
    chosen = parser.parse_args(arguments)
    words = (*chosen.names, *(QUICK if chosen.quick else ())) or ("",)
    home = robots_folder()
    paths = [path for path in sorted(home.rglob("*.urdf"))
             if any(word in path.relative_to(home).as_posix() for word in words)]  # fmt: skip
    if not paths:
        parser.error("no robot: pip install 'mechc[robots]', or see --list for the names")
    if chosen.list:
        print("\n".join(path.relative_to(home).as_posix() for path in paths))
        return 0
    result: dict[str, Any] = {"about": about(), "floating": chosen.floating, "robots": {}}
    print(f"{'':42s}" + "".join(f"{name:>14s}" for name in (*FIGURES, *GAPS)))
    for path in paths:
        name = path.relative_to(home).as_posix()
        row = result["robots"][name] = row_of(path, chosen.floating)
        print(line(name, row), flush=True)
        write("robots", result)
    return 1 if any(above_rounding(row) for row in result["robots"].values()) else 0


def robots_folder() -> Path:
    """Where example-robot-data has its robots, beside Pinocchio."""
    import pinocchio

    return Path(pinocchio.__file__).parents[4] / "share/example-robot-data/robots"


def row_of(path: Path, floating: bool) -> dict[str, Any]:
    """The figures of a robot, measured in a process of its own; ``refused``: why there are none."""
    with tempfile.TemporaryDirectory() as cache:
        command = [*module_command("suite", "robots"), str(path), *(["floating"] * floating)]
        try:
            found: dict[str, Any] = answer(command, MECHC_CACHE_DIR=cache)
        except subprocess.CalledProcessError as error:
            return {"refused": f"the process ended with {error.returncode}"}
    return found


def above_rounding(row: dict[str, Any]) -> bool:
    if "refused" in row:
        return False
    limits = dict.fromkeys(GAPS, ROUNDING) | {"accelerations": ROUNDING * row["condition"]}
    return any(not row[gap] <= limit for gap, limit in limits.items())


def line(name: str, row: dict[str, Any]) -> str:
    if "refused" in row:
        return f"{name[-42:]:42s}  {row['refused']}"
    figures = "".join(f"{row[key]:14{form}}" for key, form in FIGURES.items())
    return f"{name[-42:]:42s}{figures}" + "".join(f"{row[gap]:14.1e}" for gap in GAPS)


def measured(path: Path, floating: bool) -> dict[str, Any]:
    """The figures of a robot."""
    import mechc
    from mechc.compilation.request import compile_any
    from mechc.model import Model

    from ..peers.pinocchio_robot import PinocchioRobot

    start, before = time.perf_counter(), processor_seconds()
    try:
        mechanism = mechc.from_urdf(path, floating=floating, limits="ignore", friction="ignore",
                                    meshes="ignore")  # fmt: skip
        system = compile_any(mechanism, fix=None, outputs=("points",), ahead=False)
    except mechc.MechcError as error:
        return {"refused": f"mechc: {error}"}
    model = Model.of_system(system)
    states = random_states(model)
    model.rhs(0.0, states)
    seconds = min(time.perf_counter() - start, processor_seconds() - before)
    try:
        robot = PinocchioRobot(path, model.coordinates, model.speeds)
    except (ValueError, RuntimeError, KeyError) as error:
        return {"refused": f"Pinocchio: {error}"}
    counts = {"joints": len(robot.joints), "speeds": len(model.speeds), "compile_s": seconds}
    return counts | differences(model, robot, states) | times(model, robot, states[0])


def random_states(model: Any) -> Any:
    """States (STATES, nq + nu): angles, ways and speeds of the order of one, every joint moving."""
    rng = np.random.default_rng(19)
    return rng.normal(size=(STATES, len(model.coordinates) + len(model.speeds)))


def differences(model: Any, robot: Any, states: Any) -> dict[str, float]:
    """The largest of every kind, relative to the largest component of its state."""
    count = len(model.speeds)
    gaps, condition = dict.fromkeys(GAPS, 0.0), 1.0
    for y in states:
        state, still, wanted = robot.state(y), np.zeros(count), y[: -count - 1 : -1]
        rates, mass = model.rhs(0.0, y)[-count:], model.mass_matrix(y)
        condition = max(condition, float(np.linalg.cond(mass)))
        pairs = {
            "accelerations": (rates, robot.accelerations(state, still)),
            "mass_matrix": (mass, robot.mass_matrix(state)),
            "torques": (mass @ wanted - model.forcing(y), robot.torques(state, wanted)),
            "places": (model.points(y), robot.positions(state, model.point_names)),
        }
        for gap, (own, other) in pairs.items():
            apart, largest = np.abs(own - other).max(), np.abs(other).max()
            gaps[gap] = np.maximum(gaps[gap], apart / largest if apart else 0.0)
    return {**gaps, "condition": condition}


def times(model: Any, robot: Any, y: Any) -> dict[str, float]:
    """Microseconds, and those of mechc over those of Pinocchio."""
    model.c_function()  # waits until the rates in lanes are compiled
    ode, state, still = model.ode(), robot.state(y), np.zeros(robot.model.nv)
    aba, q, v = robot.engine.aba, state.q, state.v
    one, other = least_of_rounds(
        ROUNDS, repeated(lambda: ode(0.0, y)),
        repeated(lambda: aba(robot.model, robot.data, q, v, still)),
    )  # fmt: skip
    many = np.tile(y, (LANE_STATES, 1))
    out = np.empty_like(many)
    lane = least_of_a_call(lambda: model.rhs(0.0, many, out=out)) / LANE_STATES
    microseconds = {"ode_us": one / CALLS, "aba_us": other / CALLS, "lane_us": lane}
    return {name: 1e6 * seconds for name, seconds in microseconds.items()} | {
        "ode_ratio": one / other, "lane_ratio": CALLS * lane / other,
    }  # fmt: skip


def repeated(call: Callable[[], object]) -> Callable[[], object]:
    return lambda: [call() for _ in range(CALLS)]


if __name__ == "__main__":
    print(json.dumps(measured(Path(sys.argv[1]), len(sys.argv) > 2)))
