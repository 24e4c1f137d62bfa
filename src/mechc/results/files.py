"""Solutions as files and tables: NetCDF through xarray, CSV."""

from __future__ import annotations

import csv
import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mechc.errors import MechcError, MissingPackageError, ValueOutOfBoundsError, package
from mechc.files import replacing
from mechc.results.untrusted import (
    LARGEST_JSON,
    ReadOnce,
    checked_options,
    json_object,
    names_of,
    read_regular,
    short,
    text_of,
)
from mechc.simulation.contact_steps import contacts_of
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array
from mechc.system.reference import ModelReference

# What reading a file ends in that anybody may have written, however it is damaged.
DAMAGE = (
    MechcError, ArithmeticError, AttributeError, LookupError, MemoryError, OSError, RecursionError,
    TypeError, ValueError,
)  # fmt: skip
FORMAT = 2
VIEW = "mechc-view"  # the key of no state: it has a hyphen
LONGEST = 200  # characters of a NetCDF name
LARGEST_FILE = 2**33  # bytes of a file that is opened
_FORMULA = re.compile(r"[\s\ufeff\u200b]*[=+@\-＝＋＠－]")
TAKEN = {"time", "energy", "closure", "velocity_closure"}
TAKEN |= {"byte", "char", "short", "ushort", "int", "uint", "int64", "uint64"}  # NetCDF's own
TAKEN |= {"float", "real", "double", "bool", "string"}


def to_dataset(sol: Trajectory) -> Any:
    """An ``xarray.Dataset`` over ``time``: every component, energy and closure.

    Variables have the names of the coordinates and speeds, with characters that NetCDF does not
    take replaced by ``_``; the attribute ``long_name`` is the name, ``units`` the unit.  The
    attribute ``mechc`` contains what :func:`mechc.open` needs to simulate again.
    """
    xarray = xarray_module()
    system = sol.system
    variables = {
        key: ("time", sol[name], {"units": system.units[name], "long_name": name})
        for key, name in netcdf_names((*system.coordinates, *system.speeds)).items()
    }
    variables["energy"] = ("time", _energy(sol), {"units": "J", "long_name": "T + V"})
    unit = system.gap_unit
    variables["closure"] = ("time", sol.closure, {"units": unit, "long_name": "closure gap"})
    rate = {"units": f"{unit}/s" if unit else ""}
    variables["velocity_closure"] = ("time", sol.velocity_closure, rate)
    time = ("time", sol.t, {"units": "s"})
    attributes = {
        "title": _ascii(f"{system.title}, simulated by mechc"),
        "status": _ascii(str(sol.status)),
        "mechc": json.dumps(recipe_of(sol)),
    }
    data = xarray.Dataset(variables, coords={"time": time}, attrs=attributes)
    return data.assign_attrs(sha256=digest(data))


def _energy(sol: Trajectory) -> Array:
    """The energy (nt,), NaN of a model without it: a file is written without compiling."""
    return sol.energy if sol.has_energy else np.full(len(sol.t), np.nan)


def to_dataframe(sol: Trajectory) -> Any:
    """See :meth:`mechc.Solution.to_dataframe`."""
    package("pandas", "pandas is not installed: pip install pandas")
    data = to_dataset(sol)
    names = netcdf_names((*sol.system.coordinates, *sol.system.speeds))
    driven, inputs = sol.system.driven, sol.system.inputs
    table = data.to_dataframe().rename(columns=names)
    if driven is None or not {*inputs} <= {*driven.given}:  # functions are not in files
        return table
    return table.assign(**dict(zip(inputs, driven.values(inputs, sol.t, sol.y), strict=True)))


def digest(data: Any) -> str:
    """The sha256 of all numbers of a dataset, and of what is needed to simulate again."""
    told = hashlib.sha256(str(data.attrs["mechc"]).encode())
    for key in sorted(map(str, data.variables)):
        values = np.ascontiguousarray(data[key].values, dtype="<f8")
        told.update(f"\n{key} {values.shape}\n".encode())
        told.update(values.data)
    return told.hexdigest()


def netcdf_names(names: tuple[str, ...]) -> dict[str, str]:
    """NetCDF variable name -> name; distinct, and different from reserved names."""
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
    """Write ``.nc`` or ``.csv``, by the ending of the path.

    Raises :class:`MechcError` if the file cannot be written; an existing one is then unchanged.
    """
    writers = {".nc": _write_netcdf, ".csv": _write_csv}
    if path.suffix not in writers:
        raise ValueOutOfBoundsError(f"cannot save as {path.name!r}: end it in .nc or .csv")
    with replacing(path) as part:
        writers[path.suffix](sol, part)
    return path


def _write_netcdf(sol: Trajectory, path: Path) -> None:
    data = to_dataset(sol)
    if (view := _view_of(sol)) is not None:
        content = np.frombuffer(view, np.int8)
        data[VIEW] = (f"{VIEW}-byte", content, {"long_name": "its picture in space"})
        data = data.assign_attrs(sha256=digest(data))
    data.to_netcdf(path, engine="scipy")


def _view_of(sol: Any) -> bytes | None:
    """The picture of a user-defined mechanism, since files do not hold its description."""
    system = sol.system
    if not system.reference.custom or getattr(system, "drawn", None) is None:
        return None
    from mechc.results.view.recorded import packed_view

    try:
        return packed_view(sol)
    except (MechcError, OSError, ValueError):  # a wrong drawing keeps no motion from being saved
        return None


def recipe_of(sol: Trajectory) -> dict[str, Any]:
    """The data to simulate a motion again, as JSON data."""
    policy = sol.policy.as_dict()
    if policy["atol"] is not None:
        policy["atol"] = policy["atol"].tolist()
    y0, driven = sol.record.ends()[1][0], sol.system.driven
    return {
        "format": FORMAT,
        **sol.system.reference.to_json(),
        "params": sol.params.tolist(),
        "span": list(sol.span),
        "steps": int(sol.stats["steps"] + sol.stats["rejected"]),
        "y0": y0.tolist(),
        "policy": policy,
        "status": asdict(sol.status),
        "change_points": [asdict(point) for point in sol.change_points],
        "jumps": [[part.t0, part.y0.tolist()] for part in sol.segments[1:]],
        # where resets have changed the parameters: those of each smooth part
        "values": [p.params.tolist() for p in sol.segments] if sol.record.changes_params else [],
        "inputs": {} if driven is None else driven.inputs_as_json,
        "contacts": contacts_of(sol.record),
        "events": [[record.t.tolist(), record.y.tolist()] for record in sol.events],
        "event_titles": list(sol.event_titles),
        **({} if sol.checked is None else {"check": str(sol.checked).splitlines()}),
    }


def read(path: Path, max_bytes: float = LARGEST_JSON) -> tuple[dict[str, Any], Array, Array]:
    """The data to simulate again, and the times and states saved.

    ``"view"`` of the data is the checked picture in space, None where there is none; its values and
    those of the other data take at most ``max_bytes`` of memory each.
    """
    from mechc.results.view.recorded import unpacked_view

    data = _load(read_regular(path, LARGEST_FILE))
    recipe = json_object(data.attrs["mechc"], "what it holds for mechc", max_bytes)
    if recipe["format"] != FORMAT:
        raise MechcError(f"its format is {recipe['format']}, not {FORMAT}; xarray reads it")
    if data.attrs["sha256"] != digest(data):
        raise MechcError("it is damaged: its sha256 differs; xarray may still read parts of it")
    keys = netcdf_names(names_of(recipe["state"], "its states"))
    states = np.column_stack([data[key].values for key in keys]).astype(np.float64)
    view = bytes(data[VIEW].values.astype(np.int8)) if VIEW in data.variables else None
    recipe["view"] = None if view is None else unpacked_view(view, max_bytes)
    return recipe, data["time"].values.astype(np.float64), states


def _load(content: bytes) -> Any:
    """The dataset in a file of NetCDF 3, in memory."""
    xarray = xarray_module()
    if content[:3] != b"CDF":
        raise MechcError("it is no file of NetCDF 3")
    try:
        with xarray.open_dataset(ReadOnce(content), engine="scipy", decode_cf=False) as data:
            return data.load()
    except Exception as error:  # the reader may raise any
        raise MechcError(f"it is damaged: {error or type(error).__name__}") from None


def reference_in(told: Mapping[str, Any], *, given: bool = False) -> ModelReference:
    """The mechanism of a file; ``given``: its model is given and need not be derived.

    Raises :class:`MechcError` if it is missing, or if deriving it could take long.
    """
    derived = not (given or told.get("custom"))
    options = checked_options(told.get("options")) if derived else told.get("options")
    return ModelReference.from_json({**told, "options": options})


def verify(path: Path) -> list[str]:
    """Refuse a saved solution that is damaged; the lines of the check that was saved with it.

    Raises :class:`MechcError` with what is wrong; ``FileNotFoundError`` if there is no file.
    """
    try:
        recipe, _, _ = read(path)
        return [text_of(line, "a line of its check") for line in recipe.get("check", [])]
    except (FileNotFoundError, MissingPackageError):
        raise
    except DAMAGE as error:
        raise MechcError(f"{path}: {short(str(error) or type(error).__name__)}") from None


def _write_csv(sol: Trajectory, path: Path) -> None:
    system = sol.system
    names = (*system.coordinates, *system.speeds)
    header = ["t [s]", *(_csv_text(f"{n} [{system.units[n]}]") for n in names)]
    unit = system.gap_unit
    rate = f"{unit}/s" if unit else ""
    header += ["energy [J]", f"closure [{unit}]", f"velocity closure [{rate}]"]
    table = np.column_stack([sol.t, sol.y, _energy(sol), sol.closure, sol.velocity_closure])
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows([repr(float(x)) for x in row] for row in table)


def _csv_text(text: str) -> str:
    """The text of a CSV file in which no line begins as a formula of a spreadsheet."""
    line = " ".join(text.splitlines())
    return f"'{line}" if text[:1] in ("\t", "\r", "\n") or _FORMULA.match(line) else line


def _ascii(text: str) -> str:
    return text.encode("ascii", "backslashreplace").decode()


def xarray_module() -> Any:
    """xarray, or an error that says how to install it."""
    return package("xarray", "xarray is not installed: pip install xarray (CSV needs nothing)")
