"""Cases of a test that take long, and are left to the second run of ``.ci/run``."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def slow_among(cases: Iterable[str], slow: Collection[str]) -> list[Any]:
    """The cases as parameters of a test, the slow ones of them marked so."""
    cases = list(cases)
    if unknown := set(slow) - set(cases):
        raise ValueError(f"no such case: {', '.join(sorted(unknown))}")
    return [pytest.param(c, marks=pytest.mark.slow) if c in slow else c for c in cases]
