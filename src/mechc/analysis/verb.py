"""The verbs of a model that analyse it without a run: equilibria, ranges, ranks, linear models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mechc.assembly.initial_values import checked_numbers
from mechc.assembly.verb import ONE_SET, checked_names
from mechc.errors import AssemblyError, UnknownNameError
from mechc.simulation.initialise import state_as_given
from mechc.system.names import name_of, names_of
from mechc.system.parameters import Array, Parameters, one_double
from mechc.system.units import SECONDS

if TYPE_CHECKING:
    from mechc.analysis.constraint_rank import Redundancy
    from mechc.analysis.equilibria import Equilibria
    from mechc.analysis.linearize import Linearization
    from mechc.analysis.position_sweep import PositionSweep
    from mechc.outputs import Outputs


def equilibria(
    model: Outputs, params: Parameters = None, t: float = 0.0, *, most_starts: int | None = None
) -> Equilibria:
    """Equilibria under the loads at time t, the stable ones first.

    Found by Newton's method for the balance of forces, from points spread over the
    configurations that close the loops; angles in (-pi, pi].  Searches go on until less than
    half an equilibrium more is to be expected from how often each was found.  Whether one is
    stable is decided by the eigenvalues of the linear model about it.  Of those along a line or
    surface there is one, whose ``free`` names the coordinates that change along it.

    Parameters
    ----------
    most_starts
        The most searches, where so many do not settle it; by default up to 8192, fewer for
        many speeds.

    Returns
    -------
    Equilibria
        A tuple; ``searches``, ``expected`` and ``unexplored`` say how likely it has all.

    Raises
    ------
    AssemblyError
        If no closed configuration was found.
    MechcError
        If no equilibrium was found, the model has states besides coordinates and speeds, or how
        an input depends on the state is not known (a function of Python).
    UnavailableOutputError
        If the derivatives were not compiled and cannot be: the description is not at hand.
    """
    from mechc.analysis.equilibria import equilibria

    time = one_double(t, "the time", SECONDS)
    return equilibria(model.system, model._one_set(params, ONE_SET), time, most_starts)


def sweep_positions(
    model: Outputs,
    driven: Any,
    values: Array,
    coordinates: Mapping[str, float] | None = None,
    guess: Mapping[str, float] | None = None,
    params: Parameters = None,
    t: float = 0.0,
) -> PositionSweep:
    """One assembly, followed through a range of a driven coordinate: position analysis.

    Parameters
    ----------
    driven
        The coordinate that is driven, by name or symbol.
    values : (nt,)
        Its values (rad, m), rising or falling.
    coordinates, guess
        As in :meth:`assemble`, for the first value: other coordinates that stay as they are,
        and coordinates near the assembly wanted.
    params
        A mapping of some parameters or an array of all, of any leading shape (...): each set is
        followed by itself.
    t
        The time in s, for constraints that depend on it.

    Returns
    -------
    PositionSweep
        ``q`` and velocity ratios (..., nt, nq), ``points``, change points passed, and where the
        assembly ends.  Angles are continuous from the first configuration on.

    Raises
    ------
    AssemblyError
        If nothing is found that closes the loops at the first value, if it is a change point,
        or if the coordinates given do not determine the others.  Of several sets of parameters
        those that do not close have NaN.
    UnknownNameError, ValueOutOfBoundsError
        For a name that does not exist, and for values that do not rise or fall.

    Notes
    -----
    Newton's method, with steps halved until the tangent turns little in them.  Through a change
    point the curve goes straight on; where it turns back or aside beside one, it is followed if
    the gap between the branches is more than about 1e-12 of the lengths.
    """
    from mechc.analysis.position_sweep import sweep_positions

    name: str = name_of(driven)
    if name not in model.coordinates:
        raise UnknownNameError("coordinate", name, model.coordinates)
    given, _, near = checked_names(model, coordinates, None, guess)
    kept = checked_numbers(model, given, model.coordinates, "coordinate")
    close_by = checked_numbers(model, near, model.coordinates, "coordinate")
    if both := sorted({name, *kept} & {*close_by} | {name} & {*kept}):
        raise AssemblyError(f"{both[0]} is given twice: drive it, give it or guess it")
    p = model._for_closing(params)
    return sweep_positions(
        model.system, name, values, kept, close_by, p, one_double(t, "the time", SECONDS)
    )


def limits(
    model: Outputs, coordinate: str, params: Parameters = None
) -> tuple[tuple[float, float], ...]:
    """The ranges of a coordinate in (-pi, pi] or +-2 lengths for which the loops close.

    Each as (lower, upper), found by a scan in steps of two degrees and bisection to rounding;
    the whole circle is ``((-pi, pi),)``.

    Raises
    ------
    UnknownNameError
        If there is no such coordinate.
    """
    from mechc.analysis.equilibria import limits

    return limits(model.system, name_of(coordinate), model._one_set_for_closing(params, ONE_SET))


def redundant_constraints(
    model: Outputs, params: Parameters = None, t: float = 0.0
) -> tuple[Redundancy, ...]:
    """Rows that are redundant on every closed configuration, in the order of the constraints.

    Found by the rank of J at closed configurations spread over the whole range of the
    coordinates, each row against those before it.  Rows that depend on each other at a change
    point only are not among them.  Constraints of cut joints that always hold, which are no
    rows of the model, come last.

    Raises
    ------
    AssemblyError
        If no closed configuration is found.
    """
    from mechc.analysis.constraint_rank import redundant_constraints

    p = model._one_set_for_closing(params, ONE_SET)
    return redundant_constraints(model.system, p, one_double(t, "the time", SECONDS))


def linearize(
    model: Outputs,
    y: Array,
    params: Parameters = None,
    *,
    t: float = 0.0,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
    independent: Sequence[str] | None = None,
) -> Linearization:
    """The linear model about a state on the constraints, an equilibrium or on a trajectory.

    The directions along the constraints are spanned by independent coordinates and speeds; the
    others follow (Peterson, Gede and Hubbard 2014, Multibody System Dynamics 33,
    with the dependent ones found by pivoting).  Derivatives are those of compiled code, exact.

    With an input or parameter that stands in a constraint the dependent coordinates and speeds
    move, so that the constraints hold, and the independent ones stay: B and D contain that.

    Parameters
    ----------
    y : (nq + nu,)
        A state on the constraints (refused with the gap otherwise).
    params
        As in all outputs; missing ones have their defaults.
    t
        Time, if the equations contain it.
    inputs
        The inputs r: names of ``model.input_values`` (inputs given with a run, each derivative
        separately), or parameters: a torque, a force, a length.  Parameters whose defaults
        follow one of them move with it, unless ``params`` gives them.
    outputs
        Coordinates, speeds and user-defined outputs; by default all coordinates and speeds.
    independent
        Coordinates and speeds that become the states; by default chosen by pivoting.

    Raises
    ------
    UnavailableOutputError
        If the derivatives were not compiled and cannot be: the description is not at hand.
    ChangePointError
        At a change point, where branches cross and no unique linear model exists.
    UnknownNameError, AssemblyError, ValueError
        For unknown names, a state off the constraints, and ``independent`` that are not so.
    MechcError
        If the constraints are redundant and do not hold with another value of an input.
    """
    from mechc.analysis.linearize import linearize
    from mechc.sensitivities.columns import held_by

    p = model._one_set(params, ONE_SET)
    t = one_double(t, "the time", SECONDS)
    state = state_as_given(model.system, y, p, t)
    chosen = None if outputs is None else tuple(names_of(outputs))
    kept = None if independent is None else names_of(independent)
    held = held_by(model.system, params)
    return linearize(model.system, state, p, t, tuple(names_of(inputs)), chosen, kept, held)
