"""Linear models of a mechanism about a state on its constraints."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechc.analysis.constraint_rank import redundant_rows
from mechc.errors import ChangePointError, MechcError, UnknownNameError
from mechc.sensitivities.columns import Columns, default_slopes, with_defaults
from mechc.sensitivities.start import fill_in, without_closure
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
    by_input : (nq + nu, m)
        Map independent states and inputs to all coordinates and speeds, ``dy = to_state dx +
        by_input dr``: where an input stands in a constraint, the dependent ones move with it.
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
    by_input: Array

    def __iter__(self) -> Iterator[Array]:
        return iter((self.A, self.B, self.C, self.D))


def linearize(
    system: System,
    state: Array,
    values: Array,
    t: float,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...] | None,
    independent: Sequence[str] | None,
    held: Collection[str],
) -> Linearization:
    """The linear model about a state on the constraints: see :meth:`mechc.Model.linearize`."""
    by_parameters = any(_is_parameter(system, name) for name in inputs)
    wider = system.including("state_jacobian", *["parameter_jacobian"] * by_parameters)
    system, values = wider, wider.values_of(system, values)
    names = (*system.coordinates, *system.speeds)
    free = _independent(system, state, values, t, independent)
    columns = _columns(system, [names[i] for i in free], inputs, values, held)
    moved = _moved(system, columns, free, state, values, t)
    at, size = (state, values, t), len(free)
    rates = _along(columns, moved, system.jacobian("state", *at), system, "", *at)[free]
    chosen = names if outputs is None else outputs
    told = np.array([_output_row(system, columns, moved, name, *at) for name in chosen])
    told = told.reshape(len(chosen), columns.count)
    return Linearization(
        A=rates[:, :size],
        B=rates[:, size:],
        C=told[:, :size],
        D=told[:, size:],
        states=tuple(names[i] for i in free),
        inputs=inputs,
        outputs=chosen,
        t=float(t),
        y=state,
        rates=system.rates(state, values, t),
        to_state=moved[:, :size],
        by_input=moved[:, size:],
    )


def _is_parameter(system: System, name: str) -> bool:
    """Whether an input of the linear model is a parameter, not a value of an input of the model."""
    if name in system.input_values:
        return False
    if name not in system.parameters:
        raise UnknownNameError(
            "input or parameter", name, (*system.input_values, *system.parameters)
        )
    return True


def _columns(
    system: System, states: Sequence[str], inputs: Sequence[str], values: Array,
    held: Collection[str],
) -> Columns:  # fmt: skip
    """The directions of the states, along which no parameter changes, and then of the inputs."""
    count = len(states) + len(inputs)
    along = np.zeros((len(system.parameters), count))
    pushed = np.zeros((len(system.input_values), count))
    for k, name in enumerate(inputs, len(states)):
        if _is_parameter(system, name):
            along[system.parameters.index(name), k] = 1.0
        else:
            pushed[system.input_values.index(name), k] = 1.0
    along = with_defaults(along, default_slopes(system, values, held))
    names = (*states, *inputs)
    return Columns(names, {name: k for k, name in enumerate(names)}, along, pushed)


def _moved(
    system: System, columns: Columns, free: Places, y: Array, values: Array, t: float
) -> Array:
    """How all coordinates and speeds move along the columns (nq + nu, n + m): the independent ones
    with those that are theirs, the others so that constraints hold."""
    found = np.zeros((len(y), columns.count))
    found[free, np.arange(len(free))] = 1.0
    notes = fill_in(system, columns, [*free], found, y, values, t)
    notes += without_closure(system, columns, found, y, values, t)
    if notes:
        raise MechcError(f"there is no linear model {notes[0].replace(': none, for', ', for')}")
    return found


def _along(
    columns: Columns, moved: Array, by_state: Array, system: System, of: str, y: Array,
    values: Array, t: float,
) -> Array:  # fmt: skip
    """The change of rates, or of outputs of one's own, along the columns."""
    names = f"{of}parameter_jacobian", f"{of}input_jacobian"
    directly = columns.at_state(system, *names, y, values, t)
    through_state = by_state @ moved
    return np.asarray(through_state if directly is None else through_state + directly)


def _output_row(
    system: System, columns: Columns, moved: Array, name: str, y: Array, values: Array, t: float
) -> Array:
    """The change of one output along the columns."""
    names, name = (*system.coordinates, *system.speeds), name_of(name)
    if name in names:
        return np.asarray(moved[names.index(name)])
    own = system.data["own"]
    if name not in own:
        raise UnknownNameError("coordinate, speed or user-defined output", name, [*names, *own])
    by_state = system.evaluate("own_state_jacobian", y, values, t)
    return np.asarray(
        _along(columns, moved, by_state, system, "own_", y, values, t)[own.index(name)]
    )


# -- directions along the constraints -----------------------------------------------------------


def _independent(
    system: System, y: Array, values: Array, t: float, independent: Sequence[str] | None
) -> Places:
    """The places of independent coordinates and speeds, which determine the others."""
    nq, nu = len(system.coordinates), len(system.speeds)
    rows = system.constraint_jacobian(y, values, t)
    if not len(rows):
        size = nq + nu
        chosen = list(range(size)) if independent is None else _places(system, independent)
        if sorted(chosen) != list(range(size)):
            raise ValueError(
                f"without constraints all {size} coordinates and speeds are independent"
            )
        return np.array(chosen, dtype=np.intp)
    wanted = None if independent is None else _places(system, independent)
    of_q = None if wanted is None else [i for i in wanted if i < nq]
    of_u = None if wanted is None else [i - nq for i in wanted if i >= nq]
    _refuse_change_point(system, rows, values, t)
    free_q = _free(system.constraint_gradient(y, values, t), of_q, system.coordinates)
    return np.concatenate([free_q, nq + _free(rows, of_u, system.speeds)])


def _places(system: System, independent: Sequence[str]) -> list[int]:
    return [system.state_index(name) for name in independent]


def _free(rows: Array, wanted: list[int] | None, names: tuple[str, ...]) -> Places:
    """The columns that are free to choose: those wanted, which must determine the others."""
    offered = least_tied(scaled_rows(rows))
    free = offered if wanted is None else np.array(wanted, dtype=np.intp)
    rank = rows.shape[1] - len(offered)
    if len(free) != len(offered) or _rank(_without(rows, free)) < rank:
        raise ValueError(
            f"{len(offered)} of {', '.join(names)} are independent here, for instance "
            f"{', '.join(names[i] for i in offered) or 'none'}; not "
            f"{', '.join(names[i] for i in free) or 'none'}"
        )
    return free


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
    return np.delete(rows, columns, axis=1)


def _refuse_change_point(system: System, rows: Array, values: Array, t: float) -> None:
    """Refuse a state where rows are dependent that are independent elsewhere."""
    lost = len(rows) - _rank(rows)
    if lost and lost > len(redundant_rows(system, values, t)):
        raise ChangePointError(
            "the constraints lose rank at this state: it is a change point, where branches of the "
            "configuration cross and no unique linear model exists, or the mechanism is folded "
            "onto itself; linearize near it",
            None,
        )
