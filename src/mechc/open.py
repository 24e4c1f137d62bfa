"""Saved solutions and batches, opened again."""

from __future__ import annotations

import copyreg
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import CompilerError, MechcError, MissingInputError, MissingPackageError
from mechc.files import path_of
from mechc.model import Model
from mechc.results.solution import Solution
from mechc.results.untrusted import mapping_of, printable, short, text_of
from mechc.simulation.contact_steps import steps_of
from mechc.simulation.events.event import EventRecord
from mechc.simulation.events.own_contacts import WITHOUT
from mechc.simulation.record import Piece, Record
from mechc.simulation.settings import LARGEST_TRAJECTORY, Policy
from mechc.simulation.status import CODES, ChangePoint, Status
from mechc.system.parameters import Array

if TYPE_CHECKING:
    from mechc.batch.results import Batch
    from mechc.results.view.page import View

ROWS_A_STEP = 12  # no method stores more rows of states per step


def open_saved(
    path: str | Path, model: Model | None = None, *, max_bytes: float = LARGEST_TRAJECTORY
) -> Solution | Batch:
    """A solution saved as ``.nc``, or a batch streamed to a folder, again.

    The model is loaded and the motion simulated again from the saved start with the saved
    settings, and compared with the saved states; so it has dense output.

    Parameters
    ----------
    model
        Needed for a user-defined mechanism that is not in this user's cache any more: the same,
        compiled again.  Needed too where inputs were given with the run as functions of Python,
        which files do not hold: the model with the same inputs, ``model.with_inputs({...})`` or
        ``sol.model``.  Inputs that it is given replace those of the file.
    max_bytes
        Memory for the states and the dense output of a solution when it is simulated again: an
        untrusted file may contain any number of steps.

    Raises
    ------
    MissingInputError, MechcError
        If the file is not a saved solution or damaged, its mechanism is not found, or the motion
        differs or is too large.
    """
    path = path_of(path)
    try:
        return _batch(path, model) if _is_folder(path) else _solution(path, model, max_bytes)
    except MechcError as error:
        if isinstance(error, CompilerError) or str(error).isprintable():
            raise
        raise MechcError(printable(str(error))) from None  # files are called anything, too


def _batch(path: Path, model: Model | None) -> Batch:
    from mechc.batch.stored.store import open_batch

    batch = open_batch(path, None if model is None else model.system)
    batch.model = Model.of_system(batch.system)
    return batch


def _solution(path: Path, model: Model | None, max_bytes: float) -> Solution:
    from mechc.results.files import DAMAGE, read

    try:
        recipe, t, states = read(path, max_bytes)
        sol = _again(_model(recipe, model), recipe, t, max_bytes)
        sol._recorded_view = recipe["view"]
    except (FileNotFoundError, MissingPackageError, CompilerError):
        raise
    except MissingInputError:
        raise MissingInputError(
            f"{path} does not hold the inputs that were given with its run, functions of Python "
            "or texts: give mechc.open(path, model.with_inputs({...})) the same"
        ) from None
    except DAMAGE as error:
        told = short(str(error) or type(error).__name__)
        raise MechcError(f"{path} cannot be opened as a solution saved by mechc: {told}") from None
    _compare(path, sol, states)
    return sol


def open_view(path: str | Path) -> View:
    """The picture in space that was saved with the motion of a user-defined mechanism.

    It needs no model, no compiler, and simulates nothing: a page as of :meth:`mechc.Solution.view`,
    60 frames a second.

    Parameters
    ----------
    path
        A solution that was saved as ``.nc``.

    Raises
    ------
    MechcError
        If the file is not a saved solution, is damaged, or holds no picture, as those of the
        library's mechanisms and of earlier versions: open them by :func:`mechc.open`.
    MissingPackageError
        If three.js is not installed: ``pip install '.[view]'``.
    """
    from mechc.results.files import DAMAGE, read
    from mechc.results.view.page import saved_view

    try:
        data = read(path_of(path))[0]["view"]
    except (FileNotFoundError, MissingPackageError):
        raise
    except DAMAGE as error:
        told = short(str(error) or type(error).__name__)
        raise MechcError(f"{printable(str(path))}: {told}") from None
    if data is None:
        raise MechcError(
            f"{printable(str(path))} holds no picture: mechc.open(...).view() makes it"
        )
    return saved_view(data)


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError as error:
        raise MechcError(f"{printable(str(path)[:200])}: {error.strerror}") from None


def _model(told: Mapping[str, Any], given: Model | None) -> Model:
    from mechc.results.files import reference_in

    model = Model.of_reference(reference_in(told, given=given is not None), given)
    driven = model.system.driven
    if driven is None:
        return model
    left = driven.missing_inputs(mapping_of(told.get("inputs", {}), "its inputs"))
    if not {*model.inputs} <= {*left, *driven.given}:
        raise MissingInputError
    return model.with_inputs(left) if left else model


def _again(model: Model, recipe: dict[str, Any], t: Array, max_bytes: float) -> Solution:
    """The run up to its end; all values in the file are checked as a user's input is."""
    told = Policy(**mapping_of(recipe["policy"], "its policy"))
    room = int(max_bytes // (8 * ROWS_A_STEP * model.system.scene.width))
    policy = told.arguments() | {
        "dense": True,
        "max_steps": min(2 * int(recipe["steps"]) + 1000, room),  # cut short, the last differ
        "on_change_point": "continue" if told.on_change_point == "continue" else "stop",
    }
    sol = _pieces_again(model, recipe, policy)
    if sol.status.code == "too many steps":
        raise MechcError(
            f"simulating it again takes more than {policy['max_steps']} steps; read the file with "
            "xarray instead, or allow more: mechc.open(path, max_bytes=...)"
        )
    sol.policy = told._replace(dense=True, atol=sol.policy.atol)
    ended = mapping_of(recipe["status"], "its status")
    if ended["code"] not in {name for name, *_ in CODES.values()}:
        raise MechcError("its status is unknown")
    sol.status = Status(
        ended["code"],
        float(ended["t"]),
        text_of(ended["cause"], "the cause of its end"),
        text_of(ended["advice"], "the advice about its end"),
        tuple(text_of(text, "a warning") for text in ended["warnings"]),
    )
    if not np.array_equal(sol.record.times(), t):
        sol._times = t
    width = model.system.scene.width
    sol.events = tuple(
        EventRecord(np.array(times, float), np.array(y, float).reshape(-1, width))
        for times, y in recipe["events"]
    )
    titles = recipe.get("event_titles", ())  # files of earlier versions have none
    sol._titles = tuple(text_of(title, "the title of an event") for title in titles)
    sol.change_points = tuple(
        ChangePoint(float(c["t"]), tuple(map(float, c["q"])), float(c["gap"]))
        for c in recipe["change_points"]
    )
    return sol


def _pieces_again(model: Model, recipe: dict[str, Any], policy: dict[str, Any]) -> Solution:
    """The run from its start and, where events have reset the state, from each jump on."""
    t0, t1 = recipe["span"]
    jumps = [(float(t), np.array(y, float)) for t, y in recipe.get("jumps", [])]
    starts = [(float(t0), np.array(recipe["y0"])), *jumps]
    contacts = recipe.get("contacts") or [[[]]] * len(starts)
    ends = [*(t for t, _ in jumps), float(t1)]
    values = recipe.get("values") or [recipe["params"]] * len(starts)
    sol: Solution | None = None
    for (begin, state), end, (words, *steps), p in zip(starts, ends, contacts, values, strict=True):
        span = (begin, begin if steps else end)
        piece = model.simulate(span, state, np.array(p, float), events=WITHOUT, **policy)
        if words:
            told = [text_of(word, "a contact") for word in words]
            piece.record = _in_contact(piece, told, steps)
        sol = piece if sol is None else sol.followed_by(piece)
        policy["first_step"] = None
        made = int(piece.stats["steps"] + piece.stats["rejected"])
        policy["max_steps"] = max(policy["max_steps"] - made, 1)
        if not sol.status.ok:
            break
    assert sol is not None
    return sol


def _in_contact(part: Solution, words: list[str], given: list[Any]) -> Record:
    """The record of a part, in contact where its steps are given."""
    contacts = tuple(words)
    if not given:
        return Record([
            Piece(piece.steps, piece.params, contacts=contacts, cut=piece.cut)
            for piece in part.record.pieces
        ])  # fmt: skip
    pieces = []
    for end, told in given:
        steps = steps_of(part.system, part.params, mapping_of(told, "its contacts"))
        cut = float(end) if end < steps.ends()[0][1] else None
        pieces.append(Piece(steps, part.params, contacts=contacts, cut=cut))
    return Record(pieces)


def _pickled(sol: Solution) -> tuple[Any, ...]:
    """The data to simulate a solution again, and its states to compare with."""
    from mechc.results.files import recipe_of

    return _unpickled, (sol.model, recipe_of(sol), dict(sol.stats), sol.t, sol.y)


def _unpickled(
    model: Model, recipe: dict[str, Any], stats: dict[str, Any], t: Array, y: Array
) -> Solution:
    sol = _again(model, recipe, t, LARGEST_TRAJECTORY)
    sol.stats = MappingProxyType(stats)
    _compare(Path("the pickled solution"), sol, y)
    return sol


copyreg.pickle(Solution, _pickled)


def _compare(path: Path, sol: Solution, states: Array) -> None:
    again = sol.y
    scale = 1.0 + np.abs(states).max(initial=0.0)
    same = again.shape == states.shape and np.abs(again - states).max(initial=0.0) < 1e-6 * scale
    if not same:
        raise MechcError(
            f"{path}: simulated again, the motion differs from the one saved (another version "
            "or processor, at a motion this sensitive); read the file with xarray instead"
        )
