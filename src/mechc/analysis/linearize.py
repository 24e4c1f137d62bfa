"""Linear models of a mechanism about a state on its constraints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechc.analysis.constraint_rank import redundant_constraints
from mechc.errors import ChangePointError, UnknownNameError
from mechc.system.names import name_of
from mechc.system.parameters import Array
from mechc.system.system import System

Places = NDArray[np.intp]
DEPENDENT = 1e-9  # of the largest pivot: a row with a smaller one is dependent


@dataclass(frozen=True)
class Linearization:
    """``dx' = A dx + B dr``, ``dy = C dx + D dr`` about a state on the constraints.

    Unpacks to ``A, B, C, D``: ``control.ss(*lin)``, ``scipy.signal.StateSpace(*lin)``.

    Attributes
    ----------
    A, B, C, D : (n, n), (n, m), (p, n), (p, m)
        n states, m inputs, p outputs.
    states, inputs, outputs
        Their names: the states are the independent coordinates and speeds.
    t, y, rates
        Time, state (nq + nu,) and its rates there; these vanish at an equilibrium, elsewhere the
        model describes the deviation from the motion, at this instant.
    to_state : (nq + nu, n)
        Maps the independent states to all, ``dy = to_state dx``.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    t: float
    y: Array
    rates: Array
    to_state: Array

    def __iter__(self) -> Iterator[Array]:
        return iter((self.A, self.B, self.C, self.D))


class _Tangent(NamedTuple):
    """Directions (nq + nu, n) along the constraints, and the components where they are unit."""

    directions: Array
    independent: Places


def linearize(
    system: System,
    state: Array,
    values: Array,
    t: float,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...] | None,
    independent: Sequence[str] | None,
) -> Linearization:
    """The linear model about a state on the constraints: see :meth:`mechc.Model.linearize`."""
    by = {"state", *(_input(system, name)[0] for name in inputs)} - {"input"}
    system = system.including(*(f"{one}_jacobian" for one in by))
    by_state = system.jacobian("state", state, values, t)
    tangent = _tangent(system, state, values, t, independent)
    names = (*system.coordinates, *system.speeds)
    chosen = names if outputs is None else outputs
    by_input = _by_inputs(system, state, values, t, inputs)
    told = [_output_rows(system, name, state, values, t, inputs) for name in chosen]
    of_state = np.array([row for row, _ in told]).reshape(-1, len(names))
    feedthrough = np.array([row for _, row in told]).reshape(len(chosen), len(inputs))
    return Linearization(
        A=by_state[tangent.independent] @ tangent.directions,
        B=by_input[tangent.independent],
        C=of_state @ tangent.directions,
        D=feedthrough,
        states=tuple(names[i] for i in tangent.independent),
        inputs=inputs,
        outputs=chosen,
        t=float(t),
        y=state,
        rates=system.rates(state, values, t),
        to_state=tangent.directions,
    )


def _by_inputs(
    system: System,
    y: Array,
    values: Array,
    t: float,
    inputs: tuple[str, ...],
    of: str | None = None,
) -> Array:
    """Derivatives by the inputs, (nq + nu, m); of a user-defined output (m,)."""
    columns = [np.zeros((len(y), 0) if of is None else 0)]
    for name in inputs:
        by, place = _input(system, name)
        columns.append(system.jacobian(by, y, values, t, of)[..., place, None])
    return np.concatenate(columns, axis=-1)


def _input(system: System, name: str) -> tuple[str, int]:
    """The array of derivatives that has those by an input, and its column there."""
    given, name = system.input_values, name_of(name)
    if name in given:
        return "input", given.index(name)
    if name not in system.parameters:
        raise UnknownNameError("input or parameter", name, (*given, *system.parameters))
    return "parameter", system.parameters.index(name)


def _output_rows(
    system: System, name: str, y: Array, values: Array, t: float, inputs: tuple[str, ...]
) -> tuple[Array, Array]:
    """Derivatives of one output by the state and by the inputs."""
    names, name = (*system.coordinates, *system.speeds), name_of(name)
    if name in names:
        return np.eye(len(names))[names.index(name)], np.zeros(len(inputs))
    own = system.data["own"]
    if name not in own:
        raise UnknownNameError("coordinate, speed or user-defined output", name, [*names, *own])
    return system.jacobian("state", y, values, t, name), _by_inputs(
        system, y, values, t, inputs, name
    )


# -- directions along the constraints -----------------------------------------------------------


def _tangent(
    system: System, y: Array, values: Array, t: float, independent: Sequence[str] | None
) -> _Tangent:
    """G dq = 0 and J du + d(J u + b)/dq dq = 0, with independent ones as parameters."""
    nq, nu = len(system.coordinates), len(system.speeds)
    rows = system.constraint_jacobian(y, values, t)
    if not len(rows):
        size = nq + nu
        chosen = list(range(size)) if independent is None else _places(system, independent)
        if sorted(chosen) != list(range(size)):
            raise ValueError(
                f"without constraints all {size} coordinates and speeds are independent"
            )
        return _Tangent(np.eye(size)[:, chosen], np.array(chosen))
    wanted = None if independent is None else _places(system, independent)
    of_q = None if wanted is None else [i for i in wanted if i < nq]
    of_u = None if wanted is None else [i - nq for i in wanted if i >= nq]
    _refuse_change_point(system, rows, values, t)
    q, free_q = _kernel(system.constraint_gradient(y, values, t), of_q, system.coordinates)
    u, free_u = _kernel(rows, of_u, system.speeds)
    pushed = system.evaluate("velocity_gradient", y, values, t) @ q
    follow = -np.linalg.lstsq(_without(rows, free_u), pushed, rcond=DEPENDENT)[0]
    directions = np.zeros((nq + nu, len(free_q) + len(free_u)))
    directions[:nq, : len(free_q)] = q
    directions[nq + _others(nu, free_u), : len(free_q)] = follow
    directions[nq:, len(free_q) :] = u
    return _Tangent(directions, np.concatenate([free_q, nq + free_u]))


def _places(system: System, independent: Sequence[str]) -> list[int]:
    return [system.state_index(name) for name in independent]


def _kernel(rows: Array, wanted: list[int] | None, names: tuple[str, ...]) -> tuple[Array, Places]:
    """A basis of the rows' null space, unit in independent columns, and these columns."""
    width = rows.shape[1]
    offered = least_tied(scaled_rows(rows))
    free = offered if wanted is None else np.array(wanted, dtype=np.intp)
    rank = width - len(offered)
    if len(free) != len(offered) or _rank(_without(rows, free)) < rank:
        raise ValueError(
            f"{len(offered)} of {', '.join(names)} are independent here, for instance "
            f"{', '.join(names[i] for i in offered) or 'none'}; not "
            f"{', '.join(names[i] for i in free) or 'none'}"
        )
    basis = np.zeros((width, len(free)))
    basis[free, np.arange(len(free))] = 1.0
    dependent = _others(width, free)
    follow = np.linalg.lstsq(rows[:, dependent], rows[:, free], rcond=DEPENDENT)[0]
    basis[dependent] = -follow
    return basis, free


def least_tied(rows: Array) -> Places:
    """The columns that pivoting of the rows does not choose."""
    from scipy.linalg import qr  # slow to import

    if not len(rows):
        return np.arange(rows.shape[1])
    _, upper, pivots = qr(rows, pivoting=True)
    diagonal = np.abs(np.diag(upper))
    rank = int((diagonal > DEPENDENT * diagonal[0]).sum())
    return np.sort(pivots[rank:]).astype(np.intp)


def scaled_rows(rows: Array) -> Array:
    """Rows divided by their largest entries; those negligible against the others stay so."""
    largest = np.abs(rows).max(axis=1, initial=0.0, keepdims=True)
    whole = float(largest.max(initial=0.0)) or 1.0
    return np.asarray(rows / np.where(largest > DEPENDENT * whole, largest, whole))


def _rank(rows: Array) -> int:
    return int(np.linalg.matrix_rank(scaled_rows(rows), tol=DEPENDENT)) if rows.size else 0


def _without(rows: Array, columns: Places) -> Array:
    return rows[:, _others(rows.shape[1], columns)]


def _others(width: int, columns: Places) -> Places:
    return np.setdiff1d(np.arange(width), columns)


def _refuse_change_point(system: System, rows: Array, values: Array, t: float) -> None:
    """Refuse a state where rows are dependent that are independent elsewhere."""
    lost = len(rows) - _rank(rows)
    if lost and lost > len(redundant_constraints(system, values, t)):
        raise ChangePointError(
            "the constraints lose rank at this state: it is a change point, where branches of the "
            "configuration cross and no unique linear model exists, or the mechanism is folded "
            "onto itself; linearize near it",
            None,
        )
