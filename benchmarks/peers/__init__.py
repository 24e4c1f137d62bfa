"""The tools that mechc is compared with, by name; each module is imported when it is asked for.

A module ``peers.NAME`` has ``TOOLS``, the names that it reports as, and
``build(problem, tolerances)``, which gives its cases and the seconds of setting up; it raises
ImportError where its package is missing and :class:`NotExpressibleError` where it cannot model the
problem.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from _timing import Case


class NotExpressibleError(Exception):
    """Why a tool is not given a problem."""


@dataclass
class Built:
    """Cases of a peer on a problem, and per tool name the seconds of "derive" and "compile"."""

    cases: list[Case]
    setup: dict[str, dict[str, float]] = field(default_factory=dict)
