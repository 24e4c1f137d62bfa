"""Run times of derivatives at equal error: mechc, heyoka's variational equations, CVODES and IDAS.

Every tool runs at tolerances from 1e-4 to 1e-13.  Of each: the least milliseconds of those runs
whose derivatives are within an error of those of ``data/sensitivities.json``; forwards all columns,
backwards the gradient of the end's first component.  mechc's time is that of the whole call,
assembly and Python included; compilation and building of integrators is timed of none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.library.chains.pendulum import pendulum
from mechc_codegen.library.planar.andrews import andrews
from mechc_codegen.library.planar.four_bar import four_bar
from mechc_codegen.library.spatial.bicycle import bicycle, values

from ..formulations.described import described
from ..formulations.equations import derive
from ..problems.problem import Array
from ..references.sensitivities.derivatives import Posed, posed
from ..stability.stiff import two_masses
from ..timing.processes import least_of_rounds
from .variational import Differentiated, Run, runs

TOLERANCES = tuple(10.0**-k for k in range(4, 14))
ERRORS = (1e-4, 1e-6, 1e-8, 1e-10)
MECHANISMS: Mapping[str, Callable[[], Any]] = {
    "pendulum": pendulum, "four_bar_regular": four_bar, "stiff_masses": two_masses,
    "bicycle": lambda: described(bicycle(), values()), "andrews": andrews,
}  # fmt: skip


def table(names: Sequence[str], rounds: int) -> Iterator[str]:
    """Its lines."""
    errors = "".join(f"{f'{e:.0e}':>10}" for e in ERRORS)
    yield f"ms at an error of   {'':22}{errors}"
    for name in names:
        given = posed(name)
        given.model.wait_compiled()
        least = _least(given, name, rounds)
        for (way, tool), times in sorted(least.items()):
            told = "".join(f"{1e3 * t:10.3f}" if t < np.inf else f"{'-':>10}" for t in times)
            yield f"{name:18} {way:10} {tool:12}{told}"
    yield "-: every run ended farther off or gave up; heyoka has no adjoint, so no row backwards"


def _least(given: Posed, name: str, rounds: int) -> dict[tuple[str, str], list[float]]:
    """(way, tool) -> the least seconds at each error."""
    found: dict[tuple[str, str], list[float]] = {}
    motion = differentiated(given, MECHANISMS[name]())
    for run in (*own(given), *runs(motion, TOLERANCES)):
        error = error_of(run, given.exact)
        times = found.setdefault((run.way, run.tool), [np.inf] * len(ERRORS))
        if error > ERRORS[0]:
            continue
        (seconds,) = least_of_rounds(rounds, run.run)
        found[run.way, run.tool] = [
            min(t, seconds) if error <= e else t for t, e in zip(times, ERRORS, strict=True)
        ]
    return found


def differentiated(given: Posed, mechanism: Any) -> Differentiated:
    """The motion for the other tools, its start and the derivatives of it as mechc has them."""
    sol = given.run(given.y0, given.params, sensitivities=list(given.exact))
    columns = sol.sensitivity.columns
    first = sol.sensitivity(sol.t[0])
    slopes = np.column_stack([first[name] for name in given.exact])
    equations = derive(ordered(mechanism, given.model), {})
    order = [given.model.parameters.index(p.name) for p in equations.parameters]
    return Differentiated(
        equations, np.array(sol.y[0]), slopes, np.array(sol.params)[order],
        columns.parameters[order], given.t, stiff="radau5" in given.methods,
    )  # fmt: skip


def ordered(mechanism: Mechanism, model: Any) -> Mechanism:
    """The mechanism with its coordinates and speeds in the order of the model's."""

    def sorted_by(names: Sequence[str], things: Sequence[Any], given: Sequence[Any]) -> Any:
        places = [names.index(str(x.func)) for x in given]
        return tuple(things[places.index(k)] for k in range(len(names)))

    q, u = mechanism.q, mechanism.u
    return replace(
        mechanism,
        coordinates=sorted_by(model.coordinates, mechanism.coordinates, q),
        kinematics=sorted_by(model.coordinates, mechanism.kinematics, q),
        speeds=sorted_by(model.speeds, mechanism.speeds, u),
    )


def own(given: Posed) -> Iterator[Run]:
    """mechc's runs."""
    names = list(given.exact)
    for method in given.methods:
        for rtol in TOLERANCES:

            def columns(rtol: float = rtol, method: str = method) -> Array:
                sol = given.run(
                    given.y0, given.params, rtol=rtol, method=method, sensitivities=names
                )
                return np.column_stack([sol.sensitivity[name][-1] for name in names])

            def gradient(rtol: float = rtol, method: str = method) -> Array:
                sol = given.run(given.y0, given.params, rtol=rtol, method=method)
                found = sol.gradient(end=given.model.coordinates[0], by=names)
                return np.array([found[name] for name in names])

            yield Run(f"mechc {method}", "forwards", rtol, columns)
            yield Run(f"mechc {method}", "backwards", rtol, gradient)


def error_of(run: Run, exact: Mapping[str, Array]) -> float:
    """The largest error of a derivative over the size of its column; inf of a run that gave up."""
    found = run.run()
    if found is None:
        return np.inf
    return max(
        float(np.abs(found[..., k] - (x if found.ndim == 2 else x[0])).max() / np.abs(x).max())
        for k, x in enumerate(exact.values())
    )
