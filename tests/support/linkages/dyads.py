"""Planar linkages made of dyads, in natural coordinates; their assemblies by intersecting circles.

A dyad is a joint at given distances from two joints that are known before it.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from tests.support.linkages.python_scene import PythonScene


@dataclass(frozen=True)
class Linkage:
    """Known joints (name -> place) and dyads (joint, one, distance, other, distance)."""

    known: dict
    dyads: tuple

    @property
    def joints(self):
        return tuple(dyad[0] for dyad in self.dyads)

    @property
    def rods(self):
        """(joint, joint, distance), two for every dyad."""
        return [
            rod
            for joint, a, one, b, other in self.dyads
            for rod in ((joint, a, one), (joint, b, other))
        ]  # fmt: skip

    def scaled(self, by):
        """The same shape in another unit of length."""
        known = {name: by * np.asarray(place) for name, place in self.known.items()}
        return Linkage(
            known, tuple((j, a, by * one, b, by * two) for j, a, one, b, two in self.dyads)
        )

    def assemblies(self):
        """Places of the joints (n, joints, 2) in every assembly, each circle cut on both sides."""
        found = []
        for sides in product((1.0, -1.0), repeat=len(self.dyads)):
            places = {name: complex(*place) for name, place in self.known.items()}
            for side, (joint, a, one, b, other) in zip(sides, self.dyads, strict=True):
                places[joint] = cut(places[a], one, places[b], other, side)
            row = [places[joint] for joint in self.joints]
            if np.isfinite(row).all():
                found.append([(z.real, z.imag) for z in row])
        return np.array(found).reshape(len(found), len(self.dyads), 2)

    def clearance(self):
        """How far the circles are from touching, of the largest distance; negative: some miss."""
        least = np.inf
        for places in self.assemblies():
            known = dict(self.known) | dict(zip(self.joints, places, strict=True))
            for _, a, one, b, other in self.dyads:
                apart = np.linalg.norm(np.subtract(known[a], known[b]))
                least = min(least, one + other - apart, apart - abs(one - other))
        return least / max(distance for _, _, distance in self.rods)


def cut(a, one, b, other, side):
    """Where circles about a and b meet, NaN where they do not."""
    apart = abs(b - a)
    along = (one**2 - other**2 + apart**2) / (2 * apart)
    square = one**2 - along**2
    if not square >= 0:
        return complex(np.nan)
    return a + (b - a) / apart * complex(along, side * np.sqrt(square))


def four_bar(crank):
    pin = 1.0 * np.array([np.cos(crank), np.sin(crank)])
    return Linkage({"A": pin, "D": (3.5, 0.0)}, (("B", "A", 2.0, "D", 3.0),))


def watt(crank):
    """A four-bar whose rocker drives another one."""
    pin = np.array([np.cos(crank), np.sin(crank)])
    known = {"A": pin, "D": (3.5, 0.0), "G": (8.0, 1.0)}
    return Linkage(
        known,
        (("B", "A", 3.0, "D", 2.5), ("C", "B", 1.5, "D", 2.0), ("F", "C", 4.0, "G", 3.5)),
    )


def klann(crank):
    """Klann's walking leg, mm (boim.com; J. Klann, US patent 6,260,862)."""
    pin = 17.5 * np.array([np.cos(crank), np.sin(crank)])
    known = {"B": (-38.8, -12.5), "C": pin, "D": (-14.6, 41.9)}
    return Linkage(
        known,
        (
            ("H", "B", 23.7, "C", 38.8), ("F", "C", 73.4, "H", 35.2), ("E", "D", 34.1, "F", 57.7),
            ("G", "E", 111.7, "F", 59.0),
        ),
    )  # fmt: skip


def jansen(crank):
    """Jansen's leg by the lengths of its inventor (T. Jansen 2007, The Great Pretender)."""
    pin = 15.0 * np.array([np.cos(crank), np.sin(crank)])
    return Linkage(
        {"C": pin, "D": (-38.0, -7.8)},
        (
            ("E", "C", 50.0, "D", 41.5), ("F", "E", 55.8, "D", 40.1), ("G", "C", 61.9, "D", 39.3),
            ("H", "F", 39.4, "G", 36.7), ("I", "H", 65.7, "G", 49.0),
        ),
    )  # fmt: skip


class Rows(PythonScene):
    """Rods of a linkage, each as its length or its square, times a factor."""

    def __init__(self, linkage, squared, factors):
        self.linkage, self.squared, self.factors = linkage, np.asarray(squared), np.asarray(factors)
        super().__init__(2 * len(linkage.dyads), 2 * len(linkage.dyads))

    def evaluate(self, name, q, u):
        q = q.reshape(len(q), -1, 2)
        places = {joint: q[:, i] for i, joint in enumerate(self.linkage.joints)}
        places |= {
            n: np.broadcast_to(place, (len(q), 2)) for n, place in self.linkage.known.items()
        }
        values = np.zeros((len(q), self.rows))
        slopes = np.zeros((len(q), self.rows, len(self.linkage.joints), 2))
        for i, (a, b, length) in enumerate(self.linkage.rods):
            rod = places[a] - places[b]
            square = (rod**2).sum(axis=1)
            factor = self.factors[i]
            if self.squared[i]:
                values[:, i], slope = factor * (square - length**2), 2 * factor * rod
            else:
                size = np.sqrt(square)
                values[:, i], slope = (
                    factor * (size - length),
                    factor * rod / np.maximum(size, 1e-300)[:, None],
                )
            for joint, sign in ((a, 1.0), (b, -1.0)):
                if joint in self.linkage.joints:
                    slopes[:, i, self.linkage.joints.index(joint)] += sign * slope
        return values if name == "constraints" else slopes
