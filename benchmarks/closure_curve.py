"""Exact motion of a four-bar with a change point, for judging: no constraint, no singularity.

With signs s_k = +-1 so that s_0 l_0 + s_1 l_1 + s_2 l_2 = l_3, all links can lie in line, and the
curve of configurations has a node there.  Lines through the node (slope kappa) meet the curve in
one more place: z_1 = s_1 (1 + p), z_2 = s_2 (1 + kappa p), p rational in kappa, and real links
keep kappa on a circle (or a line).  Its angle psi is a coordinate in which the motion runs straight
through every crossing: m(psi) psi'^2 / 2 + V(psi) = E.

Checked by its own unit moduli, closure and energy.  Thin uniform rods, masses given.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as dop853

GRAVITY = 9.81


class Jet:
    """A value with its first two derivatives by psi; arrays over many motions."""

    __array_ufunc__ = None  # products with arrays come here

    def __init__(self, v, d=0.0, dd=0.0) -> None:  # type: ignore[no-untyped-def]
        self.v, self.d, self.dd = v, d, dd

    def __add__(self, o):  # type: ignore[no-untyped-def]
        o = o if isinstance(o, Jet) else Jet(o)
        return Jet(self.v + o.v, self.d + o.d, self.dd + o.dd)

    __radd__ = __add__

    def __mul__(self, o):  # type: ignore[no-untyped-def]
        o = o if isinstance(o, Jet) else Jet(o)
        return Jet(
            self.v * o.v,
            self.d * o.v + self.v * o.d,
            self.dd * o.v + 2 * self.d * o.d + self.v * o.dd,
        )

    __rmul__ = __mul__

    def inverse(self):  # type: ignore[no-untyped-def]
        r = 1 / self.v
        return Jet(r, -self.d * r * r, 2 * self.d**2 * r**3 - self.dd * r * r)


@dataclass
class Geometry:
    """Four-bars with change points, one a row; kind 'node' or 'parallel'."""

    lengths: np.ndarray  # (n, 4)
    signs: np.ndarray  # (n, 3)
    masses: np.ndarray  # (n, 3)
    parallel: np.ndarray  # (n,) the translating branch of a parallelogram: theta_1 = 0

    def links(self, psi):  # type: ignore[no-untyped-def]
        """Unit vectors along the links, as jets."""
        node = self._node(psi)
        turning, still = np.exp(1j * psi), np.ones_like(psi) + 0j
        crank = Jet(turning, 1j * turning, -turning)
        straight = [crank, Jet(still), -1.0 * crank]
        return [_where(self.parallel, a, b) for a, b in zip(straight, node, strict=True)]

    def _node(self, psi):  # type: ignore[no-untyped-def]
        s = self.signs.T
        a0, a1, a2 = (self.lengths[:, k] * s[k] for k in range(3))
        n, d = self._slope(psi, a0, a1, a2)
        B = (a1 * d + a2 * n) * (-1 / a0)  # times d
        C = a0 * B * B + a1 * d * d + a2 * n * n
        L = a0 * B * B * (d + n) + a1 * d * d * (B + n) + a2 * n * n * (B + d)
        q = -1.0 * C * L.inverse()
        # parallelogram and kites: a common factor of C and L, taken out
        r, e = a1 / a0, d + -1.0 * n
        q = _where(a2 == -a0, (-2 * n + (r + 1) * d) * (n * (n + -r * d)).inverse(), q)
        q = _where((a1 == -a2) & (a2 != -a0), -1.0 * (r * e + d + n) * (d * n).inverse(), q)
        r = a2 / a0
        other = (-2 * d + (r + 1) * n) * (d * (d + -r * n)).inverse()
        q = _where((a1 == -a0) & (a1 != -a2) & (a2 != -a0), other, q)
        return [s[0] * (1 + B * q), s[1] * (1 + d * q), s[2] * (1 + n * q)]

    def _slope(self, psi, a0, a1, a2):  # type: ignore[no-untyped-def]
        """kappa = n / d on the circle whose diameter joins the node's two slopes."""
        A, b, c = a2 * a2 / a0 + a2, a1 * a2 / a0, a1 * a1 / a0 + a1
        line = np.abs(A) < 1e-12
        A = np.where(line, 1.0, A)
        centre, radius = -b / A, np.sqrt(np.maximum(b * b - A * c, 0)) / np.abs(A)
        turning = np.exp(1j * psi)
        n = Jet(centre + radius * turning, 1j * radius * turning, -radius * turning)
        half = Jet(np.cos(psi / 2) + 0j, -np.sin(psi / 2) / 2 + 0j, -np.cos(psi / 2) / 4 + 0j)
        sine = Jet(np.sin(psi / 2) + 0j, np.cos(psi / 2) / 2 + 0j, -np.sin(psi / 2) / 4 + 0j)
        first = -c / np.where(b == 0, 1.0, 2 * b)
        return _where(line, first * half + 1j * sine, n), _where(line, half, Jet(np.ones_like(n.v)))

    def terms(self, psi):  # type: ignore[no-untyped-def]
        """m, m', V, V' and the links."""
        z = self.links(psi)
        l, m = self.lengths.T, self.masses.T
        mass, mass_slope, V, V_slope = 0.0, 0.0, 0.0, 0.0
        base = Jet(0.0)
        for k in range(3):
            centre = base + 0.5 * l[k] * z[k]
            base = base + l[k] * z[k]
            turn = [np.conj(z[k].v) * x for x in (z[k].d, z[k].dd)]
            inertia = m[k] * l[k] ** 2 / 12
            mass += m[k] * abs(centre.d) ** 2 + inertia * abs(turn[0]) ** 2
            mass_slope += 2 * m[k] * (np.conj(centre.d) * centre.dd).real
            mass_slope += 2 * inertia * (np.conj(z[k].d) * z[k].dd).real
            V += m[k] * GRAVITY * centre.v.imag
            V_slope += m[k] * GRAVITY * centre.d.imag
        return mass, mass_slope, V, V_slope, z, base

    def energy(self, y):  # type: ignore[no-untyped-def]
        mass, _, V, _, _, _ = self.terms(y[0])
        return 0.5 * mass * y[1] ** 2 + V

    def state(self, y):  # type: ignore[no-untyped-def]
        """Angles in (-pi, pi] and angular speeds, (n, 6)."""
        z = self.links(y[0])
        angles = [np.angle(x.v) for x in z]
        speeds = [(x.d / x.v).imag * y[1] for x in z]
        return np.stack([*angles, *speeds], axis=1)

    def defect(self, psi):  # type: ignore[no-untyped-def]
        """Largest departure from unit moduli and from closure."""
        _, _, _, _, z, end = self.terms(psi)
        moduli = max(np.abs(np.abs(x.v) - 1).max() for x in z)
        return max(moduli, np.abs(end.v - self.lengths[:, 3]).max())


def _where(mask, a, b):  # type: ignore[no-untyped-def]
    return Jet(*(np.where(mask, x, y) for x, y in ((a.v, b.v), (a.d, b.d), (a.dd, b.dd))))


class _Bar(ctypes.Structure):
    _fields_ = [
        ("l", ctypes.c_double * 4), ("s", ctypes.c_double * 3), ("m", ctypes.c_double * 3),
        ("parallel", ctypes.c_int),
    ]  # fmt: skip


@cache
def _library():  # type: ignore[no-untyped-def]
    source = Path(__file__).with_suffix(".c")
    target = Path(tempfile.mkdtemp()) / "closure_curve.so"
    subprocess.run(
        ["cc", "-O3", "-shared", "-fPIC", "-o", str(target), str(source), "-lm"], check=True
    )
    return ctypes.CDLL(str(target))


def integrate(geometry: Geometry, y, times, tolerance=3e-13):  # type: ignore[no-untyped-def]
    """States at the times, (len(times), 2, n): order 8, each motion with steps of its own.

    Times are summed with compensation; where the motion is not slow, psi' is put back to its
    energy.
    NaN where a motion needs more than 300,000 steps.
    """
    table = np.concatenate([dop853.A[:12, :12].ravel(), dop853.B, dop853.E5, dop853.E3])
    times = np.ascontiguousarray(times, float)
    out = np.empty((y.shape[1], len(times), 2))
    for i in range(y.shape[1]):
        one = _Bar(*(tuple(x[i]) for x in (geometry.lengths, geometry.signs, geometry.masses)),
                   int(geometry.parallel[i]))  # fmt: skip
        start = np.ascontiguousarray(y[:, i])
        _library().integrate(
            ctypes.byref(one), _pointer(start), len(times), _pointer(times),
            ctypes.c_double(tolerance), _pointer(table), _pointer(out[i]),
        )  # fmt: skip
    return out.transpose(1, 2, 0)


def _pointer(a):  # type: ignore[no-untyped-def]
    return a.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
