"""The motion of the four-bar near its change point, in 40 digits.

With n = J_x x J_y, the closure's tangent as the links' angle differences give it, q' = w n keeps
the loop closed exactly and T = w^2 A / 2, A = n.M n; the one equation left is
A w' = -(w^2 A'/2 + V'), ' along n.  A Taylor series of order 30 in time follows every bend,
however narrow, by shortening its step.  n vanishes at a change point itself: lengths must miss it.
"rounded" is what the state at the end changes by when l_3 goes from 2^-51 m less to 2^-51 m more,
half a spacing of doubles above 4 either way: arithmetic in doubles closes the loop to no less.

    python benchmarks/near_miss_reference.py OUT.json [T_END]
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mpmath as mp

mp.mp.dps = 46
ORDER = 32
TOLERANCE = mp.mpf(10) ** -38
LENGTHS, MASSES, GRAVITY = (1.0, 2.0, 3.0), (1.0, 2.0, 3.0), 9.81
START = 1.48352986419518014
ROUNDING = mp.mpf(2) ** -51


class FourBar:
    """Taylor coefficients in time of (theta_0..2, w) from those before."""

    def __init__(self, ground: float | mp.mpf) -> None:
        l = self.lengths = [mp.mpf(x) for x in LENGTHS]
        m = [mp.mpf(x) for x in MASSES]
        # thin rods with the inertia that doubles give it
        inertia = [mp.mpf(MASSES[k] * LENGTHS[k] ** 2 / 12) for k in range(3)]
        self.ground = mp.mpf(ground)
        after = [sum(m[k + 1 :], mp.mpf(0)) for k in range(3)]
        self.mu = [[mp.mpf(0)] * 3 for _ in range(3)]
        self.weight = [mp.mpf(GRAVITY) * l[k] * (m[k] / 2 + after[k]) for k in range(3)]
        for i in range(3):
            self.mu[i][i] = inertia[i] + m[i] * l[i] ** 2 / 4 + after[i] * l[i] ** 2
            for j in range(i):
                both = l[i] * l[j] * (m[i] / 2 + after[i])
                self.mu[i][j] = self.mu[j][i] = both

    def assemble(self, theta_0: float) -> list[mp.mpf]:
        """The elbow-up configuration."""
        l = self.lengths
        theta_0 = mp.mpf(theta_0)
        reach = self.ground - l[0] * mp.expj(theta_0)
        size = abs(reach)
        bend = mp.acos((l[1] ** 2 + size**2 - l[2] ** 2) / (2 * l[1] * size))
        theta_1 = mp.arg(reach) + bend
        return [theta_0, theta_1, mp.arg(reach - l[1] * mp.expj(theta_1))]

    def expand(self, q: list[mp.mpf], w: mp.mpf) -> list[list[mp.mpf]]:
        """Coefficients 0..ORDER of theta_0, theta_1, theta_2, w."""
        l, mu = self.lengths, self.mu
        pairs = [(1, 2), (2, 0), (0, 1)]  # n_i = l_j l_k sin(theta_k - theta_j)
        size = [l[j] * l[k] for j, k in pairs]
        th = [[x] for x in q]
        ws = [w]
        sines = [[mp.sin(q[k] - q[j])] for j, k in pairs]
        cosines = [[mp.cos(q[k] - q[j])] for j, k in pairs]
        level_sines = [[mp.sin(x)] for x in q]
        level = [[mp.cos(x)] for x in q]
        n, dn = [[], [], []], [[], [], []]  # n and its derivative along n
        nn: dict[tuple[int, int], list[mp.mpf]] = {
            (i, j): [] for i in range(3) for j in range(i + 1)
        }
        A, dA, dV, w2, top = [], [], [], [], []
        difference = {(2, 1): 0, (2, 0): 1, (1, 0): 2}
        slope, turning = [[], [], []], [[], [], []]
        products: dict[tuple[int, int], list[mp.mpf]] = {key: [] for key in difference}
        for o in range(ORDER):
            for i in range(3):
                n[i].append(size[i] * sines[i][o])
            for i, (j, k) in enumerate(pairs):
                slope[i].append(n[k][o] - n[j][o])
            for i in range(3):
                dn[i].append(size[i] * conv(cosines[i], slope[i], o))
            a = d = mp.mpf(0)
            for i in range(3):
                a += mu[i][i] * conv(n[i], n[i], o)
                d += 2 * mu[i][i] * conv(n[i], dn[i], o)
            for (i, j), c in difference.items():
                products[i, j].append(conv(n[i], n[j], o))
                a += 2 * mu[i][j] * conv(products[i, j], cosines[c], o)
                nn[i, j].append(conv(dn[i], n[j], o) + conv(n[i], dn[j], o))
                d += 2 * mu[i][j] * conv(nn[i, j], cosines[c], o)
                turning[c].append(conv(sines[c], slope[c], o))
                d -= 2 * mu[i][j] * conv(products[i, j], turning[c], o)
            A.append(a)
            dA.append(d)
            dV.append(sum(self.weight[i] * conv(level[i], n[i], o) for i in range(3)))
            w2.append(conv(ws, ws, o))
            top.append(-(conv(w2, dA, o) / 2 + dV[o]))
            # A * wdot = top
            wdot = top[o] - sum(A[o - s] * (s + 1) * ws[s + 1] for s in range(o))
            rate = [conv(ws, n[i], o) for i in range(3)]
            ws.append(wdot / A[0] / (o + 1))
            for i in range(3):
                th[i].append(rate[i] / (o + 1))
            for i, (j, k) in enumerate(pairs):
                turn(sines[i], cosines[i], [x - y for x, y in zip(th[k], th[j], strict=True)])
            for i in range(3):
                turn(level_sines[i], level[i], th[i])
        return [*th, ws]


def conv(a: list[mp.mpf], b: list[mp.mpf], o: int) -> mp.mpf:
    return mp.fdot((a[s], b[o - s]) for s in range(o + 1))


def turn(sine: list[mp.mpf], cosine: list[mp.mpf], angle: list[mp.mpf]) -> None:
    """The next coefficient of a sine and a cosine."""
    o = len(sine)
    s = mp.fdot((k * angle[k], cosine[o - k]) for k in range(1, o + 1)) / o
    c = -mp.fdot((k * angle[k], sine[o - k]) for k in range(1, o + 1)) / o
    sine.append(s)
    cosine.append(c)


def rounded(ground: float, t_end: float) -> list[str]:
    """The change of the state at the end over one rounding of the closure."""
    ends = [motion(ground + side * ROUNDING, [t_end])[str(mp.mpf(t_end))] for side in (-1, 1)]
    return [mp.nstr(mp.mpf(b) - mp.mpf(a), 8) for a, b in zip(*ends, strict=True)]


def motion(ground: float | mp.mpf, times: list[float]) -> dict[str, list[str]]:
    """States [theta, omega] at the times, from rest at 85 degrees."""
    bar = FourBar(ground)
    q, w, t = bar.assemble(START), mp.mpf(0), mp.mpf(0)
    states, steps = {}, 0
    for end in times:
        end = mp.mpf(end)
        while t < end:
            series = bar.expand(q, w)
            sizes = [(max(abs(c[o]) for c in series[:3]), o) for o in (ORDER - 1, ORDER)]
            allowed = [(TOLERANCE / size) ** (mp.mpf(1) / o) for size, o in sizes if size]
            h = min(min(allowed), end - t)
            q = [mp.polyval(c[::-1], h) for c in series[:3]]
            w = mp.polyval(series[3][::-1], h)
            t += h
            steps += 1
        n = normal(bar, q)
        states[str(end)] = [mp.nstr(x, 20) for x in [*q, *(w * x for x in n)]]
    gap = sum(l * mp.expj(x) for l, x in zip(bar.lengths, q, strict=True)) - bar.ground
    print(f"l_3 = {ground!r}: {steps} steps, closure {mp.nstr(abs(gap), 3)}", flush=True)
    return states


def normal(bar: FourBar, q: list[mp.mpf]) -> list[mp.mpf]:
    l = bar.lengths
    pairs = [(1, 2), (2, 0), (0, 1)]
    return [l[j] * l[k] * mp.sin(q[k] - q[j]) for j, k in pairs]


def main() -> None:
    out = Path(sys.argv[1])
    t_end = float(sys.argv[2]) if len(sys.argv) > 2 else 3.0
    found = json.loads(out.read_text()) if out.exists() else {}
    times = [t_end / 6 * k for k in range(1, 7)]
    grounds = [4.0 + sign * 10.0**-k for k in range(1, 17) for sign in (-1, 1)]
    for ground in [3.5, *grounds]:
        if ground == 4.0 or repr(ground) in found:
            continue
        found[repr(ground)] = motion(ground, times)
        found[repr(ground)]["rounded"] = rounded(ground, t_end)
        out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
