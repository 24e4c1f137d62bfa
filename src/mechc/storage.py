"""Solutions as files and tables: NetCDF through xarray, CSV."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import MechcError, MissingPackageError, ValueOutOfBoundsError

if TYPE_CHECKING:
    from mechc.solution import Solution

FORMAT = 1


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
    """NetCDF variable name -> name; distinct, and none of ours."""
    taken = {"time", "energy", "closure", "velocity_closure"}
    keys: dict[str, str] = {}
    for name in names:
        key = re.sub(r"[^A-Za-z0-9_]", "_", name)
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


def open_saved(path: str | Path) -> Solution:
    """A solution saved as ``.nc``, again.

    The model is loaded and the motion simulated again from the saved start with the saved
    settings, and compared with the saved states; so dense output works as before.

    Raises
    ------
    MechcError
        If the file is not a saved solution, its mechanism is not at hand, or the motion comes
        out different.
    """
    recipe, states = _read(Path(path))
    from mechc.load import load
    from mechc.simulate import Policy, run

    if recipe.get("custom"):
        raise MechcError(
            f"{path} holds the mechanism {recipe['mechanism']!r}, which is not shipped: compile "
            "it and simulate again"
        )
    model = load(recipe["mechanism"], **recipe["options"])
    policy = recipe["policy"]
    if policy["atol"] is not None:
        policy["atol"] = np.array(policy["atol"])
    times = None if recipe["times"] is None else np.array(recipe["times"])
    sol = run(
        model,
        (recipe["span"][0], recipe["span"][1]),
        np.array(recipe["y0"]),
        np.array(recipe["params"]),
        Policy(**policy),
        times,
    )
    _compare(path, sol, states)
    return sol


def _compare(path: str | Path, sol: Solution, states: Any) -> None:
    again = sol.y
    scale = 1.0 + np.abs(states).max(initial=0.0)
    same = again.shape == states.shape and np.abs(again - states).max(initial=0.0) < 1e-6 * scale
    if not same:
        raise MechcError(
            f"{path}: simulated again, the motion differs from the one saved (another version "
            "or processor, at a motion this sensitive); read the file with xarray instead"
        )


def _recipe(sol: Solution) -> dict[str, Any]:
    policy = asdict(sol.policy)
    if policy["atol"] is not None:
        policy["atol"] = policy["atol"].tolist()
    t, y = sol._run.states()
    return {
        "format": FORMAT,
        "mechanism": sol.model.name,
        "options": dict(sol.model.options),
        "custom": bool(sol.model.build.get("custom", False)),
        "params": sol.params.tolist(),
        "span": [float(t[0]), float(t[-1])],
        "y0": y[0].tolist(),
        "times": None if sol._times is None else sol.t.tolist(),
        "policy": policy,
        "state": [*sol.model.coordinates, *sol.model.speeds],
    }


def _read(path: Path) -> tuple[dict[str, Any], Any]:
    xarray = _xarray()
    try:
        with xarray.open_dataset(path, engine="scipy", decode_times=False) as data:
            recipe = json.loads(data.attrs["mechc"])
            keys = netcdf_names(tuple(recipe["state"]))
            states = np.column_stack([data[key].values for key in keys])
    except FileNotFoundError:
        raise
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise MechcError(f"{path} is not a solution saved by mechc ({error})") from None
    if recipe.get("format") != FORMAT:
        raise MechcError(f"{path} was saved in format {recipe.get('format')}, not {FORMAT}")
    return recipe, states


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
