"""The mechanism that mechc reads from an object, and its parts."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from sympy import Expr
from sympy.physics.mechanics import KanesMethod, dynamicsymbols


def read(
    given: Any, *, fix: Mapping[str, float] | None = None, outputs: Sequence[str] = (),
    defaults: Mapping[str, float] | None = None,
) -> tuple[Mechanism, Any]:  # fmt: skip
    """The mechanism that an object describes, and its request; as ``mechc.compile``."""
    options = CompileOptions(ConversionSettings(defaults=defaults or {}), fix or {}, outputs)
    return CompileRequest(given, options).description()


def described(given: Any, defaults: Mapping[str, float]) -> Mechanism:
    """A mechanism unchanged, a SymPy object as the mechanism it describes."""
    return given if isinstance(given, Mechanism) else read(given, defaults=defaults)[0]


def holonomic(mechanism: Mechanism) -> list[Expr]:
    """Configuration constraints, those of cut joints included."""
    closures = [c for closure in mechanism.closures for c in closure.constraints()]
    return [c.expression for c in (*mechanism.configuration_constraints, *closures)]


def kinematic_equations(mechanism: Mechanism) -> list[Expr]:
    """The kinematic equations for KanesMethod: every coordinate's rate minus its expression."""
    pairs = zip(mechanism.q, mechanism.kinematics, strict=True)
    return [q.diff(dynamicsymbols._t) - rate for q, rate in pairs]


def form_equations(method: KanesMethod, mechanism: Mechanism) -> KanesMethod:
    """The method, its equations formed with all loads, weight included."""
    loads = list(mechanism.loads)
    if mechanism.gravity is not None:
        loads += [(body.masscenter, body.mass * mechanism.gravity) for body in mechanism.bodies]
    with warnings.catch_warnings():  # around loops it does not matter which way a velocity is found
        warnings.simplefilter("ignore")
        method.kanes_equations(list(mechanism.bodies), loads)
    return method
