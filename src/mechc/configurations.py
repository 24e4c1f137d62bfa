"""Configurations of a compiled mechanism: the part of the face that closes loops."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mechc.assembly import positions
from mechc.assembly.initial_values import (
    checked_numbers,
    closed_freedoms,
    filled_start,
    guess_of_start,
)
from mechc.errors import AssemblyError, UnknownNameError
from mechc.outputs import Outputs
from mechc.system.names import by_name, name_of
from mechc.system.parameters import Array, Parameters, one_double
from mechc.system.units import SECONDS

if TYPE_CHECKING:
    from mechc.analysis.constraint_rank import Redundancy
    from mechc.analysis.equilibria import Equilibria
    from mechc.analysis.position_sweep import PositionSweep

ONE_SET = "takes one set of parameters at a time"


class Configurations(Outputs):
    """Outputs, and configurations that close the loops."""

    def assemble(
        self,
        coordinates: Mapping[str, float] | None = None,
        speeds: Mapping[str, float] | None = None,
        guess: Mapping[str, float] | None = None,
        params: Parameters = None,
        t: float = 0.0,
    ) -> Array:
        """One state that closes the loops to rounding.

        Parameters
        ----------
        coordinates
            Values to keep (rad, m); the other coordinates are solved for, as angles in (-pi, pi].
            By default those of the mechanism's start (``model.start``), with its speeds too as far
            as there are degrees of freedom besides ``speeds``.
        speeds
            Values to keep (rad/s, m/s); the others are made consistent, the least ones where the
            constraints leave a choice.
        guess
            Some coordinates near the configuration wanted; of several assemblies the nearest is
            taken, with angles within half a turn of the guess.  By default the mechanism's
            preferred one (the elbow-up configuration of a planar loop), or the one nearest to the
            start where none is preferred.  At a change point also some speeds, near those of the
            branch wanted.  Of a collapsed sheet, where the mechanism is folded onto itself and has
            more freedoms, a configuration is taken only if there is no other, with a
            :class:`CollapsedSheetWarning`, or if all coordinates are given or guessed.
        params
            As in every output of the model; those that stand in no constraint need no value.
        t
            The time in s, for constraints that depend on it.

        Returns
        -------
        y0 : (nq + nu,)

        Raises
        ------
        AssemblyError
            If nothing is found that closes the loops (with the least gap met), if the coordinates
            given do not determine the others and there is no guess, if the speeds contradict each
            other, or if the configuration is a change point and the speeds are possible on several
            branches.
        """
        given, pace, near = self._by_name(coordinates, speeds, guess)
        if coordinates is None:
            given, pace, near = filled_start(self.system, {}, pace, near)
        elif guess is None and len(given) >= closed_freedoms(self.system):
            near = guess_of_start(self.system, given)
        given, pace = self._checked_start(given, pace)
        near = checked_numbers(self, near, (*self.coordinates, *self.speeds), "coordinate")
        if both := sorted(set(near) & set(given)):
            raise AssemblyError(f"{both[0]} is both given and guessed; omit it in one of them")
        p = self._one_set_for_closing(params, f"assembly {ONE_SET}")
        return positions.assemble(
            self.system, given, pace, near, p, one_double(t, "the time", SECONDS)
        )

    def assemblies(
        self,
        coordinates: Mapping[str, float],
        speeds: Mapping[str, float] | None = None,
        params: Parameters = None,
        t: float = 0.0,
    ) -> Array:
        """The states (n, nq + nu) that close the loops with the coordinates given.

        The mechanism's preferred assembly comes first; at a change point there is one state for
        every branch on which the speeds are possible.  Configurations of a collapsed sheet, which
        are points of a continuum, are left out unless there are no others, with a
        :class:`CollapsedSheetWarning`.  Arguments and errors as in :meth:`assemble`.
        """
        given, pace, _ = self._by_name(coordinates, speeds, None)
        given, pace = self._checked_start(given, pace)
        p = self._one_set_for_closing(params, f"assembly {ONE_SET}")
        return positions.assemblies(self.system, given, pace, p, one_double(t, "the time", SECONDS))

    def _by_name(self, *given: Mapping[str, float] | None) -> list[Mapping[str, float]]:
        """Coordinates, speeds and guesses by name, each empty where there are none."""
        names = (self.coordinates, self.speeds, self.coordinates)
        examples = [f"{{{known[0]!r}: 0.5}}" if known else "{}" for known in names]
        kinds = ("coordinates", "speeds", "guesses")
        named: list[Mapping[str, float]] = [
            {} if values is None else by_name(values, kind, example)
            for values, kind, example in zip(given, kinds, examples, strict=True)
        ]
        for argument, values in zip(("coordinates", "speeds", "guess"), named, strict=True):
            self._refuse_elsewhere(argument, values)
        return named

    def _refuse_elsewhere(self, argument: str, values: Mapping[str, float]) -> None:
        """Names that belong to another argument: the error says which."""
        homes = {"coordinates": self.coordinates, "speeds": self.speeds, "params": self.parameters}
        known = homes.get(argument, (*self.coordinates, *self.speeds))
        for name in values:
            for home, names in homes.items():
                if name not in known and name in names:
                    raise UnknownNameError.misplaced(name, argument, home, values[name])

    def _checked_start(
        self, coordinates: Mapping[str, float], speeds: Mapping[str, float]
    ) -> tuple[dict[str, float], dict[str, float]]:
        return (
            checked_numbers(self, coordinates, self.coordinates, "coordinate"),
            checked_numbers(self, speeds, self.speeds, "speed"),
        )

    def equilibria(
        self, params: Parameters = None, t: float = 0.0, *, most_starts: int | None = None
    ) -> Equilibria:
        """Equilibria under the loads at time t, the stable ones first.

        Found by Newton's method for the balance of forces, from points spread over the
        configurations that close the loops; angles in (-pi, pi].  Searches go on until less than
        half an equilibrium more is to be expected from how often each was found.  Whether one is
        stable is decided by the eigenvalues of the linear model about it.

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
        return equilibria(self.system, self._one_set(params, ONE_SET), time, most_starts)

    def sweep_positions(
        self,
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
        if name not in self.coordinates:
            raise UnknownNameError("coordinate", name, self.coordinates)
        given, _, near = self._by_name(coordinates, None, guess)
        kept = checked_numbers(self, given, self.coordinates, "coordinate")
        close_by = checked_numbers(self, near, self.coordinates, "coordinate")
        if both := sorted({name, *kept} & {*close_by} | {name} & {*kept}):
            raise AssemblyError(f"{both[0]} is given twice: drive it, give it or guess it")
        p = self._for_closing(params)
        return sweep_positions(
            self.system, name, values, kept, close_by, p, one_double(t, "the time", SECONDS)
        )

    def limits(self, coordinate: str, params: Parameters = None) -> tuple[tuple[float, float], ...]:
        """The ranges of a coordinate in (-pi, pi] or +-2 lengths for which the loops close.

        Each as (lower, upper), found by a scan in steps of two degrees and bisection to rounding;
        the whole circle is ``((-pi, pi),)``.

        Raises
        ------
        UnknownNameError
            If there is no such coordinate.
        """
        from mechc.analysis.equilibria import limits

        return limits(self.system, name_of(coordinate), self._one_set_for_closing(params, ONE_SET))

    def _judge_reactions(
        self, system: Any, values: Mapping[str, Array], p: Array, t: Any, stacklevel: int
    ) -> None:
        if "cut_rows" in system.data:
            from mechc.analysis.shared_reactions import warn_of_undetermined

            warn_of_undetermined(system, values, p, t, stacklevel)

    def redundant_constraints(
        self, params: Parameters = None, t: float = 0.0
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

        p = self._one_set_for_closing(params, ONE_SET)
        return redundant_constraints(self.system, p, one_double(t, "the time", SECONDS))
