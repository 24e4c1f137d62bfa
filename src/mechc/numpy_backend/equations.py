"""The equations of a scene without C, of many states at once.

Expanded expressions are functions of the program; a tree's mass matrix, forcing and rows are
computed link by link.

Arrays have states first: q (n, nq), u (n, nu), p and k (n or 1, ...), t (n,) or (1,).
"""

from __future__ import annotations

from copy import copy
from typing import Any, NamedTuple

import numpy as np

from mechc.numpy_backend.linear import Rows, diagonal, free_motion
from mechc.numpy_backend.program import Filled, Functions
from mechc.numpy_backend.tree import LinkTree, TreeData
from mechc.system.parameters import Array

State = tuple[Array, Array, Array, Array, Array]  # t, q, u, p, k


class Place(NamedTuple):
    """What depends on the configuration: gap (n, nh), J (n, nc, nu), b of J u + b = 0 (n, nc), M,
    values for the functions of the speeds, and the geometry of a tree."""

    gap: Array
    jacobian: Array
    bias: Array
    mass: Array
    saved: Array
    tree: TreeData | None


class ArrayEquations:
    """A listing of :mod:`mechc_codegen.emit.numpy` as functions of arrays.

    ``inputs``: the values of inputs that are given with a run, as compiled scenes take them.
    """

    inputs: Any = None

    def __init__(self, listing: Any) -> None:
        self.listing = listing
        self.functions = Functions(listing.text)
        self.tree = LinkTree(listing.tree) if listing.tree is not None else None

    def with_inputs(self, inputs: Any) -> ArrayEquations:
        """The same equations with these values of the inputs."""
        other = copy(self)
        other.inputs = inputs
        return other

    def constants(self, p: Array) -> Array:
        return self.functions.constants(self.listing.constants, p)

    def place(self, t: Array, q: Array, p: Array, k: Array) -> Place:
        listing, count = self.listing, max(len(q), len(t), len(p))
        still = np.zeros((1, listing.speeds))
        filled = self._fill("configuration", listing.configuration, t, q, still, p, k)
        gap = filled.get("gap", np.zeros((count, 0)))
        bias = filled.get("bias", np.zeros((count, listing.rows)))
        if self.tree is None:
            mass = filled["mass"].reshape(count, listing.speeds, -1)
            rows = filled.get("jacobian", np.zeros((count, 0)))
            jacobian = rows.reshape(count, listing.rows, listing.speeds)
            return Place(gap, jacobian, bias, mass, filled["saved"], None)
        with np.errstate(all="ignore"):
            data = self.tree.data(filled)
            rows = np.zeros((count, 0, listing.speeds))
            if listing.rows:
                rows = self.tree.cut_rows(data)
            return Place(gap, rows, bias, self.tree.mass_matrix(data), filled["saved"], data)

    def terms(
        self, t: Array, q: Array, u: Array, p: Array, k: Array, place: Place
    ) -> tuple[Array, Array]:
        """F (n, nu) and gamma (n, nc)."""
        filled = self._fill("motion", self.listing.motion, t, q, u, p, k, place.saved)
        gamma = filled.get("gamma", np.zeros((len(place.mass), self.listing.rows)))
        if self.tree is None or place.tree is None:
            return filled["forcing"], gamma
        with np.errstate(all="ignore"):
            return self.tree.forcing(place.tree, filled["bias"], filled["wrench"]), gamma

    def coordinate_rates(self, t: Array, q: Array, u: Array, p: Array, k: Array) -> Array:
        """q' (n, nq)."""
        if self.listing.identity_kinematics:
            return u
        return self.written("coordinate_rates", t, q, u, p, k)

    def written(
        self, name: str, t: Array, q: Array, u: Array, p: Array, k: Array,
        motion: tuple[Array, Array] | None = None,
    ) -> Array:  # fmt: skip
        """An output with a separate function (n, length); motion: u' and multipliers, if it needs
        them."""
        function, length = self.listing.written[name]
        solved = motion or (np.zeros((1, 0)), np.zeros((1, 0)))
        return self._filled(function, (length,), t, q, u, p, k, *solved)[0]

    def _fill(
        self, name: str, targets: dict[str, int], t: Array, q: Array, u: Array, p: Array, k: Array,
        saved: Array | None = None,
    ) -> dict[str, Array]:  # fmt: skip
        """Arrays by name; the last array of a function without saved values is for them."""
        if saved is not None:
            found = self._filled(name, tuple(targets.values()), t, q, u, p, k, saved)
            return dict(zip(targets, found, strict=True))
        lengths = (self.listing.saved, *targets.values())
        found = self._filled(name, lengths, t, q, u, p, k)
        return dict(zip(("saved", *targets), found, strict=True))

    def _filled(self, name: str, lengths: tuple[int, ...], t: Array, *rows: Array) -> Filled:
        return self.functions.fill(name, lengths, t, *rows, inputs=self.inputs)


def rows_of(place: Place) -> Rows:
    """The constraint rows, decomposed in the metric of M's diagonal."""
    return Rows(place.jacobian, diagonal(place.mass))


def accelerations(
    place: Place, forcing: Array, gamma: Array, rows: Rows | None = None
) -> tuple[Array, Array]:
    """u' (n, nu) and multipliers (n, nc); rows: those of the configuration, if known."""
    if not gamma.shape[1]:
        return free_motion(place.mass, forcing), gamma
    return (rows or rows_of(place)).motion(place.mass, forcing, gamma)
