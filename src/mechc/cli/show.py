"""The command ``mechc show``: facts about a mechanism, and its derivation as a page."""

from __future__ import annotations

import argparse
import textwrap
from pathlib import Path

import mechc
from mechc.cli.arguments import (
    checked_options,
    library_name,
    options_of,
    output_path,
    page_ending,
    values_of,
)
from mechc.cli.own_models import READERS, is_own, own_model, own_object
from mechc.compilation.facts import Facts, facts_of
from mechc.files import write_text


def show_command(chosen: argparse.Namespace) -> int:
    """Prints quantities, and of a user's own model the verdict, of a mechanism of the library what
    follows from its values, and its options; writes the page."""
    from mechc.compilation.compiler import of_compiler
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
    thing = own_object(chosen.name) if own else mechanism_of(chosen.name, options)
    mechanism = thing
    if not isinstance(thing, of_compiler("Mechanism")):
        thing = own_model(chosen.name)
        mechanism = described(thing.system)[0]
    facts = facts_of(mechanism, {})
    names = [name for name in facts.quantities if name not in {*facts.coordinates, *facts.speeds}]
    params = values_of(facts, chosen.parameters, names, "parameter")
    facts = facts_of(mechanism, params)
    print(f"{mechanism.title}\n")
    _print_quantities(facts, is_long=Path(chosen.name).suffix in READERS)
    print()
    for label, sentence in [] if own else derivation_notes(mechanism, facts.values):
        print(f"{label}: {sentence}.")
    found = {} if own else shipped_options(chosen.name)
    if found:
        print("\noptions (--with NAME):")
    for option, about in found.items():
        print(f"  {option:15} {about}")
    if own:
        print(mechc.judge(thing, params))
    if page is not None:
        write_text(page, derivation_page(mechanism, facts.values, chosen.latex))
        print(f"\nthe derivation is in {page.resolve()}")
    elif not own:
        print(f"\nits derivation, as a page: mechc show {chosen.name} --out {chosen.name}.{ending}")
    return 0


def _print_quantities(facts: Facts, *, is_long: bool) -> None:
    """A line for each: name, value where there is one, unit, description; of long lists, names of
    one unit without values in one paragraph."""
    for name, q in facts.quantities.items():
        value = f"{facts.values[name]:g} {q.unit}" if name in facts.values else q.unit
        if not is_long or name in facts.values:
            print(f"  {name:10}  {value:18} {q.description}")
    others = [q for q in facts.quantities.values() if is_long and q.name not in facts.values]
    for unit in dict.fromkeys(q.unit for q in others):
        names = ", ".join(q.name for q in others if q.unit == unit)
        told = f"{unit}: {names}"
        print(textwrap.fill(told, 100, subsequent_indent="  ", break_on_hyphens=False))
