"""Parses arguments of ``mechc``: models, values with units, numbers, the output folder."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import chain, count
from pathlib import Path
from typing import Any

import mechc
from mechc.assembly.initial_values import filled_start
from mechc.cli.own_models import READERS, is_own, own_model, own_name, refuse_file_alone
from mechc.compilation.facts import Facts
from mechc.compilation.library.catalogue import COMPILED_AT_INSTALL, LIBRARY
from mechc.errors import MechcError, MissingInputError, UnknownNameError
from mechc.progress import Notice
from mechc.system.units import read_seconds, read_value, split_assignment

OF_ROBOTS = "limits", "friction", "effort", "meshes"  # arguments of the readers of robots

STATE = "coordinate or speed"
OWN_SECONDS = 10.0  # of a run of a user's own model


def check_name(chosen: argparse.Namespace) -> None:
    """Refuse a name that is neither of the library nor of a user's own model."""
    if not is_own(chosen.name):
        library_name(chosen.name)


def seconds_of(chosen: argparse.Namespace) -> float:
    """The end of the run, positive; the mechanism's default if it is not given."""
    check_name(chosen)
    if chosen.t_end is None:
        return OWN_SECONDS if is_own(chosen.name) else LIBRARY[chosen.name].seconds
    t_end = read_seconds(chosen.t_end)
    if not t_end > 0:
        raise MechcError(f"--t-end must be positive, not {chosen.t_end}")
    return t_end


def start_state(model: mechc.Model, chosen: argparse.Namespace, params: dict[str, float]) -> Any:
    """The state that --start and --guess describe, with the scene's defaults."""
    state_names = (*model.coordinates, *model.speeds)
    start = values_of(model, chosen.start, state_names, STATE)
    guess = values_of(model, chosen.guess, model.coordinates, "coordinate")
    halves = model.coordinates_and_speeds(start)
    return model.assemble(*filled_start(model.system, *halves, guess), params)


@contextmanager
def output_folder(
    chosen: argparse.Namespace,
    prefix: str = "mechc",
    goes_on: Callable[[Path], bool] = lambda _: False,
) -> Iterator[Path | None]:
    """The output folder, made now so that a wrong one is known before the run.

    An error that leaves it empty removes it again.

    ``goes_on``: whether a folder holds what the command continues, so that it may be there.
    """
    if getattr(chosen, "json", False) and not chosen.out:
        yield None
        return
    named = own_name(chosen.name) if is_own(chosen.name) else chosen.name
    folder = output_path(chosen, chosen.out, f"{prefix}_{named}", goes_on)
    absent = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        _make_and_try(folder)
        yield folder
    except BaseException:
        with suppress(OSError):  # one that is not empty stays
            for path in absent:
                path.rmdir()
        raise


def _make_and_try(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".mechc-probe"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise MechcError(f"cannot write into {folder}: {error.strerror}") from None


def output_path(
    chosen: argparse.Namespace, named: str | None, default: str,
    goes_on: Callable[[Path], bool] = lambda _: False,
) -> Path:  # fmt: skip
    """The file or folder to write: as named, else the default with the next free number.

    Raises :class:`MechcError` if what is named is there, unless ``--force`` is given.
    """
    forced = getattr(chosen, "force", False)

    def is_usable(path: Path) -> bool:
        taken = any(path.iterdir()) if path.is_dir() else path.is_file()
        return forced or not taken or goes_on(path)

    if not named:
        first = Path(default)
        more = (first.with_stem(f"{first.stem}_{number}") for number in count(2))
        return next(filter(is_usable, chain([first], more)))
    if not is_usable(Path(named)):
        force = "--force replaces it, or " if hasattr(chosen, "force") else ""
        raise MechcError(f"{named} exists: {force}name another")
    return Path(named)


def saved_in(path: Path) -> Path:
    """The data in a folder of ``mechc run`` or ``mechc sweep``; any other path as it is."""
    return next(filter(Path.exists, (path / "solution.nc", path / "batch")), path)


def library_name(name: str) -> str:
    """The name of a mechanism of the library."""
    refuse_file_alone(name)
    if name not in mechc.mechanisms():
        raise UnknownNameError("mechanism", name, mechc.mechanisms())
    return name


def model_of(chosen: argparse.Namespace, outputs: Sequence[str] | None = None) -> mechc.Model:
    """The mechanism and options given, compiled completely, with these outputs or its own."""
    name, own = chosen.name, is_own(chosen.name)
    options = options_of(chosen.options)
    if own:
        _refuse_other_options(name, options)
    else:
        options = checked_options(library_name(name), options)
        _refuse_unknown_names(chosen, options)
    with Notice(f"compiling {name}; the next time it is in the cache ..."):
        if own:
            model = own_model(name, outputs, options)
        else:
            model = mechc.load(name, outputs=outputs, **options)
        model.system.wait(batches=False)
    return model


def _refuse_other_options(name: str, options: Mapping[str, Any]) -> None:
    """Refuse options of a model of one's own but for what a robot's file has."""
    if options and (Path(name).suffix not in READERS or {*options} - {*OF_ROBOTS}):
        raise MechcError(
            f"--with: {name} has no such option; the library has them, and robots in files "
            f"{', '.join(OF_ROBOTS)}"
        )


def _refuse_unknown_names(chosen: argparse.Namespace, options: dict[str, Any]) -> None:
    """Refuse names before a scene that would have to be compiled first."""
    state = [*getattr(chosen, "start", ()), *getattr(chosen, "guess", ())]
    parameters = chosen.parameters
    if not (state or parameters) or (chosen.name in COMPILED_AT_INSTALL and not options):
        return
    from mechc.compilation.library.library import names_to_compile

    names = names_to_compile(chosen.name, options)
    if names is None:
        return
    both = (*names["coordinates"], *names["speeds"])
    for typed, known, kind in (
        (state, both, STATE),
        (parameters, names["parameters"], "parameter"),
    ):
        for name, _ in map(split_assignment, typed):
            if name not in known:
                raise UnknownNameError(kind, name, known)


def options_of(typed: Sequence[str]) -> dict[str, Any]:
    """Options as typed: ``friction`` is on; ``crank_torque=2*t`` has a value."""
    return {
        name.strip(): value.strip() if sign else True
        for name, sign, value in (text.partition("=") for text in typed)
    }


def checked_options(name: str, options: dict[str, Any]) -> dict[str, Any]:
    """The options, all of which the mechanism has: not arguments of ``mechc.load``.

    Raises :class:`UnknownNameError` for an option that the mechanism does not have.
    """
    if options:
        from mechc.compilation.library.library import check_options

        check_options(name, options)
    return options


def values_of(
    model: mechc.Model | Facts, typed: Sequence[str], known: Sequence[str], kind: str
) -> dict[str, float]:
    """NAME=VALUE, each name known and given once, in SI units."""
    texts = _assignments(typed, known, kind)
    return {name: read_value(value, model.quantities[name]) for name, value in texts.items()}


def inputs_of(
    model: mechc.Model, chosen: argparse.Namespace, left: Container[str] = ()
) -> dict[str, str]:
    """The inputs of ``--input``, numbers or expressions; ``left``: names that need none.

    Raises :class:`MissingInputError` if another has no value.
    """
    typed = _assignments(chosen.inputs, model.inputs, "input")
    known = {} if model.system.driven is None else model.system.driven.given
    given = {*typed, *known}
    missing = [name for name in model.inputs if name not in given and name not in left]
    if missing:
        raise MissingInputError(
            f"these inputs have no value: {', '.join(missing)}. Give each as a number or an "
            f"expression: --input {missing[0]}=2, --input '{missing[0]}=3*sin(4*t)'"
        )
    return typed


def _assignments(typed: Sequence[str], known: Sequence[str], kind: str) -> dict[str, str]:
    """NAME=VALUE, each name known and given once, as texts."""
    texts: dict[str, str] = {}
    for text in typed:
        name, value = split_assignment(text)
        if name not in known:
            raise UnknownNameError(kind, name, known)
        if name in texts:
            raise MechcError(f"{name} is given twice")
        texts[name] = value
    return texts


def tolerance(chosen: argparse.Namespace) -> float:
    """``--rtol``, checked before anything is compiled."""
    rtol = number("--rtol", chosen.rtol)
    if not 0 < rtol < 1:
        raise MechcError(f"--rtol must be between 0 and 1, not {chosen.rtol}")
    return rtol


def page_ending(chosen: argparse.Namespace) -> str:
    """The ending of the page that ``show --out`` writes, ``html`` or ``tex``."""
    wanted = "tex" if chosen.latex else "html"
    endings = {"html": (".html", ".htm"), "tex": (".tex",)}[wanted]
    if chosen.out and Path(chosen.out).suffix.lower() not in endings:
        raise MechcError(
            f"--out {chosen.out}: the derivation is written as {wanted.upper()}, to a file that "
            f"ends in {endings[0]}; "
            + ("a browser prints it as PDF" if wanted == "html" else "pdflatex makes a PDF of it")
        )
    return wanted


def number(option: str, text: str) -> float:
    """The value of an option that is a number."""
    try:
        return float(text)
    except ValueError:
        raise MechcError(f"{option} must be a number, not {text!r}") from None


def whole(option: str, text: str) -> int:
    """The value of an option that is a whole number."""
    try:
        return int(text)
    except ValueError:
        raise MechcError(f"{option} must be a whole number, not {text[:60]!r}") from None
