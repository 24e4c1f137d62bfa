"""The command ``mechc show``: facts about a mechanism, and its derivation as a page."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

import mechc
from mechc.cli.arguments import (
    checked_options,
    library_name,
    options_of,
    output_path,
    page_ending,
    values_of,
)
from mechc.cli.own_models import is_own, own_model
from mechc.files import write_text


def show_command(chosen: argparse.Namespace) -> int:
    """Prints quantities, what follows from their values, and options; writes the page."""
    from mechc.compilation.exports.standalone import described
    from mechc.compilation.library.library import (
        derivation_notes,
        derivation_page,
        mechanism_of,
        shipped_options,
    )

    own, ending = is_own(chosen.name), page_ending(chosen)
    page = output_path(chosen, chosen.out, "") if chosen.out else None
    options = {} if own else checked_options(library_name(chosen.name), options_of(chosen.options))
    model = own_model(chosen.name) if own else mechc.load(chosen.name, **options)
    params = values_of(model, chosen.parameters, model.parameters, "parameter")
    values = _values(model, params)
    print(f"{model.title}\n")
    for name, quantity in model.quantities.items():
        value = f"{values[name]:g} {quantity.unit}" if name in values else quantity.unit
        print(f"  {name:10} {value:18} {quantity.description}")
    print()
    if own and page is None:
        return 0
    mechanism = (
        described(model.system)[0] if own
        else mechanism_of(chosen.name, options)
    )  # fmt: skip
    for label, sentence in derivation_notes(mechanism, values):
        print(f"{label}: {sentence}.")
    found = {} if own else shipped_options(chosen.name)
    if found:
        print("\noptions (--with NAME):")
    for option, about in found.items():
        print(f"  {option:15} {about}")
    if page is None:
        print(f"\nits derivation, as a page: mechc show {chosen.name} --out {chosen.name}.{ending}")
        return 0
    write_text(page, derivation_page(mechanism, values, chosen.latex))
    print(f"\nthe derivation is in {page.resolve()}")
    return 0


def _values(model: mechc.Model, params: Mapping[str, float]) -> dict[str, float]:
    """Values of the parameters that have one."""
    known = model.system.parameter_set
    open_ones = [name for name in known.missing if name not in params]
    values = known.defaults if open_ones else known.resolve(params)
    found = dict(zip(known.names, values.tolist(), strict=True)) | dict(params)
    return {name: value for name, value in found.items() if name not in open_ones}
