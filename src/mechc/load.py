"""Loads or compiles a model: of the library, a variant of it, or a user-defined mechanism."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from mechc.compilation.find import library_system
from mechc.compilation.library.catalogue import LIBRARY
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.model import Model
from mechc.system.names import by_name
from mechc.system.system import System

PYDY_SYSTEM = ("eom_method", "constants", "initial_conditions", "specifieds", "times")


def mechanisms() -> tuple[str, ...]:
    """Names of the library's mechanisms."""
    return tuple(LIBRARY)


def load(
    name: str,
    *,
    instruction_set: str | None = None,
    fix: Mapping[str, float] | None = None,
    outputs: Iterable[str] | None = None,
    **options: Any,
) -> Model:
    """A mechanism of the library.

    ``four_bar`` is compiled when mechc is installed.  The others are derived at their first use and
    then cached; their motions need no C compiler, except those of long chains.

    Parameters
    ----------
    name
        One of :func:`mechanisms`.
    instruction_set
        ``"baseline"``, ``"avx2"`` or ``"avx512"`` for scenes compiled at install; by default the
        widest of this processor.
    fix, outputs
        Parameters to replace by numbers, and names of outputs, as in :func:`compile`; such a
        variant is derived on demand too.
    options
        Options that differ from the default, for instance ``friction=True``,
        ``crank_torque="2*sin(3*t)"`` or ``links=5`` (``mechc show NAME`` lists them).  Such a
        variant is derived on demand and cached too.

    Raises
    ------
    UnknownNameError
        If there is no such mechanism or option; the nearest known names are offered.
    MechcError
        If an option has a value that it does not take.
    ValueError
        If this processor or build lacks the instruction set.
    CompilerError
        If the mechanism cannot run by an installed integrator, and there is no C compiler or it
        failed.
    """
    system = library_system(
        name, instruction_set=instruction_set, fix=fix, outputs=outputs, **options
    )
    return Model.of_system(system)


def compile(
    mechanism: Any,
    *,
    name: str | None = None,
    fix: Mapping[Any, float] | None = None,
    outputs: Iterable[Any] | None = None,
    defaults: Mapping[Any, Any] | None = None,
    parameters: Mapping[Any, Any] | Iterable[Any] | None = None,
    units: Mapping[Any, str] | None = None,
    inputs: Mapping[Any, Any] | Iterable[Any] | None = None,
    states: Mapping[Any, Any] | Iterable[Any] | None = None,
    configuration_constraints: Iterable[Any] | None = None,
    reactions: Iterable[Any] | None = None,
    form: str | None = None,
    drawing: Any = None,
) -> Model:
    """Compile a user-defined mechanism; cached.

    Motions, derivatives, events and outputs of most need no C compiler: they run by an integrator
    that is installed with mechc.  With a compiler, faster code is compiled in the background.

    Parameters
    ----------
    mechanism
        A :class:`mechc.Mechanism`, or a ``KanesMethod``, ``LagrangesMethod`` or ``System`` of
        ``sympy.physics.mechanics`` whose equations are formed (else see ``form``).  Of these only
        bodies, loads, kinematics and constraints are read, never the mass matrix.  Of a ``System``
        of PyDy its method is, with its constants for defaults, its initial conditions for
        ``model.start`` and its specified functions for inputs.
    name
        Name of the model; by default that of the mechanism, or the kind of the object.
    fix
        Parameters -> numbers that replace them; terms that become zero are not compiled, and the
        model does not have these parameters.
    outputs
        Outputs besides the equations of motion: of ``"energy"``,
        ``"momenta"``, ``"points"``, ``"multipliers"``, ``"accelerations"`` (of the points),
        ``"reactions"`` (of joints),
        ``"state_jacobian"`` and ``"parameter_jacobian"`` (of the right-hand side),
        ``"sensitivities"`` (derivatives of motions), and
        ``{name: expression}`` for expressions of time, coordinates, speeds, their rates,
        parameters and multipliers (``mechc.multiplier(row)``), for vectors (their components in
        the inertial frame), matrices and lists of these, which keep their shape.  By default the
        first four of a Mechanism, the energy of a SymPy object.  Others are compiled when they are
        first asked for.
    defaults, units
        Parameters -> values used where none are given; parameters, coordinates, speeds, states and
        inputs -> units as text, SI units.  A parameter without a default must be given with each
        call.  The default of a state is its start (by default 0).  Values for symbols that are not
        in the equations are ignored, with a warning.  Values may have units, ``"30 mm"``: where
        none is known of the symbol they are converted to SI units.
    parameters
        Parameters besides those of the equations -> default values, or names alone: what stands in
        events, resets and stops only, as a coefficient of restitution or of friction.  They are
        given with runs and in batches as all others.
    inputs
        Specified functions of time (``dynamicsymbols`` that are no state) -> expressions of
        time, coordinates, speeds, states and parameters, of SymPy or as text, ``"3*sin(4*t)"``.
        Those without an expression, or with None, are given with a run:
        ``model.simulate(..., inputs={...})``.
    states
        Functions of time that are neither coordinates nor speeds -> their rates, expressions of
        all of these: activations, controllers.  Or objects that have ``x`` and ``rhs()``, such as
        the muscles of ``sympy.physics.biomechanics``.
    configuration_constraints
        Added to those of the object, if it was given only their rates.
    reactions
        Symbols or functions of time in loads that act on auxiliary speeds only (``u_auxiliary``
        of KanesMethod): the forces and torques that keep these zero.  Each is an output of its
        name, and user-defined outputs may contain it.
    form
        ``"kane"`` or ``"lagrange"``: the method for an object whose equations are not formed.  They
        are not formed by SymPy then, which takes long for large ones.
    drawing
        A :class:`mechc.Drawing`: links, pivots and paths besides those that are found from the
        description (docs/drawing.md).  It compiles nothing.

    In all of these a key is a symbol or its printed name.  Constraints, reactions and ``form`` are
    for SymPy objects: a Mechanism has them in its description.

    Raises
    ------
    TypeError
        If it is none of these.
    MechcError
        If the object lacks something needed; the message says what to add.
    CompilerError
        If the mechanism cannot run by an installed integrator, and there is no C compiler or it
        failed; the message has its command and output.
    """
    __tracebackhide__ = True  # of errors pytest and IPython show the line of the user
    held = mechanism if all(hasattr(mechanism, name) for name in PYDY_SYSTEM) else None
    if held is not None:
        mechanism, defaults = held.eom_method, {**held.constants, **(defaults or {})}
    from mechc.compilation.request import compile_any

    system = compile_any(
        mechanism,
        name=name,
        fix=fix,
        outputs=outputs,
        defaults=defaults,
        parameters=parameters,
        units=units,
        inputs=inputs,
        states=states,
        configuration_constraints=None
        if configuration_constraints is None
        else _several(configuration_constraints),
        reactions=None if reactions is None else _several(reactions),
        form=form,
        drawing=drawing,
    )
    return Model.of_system(system) if held is None else _with_all_held(system, held)


def _several(given: Any) -> tuple[Any, ...]:
    """One symbol, name or expression, or several, as a tuple."""
    single = isinstance(given, str) or not isinstance(given, Iterable)
    return (given,) if single else tuple(given)


def _with_all_held(system: System, held: Any) -> Model:
    """The model of a ``System`` of PyDy, with its start (by default 0) and its specified functions.

    PyDy itself is never imported.
    """
    given, method = dict(held.initial_conditions), held.eom_method
    begun = {state: float(given.get(state, 0.0)) for state in (*method.q, *method.u)}
    start = by_name(begun, "initial conditions")
    known = {*system.coordinates, *system.speeds}
    model = Model.of_system(system.with_start({n: x for n, x in start.items() if n in known}))
    return model.with_inputs(held.specifieds) if held.specifieds and system.inputs else model


@one_at_a_time
def get_include() -> str:
    """The folder of ``model.h`` and ``call.h``, for C that uses ``model.capsule``."""
    from mechc.compilation.compiler import include_folder

    return str(include_folder())
