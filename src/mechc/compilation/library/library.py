"""Mechanisms of the library: their options and variants, their derivation, their C."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from mechc.compilation import cache, entries
from mechc.compilation.build import compile_described, key_of
from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.compilation.parts import FIRST
from mechc.errors import UnknownNameError
from mechc.system.reference import ModelReference, Origin
from mechc.system.system import System


def shipped_options(name: str) -> dict[str, str]:
    """Option name -> what it does, of a mechanism of the library."""
    from mechc_codegen import SHIPPED

    return {option.name: option.about for option in SHIPPED[name].options}


def check_options(name: str, options: Mapping[str, Any]) -> None:
    """Raise :class:`UnknownNameError` for an option that a mechanism of the library has not."""
    known = shipped_options(name)
    for option in options:
        if option not in known:
            raise UnknownNameError(f"option of {name}", option, known)


def beyond_default(name: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The options that differ from a mechanism's default scene, counts as numbers.

    Raises :class:`UnknownNameError` for an option that it does not have.
    """
    from mechc_codegen.library.catalogue import beyond_default

    check_options(name, options)
    errors_of_compiler()
    found: dict[str, Any] = beyond_default(name, options)
    return found


@one_at_a_time
def variant(
    name: str, options: Mapping[str, Any], asked: Mapping[str, Any], *, ahead: bool = True
) -> System:
    """A mechanism of the library with options that are known to exist, compiled on demand.

    ``asked``: parameters to ``fix`` and ``outputs``, by name.  The key follows from mechanism,
    options and compiler package, and is looked up before anything is derived.
    """
    errors_of_compiler()
    told = _as_reference(options, asked)
    plain = all(map(_is_plain, options.values()))
    same = plain or _reads_again(options, told)
    reference = ModelReference(name, told if same else {}, custom=not same)
    digest = _variant_digest(name, told) if plain else None
    return compile_described(origin_of(name, options, asked), reference, digest, ahead=ahead)


def origin_of(name: str, options: Mapping[str, Any], asked: Mapping[str, Any]) -> Origin:
    """The description of a variant of a mechanism of the library."""

    def with_outputs(outputs: frozenset[str]) -> System:
        from mechc_codegen.description.request import default_outputs

        own = asked.get("outputs", default_outputs(of_object=False))
        return variant(name, options, {**asked, "outputs": sorted({*own, *outputs})}, ahead=False)

    return Origin(lambda: described_as_asked(name, options, asked), with_outputs)


def names_to_compile(name: str, options: Mapping[str, Any]) -> Mapping[str, tuple[str, ...]] | None:
    """Names of ``"coordinates"``, ``"speeds"``, ``"parameters"``, before these are compiled.

    None where the scene is compiled: then the model has them.
    """
    from mechc_codegen.description.terms import printed_name

    digest = _variant_digest(name, _as_reference(beyond_default(name, options), {}))
    if entries.load(cache.part_key(key_of(digest), FIRST)) is not None:
        return None
    mechanism = mechanism_of(name, options)
    return {
        "coordinates": tuple(map(printed_name, (*mechanism.q, *mechanism.x))),
        "speeds": tuple(map(printed_name, mechanism.u)),
        "parameters": tuple(p.symbol.name for p in mechanism.parameters),
    }


def described_as_asked(
    name: str, options: Mapping[str, Any], asked: Mapping[str, Any]
) -> tuple[Any, Any]:
    """A mechanism of the library, and the request for its outputs."""
    from mechc_codegen.frontend.read_request import read_request

    mechanism = mechanism_of(name, options)
    outputs = tuple(asked["outputs"]) if "outputs" in asked else None
    return mechanism, read_request(mechanism, asked.get("fix", {}), outputs, of_object=False)


def _as_reference(options: Mapping[str, Any], asked: Mapping[str, Any]) -> dict[str, Any]:
    """Options and requests by which another process finds the variant."""
    kept = (bool, int)
    return {k: v if isinstance(v, kept) else str(v) for k, v in options.items()} | dict(asked)


def _is_plain(value: Any) -> bool:
    return isinstance(value, (bool, int, float, str))


def _reads_again(options: Mapping[str, Any], told: Mapping[str, Any]) -> bool:
    """Whether the options can be restored from their texts."""
    from mechc_codegen.description.parsing.parser import parse_expression
    from mechc_codegen.errors import CodegenError
    from sympy.physics.mechanics import dynamicsymbols

    try:
        again = [
            parse_expression(told[key], {"t": dynamicsymbols._t}) == value
            for key, value in options.items()
            if not _is_plain(value)
        ]
    except CodegenError:
        return False
    return all(again)


def _variant_digest(name: str, told: Mapping[str, Any]) -> str:
    parts = ["shipped", name, repr(sorted(told.items()))]
    return hashlib.sha256("".join(f"{len(p)}:{p}" for p in parts).encode()).hexdigest()


def derivation_page(mechanism: Any, values: Mapping[str, float] | None, latex: bool) -> str:
    """The typeset derivation of a mechanism, as HTML or LaTeX."""
    from mechc_codegen.typeset.page import derivation, html_page, latex_document

    written = latex_document if latex else html_page
    return str(written(derivation(mechanism), values))


def derivation_notes(mechanism: Any, values: Mapping[str, float]) -> list[tuple[str, str]]:
    """Remarks that follow from parameter values: for the four-bar its Grashof class."""
    return list(mechanism.notes(values)) if mechanism.notes else []


def generated_texts(mechanism: Any, request: Any) -> Mapping[str, str]:
    """File name -> text of everything generated for a mechanism and a request for outputs."""
    from mechc_codegen import build_scene

    texts: Mapping[str, str] = build_scene(mechanism, request=request).texts
    return texts


def mechanism_of(name: str, options: Mapping[str, Any]) -> Any:
    """The mechanism as the compiler describes it."""
    from mechc_codegen import shipped_mechanism

    errors_of_compiler()
    return shipped_mechanism(name, options)
