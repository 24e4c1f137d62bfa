"""The errors of mechc: wrong input, each with what to do about it."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any


class MechcError(Exception):
    """Base of all errors of the runtime."""


class UnknownNameError(MechcError, KeyError):
    """A mechanism, parameter, coordinate, speed or output that does not exist."""

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        from difflib import get_close_matches

        known = list(map(str, known))
        close = get_close_matches(str(name), known, n=3, cutoff=0.4)
        nearest = " or ".join(map(repr, close))
        offered = f"did you mean {nearest}?" if close else f"known are {', '.join(known)}"
        offered = offered if known else "there is none"
        self.message = f"no {kind} is called {name!r}; {offered}"
        super().__init__(self.message)

    @classmethod
    def misplaced(cls, name: str, argument: str, other: str, value: object) -> UnknownNameError:
        """A name in one argument that belongs to another one."""
        return cls.with_message(
            f"{name} is not one of the {argument}: give {other}={{{name!r}: {value!r}}}"
        )

    @classmethod
    def with_message(cls, message: str) -> UnknownNameError:
        """A name that has another meaning, in these words."""
        return _unpickled(cls, message)

    def __str__(self) -> str:
        return self.message

    def __reduce__(self) -> tuple[object, ...]:
        return _unpickled, (type(self), self.message)


class UnavailableOutputError(MechcError):
    """An output that the mechanism's description does not determine, or that was not requested and
    cannot be compiled now."""


class ValueOutOfBoundsError(MechcError, ValueError):
    """A parameter or option outside its bounds, or not a finite number."""


class MissingParameterError(MechcError, ValueError):
    """A parameter without a default was not given."""


class MissingInputError(MissingParameterError):
    """An input has no value: neither an expression when compiled, nor a value with the run."""


class AssemblyError(MechcError, ValueError):
    """The loops cannot be closed, or the speeds given contradict each other."""


class RunError(MechcError):
    """An error that ends a run; ``solution`` is the motion until then."""

    def __init__(self, message: str, solution: object) -> None:
        super().__init__(message)
        self.solution = solution

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (str(self), None)  # a compiled run cannot be pickled


class ChangePointError(RunError):
    """A change point under ``on_change_point="raise"``; ``solution`` is the run until then."""


class EventError(RunError):
    """An event function failed; ``solution`` is the run until then, ``__cause__`` its error."""


class InputError(RunError):
    """A function that gives an input failed; ``__cause__`` is its error.

    ``solution`` is the run until then, None outside a run.
    """


class RunInterrupt(KeyboardInterrupt):
    """Ctrl-C while motions are computed: a KeyboardInterrupt with what was computed until then.

    Attributes
    ----------
    solution
        The :class:`mechc.Solution` of a run; None where it is of something else.
    batch
        The batch of ``simulate_batch``, in which members that did not run have the status
        ``"not run"``; else None.
    sweep
        The sweep whose batch it is; else None.
    fit
        The fit at the best values that were tried; else None.
    """

    def __init__(
        self, message: str, *, solution: Any = None, batch: Any = None, sweep: Any = None,
        fit: Any = None,
    ) -> None:  # fmt: skip
        super().__init__(message)
        self.solution, self.batch, self.sweep, self.fit = solution, batch, sweep, fit


class StepError(MechcError):
    """A step of a stepper ended before its end; ``status`` is the :class:`mechc.Status`."""

    def __init__(self, message: str, status: object = None) -> None:
        super().__init__(message)
        self.status = status


class MissingPackageError(MechcError, ImportError):
    """An optional package is needed, and is not installed or cannot be imported."""


class CompilerError(MechcError):
    """The C compiler is missing or failed; the message has its command and its output."""


class CacheError(MechcError):
    """The cache folder cannot be used safely."""


class UnusedValueWarning(UserWarning):
    """Values for symbols that are not in the equations of a model."""


class CollapsedSheetWarning(UserWarning):
    """A configuration at which the mechanism is folded onto itself was taken, or left out."""


class UndeterminedReactionWarning(UserWarning):
    """Redundant constraints share reactions in any proportion, whatever the motion."""


class CacheWarning(UserWarning):
    """Compiled scenes cannot be stored for later processes."""


def package(name: str, advice: str) -> Any:
    """An optional package.

    Raises :class:`MissingPackageError`, with the advice if it is absent, or else with the reason
    why it cannot be imported.
    """
    try:
        return import_module(name)
    except Exception as error:  # a damaged package may raise any
        absent = error.name if isinstance(error, ModuleNotFoundError) else None
        if absent and f"{name}.".startswith(f"{absent}."):
            raise MissingPackageError(advice) from error
        raise MissingPackageError(
            f"{name} is installed but cannot be imported: {type(error).__name__}: {error}"
        ) from error


def install_command(extra: str) -> str:
    """How an extra is installed: mechc is installed from its clone, not from the package index."""
    return f"pip install '.[{extra}]' in the clone of mechc"


def brief(value: object) -> str:
    """The value given, in few characters."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _unpickled(kind: type[UnknownNameError], message: str) -> UnknownNameError:
    error = kind.__new__(kind, message)
    error.message = message
    return error
