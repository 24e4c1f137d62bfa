"""Batches as xarray datasets, and streamed to Zarr so that a killed call can go on.

A folder holds ``data.zarr`` (a Zarr group of format 3, one array per result) and ``mechc``: the
request, and one manifest per finished chunk, moved into place after the chunk's data.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from mechc.batch.dataset import attributes, dimensions
from mechc.batch.results import Batch
from mechc.batch.spec import Compute, Recipe
from mechc.compilation.find import system_of
from mechc.errors import MechcError, MissingPackageError
from mechc.simulation.settings import Policy
from mechc.system.parameters import Array
from mechc.system.reference import ModelReference
from mechc.system.system import System

FORMAT = 1
DATA, NOTES, REQUEST, INPUTS = "data.zarr", "mechc", "request.json", "inputs"
LOCK = ".mechc-lock"


# -- streaming --------------------------------------------------------------------------------


def stream(
    system: System, recipe: Recipe, folder: Path, size: int, compute: Compute,
    report: Callable[[int], None],
) -> Batch:  # fmt: skip
    """Compute the chunks that ``folder`` does not hold yet; the batch, read from there.

    Raises
    ------
    MechcError
        If the folder holds something else, or the results of another request: it says what
        differs.
    """
    zarr = _zarr()
    notes = folder / NOTES
    with _locked(folder):
        _claim(system, recipe, folder, size)
        every = recipe.ranges(size)
        missing = [r for r in every if not _manifest(notes, r[0]).exists()]
        report(recipe.count - sum(last - first for first, last in missing))
        complete = True
        try:
            for first, found, whole in compute(missing, report):
                complete = complete and whole
                if whole:
                    _write_chunk(zarr, system, recipe, folder, size, first, found)
        except KeyboardInterrupt:
            complete = False
    return Batch(system, recipe, _arrays(zarr, folder), complete)


def _claim(system: System, recipe: Recipe, folder: Path, size: int) -> None:
    """Write the request into a new folder, or see that the folder holds the same one."""
    notes = folder / NOTES
    request = _request(system, recipe, size)
    if not (notes / REQUEST).exists():
        foreign = [p.name for p in folder.iterdir() if p.name not in (NOTES, LOCK)]
        if foreign:
            raise MechcError(f"{folder} holds other things ({foreign[0]}): name a new folder")
        notes.mkdir(exist_ok=True)
        _write_inputs(notes, recipe)
        _move_into_place(notes / REQUEST, json.dumps(request, indent=1))
        return
    differing = _differences(_read_request(folder), request)
    if differing:
        raise MechcError(
            f"{folder} holds the results of another request: {'; '.join(differing)}. Name a new "
            "folder, or make the same call again to go on"
        )


def _request(system: System, recipe: Recipe, size: int) -> dict[str, Any]:
    from mechc import __version__

    system.wait()
    return {
        "format": FORMAT,
        "mechc": __version__,
        **system.reference.to_json(),
        "instruction set": system.instruction_set,
        "chunk": size,
        **json.loads(json.dumps(recipe.told())),
    }


def _differences(held: dict[str, Any], asked: dict[str, Any]) -> list[str]:
    keys = [key for key in {**held, **asked} if held.get(key) != asked.get(key)]
    return [f"{key} is {_short(held.get(key))}, not {_short(asked.get(key))}" for key in keys]


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _write_inputs(notes: Path, recipe: Recipe) -> None:
    """What the members start from, so that the folder can be opened without the call."""
    columns = {
        f"{kind}/{i}": np.asarray(column)
        for kind in ("params", "coordinates", "speeds")
        for i, column in enumerate(getattr(recipe, kind).values())
    }
    names = {k: list(getattr(recipe, k)) for k in ("params", "coordinates", "speeds")}
    policy = recipe.policy._asdict()
    atol = policy.pop("atol")
    told = {
        "count": recipe.count, "span": recipe.span, "guess": dict(recipe.guess), "names": names,
        "keep_states": recipe.keep_states, "outputs": recipe.outputs,
        "reductions": recipe.reductions, "until": recipe.until, "policy": policy,
    }  # fmt: skip
    arrays: dict[str, Any] = columns | {"t_eval": recipe.t_eval}
    if recipe.states is not None:
        arrays["states"] = recipe.states
    if atol is not None:
        arrays["atol"] = atol
    with (notes / f"{INPUTS}.part").open("wb") as file:
        np.savez(file, **arrays)
    (notes / f"{INPUTS}.part").replace(notes / f"{INPUTS}.npz")
    _move_into_place(notes / f"{INPUTS}.json", json.dumps(told))


def _move_into_place(path: Path, text: str) -> None:
    part = path.with_name(f"{path.name}.part")
    part.write_text(text, "utf-8")
    part.replace(path)


def _manifest(notes: Path, first: int) -> Path:
    return notes / f"chunk-{first:012d}.json"


def _write_chunk(
    zarr: Any, system: System, recipe: Recipe, folder: Path, size: int, first: int,
    found: dict[str, Array],
) -> None:  # fmt: skip
    """The data of one chunk, then the manifest that vouches for it."""
    digest = hashlib.sha256()
    for name, values in found.items():
        array = _array(zarr, system, recipe, folder, size, name, values)
        array[first : first + len(values)] = values
        digest.update(np.ascontiguousarray(values).data)
    told = {"members": [first, first + len(found["t"])], "sha256": digest.hexdigest()}
    _move_into_place(_manifest(folder / NOTES, first), json.dumps(told))


def _array(
    zarr: Any, system: System, recipe: Recipe, folder: Path, size: int, name: str, values: Array
) -> Any:
    """The array of one result, made when it is first needed."""
    group = folder / DATA
    path = group / name
    if (path / "zarr.json").exists():
        return zarr.open_array(str(path), mode="r+")
    blank = np.nan if values.dtype.kind == "f" else 0
    if not (group / "zarr.json").exists():
        zarr.open_group(str(group), mode="a", zarr_format=3)
    return zarr.create_array(
        str(path),
        shape=(recipe.count, *values.shape[1:]),
        chunks=(min(size, recipe.count), *values.shape[1:]),
        dtype=values.dtype,
        fill_value=blank,
        dimension_names=dimensions(name, values.ndim),
        attributes=attributes(system, recipe, name),
        overwrite=True,
    )


def _arrays(zarr: Any, folder: Path) -> dict[str, Any]:
    """Every array of a folder, unread."""
    held = sorted(path.parent.name for path in (folder / DATA).glob("*/zarr.json"))
    return {name: zarr.open_array(str(folder / DATA / name), mode="r") for name in held}


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """One call at a time; the lock goes with the process that holds it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / LOCK).open("w")
    except OSError as error:
        raise MechcError(f"cannot write into {folder}: {error.strerror}") from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise MechcError(f"another call is writing into {folder}") from None
        yield


# -- opening ----------------------------------------------------------------------------------


def open_batch(folder: Path, system: System | None = None) -> Batch:
    """A batch that was streamed to a folder; its arrays are read when they are used.

    ``system`` is needed where the mechanism is one's own and not in the cache any more.

    Raises
    ------
    MechcError
        If the folder is not one, or its mechanism is not at hand.
    """
    zarr = _zarr()
    request = _read_request(folder)
    try:
        recipe = _read_recipe(folder / NOTES)
        system = system_of(ModelReference.from_json(request), system)
        chunks = recipe.ranges(int(request["chunk"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise MechcError(f"{folder} is damaged: {error}") from None
    complete = all(_manifest(folder / NOTES, first).exists() for first, _ in chunks)
    return Batch(system, recipe, _arrays(zarr, folder), complete)


def _read_request(folder: Path) -> dict[str, Any]:
    path = folder / NOTES / REQUEST
    try:
        request = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        raise MechcError(f"{folder} holds no batch written by mechc") from None
    except ValueError as error:
        raise MechcError(f"{path} is damaged: {error}") from None
    if not isinstance(request, dict) or request.get("format") != FORMAT:
        raise MechcError(f"{folder} was written in another format than {FORMAT}")
    return request


def _read_recipe(notes: Path) -> Recipe:
    told = json.loads((notes / f"{INPUTS}.json").read_text("utf-8"))
    with np.load(notes / f"{INPUTS}.npz", allow_pickle=False) as held:
        arrays = {name: held[name] for name in held.files}
    columns = {
        kind: {name: arrays[f"{kind}/{i}"] for i, name in enumerate(names)}
        for kind, names in told["names"].items()
    }
    return Recipe(
        count=int(told["count"]), span=(told["span"][0], told["span"][1]),
        states=arrays.get("states"), guess=told["guess"], t_eval=arrays["t_eval"],
        keep_states=bool(told["keep_states"]), outputs=tuple(told["outputs"]),
        reductions=tuple(told["reductions"]), until=str(told["until"]),
        policy=Policy(atol=arrays.get("atol"), **told["policy"]), **columns,
    )  # fmt: skip


def _zarr() -> Any:
    try:
        import zarr
    except ImportError:
        raise MissingPackageError(
            "zarr is not installed: pip install zarr (batches without out= do not need it)"
        ) from None
    return zarr
