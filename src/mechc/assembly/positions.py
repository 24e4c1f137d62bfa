"""Initial configurations that close the loops, with speeds that keep them closed."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from mechc.assembly import sheets
from mechc.assembly.closer import SAME, Search, closing_rows, even_points, search_of
from mechc.assembly.directions import TURN, are_turned, at_rest, turned_in_words
from mechc.assembly.sizes import gap_in_words, is_open, sizes
from mechc.assembly.speeds import in_words, only_branch, with_speeds
from mechc.errors import AssemblyError
from mechc.system.attitudes import DECIMALS
from mechc.system.parameters import Array
from mechc.system.system import System

MOST = 4096  # configurations kept of one search
NEWTON, ROUNDING, DEPENDENT = 12, 1e-15, 1e-9  # steps to length one, what is left, singular values
STARTS = 64  # of the search for the rank that the constraints have elsewhere
Values = Mapping[str, float]  # name -> number


def assemble(
    system: System,
    coordinates: Values,
    speeds: Values,
    near: Values,
    p: Array,
    t: float = 0.0,
) -> Array:
    """One state (nq + nu,) that closes the loops to rounding; see :meth:`mechc.Model.assemble`.

    ``near``: a guess: coordinates near the configuration wanted, and speeds near those of a branch.
    """
    pace = {name: value for name, value in near.items() if name in system.speeds}
    close_by = {name: near[name] for name in near if name not in pace} if pace else near
    close_by = with_attitudes(system, coordinates, close_by)
    found = _configurations(system, coordinates, p, close_by, t)
    exact = {*coordinates, *close_by} >= {*system.coordinates}
    states = with_speeds(
        system, found[:1], coordinates, speeds, p, t,
        None if exact
        else lambda: sheets.first_regular(system, found, p, t, rank_elsewhere(system, p, t)),
    )  # fmt: skip
    return only_branch(system, states, speeds, pace)


def with_attitudes(system: System, coordinates: Collection[str], near: Values) -> Values:
    """A guess, and one for the quaternions of loops of which no component is given or guessed."""
    if not system.scene.holonomic:
        return near
    given = (*coordinates, *near)
    known = {system.state_index(name) for name in given}
    free = [i for places in system.attitudes.quaternions if not known & {*places} for i in places]
    unturned = system.default_configurations(1, given)[0]
    return {**{system.coordinates[i]: float(unturned[i]) for i in free}, **near}


def assemblies(
    system: System, coordinates: Values, speeds: Values, p: Array, t: float = 0.0
) -> Array:
    """The states (n, nq + nu) that close the loops with the coordinates given."""
    found = _configurations(system, coordinates, p, {}, t, all=True)
    if system.attitudes.within(system.unknowns([system.state_index(n) for n in coordinates])):
        found = _distinct(system.attitudes.one_of_two(found), SAME * reach(system, p))
    return with_speeds(
        system, found, coordinates, speeds, p, t,
        lambda: sheets.without_collapsed(system, found, p, t, rank_elsewhere(system, p, t)),
    )  # fmt: skip


def _distinct(q: Array, same: Array) -> Array:
    """Configurations (n, nq) without those within distances ``same`` (nq,) of one before."""
    alike = (np.abs(q[:, None] - q) <= same).all(axis=2)
    return np.asarray(q[~np.tril(alike, -1).any(axis=1)])


def _configurations(
    system: System, given: Values, p: Array, near: Values, t: float, **options: Any
) -> Array:
    """Configurations found (n, nq): the nearest to the guess first, or the preferred one."""
    fixed = system.default_configurations(1, (*near, *given))
    for values in (near, given):
        for name, value in values.items():
            fixed[0, system.state_index(name)] = value
    kept = [system.state_index(name) for name in given]
    search = search_for(system, tuple(given), tuple(near))
    whole = search is None or {*near, *given} >= {*system.coordinates}
    if whole and are_closed(system, fixed, p, t)[0]:  # already
        system.attitudes.check(fixed)
        return system.attitudes.scale(fixed, kept)
    if search is None:
        raise AssemblyError(
            f"the coordinates given {_fault(system, fixed[0], p, t)}; give fewer of them and let "
            "the others be solved for"
        )
    done = search.solve(t, fixed, p[None], MOST, **options)
    many = int(done.many[0])
    if not many:
        raise AssemblyError(miss_message(system, given, near, done.open[0], p, t))
    if many > MOST and not near:
        raise AssemblyError(f"there are over {MOST} assemblies: give more coordinates, or a guess")
    found = with_lengths_one(system, np.asarray(done.found[0, :many]), kept, p, t)
    system.attitudes.check(found)
    return system.attitudes.scale(found, kept)


def with_lengths_one(system: System, q: Array, kept: Collection[int], p: Array, t: float) -> Array:
    """Closed configurations (n, nq) with the quaternions whose length has to be one brought to it,
    by Newton's method with a row for each: the search for closed loops changes lengths.

    Kept coordinates stay, but for components that were rounded; so does what does not converge.
    """
    places = np.array(system.attitudes.of_length_one, dtype=np.intp)
    if not len(places):
        return q
    q, rows = q.copy(), np.broadcast_to(p, (len(q), p.shape[-1]))
    rounded = np.abs(np.linalg.norm(q[:, places], axis=2) - 1.0).max(axis=1) <= DECIMALS
    movable = np.zeros(q.shape)
    movable[:, system.unknowns([*kept])] = 1.0
    movable[np.ix_(rounded, places.ravel())] = 1.0
    every = np.arange(len(places))[:, None]
    before, left = q.copy(), np.arange(len(q))
    for _ in range(NEWTON):
        parts = q[left][:, places]
        far = (np.square(parts).sum(axis=2) - 1.0) / 2.0
        open_ones = (np.abs(far) > ROUNDING).any(axis=1)
        left, parts, far = left[open_ones], parts[open_ones], far[open_ones]
        if not len(left):
            break
        slopes = np.zeros((*far.shape, q.shape[1]))
        slopes[:, every, places] = parts
        at = at_rest(system, q[left]), rows[left], t
        slopes = np.concatenate([system.constraint_gradient(*at), slopes], axis=1)
        gap = np.concatenate([system.constraints(*at)[:, : system.scene.holonomic], far], axis=1)
        back = np.linalg.pinv(slopes * movable[left, None], rcond=DEPENDENT)
        q[left] -= movable[left] * (back @ gap[..., None])[..., 0]
    q[left] = before[left]
    return q


def search_for(system: System, given: tuple[str, ...], near: tuple[str, ...]) -> Search | None:
    """The search with these coordinates given and guessed; None where none is to be solved for.

    Raises :class:`AssemblyError` if constraints leave a choice that no guess makes.
    """
    known: Search | None = system.cache.get((given, near))
    if known is not None:
        return known
    free = system.unknowns([system.state_index(name) for name in given])
    if not free or not system.scene.holonomic:
        return None
    excess = len(free) - closing_rows(system, free)
    if excess > 0 and not near:
        names = ", ".join(system.coordinates[i] for i in free)
        raise AssemblyError(
            f"{system.scene.holonomic} constraints do not determine {names}: give {excess} more "
            "of them, or a guess"
        )
    found = search_of(system, free, [system.state_index(name) for name in near])
    system.cache[given, near] = found
    return found


def reach(system: System, p: Array) -> Array:
    """The range of a search in every coordinate (nq,): half a turn, 1 or the mechanism's length."""
    width = len(system.coordinates)
    away = np.where(system.dimensionless[:width], 1.0, sizes(system, p).length)
    return np.where(system.angular[:width], np.pi, away)


def closed_states(system: System, starts: Array, p: Array, t: float) -> Array:
    """States (n, nq + nu) at rest that close the loops, searched from starts within -1 ... 1.

    Raises :class:`AssemblyError` if there are none.
    """
    movable = len(system.coordinates) - len(system.states)
    closed = starts * reach(system, p)
    if system.scene.holonomic:
        every = search_of(system, system.unknowns([]), starts=starts[:, :movable])
        found = every.solve(t, system.default_coordinates[None], p[None], len(starts), all=True)
        if not found.many[0]:
            raise AssemblyError(miss_message(system, {}, {}, found.open[0], p, t))
        closed = system.attitudes.scale(found.found[0, : found.many[0]])
    return at_rest(system, closed)


def rank_elsewhere(system: System, p: Array, t: float) -> int:
    """The rank of the constraints where loops close from starts spread over all; 0: nowhere."""
    key = ("rank", p.tobytes(), t)
    known: int | None = system.cache.get(key)
    if known is None:
        width = len(system.coordinates)
        try:
            y = closed_states(system, even_points(STARTS, width), p, t)
            known = sheets.highest(system, sheets.ranks_at(system, y[:, :width], p, t))
        except AssemblyError:
            known = 0
        system.cache[key] = known
    return known


def gaps(system: System, q: Array, p: Array, t: float) -> Array:
    """The configuration constraints (n, nh) at configurations (n, nq)."""
    return system.constraints(at_rest(system, q), p, t)


def are_closed(system: System, q: Array, p: Array, t: float) -> Array:
    """Whether the loops close at configurations (n, nq), with parameters (np,) or (n, np)."""
    rows = np.broadcast_to(p, (len(q), p.shape[-1]))
    opened = [is_open(system, *each, t) for each in zip(gaps(system, q, p, t), rows, strict=True)]
    return np.asarray(~(np.array(opened, bool) | are_turned(system, at_rest(system, q), p, t)))


def _fault(system: System, q: Array, p: Array, t: float) -> str:
    y = at_rest(system, q[None])[0]
    gap = system.constraints(y, p, t)
    if is_open(system, gap, p, t):
        return f"leave {gap_in_words(system, gap, p, t)}"
    return f"leave {turned_in_words(system, y, p, t)}"


def miss_message(system: System, given: Values, near: Values, q: Array, p: Array, t: float) -> str:
    """The message that no configuration closes the loops; q (nq,) has the least gap."""
    at = ", ".join(in_words(system.quantities[name], value) for name, value in given.items())
    where = f" at {at}" if at else ""
    if not np.isfinite(q).all():
        return f"no configuration closes the loops{where}: the constraints there are no numbers"
    y = at_rest(system, q[None])[0]
    gap = system.constraints(y, p, t)
    if are_turned(system, y, p, t) and not is_open(system, gap, p, t):
        met = turned_in_words(system, y, p, t)
        return f"no configuration was found{where}, but for {met}; {TURN}"
    least = f"is {np.linalg.norm(gap):.6g} m"
    if system.gap_unit != "m":
        least = f"leaves {gap_in_words(system, gap, p, t)} instead of 0"
    guess = "the guess" if near else "give a guess near what is wanted (guess={...})"
    return (
        f"no configuration was found that closes the loops{where}: the least gap met {least}. "
        f"Change the lengths, the coordinates given, or {guess}"
    )
