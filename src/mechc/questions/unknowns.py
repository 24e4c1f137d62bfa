"""Unknown numbers of a question: parameters, numbers of the start, inputs; bounds, first values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError, brief
from mechc.system.names import by_name
from mechc.system.parameters import Array
from mechc.system.system import System
from mechc.system.units import in_si

PARAMETER, START, INPUT = "parameter", "start", "input"
Bounds = tuple[float, float]
INSIDE = 1e-9  # of the width of the bounds: so far within them a search begins


@dataclass(frozen=True)
class Unknown:
    """One free number.

    Attributes
    ----------
    name, kind
        A parameter, a coordinate or speed of the start, or an input.
    lower, upper, first
        Its bounds, infinite where there are none, and where the search begins.
    member
        Of which of several motions it is a start; None where it is the same for all.
    """

    name: str
    kind: str
    lower: float
    upper: float
    first: float
    member: int | None = None

    @property
    def label(self) -> str:
        """``theta_0``; ``theta_0[1]`` of motion 1 where each has its own."""
        return self.name if self.member is None else f"{self.name}[{self.member}]"

    @property
    def size(self) -> float:
        """The unit of its changes: half the width of its bounds, else its first value, or 1."""
        half = 0.5 * (self.upper - self.lower)
        return half if np.isfinite(half) else abs(self.first) or 1.0

    def holds_for(self, member: int) -> bool:
        """Whether the unknown changes this motion."""
        return self.member in (None, member)


def read_unknown(
    system: System, name: str, kind: str, bounds: Any, given: Mapping[str, Any], *,
    default: float | None = None, member: int | None = None, clipped: bool = False,
) -> Unknown:  # fmt: skip
    """An unknown with its bounds; it begins at its value in ``given``, values by name of its kind,
    at the default, or between its bounds.

    ``clipped``: a first value beyond its bounds begins at the bound; else it is refused, and a
    default there counts as none.  Raises :class:`ValueOutOfBoundsError` for such a value, one that
    is no number, and bounds that are reversed, are not numbers or exceed those of the parameter.
    """
    low, high = checked_bounds(system, name, bounds)
    first = _given_value(system, name, given)
    if first is not None and not clipped and not low <= first <= high:
        raise ValueOutOfBoundsError(
            f"{name} begins at {first:g}, outside its bounds {low:g} ... {high:g}"
        )
    if first is None:
        own = {**system.start, **system.defaults}.get(name) if default is None else default
        known = own is not None and (clipped or low <= own <= high)
        first = float(own) if own is not None and known else middle_of(low, high)
    return Unknown(name, kind, low, high, min(max(first, low), high), member)


def named_free(free: Any, kinds: Mapping[str, str]) -> dict[str, Any]:
    """Name -> bounds of what is free; names alone stand for the model's own bounds.

    ``kinds``: name -> kind of all that may be free.  Raises :class:`UnknownNameError`.
    """
    alone = isinstance(free, (tuple, list)) and not any(np.ndim(each) for each in free)
    given = by_name(dict.fromkeys(free) if alone else free, "free", "{'m_1': (0.1, 5.0)}")
    words = [word for word in (PARAMETER, START, INPUT) if word in kinds.values()]
    told = ", ".join("coordinate, speed" if word == START else word for word in words)
    for name in given:
        if name not in kinds:
            raise UnknownNameError(" or ".join(told.rsplit(", ", 1)), name, kinds)
    return given


def kinds_of(system: System, inputs: Iterable[str] = ()) -> dict[str, str]:
    """Name -> kind of what can be free: parameters, coordinates and speeds, these inputs."""
    parameters = dict.fromkeys(system.parameters, PARAMETER)
    states = dict.fromkeys((*system.coordinates, *system.speeds), START)
    return parameters | dict.fromkeys(inputs, INPUT) | states | parameters


def _given_value(system: System, name: str, given: Mapping[str, Any]) -> float | None:
    """The user's value of an unknown; None where there is none."""
    if name not in given:
        return None
    try:
        return float(in_si(given[name], system.quantity_of(name)))
    except ValueOutOfBoundsError:
        raise
    except (TypeError, ValueError):
        raise ValueOutOfBoundsError(
            f"{name} is free: it begins at a number, not at {brief(given[name])}"
        ) from None


def middle_of(lower: float, upper: float) -> float:
    """A value between bounds of which some may be infinite."""
    if np.isfinite(lower) and np.isfinite(upper):
        return 0.5 * (lower + upper)
    if np.isfinite(lower):
        return lower + max(1.0, abs(lower))
    return upper - max(1.0, abs(upper)) if np.isfinite(upper) else 0.0


def checked_bounds(system: System, name: str, given: Any) -> Bounds:
    """Bounds in SI units; None, or ``...``, for those of the model, or none."""
    quantity = system.quantity_of(name)
    own = quantity.lower, quantity.upper
    if given is None or given is ...:
        return own
    try:
        given = in_si(given, quantity)
        low, high = (own[k] if each is None else float(each) for k, each in enumerate(given))
    except ValueOutOfBoundsError:
        raise
    except (TypeError, ValueError):
        raise ValueOutOfBoundsError(
            f"{name}: its bounds are (lower, upper) or None, not {brief(given)}"
        ) from None
    if not low < high:
        raise ValueOutOfBoundsError(f"{name}: the lower bound {low:g} must be below {high:g}")
    if low < own[0] or high > own[1]:
        raise ValueOutOfBoundsError(
            f"{name}: the bounds {low:g} ... {high:g} exceed its own: it must be "
            f"{quantity.bounds_in_words}"
        )
    return low, high


def bounds_of(unknowns: Sequence[Unknown]) -> tuple[Array, Array]:
    """Lower and upper bounds (k,)."""
    lower, upper = np.array([(one.lower, one.upper) for one in unknowns]).T.copy()
    return lower, upper


def within(x: Array, lower: Array, upper: Array) -> Array:
    """A point (k,) strictly within bounds, where a search may begin."""
    width = np.where(np.isfinite(upper - lower), upper - lower, 1.0)
    return np.clip(x, lower + INSIDE * width, upper - INSIDE * width)


def spread(lower: Array, upper: Array, count: int, seed: int) -> Array:
    """Points (count, k) spread evenly between finite bounds, by Sobol's sequence."""
    from scipy.stats import qmc

    drawn = qmc.Sobol(len(lower), seed=seed).random_base2(max(0, (count - 1).bit_length()))
    return np.asarray(lower + drawn[:count] * (upper - lower))
