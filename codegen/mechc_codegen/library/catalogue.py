"""The library: name, function that builds the mechanism, and its options."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from operator import index

from sympy import Expr

from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.parsing.parser import parse_expression
from mechc_codegen.errors import MechanismError
from mechc_codegen.library.chains.pendulum import pendulum
from mechc_codegen.library.chains.rods import planar_chain, spatial_chain
from mechc_codegen.library.chains.windows import windows
from mechc_codegen.library.parts import t as time
from mechc_codegen.library.planar.andrews import andrews
from mechc_codegen.library.planar.car_axis import car_axis
from mechc_codegen.library.planar.four_bar import four_bar
from mechc_codegen.library.planar.slider_crank import slider_crank
from mechc_codegen.library.spatial.bicycle import whipple_bicycle
from mechc_codegen.library.spatial.flyball_governor import flyball_governor
from mechc_codegen.library.spatial.heavy_top import heavy_top
from mechc_codegen.library.spatial.rigid_body import rigid_body

_WHOLE = re.compile(r"\s*[0-9]{1,9}\s*")


@dataclass(frozen=True)
class Count:
    """A whole number from ``least`` to ``most``."""

    least: int
    most: int
    default: int


@dataclass(frozen=True)
class Option:
    """An option of a scene: on or off by default.

    ``expression`` options also take a function of time; those with a ``count`` take a whole
    number.
    """

    name: str
    description: str
    expression: bool = False
    count: Count | None = None

    @property
    def about(self) -> str:
        """The description, with the numbers that a count may be."""
        if self.count is None:
            return self.description
        return f"{self.description}, {self.count.least} to {self.count.most} [{self.count.default}]"


@dataclass(frozen=True)
class LibraryMechanism:
    """A mechanism of the library, which has its own title."""

    build: Callable[..., Mechanism]
    options: tuple[Option, ...] = ()


SHIPPED: Mapping[str, LibraryMechanism] = {
    "four_bar": LibraryMechanism(
        four_bar,
        (
            Option("crank_torque", "torque on the crank: constant T_0, or of t (N m)", True),
            Option("crank_speed", "prescribed crank speed: constant Omega_0, or of t", True),
            Option("friction", "viscous friction c_0 ... c_3 in the joints"),
            Option("coupler_point", "a traced point C at (x_C, y_C) on the coupler"),
            Option("placed", "the ground pivot O at (x_O, y_O), the ground line at alpha"),
        ),
    ),
    "andrews": LibraryMechanism(andrews),
    "bicycle": LibraryMechanism(whipple_bicycle),
    "car_axis": LibraryMechanism(car_axis),
    "flyball_governor": LibraryMechanism(flyball_governor),
    "heavy_top": LibraryMechanism(heavy_top),
    "pendulum": LibraryMechanism(
        pendulum,
        (Option("links", "point masses, each hinged to the one before", count=Count(1, 100, 1)),),
    ),
    "planar_chain": LibraryMechanism(
        planar_chain,
        (Option("links", "rods, each hinged to the one before", count=Count(1, 200, 3)),),
    ),
    "rigid_body": LibraryMechanism(rigid_body),
    "slider_crank": LibraryMechanism(slider_crank),
    "spatial_chain": LibraryMechanism(
        spatial_chain,
        (Option("links", "bars, hinge axes alternately across and along", count=Count(1, 200, 3)),),
    ),
    "windows": LibraryMechanism(
        windows,
        (Option("count", "windows in the row", count=Count(1, 100, 2)),),
    ),
}


def shipped_mechanism(name: str, options: Mapping[str, object] | None = None) -> Mechanism:
    """Build a mechanism of the library.

    Parameters
    ----------
    options
        By option name: ``True``, ``False``, for options that take a function of time a SymPy
        expression or a text in the grammar of
        :mod:`mechc_codegen.description.parsing.parser`, and for counts a whole number.

    Raises
    ------
    MechanismError
        If there is no such mechanism or option, or its value is wrong.
    """
    if name not in SHIPPED:
        raise MechanismError(f"no mechanism is called {name!r}{_nearest(name, list(SHIPPED))}")
    known = _options_of(name)
    chosen = {}
    for key, value in (options or {}).items():
        if key not in known:
            hint = _nearest(key, list(known)) if known else ": it takes none"
            raise MechanismError(f"{name} has no option {key!r}{hint}")
        chosen[key] = _value(known[key], value)
    return SHIPPED[name].build(**chosen)


def beyond_default(name: str, options: Mapping[str, object]) -> dict[str, object]:
    """The options that differ from the default scene, counts as numbers.

    A constant for an option that takes an expression is included, as text.

    Raises
    ------
    MechanismError
        For a count that is not a whole number, or out of its range.
    """
    known, chosen = _options_of(name), {}
    for key, value in options.items():
        count = known[key].count
        read = _count(known[key], count, value) if count else value
        if isinstance(value, int) and not isinstance(value, bool) and count is None:
            read = str(value)
        if read is not False and (count is None or read != count.default):
            chosen[key] = read
    return chosen


def _options_of(name: str) -> dict[str, Option]:
    return {option.name: option for option in SHIPPED[name].options}


def _count(option: Option, count: Count, value: object) -> int:
    """The whole number given, also as text."""
    number = _whole(value)
    if number is None or not count.least <= number <= count.most:
        raise MechanismError(
            f"{option.name} must be a whole number from {count.least} to {count.most}, "
            f"not {value!r}"
        )
    return number


def _whole(value: object) -> int | None:
    """Python's and NumPy's whole numbers, and digits; no float, which may be an error."""
    if isinstance(value, str):
        return int(value) if _WHOLE.fullmatch(value) else None
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        return None
    return index(value)


def _value(option: Option, value: object) -> bool | int | Expr:
    if option.count is not None:
        return _count(option, option.count, value)
    if isinstance(value, bool):
        return value
    if not option.expression:
        raise MechanismError(f"the option {option.name!r} is on or off; it takes no {value!r}")
    if isinstance(value, (str, int, float)):
        return parse_expression(str(value), {"t": time})
    if isinstance(value, Expr) and not (value.free_symbols - {time}):
        return value
    raise MechanismError(f"the option {option.name!r} takes an expression of t, not {value!r}")


def _nearest(name: str, known: list[str]) -> str:
    close = get_close_matches(name, known, n=3, cutoff=0.4) or known
    return f"; did you mean {' or '.join(map(repr, close))}?"
