"""Solutions as files and tables: NetCDF through xarray, CSV."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.errors import (
    CompilerError,
    MechcError,
    MissingPackageError,
    ValueOutOfBoundsError,
)
from mechc.results.durable import replacing
from mechc.results.untrusted import (
    checked_options,
    json_object,
    mapping_of,
    names_of,
    printable,
    read_regular,
    text_of,
)
from mechc.simulation.events import EventRecord
from mechc.simulation.status import CODES, ChangePoint, Status
from mechc.system.parameters import Array

if TYPE_CHECKING:
    from mechc.batch.simulate import Batch
    from mechc.model import Model
    from mechc.simulation.solution import Solution

FORMAT = 2
LONGEST = 200  # characters of a NetCDF name
LARGEST_FILE = 2**33  # bytes of a file that is opened
LARGEST_RUN = 2**30  # bytes of the states and dense output that a file may ask for
ROWS_A_STEP = 12  # no method keeps more rows of states a step
_FORMULA = re.compile(r"[\s\ufeff\u200b]*[=+@\-＝＋＠－]")
TAKEN = {"time", "energy", "closure", "velocity_closure"}
TAKEN |= {"byte", "char", "short", "ushort", "int", "uint", "int64", "uint64"}  # NetCDF's own
TAKEN |= {"float", "real", "double", "bool", "string"}


def to_dataset(sol: Solution) -> Any:
    """An ``xarray.Dataset`` over ``time``: every component, energy and closure.

    Variables are called like the coordinates and speeds, with what NetCDF does not take
    replaced by ``_``; the attribute ``long_name`` keeps the name, ``units`` the unit.  The
    attribute ``mechc`` holds what :func:`open_saved` needs to simulate again.
    """
    xarray = _xarray()
    model = sol.model
    variables = {
        key: ("time", sol[name], {"units": model.units[name], "long_name": name})
        for key, name in netcdf_names((*model.coordinates, *model.speeds)).items()
    }
    variables["energy"] = ("time", sol.energy, {"units": "J", "long_name": "T + V"})
    variables["closure"] = ("time", sol.closure, {"units": "m", "long_name": "closure gap"})
    variables["velocity_closure"] = ("time", sol.velocity_closure, {"units": "m/s"})
    time = ("time", sol.t, {"units": "s"})
    attributes = {
        "title": _ascii(f"{model.title}, simulated by mechc"),
        "status": _ascii(str(sol.status)),
        "mechc": json.dumps(_recipe(sol)),
    }
    data = xarray.Dataset(variables, coords={"time": time}, attrs=attributes)
    return data.assign_attrs(sha256=digest(data))


def digest(data: Any) -> str:
    """The sha256 of all numbers of a dataset, and of what is needed to simulate again."""
    told = hashlib.sha256(str(data.attrs["mechc"]).encode())
    for key in sorted(map(str, data.variables)):
        values = np.ascontiguousarray(data[key].values, dtype="<f8")
        told.update(f"\n{key} {values.shape}\n".encode())
        told.update(values.data)
    return told.hexdigest()


def netcdf_names(names: tuple[str, ...]) -> dict[str, str]:
    """NetCDF variable name -> name; distinct, none of ours and none of NetCDF's."""
    taken = set(TAKEN)
    keys: dict[str, str] = {}
    for name in names:
        key = re.sub(r"[^A-Za-z0-9_]", "_", name)[:LONGEST]
        key = key if key[:1].isalpha() else f"x_{key}"
        while key in taken:
            key += "_"
        taken.add(key)
        keys[key] = name
    return keys


def save(sol: Solution, path: Path) -> Path:
    """Write ``.nc`` or ``.csv``, by the ending of the path.

    Raises
    ------
    MechcError
        If the file cannot be written; one that was there is then as it was.
    """
    writers = {".nc": _write_netcdf, ".csv": _write_csv}
    if path.suffix not in writers:
        raise ValueOutOfBoundsError(f"cannot save as {path.name!r}: end it in .nc or .csv")
    with replacing(path) as part:
        writers[path.suffix](sol, part)
    return path


def _write_netcdf(sol: Solution, path: Path) -> None:
    to_dataset(sol).to_netcdf(path, engine="scipy")


def open_saved(
    path: str | Path, model: Model | None = None, *, max_bytes: int = LARGEST_RUN
) -> Solution | Batch:
    """A solution saved as ``.nc``, or a batch streamed to a folder, again.

    The model is loaded and the motion simulated again from the saved start with the saved
    settings, and compared with the saved states; so it has dense output.

    Parameters
    ----------
    model
        Needed for a mechanism of one's own that is not in this user's cache any more: the same,
        compiled again.
    max_bytes
        What the states and the dense output of a solution may take when it is simulated again.
        A file may come from anybody, and can ask for any number of steps.

    Raises
    ------
    MechcError
        If the file is not a saved solution or damaged, its mechanism is not at hand, or the
        motion comes out different or too large.
    """
    path = Path(path)
    if _is_folder(path):
        from mechc.batch.store import open_batch

        return open_batch(path, model)
    try:
        recipe, t, states = _read(path)
        sol = _again(model_of(recipe, recipe["state"], model), recipe, t, max_bytes)
    except (FileNotFoundError, MissingPackageError, CompilerError):
        raise
    except (
        MechcError, ArithmeticError, AttributeError, LookupError, MemoryError, OSError,
        RecursionError, TypeError, ValueError,
    ) as error:  # fmt: skip
        told = printable(str(error) or type(error).__name__)
        raise MechcError(f"{path} cannot be opened as a solution saved by mechc: {told}") from None
    _compare(path, sol, states)
    return sol


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError as error:
        raise MechcError(f"{printable(str(path)[:200])}: {error.strerror}") from None


def model_of(told: Mapping[str, Any], state: Sequence[str], given: Model | None) -> Model:
    """The model of a saved run: the one given, the shipped one, or one that is in the cache."""
    if given is None and not told["custom"]:
        from mechc.load import load

        return load(text_of(told["mechanism"], "its mechanism"), **checked_options(told["options"]))
    model = _compiled_before(told) if given is None else given
    if state and [*model.coordinates, *model.speeds] != list(state):
        raise MechcError(
            f"it is of a mechanism with the states {printable(', '.join(state))}; the model "
            f"{model.name!r} has others"
        )
    return model


@one_at_a_time
def _compiled_before(told: Mapping[str, Any]) -> Model:
    from mechc.compilation.on_demand import compiled_before

    try:
        return compiled_before(told.get("compiled", ""), told["mechanism"])
    except MechcError:
        raise MechcError(
            f"its mechanism {told['mechanism']!r} is not a shipped one and not in the cache; "
            "compile it again and give it too: mechc.open(path, model)"
        ) from None


def _again(model: Model, recipe: dict[str, Any], t: Array, max_bytes: int) -> Solution:
    """The run up to where it ended, with all that a file says checked as a user's input is."""
    from mechc.simulation.settings import Policy

    told = Policy(**mapping_of(recipe["policy"], "its policy"))
    room = max_bytes // (8 * ROWS_A_STEP * model._scene.width)
    policy = told._asdict() | {
        "dense": True,
        "first_step": told.first_step or None,
        "method": "auto" if told.stiff_switch else told.method,
        "max_steps": min(2 * int(recipe["steps"]) + 1000, room),  # cut short, the last differ
        "on_change_point": "continue" if told.on_change_point == "continue" else "stop",
    }
    del policy["stiff_switch"]
    sol = model.simulate(
        recipe["span"], np.array(recipe["y0"]), np.array(recipe["params"]), **policy
    )
    if sol.status.code == "too many steps":
        raise MechcError(
            f"simulating it again takes more than {policy['max_steps']} steps; read the file with "
            "xarray instead, or allow more: mechc.open(path, max_bytes=...)"
        )
    sol.policy = told._replace(dense=True, atol=sol.policy.atol)
    sol.status = _status(mapping_of(recipe["status"], "its status"))
    if not np.array_equal(sol._run.states()[0], t):
        sol._times = t
    sol.events = tuple(_event_record(model, *told) for told in recipe["events"])
    sol.change_points = tuple(
        ChangePoint(float(c["t"]), tuple(map(float, c["q"])), float(c["gap"]))
        for c in recipe["change_points"]
    )
    return sol


def _status(told: Mapping[str, Any]) -> Status:
    """An outcome as a file tells it: known, and with texts that are nothing but text."""
    codes = {name for name, *_ in CODES.values()}
    if told["code"] not in codes:
        raise MechcError("its status is unknown")
    return Status(
        told["code"],
        float(told["t"]),
        text_of(told["cause"], "the cause of its end"),
        text_of(told["advice"], "the advice about its end"),
        tuple(text_of(text, "a warning") for text in told["warnings"]),
    )


def _event_record(model: Model, t: list[float], y: list[list[float]]) -> EventRecord:
    return EventRecord(np.array(t, float), np.array(y, float).reshape(-1, model._scene.width))


def _compare(path: Path, sol: Solution, states: Array) -> None:
    again = sol.y
    scale = 1.0 + np.abs(states).max(initial=0.0)
    same = again.shape == states.shape and np.abs(again - states).max(initial=0.0) < 1e-6 * scale
    if not same:
        raise MechcError(
            f"{path}: simulated again, the motion differs from the one saved (another version "
            "or processor, at a motion this sensitive); read the file with xarray instead"
        )


def _recipe(sol: Solution) -> dict[str, Any]:
    policy = sol.policy._asdict()
    if policy["atol"] is not None:
        policy["atol"] = policy["atol"].tolist()
    y0 = sol._run.states()[1][0]
    return {
        "format": FORMAT,
        "mechanism": sol.model.name,
        "options": dict(sol.model.options),
        "custom": bool(sol.model.build.get("custom", False)),
        "compiled": str(sol.model.build.get("key", "")),
        "params": sol.params.tolist(),
        "span": list(sol.span),
        "steps": int(sol.stats["steps"] + sol.stats["rejected"]),
        "y0": y0.tolist(),
        "policy": policy,
        "status": asdict(sol.status),
        "state": [*sol.model.coordinates, *sol.model.speeds],
        "change_points": [asdict(point) for point in sol.change_points],
        "events": [[record.t.tolist(), record.y.tolist()] for record in sol.events],
    }


def _read(path: Path) -> tuple[dict[str, Any], Array, Array]:
    """What is needed to simulate again, and the times and states saved."""
    data = _loaded(read_regular(path, LARGEST_FILE))
    recipe = json_object(data.attrs["mechc"], "what it holds for mechc")
    if recipe["format"] != FORMAT:
        raise MechcError(f"its format is {recipe['format']}, not {FORMAT}; xarray reads it")
    if data.attrs["sha256"] != digest(data):
        raise MechcError("it is damaged: its sha256 is another; what is right in it xarray reads")
    keys = netcdf_names(names_of(recipe["state"], "its states"))
    states = np.column_stack([data[key].values for key in keys]).astype(np.float64)
    return recipe, data["time"].values.astype(np.float64), states


def _loaded(content: bytes) -> Any:
    """The dataset in a file of NetCDF 3, in memory."""
    xarray = _xarray()
    if content[:3] != b"CDF":
        raise MechcError("it is no file of NetCDF 3")
    try:
        with xarray.open_dataset(io.BytesIO(content), engine="scipy", decode_cf=False) as data:
            return data.load()
    except Exception as error:  # of another's reader, whatever it stumbles over
        raise MechcError(f"it is damaged: {error or type(error).__name__}") from None


def verify(path: Path) -> None:
    """Refuse a saved solution that is not as it was written.

    Raises
    ------
    MechcError
        With what is wrong.
    FileNotFoundError
        If there is none.
    """
    try:
        _read(path)
    except (MechcError, LookupError, TypeError, ValueError) as error:
        raise MechcError(f"{path}: {printable(str(error))}") from None


def _write_csv(sol: Solution, path: Path) -> None:
    model = sol.model
    names = (*model.coordinates, *model.speeds)
    header = ["t [s]", *(_csv_text(f"{n} [{model.units[n]}]") for n in names)]
    header += ["energy [J]", "closure [m]", "velocity closure [m/s]"]
    table = np.column_stack([sol.t, sol.y, sol.energy, sol.closure, sol.velocity_closure])
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows([repr(float(x)) for x in row] for row in table)


def _csv_text(text: str) -> str:
    """Spreadsheets take some first characters of a line for a formula."""
    line = " ".join(text.splitlines())
    return f"'{line}" if text[:1] in ("\t", "\r", "\n") or _FORMULA.match(line) else line


def _ascii(text: str) -> str:
    return text.encode("ascii", "backslashreplace").decode()


def _xarray() -> Any:
    try:
        import xarray
    except ImportError:
        raise MissingPackageError(
            "xarray is not installed: pip install xarray (CSV needs nothing)"
        ) from None
    return xarray
