"""Random mechanisms: trees and single loops of one to six bodies, planar and spatial.

A :class:`Linkage` is plain data.  From it come a ``Mechanism`` (by Kane's method), the same by its
Lagrangian, and a ``System`` of SymPy's joints; ``textbook`` evaluates it without any of them.
Every number is a fraction, so that all of them mean the same linkage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

GROUND = -1
Vector3 = tuple[Fraction, Fraction, Fraction]


@dataclass(frozen=True)
class Link:
    """One body with the joint that it hangs on.

    ``place`` is where the joint sits on the parent, seen from the parent's own joint; ``centre``
    the mass centre, seen from the joint; both in units of the length ``l``, in axes that are those
    of the parent where the coordinate is zero.  ``inertia``: xx, yy, zz, xy, yz, zx in m l^2.
    ``spring``, ``damper`` and ``driven`` (by a torque or force of time) are 1 where there is one.
    """

    parent: int
    turns: bool
    axis: Vector3
    place: Vector3
    centre: Vector3
    inertia: tuple[Fraction, ...]
    spring: int
    damper: int
    driven: int


@dataclass(frozen=True)
class Loop:
    """``point`` of ``link`` stays at ``target`` of ``target_link`` along inertial ``axes``."""

    link: int
    point: Vector3
    target_link: int
    target: Vector3
    axes: tuple[int, ...]


@dataclass(frozen=True)
class Linkage:
    """Links, each after its parent; at most one loop; the direction of gravity."""

    links: tuple[Link, ...]
    gravity: Vector3
    loop: Loop | None = None

    def path(self, link: int) -> list[int]:
        """The link and all that it hangs on."""
        found = []
        while link != GROUND:
            found.append(link)
            link = self.links[link].parent
        return found

    @property
    def names(self) -> list[str]:
        """Of the parameters."""
        return ["l", "g", "k", "d", "tau", *(f"m_{k}" for k in range(len(self.links)))]


# -- strategies -----------------------------------------------------------------------------------

X, Y, Z = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
SLANTED = tuple(
    (Fraction(a, n), Fraction(b, n), Fraction(c, n)) for a, b, c, n in ((1, 2, 2, 3), (2, -3, 6, 7))
)
eighths = st.integers(-8, 8).map(lambda n: Fraction(n, 8))
often = st.sampled_from((True, True, True, False))
seldom = st.sampled_from((0, 0, 1))


@st.composite
def linkages(draw: st.DrawFn, most: int = 6, *, loop: bool | None = None) -> Linkage:
    """A linkage of at most ``most`` bodies; with a loop, without, or either."""
    planar = draw(st.booleans())
    closed = draw(st.booleans()) if loop is None else loop
    count = draw(st.integers(2 if closed else 1, most))
    links = tuple(draw(_links(k, planar, chain=closed)) for k in range(count))
    gravity = draw(st.sampled_from((Y, X) if planar else (Y, Z, SLANTED[0])))
    down: Vector3 = tuple(Fraction(-a) for a in gravity)  # type: ignore[assignment]
    return Linkage(links, down, draw(_loops(links, planar)) if closed else None)


@st.composite
def _links(draw: st.DrawFn, k: int, planar: bool, chain: bool) -> Link:
    """A chain where it is to be closed: every joint is then in the loop."""
    turns = draw(often)
    if planar:
        axis = Z if turns else draw(st.sampled_from((X, Y)))
    else:
        axis = draw(st.sampled_from((X, Y, Z, *SLANTED)))
    before = k - 1 if chain or k == 0 else draw(st.integers(GROUND, k - 1))
    return Link(
        parent=before,
        turns=turns,
        axis=_fractions(axis),
        place=draw(_arms(planar)),
        centre=draw(_arms(planar)),
        inertia=draw(_inertias(planar)),
        spring=draw(seldom),
        damper=draw(seldom),
        driven=draw(seldom),
    )


def _fractions(entries: Sequence[int | Fraction]) -> Vector3:
    x, y, z = map(Fraction, entries)
    return x, y, z


def _arms(planar: bool) -> st.SearchStrategy[Vector3]:
    across = st.just(Fraction(0)) if planar else eighths
    return st.tuples(eighths, eighths, across)


@st.composite
def _inertias(draw: st.DrawFn, planar: bool) -> tuple[Fraction, ...]:
    """From second moments a, b, c and small products: positive definite, and a body's."""
    a, b, c = (Fraction(draw(st.integers(2, 8)), 32) for _ in range(3))
    products = [Fraction(0 if planar else draw(st.integers(-1, 1)), 64) for _ in range(3)]
    return (b + c, a + c, a + b, *products)


@st.composite
def _loops(draw: st.DrawFn, links: Sequence[Link], planar: bool) -> Loop:
    """From the end of the chain to the ground or a link: less rows than joints between."""
    last = len(links) - 1
    target_link = draw(st.integers(GROUND, last - 2))
    most = min(2 if planar else 3, last - target_link - 1)
    chosen = draw(st.permutations((0, 1) if planar else (0, 1, 2)))[: draw(st.integers(1, most))]
    return Loop(
        link=last,
        point=draw(_arms(planar)),
        target_link=target_link,
        target=draw(_arms(planar)),
        axes=tuple(sorted(chosen)),
    )


@st.composite
def states(draw: st.DrawFn, size: int) -> tuple[float, list[float], list[float]]:
    """Time, coordinates and speeds; exact in binary."""
    numbers = st.integers(-24, 24).map(lambda n: n / 16)
    q, u = (draw(st.lists(numbers, min_size=size, max_size=size)) for _ in range(2))
    return draw(st.integers(0, 16)) / 8, q, u


def values(linkage: Linkage) -> dict[str, float]:
    """Of the parameters; exact in binary."""
    masses = {f"m_{k}": 1 + 0.375 * k for k in range(len(linkage.links))}
    return {"l": 1.25, "g": 9.75, "k": 3.5, "d": 0.75, "tau": 2.5, **masses}


def examples(count: int) -> settings:
    """So many of them, or in proportion to those of the profile (``--hypothesis-profile``)."""
    share = settings.default.max_examples / 100
    slow = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large]
    return settings(max_examples=max(1, round(count * share)), suppress_health_check=slow)
