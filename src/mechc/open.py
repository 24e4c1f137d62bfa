"""Saved solutions and batches, opened again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mechc.batch.results import Batch
from mechc.errors import CompilerError, MechcError, MissingPackageError
from mechc.model import Model
from mechc.results.files import read
from mechc.results.solution import Solution
from mechc.simulation.events import EventRecord
from mechc.simulation.settings import Policy
from mechc.simulation.status import ChangePoint, Status
from mechc.system.parameters import Array
from mechc.system.reference import ModelReference


def open_saved(path: str | Path, model: Model | None = None) -> Solution | Batch:
    """A solution saved as ``.nc``, or a batch streamed to a folder, again.

    The model is loaded and the motion simulated again from the saved start with the saved
    settings, and compared with the saved states; so it has dense output.

    Parameters
    ----------
    model
        Needed for a mechanism of one's own that is not in this user's cache any more: the same,
        compiled again.

    Raises
    ------
    MechcError
        If the file is not a saved solution, its mechanism is not at hand, or the motion comes
        out different.
    """
    path = Path(path)
    if path.is_dir():
        from mechc.batch.store import open_batch

        batch = open_batch(path, None if model is None else model.system)
        batch.model = Model.of_reference(batch.system.reference, model)
        return batch
    try:
        recipe, t, states = read(path)
        sol = _again(Model.of_reference(ModelReference.from_json(recipe), model), recipe, t)
    except (FileNotFoundError, MissingPackageError, CompilerError):
        raise
    except (MechcError, OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        raise MechcError(f"{path} cannot be opened as a solution saved by mechc: {error}") from None
    _compare(path, sol, states)
    return sol


def _again(model: Model, recipe: dict[str, Any], t: Array) -> Solution:
    """The run up to where it ended, with all that a file says checked as a user's input is."""
    told = Policy(**recipe["policy"])
    policy = told._asdict() | {
        "dense": True,
        "first_step": told.first_step or None,
        "method": "auto" if told.stiff_switch else told.method,
        "max_steps": told.max_steps + 100,  # cut short, the last steps differ
        "on_change_point": "continue" if told.on_change_point == "continue" else "stop",
    }
    del policy["stiff_switch"]
    sol = model.simulate(
        recipe["span"], np.array(recipe["y0"]), np.array(recipe["params"]), **policy
    )
    sol.policy = told._replace(dense=True, atol=sol.policy.atol)
    sol.status = Status(**recipe["status"] | {"warnings": tuple(recipe["status"]["warnings"])})
    if not np.array_equal(sol._run.states()[0], t):
        sol._times = t
    sol.events = tuple(_event_record(model, *told) for told in recipe["events"])
    sol.change_points = tuple(
        ChangePoint(float(c["t"]), tuple(map(float, c["q"])), float(c["gap"]))
        for c in recipe["change_points"]
    )
    return sol


def _event_record(model: Model, t: list[float], y: list[list[float]]) -> EventRecord:
    return EventRecord(np.array(t, float), np.array(y, float).reshape(-1, model.system.scene.width))


def _compare(path: Path, sol: Solution, states: Array) -> None:
    again = sol.y
    scale = 1.0 + np.abs(states).max(initial=0.0)
    same = again.shape == states.shape and np.abs(again - states).max(initial=0.0) < 1e-6 * scale
    if not same:
        raise MechcError(
            f"{path}: simulated again, the motion differs from the one saved (another version "
            "or processor, at a motion this sensitive); read the file with xarray instead"
        )
