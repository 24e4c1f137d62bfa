"""Batches streamed to Zarr, so that a killed call can be resumed.

A folder holds ``data.zarr`` (a Zarr group of format 3, one array per result) and ``mechc``: the
request, and one manifest per chunk, moved into place after the data that it certifies are on the
disk, and replaced when more members of the chunk are.  The manifests are checked when a folder is
opened and when a call resumes it.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mechc.assembly.initial_values import Assembly
from mechc.batch.dataset import attributes
from mechc.batch.driven import NONE, BatchInputs, Columns, checked_inputs
from mechc.batch.events import events_from_json
from mechc.batch.layout import (
    METADATA,
    Layout,
    create,
    layouts,
    open_array,
    output_shapes,
)
from mechc.batch.results import Batch
from mechc.batch.sensitivities import check_names
from mechc.batch.spec import (
    Compute,
    Recipe,
    checked_recipe,
    common_count,
    system_for_results,
)
from mechc.batch.stored import manifests
from mechc.compilation.find import system_of
from mechc.errors import MechcError, package
from mechc.files import file_lock, remove_parts, replacing, write_text, written_into
from mechc.inputs.signals import PARTS, Signal
from mechc.results.files import reference_in
from mechc.results.untrusted import (
    names_of,
    printable,
    read_arrays,
    read_json,
    refuse_links,
    short,
)
from mechc.simulation.settings import Policy, checked_policy, checked_span, checked_times
from mechc.system.system import System

FORMAT = 2
DATA, NOTES, REQUEST, INPUTS = "data.zarr", "mechc", "request.json", "inputs"
LOCK = ".mechc-lock"
RESUME = ". What is done is kept: make the same call again to resume"


# -- streaming --------------------------------------------------------------------------------


def stream(
    system: System, recipe: Recipe, folder: Path, size: int, compute: Compute,
    report: Callable[[int], None],
) -> Batch:  # fmt: skip
    """Compute the members that are not in ``folder`` yet; the batch, read from there.

    Raises :class:`MechcError` if the folder contains something else, or the results of another
    request: it names the difference.
    """
    zarr = _zarr()
    notes, data = folder / NOTES, folder / DATA
    with _alone_in(folder):
        _claim(system, recipe, folder, size)
        stored = layouts(recipe, system.scene.width, output_shapes(system, recipe), size)
        with written_into(folder, RESUME):
            arrays = _prepare_arrays(zarr, system, recipe, folder, stored)
            every = recipe.ranges(size)
            for first, _, _ in manifests.damaged_chunks(notes, data, stored, every):
                manifests.discard(notes, data, stored, first)
            ends = [(manifests.end_of(notes, *each), each[1]) for each in every]
        missing = [(end, last) for end, last in ends if end < last]
        report(recipe.count - sum(last - first for first, last in missing))
        complete, hashes = True, {}  # of chunks of which a part is there
        try:
            for first, found, whole in compute(missing, report):
                complete = complete and whole
                if not whole:
                    continue
                chunk, end = first - first % size, first + len(found["t"])
                with written_into(folder, RESUME):
                    if first == chunk:  # a killed call may have left a part of it
                        manifests.discard(notes, data, stored, chunk)
                    if chunk not in hashes:
                        hashes[chunk] = manifests.hashes_of(notes, data, stored, chunk, first)
                    for name in stored:
                        arrays[name][first:end] = found[name]
                        hashes[chunk][name].update(np.ascontiguousarray(found[name]).data)
                    manifests.write(notes, data, chunk, end, hashes[chunk], stored)
                if end in (chunk + size, recipe.count):
                    del hashes[chunk]
        except KeyboardInterrupt:
            complete = False
    return Batch(system, recipe, arrays, complete)


def _claim(system: System, recipe: Recipe, folder: Path, size: int) -> None:
    """Write the request into a new folder, or check that the folder has the same one."""
    from mechc import __version__

    notes = folder / NOTES
    system.wait(batches=False)
    request = {
        "format": FORMAT,
        "mechc": __version__,
        **system.reference.to_json(),
        "instruction set": system.instruction_set,
        "chunk": size,
        **json.loads(json.dumps(recipe.as_json())),
    }
    if not (notes / REQUEST).exists():
        foreign = [p.name for p in folder.iterdir() if p.name not in (NOTES, LOCK)]
        if foreign:
            raise MechcError(
                f"{folder} contains other files ({printable(foreign[0])}): name a new folder"
            )
        with written_into(folder, RESUME):
            notes.mkdir(exist_ok=True)
            _write_inputs(notes, recipe)
            write_text(notes / REQUEST, json.dumps(request, indent=1))
        return
    held = _read_request(folder)
    differing = [
        f"{key} is {_short(held.get(key))}, not {_short(request.get(key))}"
        for key in {**held, **request}
        if held.get(key) != request.get(key)
    ]
    if differing:
        raise MechcError(
            f"{folder} contains the results of another request: {'; '.join(differing)}. Name a new "
            "folder, or make the same call again to resume"
        )
    _write_inputs(notes, recipe)  # again, in case they were damaged on the disk


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _write_inputs(notes: Path, recipe: Recipe) -> None:
    """The members' inputs, so that the folder can be opened without the call."""
    columns = {
        f"{kind}/{i}": np.asarray(column)
        for kind, named in _columns(recipe).items()
        for i, column in enumerate(named.values())
    }
    names = {kind: list(named) for kind, named in _columns(recipe).items()}
    policy = recipe.policy.as_dict()
    atol = policy.pop("atol")
    told: dict[str, Any] = {
        "count": recipe.count, "span": recipe.span, "guess": dict(recipe.guess), "names": names,
        "keep_states": recipe.keep_states, "outputs": recipe.outputs,
        "reductions": recipe.reductions, "until": recipe.until, "policy": policy,
        "events": None if recipe.events is None else recipe.events.as_json(),
        "sensitivities": recipe.sensitivities,
        "sensitivity_error_control": recipe.sensitivity_error_control,
    }  # fmt: skip
    arrays: dict[str, Any] = columns | {"t_eval": recipe.t_eval}
    told["signals"] = {}
    for i, (name, signal) in enumerate(recipe.inputs.signals.items()):
        told["signals"][name], parts = signal.parts
        arrays |= {f"signals/{i}/{part}": values for part, values in parts.items()}
    if recipe.states is not None:
        arrays["states"] = recipe.states
    if atol is not None:
        arrays["atol"] = atol
    with replacing(notes / f"{INPUTS}.npz") as part, part.open("wb") as file:
        np.savez(file, **arrays)
    write_text(notes / f"{INPUTS}.json", json.dumps(told))


def _columns(recipe: Recipe) -> dict[str, Columns]:
    """The columns that may differ between members, by kind."""
    return {
        "params": recipe.params, "coordinates": recipe.coordinates, "speeds": recipe.speeds,
        "inputs": recipe.inputs.numbers,
    }  # fmt: skip


def _prepare_arrays(
    zarr: Any, system: System, recipe: Recipe, folder: Path, stored: Mapping[str, Layout]
) -> dict[str, Any]:
    """Arrays to write to; one that is missing or damaged is created again."""
    group = folder / DATA
    if not (group / METADATA).is_file():
        zarr.open_group(str(group), mode="a", zarr_format=3)
    arrays = {}
    for name, layout in stored.items():
        try:
            arrays[name] = open_array(zarr, group / name, layout, "r+")
        except MechcError:
            shutil.rmtree(group / name, ignore_errors=True)
            arrays[name] = create(zarr, group / name, layout, attributes(system, recipe, name))
    return arrays


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, so that one call at a time writes to it."""
    with ExitStack() as until_end:
        with written_into(folder):
            folder.mkdir(parents=True, exist_ok=True)
            refuse_links(folder)
            alone = until_end.enter_context(file_lock(folder / LOCK, wait=False))
        if not alone:
            raise MechcError(f"another call is writing into {folder}")
        _remove_left_behind(folder)
        yield


def _remove_left_behind(folder: Path) -> None:
    """Remove what a killed call was writing: files of mechc, and of Zarr."""
    with written_into(folder):
        remove_parts(folder / NOTES)
        for part in (folder / DATA).rglob("*.partial"):
            part.unlink(missing_ok=True)


# -- opening ----------------------------------------------------------------------------------


def open_batch(folder: Path, given: System | None = None) -> Batch:
    """A batch that was streamed to a folder, checked; its arrays are read when they are used.

    The folder is untrusted: its metadata of arrays are compared with its request, the request with
    the system, and the data with their sha256.

    ``given`` is needed for a user-defined mechanism that is not in the cache any more.

    Raises :class:`MechcError` if it is not a batch, its mechanism is not found, or it is damaged:
    with what.
    """
    zarr = _zarr()
    held = _read(folder)
    try:
        system = system_of(reference_in(held.request, given=given is not None), given)
        asked = held.recipe
        system = system_for_results(
            system, asked.outputs, asked.reductions, asked.until, asked.sensitivities
        )
    except MechcError as error:
        raise MechcError(f"{folder} cannot be opened: {short(str(error))}") from None
    with _naming_damaged(folder):
        recipe = _checked_again(system, held.recipe)
        tails = output_shapes(system, recipe)
    arrays, stored = _open_arrays(zarr, held, tails)
    for _, _, why in manifests.damaged_chunks(folder / NOTES, folder / DATA, stored, held.ranges):
        raise MechcError(f"{why}. Repeat the call that made {folder} to repair it")
    return Batch(system, recipe, arrays, not held.missing())


def holds_batch(folder: Path) -> bool:
    """Whether a batch was streamed to a folder."""
    return (folder / NOTES / REQUEST).is_file()


def is_unfinished(folder: Path) -> bool:
    """Whether a folder holds a batch of which members are not computed yet."""
    try:
        return holds_batch(folder) and bool(_read(folder).missing())
    except MechcError:
        return False


class Examined(NamedTuple):
    """Findings of :func:`examine`: chunks in all, those not computed yet, what is wrong."""

    chunks: int
    missing: int
    damage: list[str]


def examine(folder: Path) -> Examined:
    """Check all of a streamed batch, without its model.

    Raises :class:`MechcError` if it is not a batch, or so damaged that its chunks cannot be
    checked.
    """
    zarr = _zarr()
    held = _read(folder)
    _, stored = _open_arrays(zarr, held, None)
    notes, data = folder / NOTES, folder / DATA
    damage = [why for *_, why in manifests.damaged_chunks(notes, data, stored, held.ranges)]
    return Examined(len(held.ranges), len(held.missing()), damage)


class _Held(NamedTuple):
    """A folder's request and inputs, in agreement with each other."""

    folder: Path
    request: dict[str, Any]
    recipe: Recipe
    state: tuple[str, ...]
    size: int
    ranges: list[tuple[int, int]]

    def missing(self) -> list[int]:
        """First members of the chunks that are not there as a whole."""
        notes = self.folder / NOTES
        with _naming_damaged(self.folder):
            return [each[0] for each in self.ranges if manifests.end_of(notes, *each) < each[1]]


def _read(folder: Path) -> _Held:
    with _naming_damaged(folder):
        refuse_links(folder)
    request = _read_request(folder)
    with _naming_damaged(folder):
        recipe = _read_recipe(folder / NOTES)
        for key, value in json.loads(json.dumps(recipe.as_json())).items():
            if request[key] != value:
                raise ValueError(f"its inputs are not those of its request: {key}")
        state = names_of(request["state"], "its states")
        size = request["chunk"]
        if type(size) is not int or size < 1:
            raise ValueError(f"chunks of {printable(str(size))} members")
    return _Held(folder, request, recipe, state, size, recipe.ranges(size))


@contextmanager
def _naming_damaged(folder: Path) -> Iterator[None]:
    """Turn errors in a folder's files into errors that name the folder."""
    try:
        yield
    except MechcError as error:
        raise MechcError(f"{folder} is damaged: {short(str(error))}") from None
    except (ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError) as error:
        raise MechcError(f"{folder} is damaged: {short(str(error))}") from None


def _open_arrays(
    zarr: Any, held: _Held, tails: Mapping[str, tuple[int, ...]] | None
) -> tuple[dict[str, Any], dict[str, Layout]]:
    """The arrays of a folder, whose metadata are those of its request, unread.

    ``tails``: shapes of the outputs at one state; None: as in the folder's metadata.
    """
    data = held.folder / DATA
    if tails is None:
        with _naming_damaged(held.folder):
            tails = {
                name: tuple(read_json(data / f"output_{i}" / METADATA, 2**20)["shape"][2:])
                for i, name in enumerate(held.recipe.outputs)
            }
    with _naming_damaged(held.folder):
        stored = layouts(held.recipe, len(held.state), tails, held.size)
    return {name: open_array(zarr, data / name, stored[name]) for name in stored}, stored


def _read_request(folder: Path) -> dict[str, Any]:
    try:
        request = read_json(folder / NOTES / REQUEST)
    except FileNotFoundError:
        raise MechcError(f"{folder} contains no batch written by mechc") from None
    if request.get("format") != FORMAT:
        raise MechcError(
            f"{folder} was written in another format than {FORMAT}: make the call again into a "
            "new folder"
        )
    return request


def _read_recipe(notes: Path) -> Recipe:
    """The request as data; checks that need the model come later."""
    told = read_json(notes / f"{INPUTS}.json")
    arrays = read_arrays(notes / f"{INPUTS}.npz")
    columns = {
        kind: {name: arrays[f"{kind}/{i}"] for i, name in enumerate(told["names"].get(kind, ()))}
        for kind in ("params", "coordinates", "speeds", "inputs")
    }
    signals = {
        name: Signal.from_parts(words, {part: arrays[f"signals/{i}/{part}"] for part in PARTS})
        for i, (name, words) in enumerate(told.get("signals", {}).items())
    }
    driven = BatchInputs(columns["inputs"], signals)
    recipe = Recipe(
        count=told["count"], span=(told["span"][0], told["span"][1]),
        states=arrays.get("states"), guess=dict(told["guess"]), t_eval=arrays["t_eval"],
        keep_states=told["keep_states"], outputs=names_of(told["outputs"], "its outputs"),
        reductions=names_of(told["reductions"], "its reductions"), until=told["until"],
        policy=Policy(atol=arrays.get("atol"), **told["policy"]),
        params=columns["params"], coordinates=columns["coordinates"], speeds=columns["speeds"],
        inputs=driven if any(driven) else NONE, events=events_from_json(told.get("events")),
        sensitivities=names_of(told.get("sensitivities", []), "its sensitivities"),
        sensitivity_error_control=told.get("sensitivity_error_control") is True,
    )  # fmt: skip
    every = {name: values for kind in columns.values() for name, values in kind.items()}
    if recipe.states is not None:
        every["y0"] = recipe.states
    if type(recipe.count) is not int or recipe.count != common_count(every):
        raise ValueError("it has another number of members than its inputs")
    return recipe


def _checked_again(system: System, recipe: Recipe) -> Recipe:
    """The request, checked as a user's; raises ValueError if the result differs."""
    told = recipe.policy.arguments()
    span = checked_span(recipe.span)
    start: Any = recipe.states
    if start is None:
        start = Assembly(recipe.coordinates, recipe.speeds, recipe.guess)
    again = checked_recipe(
        system, span, start, recipe.params, checked_times(recipe.t_eval, span),
        recipe.keep_states, recipe.outputs, recipe.reductions, recipe.until,
        checked_policy(system, **told),
        checked_inputs(system, {**recipe.inputs.numbers, **recipe.inputs.signals}),
    )  # fmt: skip
    again = replace(
        again, events=recipe.events, sensitivities=recipe.sensitivities,
        sensitivity_error_control=recipe.sensitivity_error_control,
    )  # fmt: skip
    if again.sensitivities:
        check_names(system, again)
    if again.as_json() != recipe.as_json():
        raise ValueError("no call makes such a request")
    return again


def _zarr() -> Any:
    return package(
        "zarr", "zarr is not installed: pip install zarr (batches without out= do not need it)"
    )
