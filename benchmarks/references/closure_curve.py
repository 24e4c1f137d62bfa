"""Exact motion of a four-bar with a change point, for judging: no constraint, no singularity.

With signs s_k = +-1 so that s_0 l_0 + s_1 l_1 + s_2 l_2 = l_3, all links can lie in line, and the
curve of configurations has a node there.  Lines through the node (slope kappa) meet the curve in
one more place: z_1 = s_1 (1 + p), z_2 = s_2 (1 + kappa p), p rational in kappa, and real links
keep kappa on a circle (or a line).  Its angle psi is a coordinate in which the motion runs straight
through every crossing: m(psi) psi'^2 / 2 + V(psi) = E.  Thin uniform rods, masses given.

The formulas are in closure_curve.c, which is compiled at the first use.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as dop853

from ..problems.problem import Array
from .compiled import library, pointer

TABLE = np.concatenate([dop853.A[:12, :12].ravel(), dop853.B, dop853.E5, dop853.E3])


class _Bar(ctypes.Structure):
    _fields_ = (
        ("l", ctypes.c_double * 4), ("s", ctypes.c_double * 3), ("m", ctypes.c_double * 3),
        ("parallel", ctypes.c_int),
    )  # fmt: skip


@dataclass(frozen=True)
class Geometry:
    """Four-bars with change points, one a row."""

    lengths: Array  # (n, 4)
    signs: Array  # (n, 3)
    masses: Array  # (n, 3)
    parallel: Array  # (n,) the translating branch of a parallelogram: theta_1 = 0

    def __len__(self) -> int:
        return len(self.lengths)

    def repeated(self, times: int) -> Geometry:
        """All of them one after the other, several times."""
        return Geometry(*(np.concatenate([x] * times) for x in vars(self).values()))

    def state(self, y: Array) -> Array:
        """Angles in (-pi, pi] and angular speeds (n, 6) of (psi, psi'), (2, n)."""
        return self._read(y)[:, :6]

    def energy(self, y: Array) -> Array:
        """Joules, (n,)."""
        return self._read(y)[:, 6]

    def _read(self, y: Array) -> Array:
        found = np.empty((len(self), 7))
        for i, start in enumerate(np.ascontiguousarray(y.T)):
            library(__file__).read(ctypes.byref(self._bar(i)), pointer(start), pointer(found[i]))
        return found

    def _bar(self, i: int) -> _Bar:
        parts = (tuple(x[i]) for x in (self.lengths, self.signs, self.masses))
        return _Bar(*parts, int(self.parallel[i]))

    def integrate(self, y: Array, times: Array, tolerance: float = 3e-13) -> Array:
        """States at the times, (len(times), 2, n): order 8, each motion with steps of its own.

        Times are summed with compensation; where the motion is not slow, psi' is put back to its
        energy.  NaN where a motion needs more than 300,000 steps.
        """
        times = np.ascontiguousarray(times, float)
        out = np.empty((len(self), len(times), 2))
        for i, start in enumerate(np.ascontiguousarray(y.T)):
            library(__file__).integrate(
                ctypes.byref(self._bar(i)), pointer(start), len(times), pointer(times),
                ctypes.c_double(tolerance), pointer(TABLE), pointer(out[i]),
            )  # fmt: skip
        return out.transpose(1, 2, 0)
