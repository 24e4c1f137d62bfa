"""Exact motion of a planar linkage with one freedom, however near its change points it passes.

For judging: on the curve of configurations nothing is singular but a change point itself.  The unit
null vector n of the closure's rows R, oriented so that det [R; n] > 0, is smooth along the curve,
and with its length s measured by the mass matrix s'' = -dV/ds.  In extended precision, by
extrapolation, the loops closed at every step: linkage_curve.c, which is compiled at the first use.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..problems.problem import Array
from .compiled import library, pointer

MOST = 16
GRAVITY = 9.81  # m/s^2


class _Linkage(ctypes.Structure):
    _fields_ = (
        ("rods", ctypes.c_int), ("loops", ctypes.c_int), ("inertia", ctypes.c_double * MOST**2),
        ("moment", ctypes.c_double * MOST), ("tips", ctypes.c_double * MOST**2),
        ("grounds", ctypes.c_double * MOST), ("parts", ctypes.c_double * MOST),
    )  # fmt: skip


@dataclass(frozen=True)
class PlanarLinkage:
    """Thin uniform rods in a vertical plane.

    Parameters
    ----------
    hung
        By rod: the rod on whose end it hangs, -1 for the pivot at the origin.
    lengths, masses
        Of the rods, m and kg.
    ends
        The rods whose ends are pinned to the ground, one a loop.
    grounds
        Where, as (x, parts of x below its last digit), m.
    """

    hung: Sequence[int]
    lengths: Sequence[float]
    masses: Sequence[float]
    ends: Sequence[int]
    grounds: Sequence[tuple[float, float]]

    def moved(self, loop: int, by: float) -> PlanarLinkage:
        """The same with one pivot on the ground moved, by less than an ulp too."""
        x, part = self.grounds[loop]
        grounds = list(self.grounds)
        grounds[loop] = x, part + by
        return replace(self, grounds=grounds)

    def integrate(self, y0: Array, times: Array, tolerance: float = 1e-14) -> Array:
        """Absolute angles and their rates at the times, (len(times), 2 rods); NaN where the motion
        takes too many steps.

        Where rounding in a narrow bend is more than the tolerance, ten or a hundred times of it are
        tried.
        """
        for looser in (1.0, 10.0, 100.0):
            out = self._integrate(y0, times, looser * tolerance)
            if np.isfinite(out).all():
                break
        return out

    def _integrate(self, y0: Array, times: Array, tolerance: float) -> Array:
        times = np.ascontiguousarray(times, float)
        start = np.ascontiguousarray(y0, float)
        out = np.full((len(times), 2 * len(self.hung)), np.nan)
        made = library(__file__).integrate(
            ctypes.byref(self._passed()), pointer(start), len(times), pointer(times),
            ctypes.c_double(tolerance), pointer(out),
        )  # fmt: skip
        return out if made else np.full_like(out, np.nan)

    def _passed(self) -> _Linkage:
        n, lengths, masses = len(self.hung), np.array(self.lengths), np.array(self.masses)
        tips = np.zeros((n, n))  # of rod k, in unit vectors along the rods
        for k, on in enumerate(self.hung):
            tips[k] = tips[on] if on >= 0 else 0.0
            tips[k, k] = lengths[k]
        middles = tips - 0.5 * np.diag(lengths)
        inertia = (middles.T * masses) @ middles + np.diag(masses * lengths**2 / 12)
        flat = _Linkage(n, len(self.ends))
        flat.inertia[: n * n] = inertia.ravel().tolist()
        flat.moment[:n] = (GRAVITY * masses @ middles).tolist()
        flat.tips[: len(self.ends) * n] = tips[list(self.ends)].ravel().tolist()
        flat.grounds[: len(self.ends)] = [x for x, _ in self.grounds]
        flat.parts[: len(self.ends)] = [part for _, part in self.grounds]
        return flat


def four_bar(lengths: Sequence[float], masses: Sequence[float] = (1.0, 2.0, 3.0)) -> PlanarLinkage:
    """Three rods end to end; the last length is that of the ground."""
    return PlanarLinkage([-1, 0, 1], lengths[:3], masses, [2], [(lengths[3], 0.0)])
