"""The shipped library: name, what builds the mechanism, and the options a scene may ask for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches

from sympy import Expr

from mechc_codegen.errors import MechanismError
from mechc_codegen.expression import parse_expression
from mechc_codegen.mechanism import Mechanism
from mechc_codegen.mechanisms.four_bar import four_bar
from mechc_codegen.mechanisms.four_bar import t as time


@dataclass(frozen=True)
class Option:
    """One thing a scene may ask for; ``expression`` options also take a function of time."""

    name: str
    description: str
    expression: bool = False


@dataclass(frozen=True)
class Shipped:
    """A mechanism of the library."""

    build: Callable[..., Mechanism]
    title: str
    options: tuple[Option, ...] = ()


SHIPPED: Mapping[str, Shipped] = {
    "four_bar": Shipped(
        four_bar,
        "Planar four-bar linkage",
        (
            Option("crank_torque", "torque on the crank: constant T_0, or of t (N m)", True),
            Option("crank_speed", "prescribed crank speed: constant Omega_0, or of t", True),
            Option("friction", "viscous friction c_0 ... c_3 in the joints"),
            Option("coupler_point", "a traced point C at (x_C, y_C) on the coupler"),
        ),
    )
}


def shipped_mechanism(name: str, options: Mapping[str, object] | None = None) -> Mechanism:
    """Build a mechanism of the library.

    Parameters
    ----------
    options
        By option name: ``True``, ``False``, or for options that take a function of time a SymPy
        expression or a text in the grammar of :mod:`mechc_codegen.expression`.

    Raises
    ------
    MechanismError
        If there is no such mechanism or option.
    """
    if name not in SHIPPED:
        raise MechanismError(f"no mechanism is called {name!r}{_nearest(name, list(SHIPPED))}")
    shipped = SHIPPED[name]
    known = {option.name: option for option in shipped.options}
    chosen = {}
    for key, value in (options or {}).items():
        if key not in known:
            raise MechanismError(f"{name} has no option {key!r}{_nearest(key, list(known))}")
        chosen[key] = _value(known[key], value)
    return shipped.build(**chosen)


def _value(option: Option, value: object) -> bool | Expr:
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
