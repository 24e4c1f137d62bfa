"""The command ``mechc export``: a mechanism as C for other programs."""

from __future__ import annotations

import argparse

from mechc.cli.arguments import (
    checked_options,
    model_of,
    options_of,
    output_folder,
    seconds_of,
    start_state,
    values_of,
)
from mechc.cli.own_models import is_own, own_description, own_name
from mechc.errors import MechcError
from mechc.export import export_c


def export_command(chosen: argparse.Namespace) -> int:
    """Assembles the start of the example, then writes the files."""
    if not chosen.c:
        raise MechcError("say what to export: --c")
    own = is_own(chosen.name)
    model = model_of(chosen)
    params = values_of(model, chosen.parameters, model.parameters, "parameter")
    start = start_state(model, chosen, params)
    folder = output_folder(chosen, "mechc_export")
    assert folder is not None
    files = export_c(
        own_description(chosen.name) if own else chosen.name,
        folder,
        name=chosen.prefix or (own_name(chosen.name) if own else None),
        y0=start,
        params=params,
        t_end=seconds_of(chosen),
        **({} if own else checked_options(chosen.name, options_of(chosen.options))),
    )
    for file in files:
        print(file)
    c = next(file.name for file in files if file.suffix == ".c")
    print(f"\ncc -std=c99 -O2 -o run {c} main.c -lm && ./run > motion.csv   in {folder}")
    return 0
