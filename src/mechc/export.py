"""Mechanisms for other programs: as C, as WebAssembly, and as functional mock-up units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from mechc.compilation.event_tapes import typed_expression
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.errors import ValueOutOfBoundsError
from mechc.files import replacing, written_into
from mechc.simulation.events.exported import exported_events
from mechc.simulation.events.expressions import StateNames
from mechc.simulation.events.own_contacts import with_own_contacts
from mechc.simulation.settings import checked_span


@one_at_a_time
def export_c(
    mechanism: Any,
    folder: str | Path,
    *,
    name: str | None = None,
    y0: Sequence[float] | Mapping[Any, float] | None = None,
    params: Mapping[str, float] | None = None,
    t_end: float = 10.0,
    real: str = "double",
    fix: Mapping[Any, float] | None = None,
    outputs: Iterable[Any] | None = None,
    **options: Any,
) -> list[Path]:
    """Write a mechanism as C99 that needs nothing but a C compiler and its libm.

    Files: ``NAME.h`` and ``NAME.c`` with rates, outputs, projection onto the constraints and a step
    of fixed length; ``main.c``, a run that prints CSV; ``CMakeLists.txt``.  Nothing in them
    allocates memory or keeps a state between calls.

    Parameters
    ----------
    mechanism
        A :class:`mechc.Model`, the name of a mechanism of the library, or what
        :func:`mechc.compile` takes.
    folder
        Made if it does not exist; files of the same names are replaced.
    name
        Begins every public name, and names the files; by default that of the mechanism.
    y0
        State (nq + nu) at which the example begins, SI units; by default zero.  Of a model also
        coordinates and speeds by name, with which its loops are closed.
    params
        Values for the example, by name; by default those of the mechanism.
    t_end
        Time in s at which the example ends.
    real
        The type of all numbers, ``"double"`` or ``"float"``.
    fix, outputs
        As for :func:`mechc.compile`; of a model besides those that it has.
    options
        Of the mechanism of the library as in :func:`mechc.load`, or the other arguments of
        :func:`mechc.compile`.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    MechcError
        If ``name`` cannot begin a name in C, ``real`` is another type or has no such numbers, the
        model has values of inputs, or the mechanism cannot be compiled.
    ValueOutOfBoundsError
        If y0 has another length; for numbers that are not finite or out of their bounds.

    Notes
    -----
    The step is Kutta's method of order 4, and its end is moved to the nearest state on the
    constraints.  Inputs keep their values during a step, or a function of the program gives them
    (``model.drive``).  Methods with error control, and motion through change points, are those of
    :func:`mechc.load`'s models alone.
    """
    from mechc.compilation.exports.standalone import (
        read_export,
        standalone_texts,
        warn_of_contacts,
    )

    _, end = checked_span(t_end)
    if end < 0.0:
        raise ValueOutOfBoundsError("t_end is a number of seconds from 0 on")
    asked = read_export(mechanism, y0, dict(params or {}), fix=fix, outputs=outputs, **options)
    warn_of_contacts(asked.mechanism)
    texts = standalone_texts(asked, name or asked.mechanism.name, t_end, real)
    target = Path(folder)
    with written_into(target):
        target.mkdir(parents=True, exist_ok=True)
        for file, text in texts.items():
            (target / file).write_text(text, "utf-8")
    return [target / file for file in texts]


@one_at_a_time
def export_wasm(
    mechanism: Any,
    folder: str | Path,
    *,
    name: str | None = None,
    y0: Sequence[float] | Mapping[Any, float] | None = None,
    params: Mapping[str, float] | None = None,
    sliders: Iterable[str] | Mapping[str, tuple[float, float]] | None = None,
    fix: Mapping[Any, float] | None = None,
    outputs: Iterable[Any] | None = None,
    **options: Any,
) -> list[Path]:
    """Write a mechanism for pages: the core of a unit of :func:`export_fmu` as WebAssembly.

    Files: ``NAME.wasm``; ``NAME.js``, a module of JavaScript that has it inside: parameters by
    name, starts whose loops are closed, mechc's own integrators, outputs, points; ``NAME.html``, a
    page that simulates while it plays and has sliders.  None of them loads anything from elsewhere.

    Parameters
    ----------
    mechanism, folder, name, params, fix, outputs, options
        As for :func:`export_c`.
    y0
        Where it starts, as for :func:`export_c`; by default zero.
    sliders
        Names of parameters, of coordinates and speeds of the start, and of inputs; a mapping gives
        the least and the greatest value of each.  By default parameters, 8 at most, that do not
        follow from others, and the coordinates of the mechanism's own start.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    MechcError
        If ``name`` cannot begin a name in C, there is no compiler (the package ``ziglang``, of the
        extra ``compiler``), a parameter has no value, or the mechanism cannot be compiled.
    ValueOutOfBoundsError
        If y0 has another length, or a slider's range is none.
    UnknownNameError
        For a slider of nothing.
    """
    from mechc.compilation.exports.standalone import read_export, warn_of_contacts
    from mechc.compilation.exports.web import web
    from mechc.results.web.page import live_page, module_text
    from mechc.results.web.sliders import chosen_sliders

    asked = read_export(mechanism, y0, dict(params or {}), fix=fix, outputs=outputs, **options)
    warn_of_contacts(asked.mechanism)
    name = name or str(asked.mechanism.name)
    wasm, about = web(asked, name)
    ranges, held = chosen_sliders(about, asked.mechanism.start, sliders)
    about |= {"held": held}
    module = module_text(wasm, about)
    texts = {"js": module, "html": live_page(module, about, ranges)}
    target = Path(folder)
    with written_into(target):
        target.mkdir(parents=True, exist_ok=True)
        (target / f"{name}.wasm").write_bytes(wasm)
        for kind, text in texts.items():
            (target / f"{name}.{kind}").write_text(text, "utf-8", newline="\n")
    return [target / f"{name}.{kind}" for kind in ("wasm", *texts)]


@one_at_a_time
def export_fmu(
    mechanism: Any,
    file: str | Path,
    *,
    version: str = "3.0",
    name: str | None = None,
    y0: Sequence[float] | Mapping[Any, float] | None = None,
    params: Mapping[str, float] | None = None,
    t_end: float = 10.0,
    rtol: float = 1e-9,
    drift: float = 1e-4,
    derivatives: bool = True,
    events: Sequence[Any] = (),
    fix: Mapping[Any, float] | None = None,
    outputs: Iterable[Any] | None = None,
    **options: Any,
) -> Path:
    """Write a mechanism as a functional mock-up unit (FMU), compiled for this machine.

    One file serves both ways: by co-simulation mechc's own integrators advance the motion, with
    error control and loops closed; by model exchange the importer integrates all coordinates and
    speeds.  The C that it is compiled from is in it.

    Parameters
    ----------
    mechanism, fix, outputs, options
        As for :func:`export_c`.
    file
        The archive, NAME.fmu; replaced if it exists.
    version
        Of FMI, ``"3.0"`` or ``"2.0"``.
    name
        The identifier of the model; by default that of the mechanism.
    y0
        Where the model starts, as for :func:`export_c`; by default zero.  At the end of
        initialization it is moved to the nearest state on the constraints.
    params
        Start values of parameters, by name; by default those of the mechanism.  A default that
        follows other parameters, as the inertia of a rod, is calculated in the unit unless it is
        given here.
    t_end
        End of the default experiment, s.
    rtol
        Relative tolerance of co-simulation where the importer asks for none.
    drift
        Start value of the parameter ``mechc.drift``: by model exchange a state that is farther from
        the constraints, relative to its nominal value, is moved onto them in event mode; 0: never.
    derivatives
        Offer directional and adjoint derivatives.  Of a large mechanism they take most of the time
        of the export.
    events
        Events that are expressions, as of :meth:`mechc.Model.simulate`, with resets that are, too:
        event indicators by model exchange; co-simulation makes the resets within its steps.  With
        stops or dry friction the unit has co-simulation alone.

    Returns
    -------
    Path
        The archive.

    Raises
    ------
    MechcError
        If ``name`` is no identifier, there is no such version or no compiler, a parameter has no
        value, or the mechanism cannot be compiled.
    ValueOutOfBoundsError
        If y0 has another length, or rtol or drift is no such number; for events that are no
        expressions and for events that end a run.
    UnknownNameError
        For a name in an event that the mechanism does not have.

    Notes
    -----
    The interface is the Functional Mock-up Interface, versions 2.0.4 and 3.0.2.
    """
    from mechc.compilation.exports.fmu import write_fmu
    from mechc.compilation.exports.standalone import read_export

    if not 0.0 < rtol <= 0.1 or not 0.0 <= drift < float("inf"):
        raise ValueOutOfBoundsError("rtol lies above 0 and up to 0.1, drift is a number from 0 on")
    _, end = checked_span(t_end)
    if end < 0.0:
        raise ValueOutOfBoundsError("t_end is a number of seconds from 0 on")
    asked = read_export(mechanism, y0, dict(params or {}), fix=fix, outputs=outputs, **options)
    target = Path(file)
    with replacing(target) as part:
        write_fmu(
            asked, part, name=name or asked.mechanism.name, version=version, end=end,
            rtol=float(rtol), drift=float(drift), derivatives=bool(derivatives),
            events=partial(_events, events),
        )  # fmt: skip
    return target


def _events(
    given: Any, metadata: Mapping[str, Any], *names: Sequence[str]
) -> tuple[list[Any], Any]:
    """Events and contacts over plain symbols; ``names``: of coordinates, speeds and parameters."""
    every = with_own_contacts(given, metadata, {})
    return exported_events(every, StateNames(*names), typed_expression)
