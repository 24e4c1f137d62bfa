"""A trajectory for users: displayed, drawn, saved, continued."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.analysis.shared_reactions import PARTS, warn_of_undetermined
from mechc.errors import MechcError, ValueOutOfBoundsError
from mechc.files import path_of
from mechc.progress import Notice
from mechc.simulation.record import Piece, Record
from mechc.simulation.simulate import continue_run
from mechc.simulation.trajectory import Trajectory
from mechc.system.names import name_of, names_of
from mechc.system.parameters import Array
from mechc.system.quantities import output_of

if TYPE_CHECKING:
    from mechc.results.check import Check
    from mechc.sensitivities.gradient import Gradient
    from mechc.sensitivities.history import Sensitivity
    from mechc.simulation.events.event import EventRecord
    from mechc.simulation.settings import Policy
    from mechc.simulation.status import Status
    from mechc.system.system import System


class Solution(Trajectory):
    """A trajectory, and the model that made it: what ``model.simulate`` and ``mechc.open`` return.

    Attributes
    ----------
    model
        The :class:`mechc.Model` that was simulated, driven by its inputs where it has some.
    params : (np,)
        Its parameters; those that its resets change as they are at the start.  ``params_at(t)``
        are those that hold at a time, ``segments`` have them for each smooth part.
    t : (nt,)
        Times in s: ``t_eval``, or the accepted steps.
    events
        An :class:`mechc.EventRecord` (times, states) for each event; ``event_titles`` has their
        expressions.
    y : (nt, nq + nu)
        States; ``q`` and ``u`` are its halves, ``sol["theta_0"]`` one component (nt,).
    """

    _sensitivity: Sensitivity | None = None
    _arguments: tuple[Any, Any] | None = None  # y0 and params, as they were given
    _recorded_view: Mapping[str, Any] | None = None  # of its file, for a model of unknown looks

    def __init__(
        self,
        model: Any,
        system: System,
        params: Array,
        policy: Policy,
        record: Record,
        outcome: Callable[[], tuple[Status, dict[str, Any]]],
        times: Array | None = None,
        events: tuple[EventRecord, ...] = (),
    ) -> None:
        self.model = model
        Trajectory.__init__(self, system, params, policy, record, outcome, times, events)

    def __copy__(self) -> Solution:
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        return other

    def __deepcopy__(self, memo: Any) -> Solution:
        """A copy of the solution with copies of its arrays; the run itself never changes."""
        other = copy(self)
        other.params = self.params.copy()
        for name in ("_history", "energy", "work", "closure", "velocity_closure"):
            other.__dict__.pop(name, None)
        return other

    def continue_to(
        self,
        t_end: float,
        *,
        max_steps: int | None = None,
        on_change_point: str | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Solution:
        """This motion and what follows it until ``t_end``, as one new Solution.

        Continues from the end of the run, whatever ended it, with the same method, tolerances
        and events (a terminal one counts from zero).  The states are the accepted steps, also if
        ``t_eval`` was given.

        Parameters
        ----------
        t_end
            In s, beyond the end of the run in its direction.
        max_steps, on_change_point, progress
            As in :meth:`mechc.Model.simulate`; those of this run when None.

        Raises
        ------
        ValueOutOfBoundsError
            If t_end is before the run's end.
        MechcError
            If the run was made with ``dense=False``, or with events and read from a file.
        """
        if not self.policy.dense:
            raise MechcError("this run kept no dense output: simulate with dense=True")
        return continue_run(
            self, t_end, partial(Solution, self.model),
            max_steps=max_steps, on_change_point=on_change_point, progress=progress,
        )  # fmt: skip

    def followed_by(self, after: Solution) -> Solution:
        """This motion and one that begins where it ends, with a jump between them, as one."""
        added = [
            Piece(piece.steps, piece.params, not k or piece.jumps, (), piece.contacts, piece.cut)
            for k, piece in enumerate(after.record.pieces)
        ]
        whole = copy(after)
        whole.params, whole.joined, whole.checked = self.params, True, None
        cached = ("_history", "span", "change_points", "energy", "work", "_conserves_energy")
        for name in (*cached, "closure", "velocity_closure"):
            whole.__dict__.pop(name, None)
        whole.record = Record([*self.record.pieces, *added])
        whole.record.share_params()
        return whole

    def output(self, name: Any, t: float | Array | None = None) -> Array:
        """An output of the model along this motion, (nt, ...), the output's shape after the times.

        While a contact lasts (``mechc.Stop``, ``mechc.DryFriction``), accelerations, multipliers
        and reactions are those of the motion in contact, with the contacts' forces;
        :meth:`mechc.Model.output` of a state alone knows of no contact.  A contact's force acts
        along the slopes of its gap and its slip over the speeds, which have no place on a body:
        reactions balance it as if the joints did.

        Parameters
        ----------
        name
            ``"energy"``, ``"rates"`` (y', with the accelerations), ``"multipliers"``,
            ``"reaction_forces"``, ``"points"``, an output of the user's own, a number of one,
            ``"reaction_torques[crank,z]"``, or what else :meth:`mechc.Model.output` takes.
        t
            Times (...) in s, where the run has dense output; by default ``sol.t``.

        Returns
        -------
        Array
            NaN for what contacts change in a solution that was read from a file: their laws are
            not kept in it.

        Raises
        ------
        UnknownNameError, UnavailableOutputError
            If there is no such output, or it was not requested and cannot be compiled now.
        ValueOutOfBoundsError
            For times the run did not reach.
        MechcError
            For the derivatives of a motion in which contacts last.
        """
        y = self.y if t is None else self(t)
        times = self.t if t is None else np.asarray(t, dtype=np.float64)
        name, every = name_of(name), times.reshape(-1)

        def along(whole: Any) -> Array:
            found = self.output_along(whole, every, y.reshape(-1, y.shape[-1]))
            if whole in PARTS and len(found):
                p = self.values_along(every)
                warn_of_undetermined(self.system, {whole: found}, p, times, stacklevel=5)
            return found

        found = output_of(self.system, name, along)
        return found.reshape((*times.shape, *found.shape[1:]))

    def check(self) -> Check:
        """Check this motion as a reviewer would, by two more runs at most.

        It is computed again at a hundredth of the tolerances, and by another method: differences
        are estimates of the errors, and change points and events are compared.  Closure and energy
        balance are looked at along the dense output; the rates of some states are compared
        with those that Newton's and Euler's equations give for the bodies, joints and loads of the
        description, evaluated with numbers alone.

        Returns
        -------
        Check
            ``print`` shows it as a table; ``check.ok`` is False where there are ``warnings``.
            ``sol.save`` keeps it, and ``mechc verify FILE`` repeats it.

        Raises
        ------
        MechcError
            For a run without dense output, one with events that was read from a file, and one that
            was joined of several (``followed_by``).
        """
        from mechc.results.check import check

        with Notice("checking the motion by two more runs ..."):
            found = self.checked = check(self, self.model.judge_rates)
        return found

    # -- derivatives ---------------------------------------------------------------------------

    def differentiate(self, names: Sequence[str], y0: Any, params: Any) -> Sensitivity:
        """Compute ``sensitivity`` by these names; y0 and params as ``simulate`` was given them."""
        from mechc.sensitivities.run import sensitivity_of_run

        self._sensitivity = sensitivity_of_run(self, names, y0, params)
        return self._sensitivity

    def differentiated_within_tolerance(
        self, names: Sequence[str], again: Callable[[Policy], Solution]
    ) -> Solution:
        """This motion by steps for ``sensitivity`` by these names too; ``again`` computes it."""
        from mechc.sensitivities.control import controlled

        return controlled(again, self, lambda sol: sol.differentiate(names, *sol._run_start))[0]

    @property
    def _run_start(self) -> tuple[Any, Any]:
        """The start and the parameters as they were given; those of a part of a motion its own."""
        return self._arguments or (self.record.ends()[1][0], self.params)

    @property
    def sensitivity(self) -> Sensitivity:
        """Derivatives of the states; ``sol.sensitivity["l_3"]`` is (nt, nq + nu).

        Raises
        ------
        MechcError
            If the run was made without ``sensitivities``.
        """
        if self._sensitivity is None:
            raise MechcError(
                "this run has no derivatives: simulate with sensitivities=[...], the names "
                "that derivatives are taken by"
            )
        return self._sensitivity

    def gradient(
        self,
        end: Any = None,
        integral: Any = None,
        by: Sequence[Any] | None = None,
    ) -> Gradient:
        """The gradient of an objective of this run, by the adjoint of the steps as they were taken:
        by many names it costs hardly more than by one.

        ``sol.gradient(end="theta_0", by=["l_3", "m_1"])["l_3"]``.  The objective is the sum of both
        parts; the run needs no ``sensitivities``.  Long runs are
        kept within a bound of memory by ``simulate(..., checkpoints=...)``.

        Parameters
        ----------
        end
            What counts at the end of the run: a coordinate, a speed, ``"energy"`` or a scalar
            output of the model; a mapping of such names to weights, whose weighted sum counts; or
            an array (nq + nu,), the derivative of your own function by the end state.
        integral
            What is integrated over the time of the run: a name, or a mapping to weights.
        by
            Parameters, coordinates and speeds of a mapping y0, inputs that are numbers, ``"y0"``;
            as of ``sensitivities``.  By default all parameters.

        Returns
        -------
        Gradient
            A mapping of names to derivatives; ``value`` is the objective, ``notes`` says which
            derivatives do not exist and why; these are NaN.

        Raises
        ------
        UnavailableOutputError, UnknownNameError, MechcError
            As of ``simulate(..., sensitivities=...)``, and for an output that is no scalar.
        """
        from mechc.sensitivities.gradient import gradient_of_run

        if not self.policy.dense:
            raise MechcError("this run kept no dense output: simulate with dense=True")
        names = None if by is None else names_of(by)
        return gradient_of_run(self, end, integral, names, *self._run_start)

    def sensitivity_of(self, output: Any, name: Any, t: Array | None = None) -> Array:
        """The derivative of an output, (nt, ...), the output's shape after the times.

        Parameters
        ----------
        output
            A coordinate, a speed, ``"energy"``, or an output (``"points"``, ``"kinetic_energy"``, a
            name of the user's own).
        name
            One of those in ``sensitivity.names``, or a list of them: their columns, in its order,
            are the last axis then.
        t
            Times (nt,) in s; by default ``sol.t``.

        Raises
        ------
        UnknownNameError
            For an output or a name that there is not.
        MechcError
            If the run was made without ``sensitivities``.
        """
        from mechc.sensitivities.outputs import output_sensitivity

        return output_sensitivity(self, self.sensitivity, output, name, t)

    # -- display ------------------------------------------------------------------------------

    def to_xarray(self) -> Any:
        """Everything as an ``xarray.Dataset`` over time."""
        from mechc.results.files import to_dataset

        with Notice("collecting the motion for xarray ..."):
            return to_dataset(self)

    def to_dataframe(self) -> Any:
        """State, energy, closure and inputs (SI units) over time: a pandas.DataFrame.

        Raises
        ------
        MissingPackageError
            If pandas is not installed: ``pip install pandas``.
        """
        from mechc.results.files import to_dataframe

        return to_dataframe(self)

    def save(self, path: str | Path) -> Path:
        """Write to ``.nc`` (NetCDF, opened again by :func:`mechc.open`) or ``.csv``."""
        from mechc.results.files import save

        with Notice(f"writing {path} ..."):
            return save(self, path_of(path))

    def plot(self, *names: Any, degrees: bool = True, forces: Any = False) -> Any:
        """One matplotlib figure.

        Parameters
        ----------
        names
            What to draw over time, in one panel for each unit: coordinates, speeds, ``"energy"``,
            inputs given with the run, and outputs of the model that are one number.  Without any:
            coordinates, speeds, paths, energy and closure.
        degrees
            Show angles in degrees; False: in radians.
        forces
            True: draw the reactions of joints and the loads as arrows in N at the start and at the
            end, beside the paths, with their scale; or names of joints and of points with loads.

        Raises
        ------
        UnknownNameError, UnavailableOutputError
            For a name that does not exist, and an output that the model was compiled without.
        ValueOutOfBoundsError
            For an output of several numbers, for ``forces`` with ``names``, which are drawn over
            time, and for ``forces=True`` where there are none.
        """
        from mechc.results.figures import curves, picture

        if names and forces is not False:
            raise ValueOutOfBoundsError("forces are drawn beside the paths: plot(forces=...) alone")
        with Notice("drawing ..."):
            if names:
                return curves(self, names_of(names), degrees)
            return picture("overview", self, forces=forces)

    def animate(self, *, fps: float = 60.0, forces: Any = False) -> Any:
        """The motion, as an object that displays itself and has ``save(path)``.

        ``fps`` as of :meth:`view`, ``forces`` as of :meth:`plot`.
        """
        from mechc.results.animation import animate

        with Notice("drawing the motion ..."):
            return animate(self, fps=fps, forces=forces)

    def view(self, *, fps: float = 60.0, forces: Any = None) -> Any:
        """The motion in space, as an object that displays itself and has ``save(path)``.

        One page without network: solids, camera, plots and time line (docs/view.md).  A motion
        opened from its file without its model has the picture that was saved with it.

        Parameters
        ----------
        fps
            Frames per second of simulated time; more where steps are shorter, at most 3000, between
            which the page interpolates.
        forces
            As of :meth:`plot`.  By default the reactions of a model that was compiled with them,
            and loads when they are switched on.

        Raises
        ------
        UnknownNameError
            If there is no force of a name among ``forces``.
        MissingPackageError
            If three.js is not installed: ``pip install '.[view]'``.
        """
        from mechc.results.view.page import saved_view, view

        drawn = getattr(self.model.system, "drawn", None)
        if self._recorded_view is not None and drawn is None:
            return saved_view(self._recorded_view)
        with Notice("drawing the view ..."):
            return view(self, fps=fps, forces=forces)

    def __repr__(self) -> str:
        return f"<mechc.Solution of {self.system.name}: {len(self)} states, {self.status.headline}>"

    def _repr_html_(self) -> str:
        from mechc.results.summary import solution_html

        return solution_html(self)
