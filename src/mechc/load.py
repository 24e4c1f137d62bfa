"""Getting a model: of the library, a variant of one of these, or one's own mechanism."""

from __future__ import annotations

import hashlib
import importlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from mechc.compilation.catalogue import COMPILED_AT_INSTALL, LIBRARY
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from mechc.model import Model
from mechc.system.parameters import brief, by_name

BACKENDS = ("c", "numpy")
_loaded: dict[tuple[str, str | None], Model] = {}


def mechanisms() -> tuple[str, ...]:
    """Names of the library's mechanisms."""
    return tuple(LIBRARY)


def load(
    name: str,
    *,
    instruction_set: str | None = None,
    fix: Mapping[str, float] | None = None,
    outputs: Iterable[str] | None = None,
    backend: str = "c",
    **options: Any,
) -> Model:
    """A mechanism of the library.

    ``four_bar`` is compiled when mechc is installed; the others are at their first use, and then
    cached, which needs a C compiler.

    Parameters
    ----------
    name
        One of :func:`mechanisms`.
    instruction_set
        ``"baseline"``, ``"avx2"`` or ``"avx512"`` of what is compiled at install; the widest of
        this processor when None.
    fix, outputs
        Parameters that become numbers, and names of the outputs wanted, as in :func:`compile`;
        such a variant is compiled on demand too.
    backend
        ``"c"``, or ``"numpy"``: derived and evaluated in this process without any compiled code,
        slowly (docs/backends.md says how and what is missing).
    options
        What the scene asks for beyond the default, for instance ``friction=True``,
        ``crank_torque="2*sin(3*t)"`` or ``links=5`` (``mechc show NAME`` lists them).  Such a
        variant is compiled on demand and cached too.

    Raises
    ------
    UnknownNameError
        If there is no such mechanism or option; the nearest known names are offered.
    MechcError
        If an option has a value that it does not take.
    ValueError
        If this processor or build lacks the instruction set.
    CompilerError
        If a variant has to be compiled and cannot be.
    """
    if name not in LIBRARY:
        raise UnknownNameError("mechanism", name, LIBRARY)
    if instruction_set is not None and not _is_word(instruction_set):
        raise ValueError(f"no instruction set is called {brief(instruction_set)}")
    asked, key = _asked(fix, outputs), (name, instruction_set)
    if key in _loaded and backend == "c" and not (asked or options):
        return _loaded[key]  # at once, whatever other threads are compiling
    return _loaded_alone(name, instruction_set, asked, backend, options)


@one_at_a_time
def _loaded_alone(
    name: str,
    instruction_set: str | None,
    asked: Mapping[str, Any],
    backend: str,
    options: Mapping[str, Any],
) -> Model:
    """What was compiled at install, or else is compiled now."""
    chosen = options
    if options:
        from mechc.compilation.on_demand import beyond_default

        chosen = beyond_default(name, options)
    if checked_backend(backend) == "numpy":
        return _without_c(name, instruction_set, chosen, asked)
    if chosen or asked or name not in COMPILED_AT_INSTALL:
        from mechc.compilation.on_demand import compile_shipped

        if instruction_set is not None:
            raise ValueError(
                "what is compiled on demand is for this processor alone: leave instruction_set out"
            )
        return compile_shipped(name, chosen, asked)
    key = (name, instruction_set)
    if key not in _loaded:
        _loaded[key] = Model(_scene_module(name).model, instruction_set=instruction_set)
    return _loaded[key]


def _asked(fix: Mapping[str, float] | None, outputs: Iterable[str] | None) -> dict[str, Any]:
    """What a variant is asked for beside its options, as names and numbers."""
    asked: dict[str, Any] = {}
    if fix:
        given = by_name(fix, "parameters to fix", "{'g': 9.81}")
        asked["fix"] = {str(k): _number(k, given[k]) for k in sorted(given, key=str)}
    if outputs is not None:
        names = [outputs] if isinstance(outputs, str) else list(outputs)
        if not all(isinstance(each, str) for each in names):
            raise TypeError(
                "outputs of a shipped mechanism are asked for by name; expressions of one's own "
                "are for mechc.compile"
            )
        asked["outputs"] = sorted(set(names))
    return asked


def _is_word(text: object) -> bool:
    return isinstance(text, str) and text.isascii() and text.isalnum()


def _number(name: object, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueOutOfBoundsError(f"{name} must be a number, not {brief(value)}") from None


def checked_backend(backend: str) -> str:
    """``"c"`` or ``"numpy"``."""
    if backend not in BACKENDS:
        raise UnknownNameError("backend", backend, BACKENDS)
    return backend


def _without_c(
    name: str,
    instruction_set: str | None,
    options: Mapping[str, Any],
    asked: Mapping[str, Any],
) -> Model:
    from mechc.compilation.on_demand import shipped_without_c

    if instruction_set is not None:
        raise ValueError("backend='numpy' has no instruction sets: leave instruction_set out")
    return shipped_without_c(name, options, asked)


def reload(
    name: str, options: dict[str, Any], instruction_set: str | None, backend: str = "c"
) -> Model:
    """What unpickles a model."""
    return load(name, instruction_set=instruction_set, backend=backend, **options)


def compile(
    mechanism: Any,
    *,
    name: str | None = None,
    fix: Mapping[Any, float] | None = None,
    outputs: Iterable[Any] | None = None,
    defaults: Mapping[Any, Any] | None = None,
    units: Mapping[Any, str] | None = None,
    inputs: Mapping[Any, Any] | None = None,
    states: Mapping[Any, Any] | Iterable[Any] | None = None,
    configuration_constraints: Iterable[Any] | None = None,
    backend: str = "c",
) -> Model:
    """Compile a mechanism of one's own; cached, needs a C compiler unless ``backend="numpy"``.

    Parameters
    ----------
    mechanism
        A :class:`mechc.Mechanism`, or a ``KanesMethod``, ``LagrangesMethod`` or ``System`` of
        ``sympy.physics.mechanics`` whose equations are formed.  Of these only bodies, loads,
        kinematics and constraints are read, never the mass matrix.
    name
        What the model is called; by default the kind of the object.
    fix
        Parameters -> numbers that are folded in; what vanishes by that is not compiled, and they
        are no parameters any more.
    outputs
        What can be asked of the model besides the equations of motion: of ``"energy"``,
        ``"momenta"``, ``"points"``, ``"multipliers"``, ``"accelerations"`` (of the points),
        ``"reactions"`` (of joints),
        ``"state_jacobian"`` and ``"parameter_jacobian"`` (of the right-hand side), and
        ``{name: expression}`` for expressions of time, coordinates, speeds, their rates,
        parameters and multipliers (``mechc.multiplier(row)``).  By default the first four of a
        Mechanism, the energy of an object of SymPy's.
    defaults, units
        Parameters -> values used where none are given (SI units); parameters, coordinates and
        speeds -> units in words.  A parameter without a default is asked for by name.  The default
        of a state is what it starts from where nothing else is said (else 0).
    inputs
        Specified functions of time (``dynamicsymbols`` that are no state) -> expressions of
        time, coordinates, speeds, states and parameters.  Those that are left open, or None, are
        given with a run: ``model.simulate(..., inputs={...})``.
    states
        Functions of time that are neither coordinates nor speeds -> their rates, expressions of
        all that is named here: activations, controllers.  Or objects that have ``x`` and
        ``rhs()``, as the muscles of ``sympy.physics.biomechanics`` do.
    configuration_constraints
        Added to those that the object holds, where it was given their rates alone.
    backend
        ``"c"``; or ``"numpy"`` where there is no compiler: the same model, slower, which does not
        pass change points and makes no batches (docs/backends.md).

    In all of these a key is a symbol or its printed name; all but ``fix`` and ``outputs`` are
    for objects of SymPy's.

    Raises
    ------
    TypeError
        If it is something else.
    MechcError
        If the object cannot say what is needed; the message says what to add.
    CompilerError
        If there is no C compiler or it failed; the message holds its command and output.
    """
    return _compiled_alone(
        mechanism,
        name=name,
        fix=fix,
        outputs=outputs,
        defaults=defaults,
        units=units,
        inputs=inputs,
        states=states,
        configuration_constraints=None
        if configuration_constraints is None
        else tuple(configuration_constraints),
        backend=checked_backend(backend),
    )


@one_at_a_time
def _compiled_alone(mechanism: Any, **asked: Any) -> Model:
    from mechc.compilation.on_demand import compile_any

    return compile_any(mechanism, **asked)


@one_at_a_time
def get_include() -> str:
    """The folder of ``model.h`` and ``call.h``, for C that uses ``model.capsule``."""
    from mechc.compilation.on_demand import include_folder

    return str(include_folder())


def fingerprint(model: Model) -> str:
    """What tells this compiled scene from any other: its cache key, or its file's hash."""
    if "key" in model.build:
        _ = model._scene.lanes  # waits until all of it is compiled, and so in the cache
        return str(model.build["key"])
    path = _scene_module(model.name).__file__
    assert path is not None
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def _scene_module(name: str) -> ModuleType:
    return importlib.import_module(f"mechc._scenes.{name}")
