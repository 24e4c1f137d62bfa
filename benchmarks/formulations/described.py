"""What mechc reads of an object before it derives anything, and what a mechanism consists of."""

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
    """The mechanism that an object describes, and what is asked of it; as ``mechc.compile``."""
    options = CompileOptions(ConversionSettings(defaults=defaults or {}), fix or {}, outputs)
    return CompileRequest(given, options).described()


def described(given: Any, defaults: Mapping[str, float]) -> Mechanism:
    """A mechanism as it is, an object of SymPy's as the mechanism it describes."""
    return given if isinstance(given, Mechanism) else read(given, defaults=defaults)[0]


def holonomic(mechanism: Mechanism) -> list[Expr]:
    """Configuration constraints, those of cut joints included."""
    closures = [c for closure in mechanism.closures for c in closure.constraints()]
    return [c.expression for c in (*mechanism.configuration_constraints, *closures)]


def kinematic_equations(mechanism: Mechanism) -> list[Expr]:
    """What vanishes, as KanesMethod takes it: every coordinate's rate less what gives it."""
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
