"""Rows of the table of docs/validation.md: what was recorded elsewhere, and what mechc computes.

An error is the largest deviation from the converged values (`converged.json`, made by the other
formulation), as a part of the series' largest magnitude, or absolute where that is below 1.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from .elsewhere.examples import CONVERGED
from .elsewhere.joints import converged as converged_joints
from .scenes import bodies, engines, joints, loops, wheels

HERE = Path(__file__).parent
RTOL = 1e-12
EXAMPLES = {
    example.path.rpartition("/")[2]: example
    for module in (loops, engines, wheels, bodies)
    for example in module.EXAMPLES
}
LINE_FORCES = ("distance", "spring", "short_spring")


@dataclass(frozen=True)
class Row:
    """One problem: where it is published, what is compared, and both errors."""

    problem: str
    compared: str
    theirs: float
    ours: float


def read(name: str) -> dict:
    return json.loads((HERE / f"{name}.json").read_text())


def joint_row(name: str) -> Row:
    """One case of Chrono: positions, attitudes, and loads of the joint on the ground."""
    recorded, converged = read("chrono"), read("converged")["chrono"][name]
    ours = joint_series(name, recorded["times"])
    return _row(name, recorded["cases"][name], converged, ours)


def example_row(name: str) -> Row:
    """One example of Modelica: all signals that were recorded of the scene."""
    recorded, converged = read("modelica")["cases"][name], read("converged")["modelica"][name]
    return _row(name, recorded["signals"], converged, example_series(name, recorded["times"]))


def _row(name: str, recorded: dict, converged: dict, ours: dict) -> Row:
    return Row(
        name,
        ", ".join(dict.fromkeys(WORDS.get(what, what.partition("[")[0]) for what in recorded)),
        max(error(what, recorded[what], converged[what]) for what in recorded),
        max(error(what, ours[what], converged[what]) for what in recorded),
    )


WORDS = {
    "Pos": "position", "Quat": "attitude", "Rforce": "force", "Rtorque": "torque",
    "RforceP": "force of the guide", "RtorqueP": "torque of the guide",
    "RforceA": "force of the drive", "RtorqueA": "torque of the drive",
    "Rforce_Body1": "force at the pin", "Rtorque_Body1": "torque at the pin",
    "Rforce_Body2": "force at the ball", "Rtorque_Body2": "torque at the ball",
}  # fmt: skip


def error(what: str, values: list, exact: list) -> float:
    """The largest deviation, by the largest magnitude; attitudes by their matrices."""
    a, b = (_axes(x) if what == "Quat" else np.asarray(x) for x in (values, exact))
    return float(abs(a - b).max() / max(1.0, abs(b).max()))


def _axes(series):
    series = np.asarray(series)
    if series.shape[-1] != 4:
        return series
    return Rotation.from_quat(series[:, [1, 2, 3, 0]]).as_matrix().reshape(len(series), 9)


def joint_series(name: str, times: list) -> dict:
    """mechc's motion of a case, in ADAMS's terms."""
    case = joints.CASES[name]
    model = case.scene()
    y0 = model.assemble(case.start, case.speeds, params=case.values)
    sol = model.simulate(times[-1], y0, case.values, rtol=RTOL, t_eval=times)

    def outputs(*names):
        return np.stack([sol.output(one, times) for one in names], axis=-1)

    place = outputs(*(f"r{k}" for k in range(3)))
    axes = outputs(*(f"R{k}{j}" for k in range(3) for j in range(3)))
    series = {"Pos": place, "Quat": axes}
    if case.scene.__name__ in LINE_FORCES:
        return series | {"Rforce": outputs("F0", "F1", "F2")}
    force, torque = model.reactions(sol.y, case.values)
    if case.scene is joints.rod:
        return series | {
            "Rforce_Body1": -force[:, 0],
            "Rtorque_Body1": -torque[:, 0],
            "Rforce_Body2": force[:, 1],
            "Rtorque_Body2": torque[:, 1],
        }
    # mechc's torque is about the body's point of the joint, ADAMS's about the ground's
    arm = outputs("p0", "p1", "p2") - [case.values.get(f"a_{x}", 0.0) for x in "xyz"]
    force, torque = force[:, 0], torque[:, 0]
    if case.scene is joints.actuator:
        axis = axes.reshape(-1, 3, 3)[:, :, 2]
        drive = np.sum(force * axis, axis=1)[:, None] * axis
        guide = force - drive
        return series | {
            "RforceA": drive,
            "RtorqueA": torque,
            "RforceP": -guide,
            "RtorqueP": -(torque + np.cross(arm, guide)),
        }
    if case.scene is joints.revolute:  # ADAMS counts the spring as part of the joint
        torque = torque + outputs("T0", "T1", "T2")
    return series | {"Rforce": -force, "Rtorque": -(torque + np.cross(arm, force))}


def example_series(name: str, times: list) -> dict:
    """mechc's motion of an example, under the names of the recorded signals."""
    example = EXAMPLES[name]
    model = example.scene()
    y0 = model.assemble(example.start, example.speeds, example.guess, params=example.values)
    sol = model.simulate(
        example.end, y0, example.values, rtol=RTOL, t_eval=times, inputs=example.inputs or None
    )
    states = {*model.coordinates, *model.speeds}
    return {
        signal: sol[here] if here in states else sol.output(here, times)
        for signal, here in example.signals.items()
    }


def rows() -> Iterator[Row]:
    """All rows, in the order of the table."""
    yield from map(joint_row, joints.CASES)
    yield from map(example_row, EXAMPLES)


def converge() -> None:
    """Write `converged.json` anew, of the series that were recorded; some minutes."""
    chrono, modelica = read("chrono"), read("modelica")
    found = {
        "chrono": {
            name: _only(series, converged_joints(name, chrono["times"]))
            for name, series in chrono["cases"].items()
        },
        "modelica": {
            name: _only(case["signals"], CONVERGED[name](case["times"]))
            for name, case in modelica["cases"].items()
        },
    }
    write("converged", found, 12)


def _only(names: dict, series: dict) -> dict:
    return {name: series[name] for name in names}


def write(name: str, data: dict, decimals: int) -> None:
    """JSON with numbers of that many decimals, which makes rounding to zero."""

    def rounded(value):
        if isinstance(value, dict):
            return {key: rounded(one) for key, one in value.items()}
        if isinstance(value, list):
            return [rounded(one) for one in value]
        return round(value, decimals) + 0.0 if isinstance(value, float) else value

    text = json.dumps(rounded(data), separators=(",", ":"))
    (HERE / f"{name}.json").write_text(text.replace("},", "},\n") + "\n")
