"""Rates of a compiled program beside those that its description determines."""

from __future__ import annotations

from typing import NamedTuple

from mechc.system.parameters import Array


class Judged(NamedTuple):
    """How the rates at n states differ from those by Newton's and Euler's equations.

    Attributes
    ----------
    rates : (n, nq + nu)
        By the compiled program.
    kinematics : (n, nq)
        The differences of those of the coordinates and states.
    accelerations : (n, nu)
        What those of the speeds lack.
    felt : (n, nu)
        The sum of the magnitudes that each load by itself gives the speeds' rates, within the
        constraints: what an equilibrium is judged by.
    clear : (n,)
        False near a singular configuration, where accelerations are not determined: not compared.
    """

    rates: Array
    kinematics: Array
    accelerations: Array
    felt: Array
    clear: Array
