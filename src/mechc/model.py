"""A compiled mechanism as users see it: checks arguments, then calls functions of its system."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any
from weakref import WeakValueDictionary

import numpy as np

from mechc.analysis import verb as analysis_verb
from mechc.assembly import verb as assembly_verb
from mechc.batch import verb as batch_verb
from mechc.compilation.find import system_of
from mechc.differentiable import verb as differentiable_verb
from mechc.errors import RunInterrupt
from mechc.fitting import verb as fitting_verb
from mechc.optimal import verb as optimal_verb
from mechc.outputs import Outputs
from mechc.periodic import verb as periodic_verb
from mechc.prescribed import verb as prescribed_verb
from mechc.results.solution import Solution
from mechc.simulation.events.own_contacts import with_own_contacts
from mechc.simulation.events.run_events import (
    Compiler,
    RunEvents,
    refuse_backwards,
    run_events,
)
from mechc.simulation.initialise import checked_state
from mechc.simulation.settings import (
    LARGEST_TRAJECTORY,
    MOST_STEPS,
    Policy,
    checked_policy,
    checked_span,
    checked_span_and_times,
    refuse_beside_checkpoints,
    without_series,
)
from mechc.simulation.simulate import run
from mechc.synthesis import verb as synthesis_verb
from mechc.system.names import by_name, names_of, owned
from mechc.system.parameters import Array, Parameters
from mechc.system.picture import Picture
from mechc.system.reference import ModelReference
from mechc.system.system import System, Time

if TYPE_CHECKING:
    from mechc.results.model_report import Report
    from mechc.simulation.stepper import Stepper
    from mechc.system.judged import Judged

SIMULATE_ONE_SET = f"simulate {assembly_verb.ONE_SET}"
_models: WeakValueDictionary[int, Model] = WeakValueDictionary()


class Model(Outputs):
    """A compiled mechanism.

    ====================== =========================================================================
    what for               methods and attributes
    ====================== =========================================================================
    one motion             :meth:`simulate`, :meth:`stepper`, :meth:`widget`, :meth:`with_inputs`
    many motions           :meth:`simulate_batch`, :meth:`sweep`, :meth:`tolerances`
    derivatives of motions :meth:`jvp`, :meth:`vjp`, ``simulate(..., sensitivities=...)``
    values from recordings :meth:`fit`
    motions of least cost  :meth:`optimise`
    cycles                 :meth:`periodic`
    linkages for a task    :meth:`synthesize`
    closed configurations  :meth:`assemble`, :meth:`assemblies`, :meth:`sweep_positions`,
                           :meth:`limits`, :meth:`equilibria`, :meth:`redundant_constraints`,
                           :attr:`start`
    linear models          :meth:`linearize`, :meth:`state_jacobian`, :meth:`parameter_jacobian`,
                           :meth:`input_jacobian`, :attr:`input_values`
    equations of motion    :meth:`rhs`, :meth:`ode`, :meth:`mass_matrix`, :meth:`forcing`,
                           :meth:`constraints`, :meth:`velocity_constraints`,
                           :meth:`constraint_jacobian`, :meth:`inverse_dynamics`
    outputs at a state     :meth:`energy`, :meth:`kinetic_energy`, :meth:`potential_energy`,
                           :meth:`momenta`, :meth:`points`, :meth:`point_velocities`,
                           :meth:`point_accelerations`, :meth:`reactions`, :meth:`multipliers`,
                           :meth:`output`, :meth:`integrand`, :meth:`c_function`
    names and values       :attr:`quantities`, :attr:`units`, :attr:`descriptions`, :attr:`bounds`,
                           :attr:`defaults`, :attr:`array_outputs`, :attr:`constraint_names`,
                           :attr:`body_names`, :attr:`joint_names`, :attr:`point_names`,
                           :meth:`state_index`, :meth:`coordinates_and_speeds`
    what was compiled      :meth:`report`, :attr:`options`, :attr:`instruction_set`, :attr:`build`,
                           :meth:`wait_compiled`, :attr:`capsule`
    pictures               :attr:`picture`, :attr:`picture_in_space`, :attr:`view`, :attr:`ground`,
                           :attr:`skeleton`, :attr:`traced`
    saving                 ``sol.save(path)`` and :func:`mechc.open` for motions; ``pickle`` takes
                           models too
    ====================== =========================================================================

    States are ``y = [q, u]``: coordinates, then speeds, in the order of ``coordinates`` and
    ``speeds``.  The last of the coordinates are those in ``states``: activations, controllers,
    which have differential equations and no speed.  For states and parameters of outputs see
    :class:`mechc.outputs.Outputs`.
    """

    @classmethod
    def of_system(cls, system: System) -> Model:
        """The model of a system, one and the same as long as the system exists."""
        known = _models.get(id(system))
        if known is None or known.system is not system:
            known = _models[id(system)] = cls(system)
        return known

    @classmethod
    def of_reference(cls, reference: ModelReference, given: Model | None = None) -> Model:
        """The model that a reference describes, or the one given if it agrees with it.

        Raises
        ------
        MechcError
            If it is not found.
        """
        return cls.of_system(system_of(reference, None if given is None else given.system))

    # -- description -----------------------------------------------------------------------

    @property
    def build(self) -> Mapping[str, Any]:
        """The record of its compilation: options, seconds of each stage and key in the cache."""
        return self.system.build

    @property
    def options(self) -> Mapping[str, Any]:
        """The options this variant of a shipped mechanism was compiled with."""
        return dict(self.system.reference.options)

    @property
    def instruction_set(self) -> str:
        """The instruction set in use, chosen for this processor."""
        return self.system.instruction_set

    @property
    def defaults(self) -> Mapping[str, float]:
        """Default value of every parameter that has one, SI units."""
        return self.system.defaults

    @property
    def picture(self) -> Picture:
        """The drawing of the mechanism, a :class:`mechc.system.picture.Picture` made at first use.

        Raises
        ------
        MechcError
            If its description cannot be read again.
        """
        return self.system.picture

    @property
    def picture_in_space(self) -> Picture:
        """The drawing with solids, springs and dampers, as ``sol.view()`` shows it."""
        return self.system.picture_in_space

    @property
    def capsule(self) -> object:
        """The compiled model for C, a pointer to the ``mechc_model`` of ``model.h``.

        Its name contains the interface's version; :func:`mechc.get_include` has the header.
        """
        return self.system.scene.capsule

    def report(self, *, compare: bool = True) -> Report:
        """A report of what is compiled, what is omitted and why, and the seconds of each stage.

        Parameters
        ----------
        compare
            Where parameters are fixed or outputs were not requested: derive the scene with all of
            them too, so that the report gives the savings.  Takes as long as deriving.

        Returns
        -------
        Report
            A text; in a notebook, tables.
        """
        from mechc.results.model_report import model_report

        return model_report(self.system, compare=compare)

    # -- verbs of the folders ----------------------------------------------------------------

    assemble = assembly_verb.assemble
    assemblies = assembly_verb.assemblies
    sweep_positions = analysis_verb.sweep_positions
    limits = analysis_verb.limits
    equilibria = analysis_verb.equilibria
    redundant_constraints = analysis_verb.redundant_constraints
    linearize = analysis_verb.linearize
    inverse_dynamics = prescribed_verb.inverse_dynamics
    simulate_batch = batch_verb.simulate_batch
    sweep = batch_verb.sweep
    tolerances = batch_verb.tolerances
    jvp = differentiable_verb.jvp
    vjp = differentiable_verb.vjp
    fit = fitting_verb.fit
    optimise = optimal_verb.optimise
    periodic = periodic_verb.periodic
    synthesize = synthesis_verb.synthesize

    # -- along a motion -----------------------------------------------------------------------

    def judge_rates(
        self, t: Array, y: Array, p: Array, steps: Sequence[Array], forces: Array | None = None
    ) -> list[Judged]:
        """How y' at states differs from the description's; see ``mechc.Solution.check``."""
        from mechc.compilation.newton_euler import judge

        return judge(self.system, t, y, p, steps, forces)

    def _judge_reactions(
        self, system: System, values: Mapping[str, Array], p: Array, t: Time, stacklevel: int
    ) -> None:
        if "cut_rows" in system.data:
            from mechc.analysis.shared_reactions import warn_of_undetermined

            warn_of_undetermined(system, values, p, t, stacklevel)

    # -- simulation ---------------------------------------------------------------------------

    def simulate(
        self,
        t_span: Any,
        y0: Array | Mapping[Any, float],
        params: Parameters = None,
        *,
        rtol: float = 1e-9,
        atol: float | Array | None = None,
        t_eval: Array | None = None,
        method: str = "auto",
        lockstep: bool | None = None,
        first_step: float | None = None,
        max_step: float = math.inf,
        max_steps: int = MOST_STEPS,
        max_bytes: float = LARGEST_TRAJECTORY,
        dense: bool = True,
        events: Sequence[Any] = (),
        on_change_point: str = "continue",
        progress: Callable[[float], None] | None = None,
        inputs: Mapping[str, Any] | None = None,
        sensitivities: Sequence[Any] = (),
        sensitivity_error_control: bool = False,
        checkpoints: float | None = None,
    ) -> Solution:
        """Integrate the motion, every stage and every accepted state on the constraints.

        Parameters
        ----------
        t_span
            ``(t0, t1)`` in s, forwards or backwards, or ``t1`` alone with t0 = 0; more than two
            times are ``t_eval`` too.  All times may have units, ``"500 ms"``.
        y0
            State (nq + nu,) at t0, from ``model.assemble``; projected onto the constraints if it
            violates them by rounding.  A mapping of coordinates and speeds is assembled.
        params
            A mapping of some parameters or an array (np,) of all; defaults otherwise.
        rtol, atol
            Tolerated error.  ``atol=None``: rtol times each component's scale (1 rad, the model's
            length, speeds by their largest value so far); else ``atol + rtol |y|`` as in SciPy,
            for each component in its unit or with one, ``"1e-6 deg"``.
        t_eval
            Times of the reported states, within the span; by default those of the accepted steps.
        method
            ``"dopri5"`` or ``"dop853"`` (Dormand & Prince of order 5 and 8, explicit),
            ``"gauss8"`` (collocation of order 16, eight stages, one per SIMD lane),
            ``"radau5"`` (Radau IIA of order 5, for stiff scenes), ``"taylor"`` (Taylor series of
            the motion, of an order that follows from rtol, for small scenes without constraints,
            tables and inputs, whose equations are analytic), or ``"auto"``: ``"gauss8"``, or
            ``"dop853"`` where the equations have kinks (``Abs``), or ``"taylor"`` for short runs of
            small scenes with a diagonal mass matrix, or ``"dop853 in lockstep"`` from rtol 1e-5 on
            where the speeds are no derivatives of the coordinates, and ``"radau5"`` where stability
            limits the steps.  SciPy's names of the same methods are taken too: ``"RK45"``,
            ``"DOP853"``, ``"Radau"``.
        lockstep
            Take the steps that a batch in lockstep takes: those of ``"gauss8"`` solve their stages
            one after another, so that a lane holds a member; by itself the slower.  By default only
            with the name ``"gauss8 in lockstep"``, as of ``batch.method``; ``"dop853 in lockstep"``
            and ``"taylor in lockstep"`` go over to collocation as members do.  Scenes that the
            lanes do not take, of over 32 components or with corners or jumps in their equations,
            run alone in any case: ``sol.method`` says how it ran.
        first_step, max_step, max_steps
            First and largest step in s, and the largest number of attempted steps.
        max_bytes
            Memory for the accepted states and the dense output, 1 GiB by default.  A run that needs
            more ends with the status ``"memory limit"``, which names what limits its steps.
        dense
            Keep the dense output for ``sol(t)``.
        events
            Functions ``g(t, y)`` whose zeros are found on the dense output, each an
            :class:`mechc.Event`, a function with SciPy's attributes ``direction`` and
            ``terminal``, or an expression, of SymPy or as text, also with a direction, ``q > 1``;
            their times and states are in ``sol.events``.
            One with a ``reset`` changes the state, and the run continues: ``sol.segments``.
        on_change_point
            At a configuration where branches of the motion cross: ``"continue"`` straight on along
            the same branch, ``"stop"`` before it, or ``"raise"``
            :class:`mechc.ChangePointError`.  Crossings are in ``sol.change_points``.
        progress
            Called now and then with the fraction done.
        inputs
            A value for each input in ``model.inputs``: a number, also with a unit, an expression as
            text, a :class:`mechc.Signal`, a function ``f(t)`` or ``f(t, q, u)``, a tuple of
            functions of t with the derivatives of the first, or a :class:`mechc.Sampled`
            controller; see :meth:`with_inputs`.  ``sol.model`` is then the model driven by them.
        sensitivities
            Names of what ``sol.sensitivity`` has derivatives by: parameters (with those whose
            defaults follow them), coordinates and speeds of a mapping y0 (the others follow from
            the closing of the loops), inputs that are numbers, values of signals (``"F[3]"``; all:
            ``"F"``), ``"y0"`` for every component of the start.  The steps are those of the run
            without, but end at every sample of such signals; see docs/sensitivities.md.
        sensitivity_error_control
            Choose the steps for the derivatives too, so that their errors follow ``rtol`` and
            ``atol``; by default they are chosen for the motion alone.  A derivative times the value
            of its parameter is held to the tolerances of the motion.  The motion is computed
            several times for it, and its events and inputs are asked as often.
        checkpoints
            Bytes of memory within which the run stays, for ``sol.gradient``: in place of states and
            dense output it keeps states of the integrator, and computes what lies between them
            again when it is asked for, the same to the last bit.  Not with ``events`` and
            ``sensitivities``.  Its energy is not checked.

        Raises
        ------
        AssemblyError
            If y0 does not satisfy the constraints; the message has the gap.
        UnknownNameError, ValueOutOfBoundsError, ValueError
            For bad names, values and shapes.
        UnavailableOutputError
            For sensitivities of a model that was compiled without and cannot be compiled with
            them: its description is not at hand.

        Notes
        -----
        A failure during the run raises nothing: the run ends with ``sol.status``, and the solution
        until then is kept.  A failing event function raises :class:`mechc.EventError`, a failing
        input :class:`mechc.InputError`, and Ctrl-C :class:`mechc.RunInterrupt`, a
        KeyboardInterrupt: ``error.solution`` is the motion until then.
        """
        span, times = checked_span_and_times(t_span, t_eval)
        model = self if inputs is None else self._driven_over(span, inputs, sensitivities)
        by = names_of(sensitivities) if len(sensitivities) else ()
        if by and model.inputs:
            model = model._breaking_at_samples(by)
        system, p = model.system, model._one_set(params, SIMULATE_ONE_SET)
        chosen = _run_events(events, system, p, span)
        keeps = checkpoints is not None
        if keeps:
            refuse_beside_checkpoints(chosen or (), by)
        policy = checked_policy(
            system, rtol=rtol, atol=atol, first_step=first_step, max_step=max_step,
            method=without_series(system, method) if (by or keeps) and not lockstep else method,
            max_steps=max_steps,
            dense=bool(dense or keeps or times is not None or chosen or len(sensitivities)),
            on_change_point=on_change_point, max_bytes=max_bytes, checkpoints=checkpoints,
            lockstep=lockstep,
        )  # fmt: skip
        if by:
            system.differentiable()  # else an error would come after the run
        given = y0
        if type(y0) is not np.ndarray and isinstance(y0, Mapping):
            y0 = model._start(y0, p, span[0])
        state = checked_state(system, y0, p, span[0])
        make = partial(Solution, model)
        sol = run(make, system, span, state, p, policy, times, chosen, progress)
        sol._arguments = owned(given), owned(params)
        try:
            if by and sensitivity_error_control:
                again = partial(_run_again, sol, make, span, state, times, chosen, progress)
                return sol.differentiated_within_tolerance(by, again)
            if by:
                sol.differentiate(by, given, params)
        except KeyboardInterrupt:
            words = "interrupted; error.solution is the motion, without its derivatives"
            raise RunInterrupt(words, solution=sol) from None
        return sol

    @batch_verb.with_options_of(simulate)
    def widget(
        self,
        t_span: Any,
        y0: Array | Mapping[Any, float],
        params: Parameters = None,
        *,
        sliders: Mapping[Any, tuple[float, float]],
        fps: float = 60.0,
        **policy: Any,
    ) -> Any:
        """The motion in space with sliders, in a notebook: values are simulated while dragged.

        ``model.widget(5, {"theta_0": 1.5}, sliders={"l_3": (3.2, 3.9), "theta_0": (1.2, 2.0)})``

        Parameters
        ----------
        t_span, y0, params, **policy
            As of :meth:`simulate`.  With loops, give y0 as a mapping: it is assembled anew.
        sliders
            Name or symbol -> (lowest, highest), SI units: parameters, coordinates and speeds of
            the start, inputs that are numbers.  Sliders show angles in degrees.
        fps
            Frames per second of simulated time, as of ``sol.view``.

        Returns
        -------
        anywidget.AnyWidget
            ``values``, a mapping that can be set too; ``solution``, that which is shown; ``note``,
            why there is no motion for the values: the last one that there was then stays.

        Raises
        ------
        MissingPackageError
            Without anywidget or three.js: ``pip install '.[notebook,view]'``.
        UnknownNameError, ValueOutOfBoundsError
            For a slider that there cannot be, and a first value outside its range.
        """
        from mechc.results.view.variation import variation
        from mechc.results.view.widget import MotionWidget

        return MotionWidget(variation(self, t_span, y0, params, sliders, policy), fps)

    def stepper(
        self,
        y0: Array | Mapping[Any, float],
        params: Parameters = None,
        *,
        t: float = 0.0,
        inputs: Mapping[str, Any] | None = None,
        rtol: float = 1e-9,
        atol: float | Array | None = None,
        method: str = "auto",
        max_step: float = math.inf,
        max_steps: int = MOST_STEPS,
        on_change_point: str = "continue",
        events: Sequence[Any] = (),
    ) -> Stepper:
        """The motion from y0 at time t, to be advanced step by step: in a loop with the world.

        ``stepper.step(dt, {"F": 0.5})`` gives the state after dt.  Arguments as in
        :meth:`simulate`; ``max_steps`` counts within one step.  An input that is to change in steps
        is given its first value here, as a number.

        Raises
        ------
        AssemblyError, MissingInputError, UnknownNameError, ValueOutOfBoundsError, ValueError
            As :meth:`simulate`.
        """
        from mechc.simulation.stepper import Stepper

        start, _ = checked_span((t, t))
        model = (
            self._driven_over((start, math.inf), {} if inputs is None else inputs, ())
            if self.inputs
            else self
        )
        system, p = model.system, model._one_set(params, f"a stepper {assembly_verb.ONE_SET}")
        policy = checked_policy(
            system, rtol=rtol, atol=atol, method=without_series(system, method), max_step=max_step,
            max_steps=max_steps, dense=system.scene.holonomic > 0, on_change_point=on_change_point,
        )  # fmt: skip
        if isinstance(y0, Mapping):
            y0 = model._start(y0, p, start)
        found = _run_events(events, system, p, (start, math.inf))
        return Stepper(system, start, checked_state(system, y0, p, start), p, policy, found)

    def _start(self, given: Mapping[Any, float], p: Array, t: float) -> Array:
        """The state from coordinates and speeds in one mapping."""
        rest, speeds = self.coordinates_and_speeds(by_name(given, "y0"))
        for name in rest:
            self.system.state_index(name)
        return self.assemble(rest, speeds, params=p, t=t)

    # -- other processes -----------------------------------------------------------------------

    def wait_compiled(self) -> None:
        """Return when the functions of this scene's own runs and batches are compiled.

        Runs, their derivatives and batches of a new scene are by the unit of its kind, two to nine
        times as slow; its own functions are compiled in the background after some work by that.
        Both give the same bits.  For measurements of speed, and before other processes need the
        scene.  Derivatives are among them where the model was compiled with
        ``outputs=("sensitivities", ...)``.

        Raises
        ------
        CompilerError
            If there is no C compiler.
        """
        self.system.wait(derivatives=True)

    def __reduce__(self) -> tuple[Any, ...]:
        """The model's reference, by which it is found again in the library or the user's cache."""
        system = self.system
        if system.reference.custom and not system.reference.key:
            raise TypeError(
                f"a model that is not in the cache cannot be pickled: compile {self.name!r} again "
                "in the other process"
            )
        system.wait(batches=False)
        inputs = {} if system.driven is None else system.driven.given
        reference = replace(system.reference, defaults=dict(system.given_defaults))
        return _found_again, (reference, dict(self.start), inputs)

    def __copy__(self) -> Model:
        return self

    def __deepcopy__(self, memo: Any) -> Model:
        """A model is immutable."""
        return self

    def __repr__(self) -> str:
        return f"<mechc.Model {self.system.headline}>"

    def _repr_html_(self) -> str:
        from mechc.results.summary import model_html

        return model_html(self.system)


def _run_events(
    events: Any, system: System, p: Array, span: tuple[float, float]
) -> RunEvents | None:
    """The events of a run and the contacts of the system; None without any."""
    if type(events) is tuple and not events and not system.data.get("contacts"):
        return None  # nearly always, and fast
    events = with_own_contacts(events, system.data, system.cache)
    if isinstance(events, (tuple, list)) and not events:
        return None
    from mechc.compilation.event_tapes import COMPILER

    found = run_events(events, system, p, Compiler(*COMPILER))
    refuse_backwards(found.laws, span)
    return found if len(found) else None


def _run_again(
    sol: Solution, make: Callable[..., Solution], span: tuple[float, float], state: Array,
    times: Array | None, events: RunEvents | None, progress: Callable[[float], None] | None,
    policy: Policy,
) -> Solution:  # fmt: skip
    """The motion of a solution by another policy."""
    again = run(make, sol.system, span, state, sol.params, policy, times, events, progress)
    again._arguments = sol._arguments
    return again


def _found_again(
    reference: ModelReference, start: dict[str, float], inputs: dict[str, Any]
) -> Model:
    """The model that was pickled."""
    system = system_of(reference)
    if start != dict(system.start):
        system = system.with_start(start)
    model = Model.of_system(system)
    return model.with_inputs(inputs) if inputs else model
