"""Mechanisms as C for other programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.results.durable import written_into


@one_at_a_time
def export_c(
    mechanism: Any,
    folder: str | Path,
    *,
    name: str | None = None,
    y0: Sequence[float] | None = None,
    params: Mapping[str, float] | None = None,
    t_end: float = 10.0,
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
        The name of a mechanism of the library, or what :func:`mechc.compile` takes.
    folder
        Made if it does not exist; files of the same names are replaced.
    name
        Begins every public name, and names the files; by default that of the mechanism.
    y0
        State (nq + nu) at which the example begins, SI units; by default zero.
        ``model.assemble(...)`` gives one that is on the constraints.
    params
        Values for the example, by name; by default those of the mechanism.
    t_end
        Time in s at which the example ends.
    fix, outputs
        As for :func:`mechc.compile`.
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
        If ``name`` cannot begin a name in C, or the mechanism cannot be compiled.
    ValueOutOfBoundsError
        If y0 has another length.

    Notes
    -----
    The step is Kutta's method of order 4, and its end is moved to the nearest state on the
    constraints.  Inputs given with a run keep their values during a step.  Methods with error
    control, and motion through change points, are those of :func:`mechc.load`'s models alone.
    """
    from mechc.compilation.standalone import standalone_texts

    texts = standalone_texts(
        mechanism, name, y0, dict(params or {}), t_end, fix=fix, outputs=outputs, **options
    )
    target = Path(folder)
    with written_into(target):
        target.mkdir(parents=True, exist_ok=True)
        for file, text in texts.items():
            (target / file).write_text(text, "utf-8")
    return [target / file for file in texts]
