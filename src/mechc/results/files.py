"""Solutions as files and tables: NetCDF through xarray, CSV."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import (
    CompilerError,
    MechcError,
    MissingPackageError,
    ValueOutOfBoundsError,
)
from mechc.simulation.events import EventRecord
from mechc.simulation.status import ChangePoint, Status
from mechc.system.parameters import Array

if TYPE_CHECKING:
    from mechc.batch.simulate import Batch
    from mechc.model import Model
    from mechc.simulation.solution import Solution

FORMAT = 1
LONGEST = 200  # characters of a NetCDF name
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
    return xarray.Dataset(variables, coords={"time": time}, attrs=attributes)


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
    """Write ``.nc`` or ``.csv``, by the ending of the path."""
    if path.suffix == ".nc":
        to_dataset(sol).to_netcdf(path, engine="scipy")
    elif path.suffix == ".csv":
        _write_csv(sol, path)
    else:
        raise ValueOutOfBoundsError(f"cannot save as {path.name!r}: end it in .nc or .csv")
    return path


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

        return open_batch(path, model)
    try:
        recipe, t, states = _read(path)
        sol = _again(model_of(recipe, recipe["state"], model), recipe, t)
    except (FileNotFoundError, MissingPackageError, CompilerError):
        raise
    except (MechcError, OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        raise MechcError(f"{path} cannot be opened as a solution saved by mechc: {error}") from None
    _compare(path, sol, states)
    return sol


def model_of(told: Mapping[str, Any], state: Sequence[str], given: Model | None) -> Model:
    """The model of a saved run: the one given, the shipped one, or one that is in the cache."""
    if given is None and not told["custom"]:
        from mechc.load import load

        return load(told["mechanism"], **told["options"])
    model = _compiled_before(told) if given is None else given
    if state and [*model.coordinates, *model.speeds] != list(state):
        raise MechcError(
            f"it is of a mechanism with the states {', '.join(state)}; the model {model.name!r} "
            "has others"
        )
    return model


def _compiled_before(told: Mapping[str, Any]) -> Model:
    from mechc.compilation.on_demand import compiled_before

    try:
        return compiled_before(told.get("compiled", ""), told["mechanism"])
    except MechcError:
        raise MechcError(
            f"its mechanism {told['mechanism']!r} is not a shipped one and not in the cache; "
            "compile it again and give it too: mechc.open(path, model)"
        ) from None


def _again(model: Model, recipe: dict[str, Any], t: Array) -> Solution:
    """The run up to where it ended, with all that a file says checked as a user's input is."""
    from mechc.simulation.settings import Policy

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
        "y0": y0.tolist(),
        "policy": policy,
        "status": asdict(sol.status),
        "state": [*sol.model.coordinates, *sol.model.speeds],
        "change_points": [asdict(point) for point in sol.change_points],
        "events": [[record.t.tolist(), record.y.tolist()] for record in sol.events],
    }


def _read(path: Path) -> tuple[dict[str, Any], Array, Array]:
    """What is needed to simulate again, and the times and states saved."""
    xarray = _xarray()
    with xarray.open_dataset(path, engine="scipy", decode_times=False) as data:
        recipe = json.loads(data.attrs["mechc"])
        if recipe["format"] != FORMAT:
            raise MechcError(f"its format is {recipe['format']}, not {FORMAT}")
        keys = netcdf_names(tuple(recipe["state"]))
        states = np.column_stack([data[key].values for key in keys]).astype(np.float64)
        return recipe, data["time"].values.astype(np.float64), states


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
    """Spreadsheets take some first characters for a formula."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t", "\r") else text


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
