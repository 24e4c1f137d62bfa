"""Derivatives of motions and of rates, beside differences."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...timing.cases import Array
from ..judge import Case, Difference, Fault, Run, Told, apart
from .motions import FINER

STEP = 1e-4  # of a difference, relative
FAR = 1e-5  # relative, of derivatives of motions with steps chosen for the motion, times the growth
FLAT = 1e-6  # step of differences of rates


def _names(case: Case, run: Run) -> list[str]:
    """Some parameters that do not stand in the constraints."""
    free = [n for n in case.model.parameters if run.params.get(n)]
    return _some(case, [n for n in free if n not in case.reference.closing_parameters], 2)


def _some(case: Case, names: list[str], most: int) -> list[str]:
    return [str(n) for n in case.rng.permutation(names)[:most]]


def _end(case: Case, run: Run, name: str, value: float) -> Array | None:
    params, y0 = dict(run.params), run.y0.copy()
    if name in params:
        params[name] = value
    else:
        y0[(*case.model.coordinates, *case.model.speeds).index(name)] = value
    sol = case.model.simulate(
        case.span, y0, params, rtol=FINER, method="dop853", dense=False, **case.more
    )
    return sol.y[-1] if sol.status.ok else None


def of_motions(case: Case) -> Iterator[Told]:
    """``sensitivities=`` and ``gradient``, beside central differences of two steps."""
    for run in case.whole[:1]:
        by = _names(case, run)
        if not case.reference.closes:
            by.append(str(case.rng.choice(list(run.numbers.start))))
        if not by:
            continue
        start = dict(run.numbers.start) if not case.reference.closes else run.y0
        sol = case.model.simulate(case.span, start, run.params, sensitivities=by, **case.more)
        if not sol.status.ok:
            yield Fault("sensitivities", f"{sol.status}; {run.numbers}")
            continue
        gradient = sol.gradient(end=case.model.coordinates[0], by=by)
        for name in by:
            found = sol.sensitivity[name][-1]
            value = run.params.get(name, run.numbers.start.get(name, 0.0))
            estimates = []
            for share in (STEP, STEP / 2):
                step = share * max(abs(value), 0.1)
                ends = [_end(case, run, name, value + sign * step) for sign in (1, -1)]
                if any(end is None for end in ends):
                    break
                estimates.append((ends[0] - ends[1]) / (2 * step))
            if len(estimates) < 2:
                continue
            coarse, fine = estimates
            size = apart(found[None], fine[None])
            limit = 10 * apart(coarse[None], fine[None]) + FAR * run.growth**2
            told = f"by {name}: {found}, differences {fine}; {run.numbers}"
            yield Difference("sensitivities", size, limit, told)
            one, scale = found[0], max(1.0, abs(float(found[0])))
            off = abs(float(gradient[name]) - float(one)) / scale
            yield Difference("gradient", off, 1e-7 * run.growth, f"by {name}: {gradient[name]!r}, "
                             f"forwards {one!r}; {run.numbers}")  # fmt: skip


def linear(case: Case) -> Iterator[Told]:
    """``linearize``: A and B beside differences of SymPy's rates along the constraints."""
    for run in case.whole[:2]:
        y, names = run.y0, (*case.model.coordinates, *case.model.speeds)
        by = _names(case, run)
        by += _some(case, sorted(case.reference.closing_parameters.intersection(run.params)), 1)
        found = case.model.linearize(y, run.params, inputs=by)
        rows = [names.index(n) for n in found.states]
        others = [case.order[k] for k in range(len(names)) if k not in rows]
        rates = partial(_independent, case, rows, others)
        for k, direction in enumerate(found.to_state.T):
            slopes = []
            for h in (FLAT, 2 * FLAT):
                ends = [rates(y + s * h * direction, run.params) for s in (1, -1)]
                slopes.append((ends[0] - ends[1]) / (2 * h))
            told = f"by {found.states[k]}; {run.numbers}"
            yield _slope("linearize: A", found.A[:, k], slopes, told)
        for k, name in enumerate(by):
            value, slopes = run.params[name], []
            for h in (FLAT, 2 * FLAT):
                ends = [rates(y, run.params | {name: value + s * h}) for s in (1, -1)]
                slopes.append((ends[0] - ends[1]) / (2 * h))
            yield _slope("linearize: B", found.B[:, k], slopes, f"by {name}; {run.numbers}")


def _independent(
    case: Case, rows: list[int], others: list[int], y: Array, params: dict[str, float]
) -> Array:
    """Rates of the independent states; the others follow from the constraints."""
    there = case.reference.closed(0.0, case.to_reference(y), params, others)
    found: Array = case.reference.rates(params)(0.0, there)[case.order][rows]
    return found


def _slope(door: str, found: Array, slopes: list[Array], told: str) -> Difference:
    fine, coarse = slopes
    size = float(np.abs(found - fine).max())
    limit = 10 * float(np.abs(fine - coarse).max()) + 1e-7 * (1 + float(np.abs(fine).max()))
    return Difference(door, size, limit, f"{found}, differences {fine} {told}")
