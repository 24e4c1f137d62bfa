"""The command ``mechc synthesize``: parameters of linkages from targets in a CSV file."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import mechc
from mechc.cli.arguments import check_name, model_of, output_folder, values_of, whole
from mechc.cli.fit import Table, free_name, read_columns
from mechc.errors import MechcError, UnknownNameError
from mechc.files import write_text, written_into
from mechc.progress import Notice, ProgressBar
from mechc.results.figures import save_figure
from mechc.system.quantity import Kind
from mechc.system.units import factor_of, of_unknown_unit

MISSED = 1  # exit code: no design meets all conditions


def synthesize_command(chosen: argparse.Namespace) -> int:
    """Reads the targets, searches, prints the designs, draws the best."""
    check_name(chosen)
    if not chosen.free:
        raise MechcError("say what is to be found: --free NAME=LOW:HIGH, for instance l_1=0.1:5")
    table = read_columns(Path(chosen.data))
    model = model_of(chosen, ("points", "sensitivities"))
    options: dict[str, Any] = {"turns": chosen.turns, "ordered": not chosen.any_order}
    if chosen.transmission:
        typed = [text.split(",") for text in chosen.transmission]
        options["transmission_angle"] = [[part.strip() for part in parts] for parts in typed]
    targets = _targets(model, table, chosen.data)
    with output_folder(chosen, "mechc_synthesis") as folder, ProgressBar("searching") as bar:
        designs = model.synthesize(
            targets, dict(free_name(model, text) for text in chosen.free), chosen.driven,
            params=values_of(model, chosen.parameters, model.parameters, "parameter"),
            samples=whole("--samples", chosen.samples), seed=whole("--seed", chosen.seed),
            refined=whole("--refined", chosen.refined), progress=bar.update, **options,
        )  # fmt: skip
    told = {"mechanism": model.name, **designs.to_json()}
    print(json.dumps(told) if chosen.json else designs)
    if folder is not None:
        with Notice("drawing ..."), written_into(folder):
            save_figure(designs.plot(), folder, "design")
            write_text(folder / "designs.json", json.dumps(told, indent=1) + "\n")
        if not chosen.json:
            print(f"\nwritten into {folder.resolve()}: design.png, design.svg, designs.json")
    return MISSED if designs[0].warnings else 0


def _targets(model: mechc.Model, table: Table, path: str) -> dict[str, Any]:
    """Columns in SI units: coordinates and outputs by name, points as ``C.x``, ``C.y``, ``C.z``."""
    found: dict[str, Any] = {}
    points = model.system.with_output("points").point_names
    for column, (unit, values) in table.items():
        name, dot, axis = column.rpartition(".")
        if dot and name in points and axis in ("x", "y", "z"):
            of_length = replace(of_unknown_unit(column), unit="m", kind=Kind.LENGTH)
            scaled = factor_of(unit, of_length) * np.array(values)
            found.setdefault(name, {})[axis] = scaled
        elif column in model.coordinates:
            found[column] = factor_of(unit, model.quantities[column]) * np.array(values)
        elif column in model.data["own"] and not unit:
            found[column] = np.array(values)
        else:
            known = (*model.coordinates, *(f"{each}.x" for each in points), *model.data["own"])
            raise UnknownNameError(f"target, a column of {path},", column, known)
    for name, axes in found.items():
        if isinstance(axes, dict):
            none = np.full(len(next(iter(axes.values()))), np.nan)
            width = "xyz" if "z" in axes else "xy"
            found[name] = np.column_stack([axes.get(axis, none) for axis in width])
    return found
