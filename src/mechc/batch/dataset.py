"""Batches as xarray datasets: names of axes and results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechc.batch.layout import dimensions
from mechc.batch.reductions import read_reduction
from mechc.batch.spec import Recipe
from mechc.errors import package
from mechc.native._codes import COUNTERS, FINISHED, LEAST, NOT_RUN, STOPPED_BY_EVENT
from mechc.results.files import netcdf_names, xarray_module
from mechc.simulation.status import CODES
from mechc.system.system import System

ABOUT = {
    "y": "state at the end",
    "y0": "state at the start",
    "y_eval": "states at t_eval",
    "t": "time reached",
    "status": f"how it ended: {FINISHED} finished, {STOPPED_BY_EVENT} stopped by an event, "
    f"{NOT_RUN} not run, else a failure",
    "miss": "least gap met where nothing closes, in the unit of the constraints",
    "change_points": "change points crossed",
    "sensitivity": "derivatives of the states at t_eval",
    "sensitivity_final": "derivatives of the state at the end",
    "sensitivity_max": "largest absolute value of the derivatives, at t_eval or the steps",
    "least_singular": "least conditioning of the constraints met",
    "critical_gap": "least gap at a critical configuration near the motion",
    "event_counts": "zeros of each event",
    "event_latest": "time of the last zero of each event",
    "lowered_impacts": "impacts at which less than the whole restitution counted",
}
UNITS = {"t": "s", "event_latest": "s", "critical_gap": "m"}


def to_dataset(
    system: System, recipe: Recipe, arrays: Mapping[str, Any], warnings: Sequence[str]
) -> Any:
    """See :meth:`mechc.batch.results.Batch.to_xarray`."""
    asked = {f"reduction_{i}": text for i, text in enumerate(recipe.reductions)}
    asked |= {f"output_{i}": name for i, name in enumerate(recipe.outputs)}
    own = tuple(name for name in arrays if name not in asked)
    keys = {name: name for name in own}
    for name, key in zip(asked, netcdf_names(tuple(asked.values())), strict=True):
        keys[name] = key if key not in own else f"{key}_asked"
    variables = {
        keys[name]: (
            dimensions(name, len(values.shape)), np.asarray(values),
            attributes(system, recipe, name),
        )
        for name, values in arrays.items()
    }  # fmt: skip
    coords: dict[str, Any] = {"state": [*system.coordinates, *system.speeds]}
    if len(recipe.t_eval):
        coords["time"] = ("time", recipe.t_eval, {"units": "s"})
    if recipe.sensitivities:
        coords["by"] = list(recipe.sensitivities)
    varied = recipe.varying_columns()
    taken = {*variables, *coords}
    for key, name in netcdf_names(tuple(varied)).items():
        free = key if key not in taken else f"{key}_given"
        told = {"units": system.units.get(name, ""), "long_name": name}
        coords[free] = ("member", varied[name], told)
    about = {"title": f"{system.name}, simulated by mechc", "warnings": list(warnings)}
    return xarray_module().Dataset(variables, coords=coords, attrs=about)


def to_dataframe(system: System, recipe: Recipe, arrays: Mapping[str, Any]) -> Any:
    """See :meth:`mechc.batch.results.Batch.to_dataframe`."""
    pandas = package("pandas", "pandas is not installed: pip install pandas")
    columns: dict[str, Any] = dict(recipe.varying_columns())
    columns["status"] = [CODES[int(code)][0] for code in arrays["status"]]
    columns["t"] = np.asarray(arrays["t"])
    for i, text in enumerate(recipe.reductions):
        columns[text] = np.asarray(arrays[f"reduction_{i}"])
    ends = np.asarray(arrays["y"]).T
    names = (*system.coordinates, *system.speeds)
    columns |= {f"{name}_end": end for name, end in zip(names, ends, strict=True)}
    counted = {name: np.asarray(arrays[name]) for name in COUNTERS if name in arrays}
    least = {name: np.asarray(arrays[name]) for name in (*LEAST, "miss") if name in arrays}
    columns |= counted | {name: np.where(np.isinf(x), np.nan, x) for name, x in least.items()}
    members = pandas.RangeIndex(recipe.count, name="member")
    return pandas.DataFrame(columns, index=members)


def attributes(system: System, recipe: Recipe, name: str) -> dict[str, str]:
    """Meaning and unit of a result."""
    kind, _, index = name.rpartition("_")
    if kind == "reduction":
        reduction = read_reduction(system, recipe.reductions[int(index)])
        return {"long_name": reduction.text, "units": reduction.unit}
    if kind == "output":
        return {"long_name": recipe.outputs[int(index)]}
    told = {"long_name": ABOUT.get(name, name.replace("_", " "))}
    return told | ({"units": UNITS[name]} if name in UNITS else {})
