"""The four-bar in other units, with other masses, lengths and tolerances, and at dead points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

import mechc

from ..problems.data import four_bar_state
from ..problems.redundant import spatial, two_rockers
from ..references.linkage_curve import PlanarLinkage, four_bar
from .judge import ROUNDING, Row, limit_of, runs, speeds_apart, verdict
from .misses.on_curve import judged, margins

ULPS = 10 * 4.4e-16  # m: closure kept to an ulp or two of the longest link turns the shortest
REGULAR: Mapping[str, float] = {"l_3": 3.5}
GROUNDS = {"regular": 3.5, "change_point": 4.0}
CONDITION = {"regular": 5.8, "change_point": 80.0}  # largest |d state / d start| in 20 s
RTOLS = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
T_END = 20.0
START = np.radians(85)
# Constraints that say the same twice: a second rocker that moves as the first; five rows in space.
REDUNDANT = {
    "two rockers": (two_rockers, {}),
    "in space": (spatial, {"tilt_0": 0.3, "tilt_1": 0.7}),
}


def units(quick: bool) -> Iterator[Row]:
    """Both reference scenes written in other units: the same angles, speeds per unit of time."""
    for name in GROUNDS:
        for scale in (1e-9, 1e-6, 1e-3, 1e3, 1e6):
            lengths = {f"l_{k}": scale * l for k, l in enumerate((1.0, 2.0, 3.0, GROUNDS[name]))}
            params = {**lengths, "g": 9.81 * scale}
            yield from _reference(f"{scale:g} m", name, params, _some(quick))
        for scale in (1e-15, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e15):
            params = {"l_3": GROUNDS[name], **{f"m_{k}": scale * (k + 1) for k in range(3)}}
            yield from _reference(f"{scale:g} kg", name, params, _some(quick))
        for scale in (1e-6, 1e-3, 1e3, 1e6):
            params = {"l_3": GROUNDS[name], "g": 9.81 * scale**2}
            yield from _reference(f"{scale:g} s", name, params, _some(quick), clock=scale)


def tolerances(quick: bool) -> Iterator[Row]:
    for name in GROUNDS:
        rtols = [10.0**-k for k in range(2, 16)]
        yield from _reference("", name, {"l_3": GROUNDS[name]}, rtols)


def mass_ratios(quick: bool) -> Iterator[Row]:
    ratios = (1e-8, 1e8) if quick else (1e-8, 1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e6, 1e8)
    for k in range(3):
        for ratio in ratios:
            params = {**REGULAR, f"m_{k}": ratio}
            case = f"m_{k} = {ratio:g} kg"
            # A rocker of 1e8 kg swings the light links through a dead point in microseconds, where
            # rounding stops the judge: it is followed until then.
            t_end = 0.5 if k == 2 and ratio == 1e8 else 5.0
            yield from _judged(case, params, {"theta_0": START}, t_end, _some(quick))


def length_ratios(quick: bool) -> Iterator[Row]:
    """One link ever shorter than the others, for as many swings of its own."""
    for k in (4, 8) if quick else range(1, 9):
        short = 10.0**-k
        fall = short**0.5
        for name, lengths, at, t_end in (
            ("crank", (short, 3.0, 3.0, 3.5), "theta_0", 5 * fall),
            ("coupler", (3.0, short, 3.5, 4.0), "theta_1", 5 * fall),
            ("rocker", (3.0, 3.5, short, 4.0), "theta_2", 5 * fall),
            ("ground", (3.0, 2.0, 2.5, short), "theta_0", 5.0),
        ):
            params = {f"l_{i}": l for i, l in enumerate(lengths)}
            yield from _judged(f"{name} {short:g} m", params, {at: START}, t_end, _some(quick))


def dead_points(quick: bool) -> Iterator[Row]:
    """Coupler and rocker in line at the ends of the crank's swing; and crank and coupler."""
    for case, lengths, start, pace, t_end in (
        ("coupler and rocker", (3.0, 1.2, 2.0, 4.0), 0.5, 3.0, 3.0),
        ("coupler and rocker, fast", (3.0, 1.2, 2.0, 4.0), 0.5, 30.0, 1.0),
        ("crank and coupler", (1.0, 2.5, 2.0, 3.0), 1.0, 12.0, 2.0),
    ):
        params = {f"l_{i}": l for i, l in enumerate(lengths)}
        first = {"theta_0": start}
        yield from _judged(case, params, first, t_end, _some(quick), {"omega_0": pace}, in_line)


def in_line(sol: mechc.Solution) -> bool:
    """Whether two neighbouring links pass through one line."""
    bends = [np.sin(sol.q[:, i + 1] - sol.q[:, i]) for i in range(2)]
    return any(bend.min() < 0 < bend.max() for bend in bends)


def open_starts(quick: bool) -> Iterator[Row]:
    """One angle or one speed of a closed start moved; the motion is that of the closed one."""
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": 1.0}, speeds={"omega_0": 1.0}, params=REGULAR)
    linkage = _linkage(REGULAR)
    exact, (_, condition) = linkage.integrate(y0, np.array([2.0]))[0], margins(linkage, y0, 2.0)
    for place, name in ((1, "theta_1"), (4, "omega_1")):
        for gap in (1e-16, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0, 1e8):
            moved = y0.copy()
            moved[place] += gap
            for _, method, rtol, found in runs(model, 2.0, moved, REGULAR, rtols=(1e-10,)):
                case, limit = f"{name} off by {gap:g}, {method}", limit_of(rtol + gap, condition)
                yield verdict(case, found, exact, limit, gap=gap)


def redundant(quick: bool) -> Iterator[Row]:
    """Against the exact states of the planar four-bar; the second rocker moves as the first."""
    plain = mechc.load("four_bar")
    for which, (build, turned) in REDUNDANT.items():
        model = mechc.compile(build())
        twin = [0, 1, 2, 2][: len(model.coordinates)]
        twin += [3 + k for k in twin]
        for name, ground in GROUNDS.items():
            y0 = plain.assemble({"theta_0": START}, params={"l_3": ground})[twin]
            exact = four_bar_state(name, T_END)[twin]
            scale = speeds_apart(exact, len(model.coordinates))
            params = {"l_3": ground, **turned}
            for told, _, rtol, found in runs(model, T_END, y0, params, rtols=_some(quick)):
                limit = limit_of(rtol, CONDITION[name])
                yield verdict(f"{which}, {name}, {told}", found, exact, limit, scale)


# -- runs ---------------------------------------------------------------------------------------


def _some(quick: bool) -> Sequence[float]:
    return (1e-8,) if quick else RTOLS


def _reference(
    case: str, name: str, params: Mapping[str, float], rtols: Sequence[float], clock: float = 1.0
) -> Iterator[Row]:
    """Against the exact states; ``clock``: units of time in a second."""
    model = mechc.load("four_bar")
    exact = four_bar_state(name, T_END)
    pace = np.where(np.arange(6) < 3, 1.0, clock)
    y0 = model.assemble({"theta_0": START}, params=params)
    for told, _, rtol, found in runs(model, T_END / clock, y0, params, rtols=rtols):
        which, limit = ", ".join(filter(None, (case, name, told))), limit_of(rtol, CONDITION[name])
        yield verdict(which, found, exact * pace, limit, speeds_apart(exact, 3) * pace)


def _judged(
    case: str, params: Mapping[str, float], first: Mapping[str, float], t_end: float,
    rtols: Sequence[float], speeds: Mapping[str, float] | None = None, met=None,  # type: ignore[no-untyped-def]
) -> Iterator[Row]:  # fmt: skip
    """Against the motion on the curve of configurations; ``met``: what the run is to go through."""
    model = mechc.load("four_bar")
    y0, linkage = model.assemble(first, speeds=speeds, params=params), _linkage(params)
    rounding = max(ROUNDING, ULPS / min(*linkage.lengths, linkage.grounds[0][0]))
    for how, _, rtol, found in runs(model, t_end, y0, params, rtols=rtols):
        told = f"{case}, {how}"
        if met and not isinstance(found, str) and found.status.ok and not met(found):
            raise RuntimeError(f"{told}: the scene misses what it is made for")
        yield judged(told, found, linkage, y0, lambda state: state, t_end, rtol, rounding)


def _linkage(params: Mapping[str, float]) -> PlanarLinkage:
    """Lengths and masses that are not given are the default ones."""
    lengths = [params.get(f"l_{k}", k + 1.0) for k in range(4)]
    return four_bar(lengths, [params.get(f"m_{k}", k + 1.0) for k in range(3)])
