"""What a person adds to a script: compile, start, simulate."""

from __future__ import annotations

from typing import Any

import mechc

from .script import Script


def compiled(script: Script) -> Any:
    """The line that takes the place of lambdify."""
    return mechc.compile(
        script.method, defaults=script.constants, states=script.rates or None, **script.further
    )


def driven(model: Any, script: Script) -> Any:
    return model.with_inputs(script.inputs) if script.inputs else model


def started(model: Any, script: Script) -> Any:
    """The state that the script starts from, its constraints closed."""
    method = getattr(script.method, "eom_method", script.method)
    speeds = {u: value for u, value in script.start.items() if u in set(method.u)}
    rest = {q: value for q, value in script.start.items() if q not in speeds}
    return model.assemble(rest, speeds, guess=script.guess or None)
