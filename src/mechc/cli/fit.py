"""The command ``mechc fit``: values from recorded motions in CSV files."""

from __future__ import annotations

import argparse
import csv
import io
import json
import math
import time
from array import array
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import mechc
from mechc.assembly.initial_values import filled_start
from mechc.cli.arguments import (
    STATE,
    check_name,
    inputs_of,
    model_of,
    number,
    output_folder,
    tolerance,
    values_of,
    whole,
)
from mechc.cli.options import INTERRUPTED
from mechc.errors import MechcError, RunInterrupt, UnknownNameError
from mechc.files import write_text, written_into
from mechc.fitting.measured import Measured, checked_measured, known_columns
from mechc.fitting.recordings import TIMES
from mechc.progress import Notice, ProgressBar
from mechc.results.figures import save_figure
from mechc.system.quantity import NamedQuantity
from mechc.system.units import SECOND_WORDS, SECONDS, factor_of, read_value

OUTPUTS = ("energy", "points", "sensitivities")
FAILED = 1
LARGEST, MOST_NUMBERS = 2**28, 2**26  # bytes of a file that is read, and cells
Table = dict[str, tuple[str, "array[float]"]]  # column -> its unit and its numbers


def fit_command(chosen: argparse.Namespace) -> int:
    """Reads the recordings, fits, prints the values, draws."""
    check_name(chosen)
    if not chosen.free:
        raise MechcError("say what is to be found: --free NAME=LOW:HIGH, for instance m_1=0.1:5")
    rtol = tolerance(chosen)
    tables = [read_columns(Path(path)) for path in chosen.data]
    model = model_of(chosen, OUTPUTS)
    measured = _measurements(model, chosen.measure, tables)
    recordings = [_recording(t, measured, p) for t, p in zip(tables, chosen.data, strict=True)]
    free = dict(free_name(model, text) for text in chosen.free)
    inputs = inputs_of(model, chosen, left=free)
    start, guess = _start(model, chosen, free)
    pairs = {one.name: one.sigma for one in measured}
    sigmas = list(pairs) if any(map(math.isnan, pairs.values())) else pairs
    began = time.perf_counter()
    title = f"fitting {model.name}"
    with output_folder(chosen, "mechc_fit") as folder, ProgressBar(title) as bar:
        interrupted = False
        try:
            result = model.fit(
                recordings, free, sigmas, y0=start, guess=guess, inputs=inputs or None,
                params=values_of(model, chosen.parameters, model.parameters, "parameter"),
                starts=whole("--starts", chosen.starts), seed=whole("--seed", chosen.seed),
                loss=chosen.loss, f_scale=number("--f-scale", chosen.f_scale), rtol=rtol,
                method=chosen.method, progress=bar.update,
            )  # fmt: skip
        except RunInterrupt as interrupt:
            if interrupt.fit is None:  # before the search
                raise
            result, interrupted = interrupt.fit, True
    told = {**result.to_json(), "wall_s": time.perf_counter() - began}
    print(json.dumps(told) if chosen.json else result)
    if folder is not None:
        with Notice("drawing ..."), written_into(folder):
            save_figure(result.plot(), folder, "fit")
            write_text(folder / "fit.json", json.dumps(told, indent=1) + "\n")
        if not chosen.json:
            print(f"\nwritten into {folder.resolve()}: fit.png, fit.svg, fit.json")
    if interrupted:
        return INTERRUPTED
    return 0 if result.converged else FAILED


# -- recordings -------------------------------------------------------------------------------


def read_columns(path: Path) -> Table:
    """The columns of a CSV file with a header; an empty cell is a missing sample."""
    text = io.TextIOWrapper(io.BytesIO(_content(path)), encoding="utf-8-sig", newline="")
    try:
        rows = (row for row in csv.reader(text) if any(cell.strip() for cell in row))
        header = [_column(cell) for cell in next(rows, ())]
        columns = [array("d") for _ in header]
        for k, row in enumerate(rows):
            if k * len(header) >= MOST_NUMBERS:
                raise MechcError(f"{path} has more than {MOST_NUMBERS} numbers")
            for column, value in zip(
                columns, _numbers(row, len(header), path, k + 2), strict=False
            ):
                column.append(value)
    except (csv.Error, UnicodeDecodeError) as error:
        raise MechcError(f"{path} is no CSV file: {error}") from None
    if not header:
        raise MechcError(f"{path} is empty")
    return {
        name: (unit, column) for (name, unit), column in zip(header, columns, strict=True) if name
    }


def _content(path: Path) -> bytes:
    """The content of a file or a pipe, as much as is taken."""
    blocks, size = [], 0
    with path.open("rb") as file:
        while block := file.read(2**20):
            blocks.append(block)
            size += len(block)
            if size > LARGEST:
                raise MechcError(
                    f"{path} is larger than {LARGEST >> 20} MiB; leave out rows or columns"
                )
    return b"".join(blocks)


def _column(cell: str) -> tuple[str, str]:
    """``theta_0 [deg]``, ``theta_0 (deg)`` or ``points[2,0]``: name and unit."""
    text, unit = cell.strip().removeprefix("'"), ""
    for opening, closing in ("[]", "()"):
        before, bracket, inside = text.removesuffix(closing).rpartition(opening)
        is_index = opening == "[" and ("," in inside or inside.strip()[:1] in ("", *"0123456789"))
        if bracket and text.endswith(closing) and closing not in inside and not is_index:
            text, unit = before, inside.strip()
            break
    return "".join(text.split()), unit


def _numbers(row: list[str], width: int, path: Path, line: int) -> list[float]:
    cells = [*row, *[""] * (width - len(row))]
    try:
        return [float(cell) if cell.strip() else math.nan for cell in cells]
    except ValueError as error:
        raise MechcError(f"{path}, line {line}: {error}") from None


def _recording(table: Table, measured: Iterable[Measured], path: str) -> dict[str, Any]:
    """Columns in SI units."""
    key = next((name for name in TIMES if name in table), None)
    if key is None:
        raise MechcError(f"{path} has no column 't' or 'time'")
    unit = table[key][0]
    scale = 1.0 if unit in ("", *SECOND_WORDS) else factor_of(unit, replace(SECONDS, name=key))
    found = {"t": scale * np.array(table[key][1])}
    for one in measured:
        if one.name not in table:
            raise UnknownNameError(f"column of {path}", one.name, table)
        unit, values = table[one.name]
        meaning = replace(one.quantity.meaning, name=one.name)
        found[one.name] = factor_of(unit, meaning) * np.array(values)
    return found


# -- what is measured and free ----------------------------------------------------------------


def _measurements(model: mechc.Model, typed: Iterable[str], tables: list[Table]) -> Any:
    """The columns typed as NAME or NAME=SIGMA; else all that the model knows."""
    pairs: dict[str, float | None] = {}
    for text in typed:
        name, sign, value = text.partition("=")
        key = "".join(name.split())
        one = checked_measured(model.system, [key])[1][0].quantity
        pairs[key] = read_value(value, replace(one.meaning, lower=0.0)) if sign else None
    if pairs:
        unknown = any(sigma is None for sigma in pairs.values())
        without = unknown and not any(pairs.values())
        return checked_measured(model.system, list(pairs) if without else pairs)[1]
    columns = [name for name in tables[0] if name not in TIMES]
    return checked_measured(model.system, known_columns(model.system, columns))[1]


def free_name(
    model: mechc.Model, text: str
) -> tuple[str, tuple[float | None, float | None] | None]:
    """NAME, or NAME=LOW:HIGH with units; a side left empty has no bound."""
    name, sign, ends = (part.strip() for part in text.partition("="))
    if not sign:
        return name, None
    low, colon, high = ends.partition(":")
    if not colon or name not in model.quantities:
        if name in model.quantities:
            raise MechcError(f"--free {text}: write NAME=LOW:HIGH, for instance m_1=0.1:5")
        raise UnknownNameError("parameter, coordinate or speed", name, model.quantities)
    quantity = model.quantities[name]
    return name, (_end(low, quantity), _end(high, quantity))


def _end(typed: str, quantity: NamedQuantity) -> float | None:
    return read_value(typed, quantity) if typed.strip() else None


def _start(
    model: mechc.Model, chosen: argparse.Namespace, free: dict[str, Any]
) -> tuple[dict[str, float] | None, dict[str, float]]:
    """The values given of the start, filled up as ``mechc run`` does; None where nothing is."""
    states = (*model.coordinates, *model.speeds)
    given = values_of(model, chosen.start, states, STATE)
    guess = values_of(model, chosen.guess, model.coordinates, "coordinate")
    if not given:
        return None, guess
    every = {name: math.nan for name in free if name in states} | given
    q, u, near = filled_start(model.system, *model.coordinates_and_speeds(every), guess)
    return {name: value for name, value in {**q, **u}.items() if not math.isnan(value)}, near
