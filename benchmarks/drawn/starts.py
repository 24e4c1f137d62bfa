"""Starts on the constraints: lengths that follow from the configuration, speeds that fit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from sympy import sympify
from sympy.physics.mechanics import dynamicsymbols

from .judge import Case
from .scene import Numbers

CLOSED = 1e-11  # what rounding leaves of a start's gaps


class UnclosedError(Exception):
    """Newton's steps find no state on the constraints near a start that was drawn."""


def started(values: Numbers, case: Case) -> Numbers:
    """With parameters that follow from the start, and a start that the constraints allow."""
    params, start = dict(values.params), dict(values.start)
    follows: dict[Any, Any] = case.names.get("follows", {})
    known: dict[Any, Any] = {dynamicsymbols._t: 0}
    if follows:
        known |= {x: start[str(x.func.__name__)] for x in case.names["q"]}
    for symbol, expression in follows.items():
        expression = expression.xreplace(case.names.get("in_sympy", {}))
        given = case.reference.fixed | params
        numbers = {s: given[str(s)] for s in expression.free_symbols if str(s) in given}
        params[str(symbol)] = float(sympify(expression.xreplace(known)).xreplace(numbers))
    if case.reference.closes:
        y = np.array([start[n] for n in case.reference.names])
        y = case.reference.closed(0.0, y, params)
        if not np.abs(case.reference.closing(0.0, y, params)[0]).max() < CLOSED:
            raise UnclosedError
        start = dict(zip(case.reference.names, y.tolist(), strict=True))
    return replace(values, params=params, start=start)
