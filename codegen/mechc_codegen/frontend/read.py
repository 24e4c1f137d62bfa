"""Objects of ``sympy.physics.mechanics`` -> Source: which reader reads which."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sympy.physics.mechanics import KanesMethod, LagrangesMethod, System

from mechc_codegen.description.source import Source
from mechc_codegen.frontend.form import check_form

KINDS = (KanesMethod, LagrangesMethod, System)


def readable(thing: object) -> bool:
    """Whether there is a reader for an object."""
    return isinstance(_inner_method(thing), KINDS)


def read(thing: Any, form: str | None = None) -> Source:
    """Read a mechanics object; only its reader is imported.

    ``form``: the method, ``"kane"`` or ``"lagrange"``, of one whose equations are not formed.

    Raises
    ------
    MechanismError
        If its equations are not formed, and ``form`` is not given; the message says what to do.
    """
    inner = _inner_method(thing)
    check_form(inner, form)
    if isinstance(inner, KanesMethod):
        from mechc_codegen.frontend.kane import read_kane

        return _with_joints(thing, read_kane(inner, form))
    if isinstance(inner, LagrangesMethod):
        from mechc_codegen.frontend.lagrange import read_lagrange

        return read_lagrange(inner, form)
    from mechc_codegen.frontend.system import read_system

    return read_system(inner, form)


def _with_joints(thing: Any, source: Source) -> Source:
    """The source with the joints of a JointsMethod, if the object is one."""
    joints = getattr(thing, "_joints", ())
    if not joints:
        return source
    from mechc_codegen.description.joints.tree import joint_of

    return replace(source, joints=tuple(joint_of(joint) for joint in joints))


def _inner_method(thing: Any) -> Any:
    """The real object inside a JointsMethod, which SymPy has deprecated."""
    return thing.method if type(thing).__name__ == "JointsMethod" else thing
