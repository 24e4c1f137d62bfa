"""One case from its seed to its differences."""

from __future__ import annotations

import os
import traceback
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from importlib.util import find_spec

import numpy as np

import mechc

from .doors import DOORS
from .doors.motions import begin
from .equations import equations
from .judge import POINTS, Case, Difference, Run, Told
from .of_mujoco import OfMujoco
from .reference import Reference
from .scene import Scene, UnbuiltError, drawn, numbers
from .starts import UnclosedError, started

LONGEST_TEXT = 6000  # characters of a message


@dataclass
class Outcome:
    """What became of a case, to be told by another process."""

    case: int
    kind: str = ""
    used: frozenset[str] = frozenset()
    faults: list[str] = field(default_factory=list)
    compared: Counter[str] = field(default_factory=Counter)  # by door
    largest: dict[str, float] = field(default_factory=dict)  # share of what is allowed, by door
    ended: Counter[str] = field(default_factory=Counter)  # runs without a motion, by why
    scenes: int = 0
    seconds: Counter[str] = field(default_factory=Counter)
    text: str = ""


def judge_case(seed: int, case: int, count: int, only: Sequence[str]) -> Outcome:
    """The outcome of a case with so many sets of numbers."""
    return judge_scene(drawn(seed, case), (seed, case), count, only)


def judge_scene(
    scene: Scene, key: tuple[int, int], count: int, only: Sequence[str] = ()
) -> Outcome:
    """The outcome of a scene; ``key`` draws its numbers, and doors where ``only`` names none."""
    found = Outcome(key[1], scene.kind, scene.used, text=scene.text)
    if scene.kind == "MJCF" and find_spec("mujoco") is None:
        found.ended["not installed: MuJoCo"] += 1
        return found
    try:
        _judge(scene, key, count, only, found)
    except UnbuiltError as error:
        found.ended[f"SymPy does not form it: {error}"] += 1
    except Exception:
        found.faults.append("error: " + traceback.format_exc()[-LONGEST_TEXT:])
    return found


def _judge(
    scene: Scene, key: tuple[int, int], count: int, only: Sequence[str], found: Outcome
) -> None:
    begun = _processor()
    names = scene.built()
    reference = OfMujoco(names["mjcf"]) if "mjcf" in names else Reference(equations(names), names)
    begun = _spent(found, "SymPy", begun)
    model = scene.compiled(names)
    begun = _spent(found, "compile", begun)
    made = Case(
        scene, names, model, reference, np.random.default_rng([*key, 2]),
        np.linspace(0.0, scene.span, POINTS),
    )  # fmt: skip
    states = (*model.coordinates, *model.speeds)
    for draw in range(count):
        values = numbers(scene, key, draw)
        try:
            values = started(values, made)
        except UnclosedError:
            found.ended["a start that Newton's steps do not close"] += 1
            continue
        values = replace(values, params=_of_the_model(values.params, model, reference))
        run = Run(values, np.array([values.start[n] for n in states]))
        made.runs.append(run)
        begin(made, run)
        if run.ended:
            found.ended[run.ended] += 1
    found.scenes = len(made.runs)
    begun = _spent(found, "base", begun)
    chosen = np.random.default_rng([*key, 3])
    for name, (share, door) in DOORS.items():
        taken = chosen.random() < share
        if not (any(word in name for word in only) if only else taken):
            continue
        try:
            _note(found, list(door(made)))
        except Exception as error:
            if not _stated(name, error):
                found.faults.append(f"{name}: {_words(error)}")
            else:
                found.ended[f"{name} refuses"] += 1
        begun = _spent(found, name, begun)


def _of_the_model(
    params: dict[str, float], model: mechc.Model, reference: Reference
) -> dict[str, float]:
    """Without those that have no effect: SymPy's matrices do not have them either."""
    known = set(model.parameters)
    missing = [n for n in params if n not in known and n in reference.parameters]
    if missing:
        raise AssertionError(f"the model has no {missing}, which SymPy's matrices have")
    return {n: v for n, v in params.items() if n in known}


def _note(found: Outcome, told: Sequence[Told]) -> None:
    """Counts all, and tells the worst of each door with the number that fail."""
    failing: dict[str, list[tuple[float, str]]] = {}
    for each in told:
        if isinstance(each, Difference):
            found.compared[each.door] += 1
            share = each.size / each.allowed
            found.largest[each.door] = max(found.largest.get(each.door, 0.0), share)
            if each.fails:
                words = f"{each.size:.3g}, allowed {each.allowed:.2g}: {each.told}"
                failing.setdefault(each.door, []).append((share, words))
        else:
            failing.setdefault(each.door, []).append((float("inf"), each.told))
    for door, words in failing.items():
        worst = max(words)[1]
        found.faults.append(f"{door} ({len(words)} scenes): {worst}")


STATED = {  # words by which a door may refuse a scene, as its page says
    "taylor": "taylor",  # scenes whose equations are not analytic, large ones
    "saved and opened": "does not hold the inputs",  # functions of Python and texts
    "sensitivities": "of a motion with friction",
}


def _stated(name: str, error: Exception) -> bool:
    """Whether a door may refuse a scene by what its page says."""
    words = next((STATED[key] for key in STATED if key in name), None)
    told = words is not None and words in str(error)
    return told and isinstance(error, mechc.MechcError | ValueError)


def _words(error: Exception) -> str:
    if isinstance(error, mechc.MechcError | ValueError):
        return f"{type(error).__name__}: {error}"
    return traceback.format_exc()[-LONGEST_TEXT:]


def _processor() -> float:
    """Seconds of this process and of the compilers that it has waited for."""
    return sum(os.times()[:4])


def _spent(found: Outcome, what: str, begun: float) -> float:
    now = _processor()
    found.seconds[what] += now - begun
    return now


def warm() -> None:
    """Imports what all cases share."""
    for module in ("compilation.request", "batch.simulate", "sensitivities.run", "results.files"):
        import_module(f"mechc.{module}")
    for module in ("compiler", "frontend.from_equations", "frontend.compile_request", "export.fmu"):
        import_module(f"mechc_codegen.{module}")
