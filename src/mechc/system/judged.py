"""Rates of a compiled program beside those that its description determines."""

from __future__ import annotations

from typing import NamedTuple

from mechc.system.parameters import Array


class Judged(NamedTuple):
    """How the rates at n states differ from those by Newton's and Euler's equations.

    Attributes
    ----------
    accelerations : (n, nu)
        What the rates of the speeds lack.
    free : (n, nu)
        The magnitudes that loads alone would give them, without constraints.
    kinematics : (n, nq)
        Largest differences of the rates of coordinates and states.
    gaps : (n, rows)
        Of the configuration constraints.
    clear : (n,)
        False near a singular configuration, where accelerations are not determined: not compared.
    """

    accelerations: Array
    free: Array
    kinematics: Array
    gaps: Array
    clear: Array
