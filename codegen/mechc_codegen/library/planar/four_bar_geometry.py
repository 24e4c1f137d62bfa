"""Grashof's class, crank limits and change points of a four-bar linkage from its lengths."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from math import atan2, degrees, fsum, sqrt, ulp

LENGTHS = ("l_0", "l_1", "l_2", "l_3")
BY_SHORTEST = {
    "l_0": "crank-rocker: the crank (shortest) turns fully, the rocker swings",
    "l_1": "double-rocker: the coupler (shortest) turns fully, crank and rocker swing",
    "l_2": "rocker-crank: the rocker (shortest) turns fully, the crank swings",
    "l_3": "double-crank: the ground is shortest, crank and rocker both turn fully",
}


def geometry_notes(parameters: Mapping[str, float]) -> list[tuple[str, str]]:
    """Grashof class, limits of theta_0 and change points of the given lengths, in words."""
    lengths = [parameters[name] for name in LENGTHS]
    return [
        ("Grashof class", grashof_class(lengths)),
        ("Limits of theta_0", _limits_in_words(lengths)),
        ("Change points", _change_points_in_words(lengths)),
    ]


def grashof_class(lengths: list[float]) -> str:
    """Shortest plus longest against the other two (Grashof 1883), and which link is shortest."""
    shortest, second, third, longest = sorted(lengths)
    slack = _slack(lengths)
    if slack < 0:
        return "cannot be assembled: the longest link exceeds the sum of the others"
    if slack == 0:
        return "a structure: it closes only with all links in line and cannot move"
    margin = _snap(fsum((second, third, -shortest, -longest)), lengths)
    if margin == 0:
        return "change-point linkage: shortest + longest = sum of the other two"
    if margin < 0:
        return "triple-rocker (not Grashof): no link turns fully"
    return BY_SHORTEST[LENGTHS[lengths.index(shortest)]]


def crank_limits(lengths: list[float]) -> tuple[float, float] | None:
    """Smallest and largest |theta_0| in [0, pi] for which the loop closes; None if there is none.

    The distance of p_1 from the rocker's pivot must lie between |l_1 - l_2| and l_1 + l_2.
    """
    _, l1, l2, _ = lengths
    if _slack(lengths) < 0:
        return None
    return _angle_at_reach(abs(l1 - l2), lengths), _angle_at_reach(l1 + l2, lengths)


def change_points(lengths: list[float]) -> list[tuple[float, float, float]]:
    """The collinear configurations (angles 0 or 180 degrees) that close the loop to rounding."""
    return [
        (_angle_of_sign(a), _angle_of_sign(b), _angle_of_sign(c))
        for a, b, c in product((1, -1), repeat=3)
        if _snap(_gap((a, b, c), lengths), lengths) == 0
    ]


def _angle_at_reach(reach: float, lengths: list[float]) -> float:
    """|theta_0| at which p_1 is ``reach`` from the rocker's pivot, clamped to [0, pi].

    Half angles keep full accuracy near 0 and pi, where the cosine alone would lose half the
    digits.
    """
    l0, _, _, l3 = lengths
    beyond_folded = _snap(reach - abs(l0 - l3), lengths)
    short_of_straight = _snap(l0 + l3 - reach, lengths)
    sine = max(beyond_folded, 0.0) * (reach + abs(l0 - l3))
    cosine = max(short_of_straight, 0.0) * (l0 + l3 + reach)
    return 2 * atan2(sqrt(sine), sqrt(cosine))


def _slack(lengths: list[float]) -> float:
    """Sum of the three shorter links minus the longest."""
    *others, longest = sorted(lengths)
    return _snap(fsum((*others, -longest)), lengths)


def _gap(signs: tuple[int, int, int], lengths: list[float]) -> float:
    return fsum((*(s * l for s, l in zip(signs, lengths[:3], strict=True)), -lengths[3]))


def _snap(difference: float, lengths: list[float]) -> float:
    """Zero where ``difference`` is the rounding of the lengths: 0.1 + 0.4 is 0.2 + 0.3."""
    return 0.0 if abs(difference) <= 4 * ulp(max(lengths)) else difference


def _angle_of_sign(sign: int) -> float:
    return 0.0 if sign > 0 else 180.0


def _limits_in_words(lengths: list[float]) -> str:
    limits = crank_limits(lengths)
    if limits is None:
        return "no theta_0 closes the loop"
    low, high = map(degrees, limits)
    if low == 0 and high == 180:
        return "none: the loop closes at every theta_0"
    if low == high:
        return f"theta_0 = {low:g} deg is the only angle at which the loop closes"
    if low == 0:
        return f"from {-high:.8g} to {high:.8g} deg, through 0"
    if high == 180:
        return f"from {low:.8g} to {360 - low:.8g} deg, through 180 deg"
    return (
        f"from {low:.8g} to {high:.8g} deg, or from {-high:.8g} to {-low:.8g} deg: the linkage "
        "cannot pass from one range to the other"
    )


def _change_points_in_words(lengths: list[float]) -> str:
    found = change_points(lengths)
    if not found:
        return "none: these lengths never bring all links in line"
    places = "; ".join(
        f"theta_0 = {a:g}, theta_1 = {b:g}, theta_2 = {c:g} deg" for a, b, c in found
    )
    if _slack(lengths) == 0:
        return f"the only configuration is {places}; the linkage is locked there"
    return (
        f"all links are in line at {places}. There the configuration curve crosses itself: the "
        "ideal linkage passes straight on, a real one has to be guided"
    )
