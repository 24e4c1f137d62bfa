"""Solutions as files and tables: NetCDF through xarray, CSV."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mechc.errors import (
    MechcError,
    MissingPackageError,
    ValueOutOfBoundsError,
)
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array

FORMAT = 1
LONGEST = 200  # characters of a NetCDF name
TAKEN = {"time", "energy", "closure", "velocity_closure"}
TAKEN |= {"byte", "char", "short", "ushort", "int", "uint", "int64", "uint64"}  # NetCDF's own
TAKEN |= {"float", "real", "double", "bool", "string"}


def to_dataset(sol: Trajectory) -> Any:
    """An ``xarray.Dataset`` over ``time``: every component, energy and closure.

    Variables are called like the coordinates and speeds, with what NetCDF does not take
    replaced by ``_``; the attribute ``long_name`` keeps the name, ``units`` the unit.  The
    attribute ``mechc`` holds what :func:`mechc.open` needs to simulate again.
    """
    xarray = xarray_module()
    system = sol.system
    variables = {
        key: ("time", sol[name], {"units": system.units[name], "long_name": name})
        for key, name in netcdf_names((*system.coordinates, *system.speeds)).items()
    }
    variables["energy"] = ("time", sol.energy, {"units": "J", "long_name": "T + V"})
    variables["closure"] = ("time", sol.closure, {"units": "m", "long_name": "closure gap"})
    variables["velocity_closure"] = ("time", sol.velocity_closure, {"units": "m/s"})
    time = ("time", sol.t, {"units": "s"})
    attributes = {
        "title": _ascii(f"{system.title}, simulated by mechc"),
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


def save(sol: Trajectory, path: Path) -> Path:
    """Write ``.nc`` or ``.csv``, by the ending of the path."""
    if path.suffix == ".nc":
        to_dataset(sol).to_netcdf(path, engine="scipy")
    elif path.suffix == ".csv":
        _write_csv(sol, path)
    else:
        raise ValueOutOfBoundsError(f"cannot save as {path.name!r}: end it in .nc or .csv")
    return path


def _recipe(sol: Trajectory) -> dict[str, Any]:
    policy = sol.policy._asdict()
    if policy["atol"] is not None:
        policy["atol"] = policy["atol"].tolist()
    y0 = sol._run.states()[1][0]
    return {
        "format": FORMAT,
        **sol.system.reference.to_json(),
        "params": sol.params.tolist(),
        "span": list(sol.span),
        "y0": y0.tolist(),
        "policy": policy,
        "status": asdict(sol.status),
        "change_points": [asdict(point) for point in sol.change_points],
        "events": [[record.t.tolist(), record.y.tolist()] for record in sol.events],
    }


def read(path: Path) -> tuple[dict[str, Any], Array, Array]:
    """What is needed to simulate again, and the times and states saved."""
    xarray = xarray_module()
    with xarray.open_dataset(path, engine="scipy", decode_times=False) as data:
        recipe = json.loads(data.attrs["mechc"])
        if recipe["format"] != FORMAT:
            raise MechcError(f"its format is {recipe['format']}, not {FORMAT}")
        keys = netcdf_names(tuple(recipe["state"]))
        states = np.column_stack([data[key].values for key in keys]).astype(np.float64)
        return recipe, data["time"].values.astype(np.float64), states


def _write_csv(sol: Trajectory, path: Path) -> None:
    system = sol.system
    names = (*system.coordinates, *system.speeds)
    header = ["t [s]", *(_csv_text(f"{n} [{system.units[n]}]") for n in names)]
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


def xarray_module() -> Any:
    """xarray, or the error that says how to install it."""
    try:
        import xarray
    except ImportError:
        raise MissingPackageError(
            "xarray is not installed: pip install xarray (CSV needs nothing)"
        ) from None
    return xarray
