"""The choice of the method that forms the equations, for objects without formed equations.

Nothing is formed: only what a method is given is read.  The object itself is not changed.
"""

from __future__ import annotations

from copy import copy
from typing import Any

from sympy import Derivative
from sympy.physics.mechanics import KanesMethod, LagrangesMethod, System

from mechc_codegen.description.terms import printed_name
from mechc_codegen.errors import MechanismError

METHODS = {"kane": KanesMethod, "lagrange": LagrangesMethod}


class _Given(LagrangesMethod):  # type: ignore[misc]  # SymPy has no types
    """A LagrangesMethod as a System makes it, without equations."""

    def _form_eoms(self) -> None:
        pass


def check_form(thing: Any, form: str | None) -> None:
    """Refuse a method that does not exist or does not fit the object.

    Raises
    ------
    MechanismError
        The message names what can be asked for.
    """
    if form is None:
        return
    if not isinstance(form, str) or form not in METHODS:
        raise MechanismError(f"form is 'kane' or 'lagrange', not {form!r}")
    if not isinstance(thing, (System, METHODS[form])):
        raise MechanismError(
            f"form={form!r} is for a System or a {METHODS[form].__name__}, not for a "
            f"{type(thing).__name__}"
        )


def by_lagrange(system: System) -> LagrangesMethod:
    """The LagrangesMethod of a System, without forming its equations.

    Raises
    ------
    MechanismError
        If speeds of the System are not the derivatives of its coordinates.
    """
    other = [u for u in system.u if not isinstance(u, Derivative)]
    if other:
        raise MechanismError(
            "Lagrange's method needs the derivatives of the coordinates as speeds; this System "
            f"has {', '.join(map(printed_name, other))}: make its joints with the speeds "
            "q.diff(t), or use form='kane'"
        )
    made = copy(system)
    made.form_eoms(_Given)
    return made.eom_method
