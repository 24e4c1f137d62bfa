"""The command ``mechc export``: a mechanism for other programs."""

from __future__ import annotations

import argparse
from typing import Any

from mechc.cli.arguments import (
    checked_options,
    model_of,
    options_of,
    output_folder,
    output_path,
    seconds_of,
    start_state,
    values_of,
)
from mechc.cli.own_models import is_own, own_name
from mechc.errors import MechcError
from mechc.export import export_c, export_fmu, export_wasm


def export_command(chosen: argparse.Namespace) -> int:
    """Assembles the start, then writes the files."""
    kinds = {_c: chosen.c, _fmu: chosen.fmu, _wasm: chosen.wasm}
    asked = [kind for kind, flag in kinds.items() if flag]
    if len(asked) != 1:
        raise MechcError("say what to export: --c, --fmu or --wasm")
    if chosen.float and not chosen.c:
        raise MechcError("--float is for --c")
    if chosen.fmi and not chosen.fmu:
        raise MechcError("--fmi chooses the version of --fmu")
    return asked[0](chosen)


def _common_arguments(chosen: argparse.Namespace) -> tuple[Any, dict[str, Any]]:
    """The mechanism that is handed on, and arguments that both kinds of files have."""
    own = is_own(chosen.name)
    model = model_of(chosen)
    params = values_of(model, chosen.parameters, model.parameters, "parameter")
    return model if own else chosen.name, {
        "name": chosen.prefix or (own_name(chosen.name) if own else None),
        "y0": start_state(model, chosen, params),
        "params": params,
        "t_end": seconds_of(chosen),
        **({} if own else checked_options(chosen.name, options_of(chosen.options))),
    }


def _c(chosen: argparse.Namespace) -> int:
    mechanism, arguments = _common_arguments(chosen)
    real = "float" if chosen.float else "double"
    with output_folder(chosen, "mechc_export") as folder:
        assert folder is not None
        files = export_c(mechanism, folder, real=real, **arguments)
    for file in files:
        print(file)
    c = next(file.name for file in files if file.suffix == ".c")
    print(f"\ncc -std=c99 -O2 -o run {c} main.c -lm && ./run > motion.csv   in {folder}")
    return 0


def _wasm(chosen: argparse.Namespace) -> int:
    mechanism, arguments = _common_arguments(chosen)
    del arguments["t_end"]
    with output_folder(chosen, "mechc_export") as folder:
        assert folder is not None
        files = export_wasm(mechanism, folder, **arguments)
    for file in files:
        print(f"{file}  {file.stat().st_size / 1e3:.0f} kB")
    return 0


def _fmu(chosen: argparse.Namespace) -> int:
    mechanism, arguments = _common_arguments(chosen)
    named = chosen.prefix or (own_name(chosen.name) if is_own(chosen.name) else chosen.name)
    file = output_path(chosen, chosen.out, f"{named}.fmu")
    print(export_fmu(mechanism, file, version=chosen.fmi or "3.0",
                     derivatives=not chosen.no_derivatives, **arguments))  # fmt: skip
    return 0
