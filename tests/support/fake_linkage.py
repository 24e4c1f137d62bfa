"""A four-bar whose motion is exact, made without mechc: lengths 1, 2, 3 and 3.5 m, g = 9.81.

The linkage starts from rest at 85 degrees and swings between its two turning angles.  With
theta_0 = mean - amplitude cos(s), energy gives dt/ds, whose cosine series is integrated term by
term; so t(s) is exact to rounding and the state follows from closed-form trigonometry.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mechc
from mechc.system.picture import Picture
from mechc.system.quantity import Kind

Array = NDArray[np.float64]
LENGTHS = (1.0, 2.0, 3.0)
GROUND = 3.5
MASSES = np.array([1.0, 2.0, 3.0])
G = 9.81
FIRST, LAST = np.deg2rad(85.0), np.deg2rad(412.48633345706614341)
HALF_PERIOD = 1.6607240639610833


def direction(angle: Array) -> Array:
    """Unit vectors (..., 3) in the plane."""
    return np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)


def normal(angle: Array) -> Array:
    """Those unit vectors a quarter turn on."""
    return direction(angle + np.pi / 2)


def configuration(crank: Array) -> Array:
    """Elbow-up angles (..., 3) for each crank angle."""
    l_0, l_1, l_2 = LENGTHS
    gap = np.array([GROUND, 0.0, 0.0]) - l_0 * direction(crank)
    length = np.linalg.norm(gap, axis=-1)
    slope = np.arctan2(gap[..., 1], gap[..., 0])
    theta_1 = slope + np.arccos((l_1**2 + length**2 - l_2**2) / (2 * l_1 * length))
    theta_2 = slope - np.arccos((l_2**2 + length**2 - l_1**2) / (2 * l_2 * length))
    return np.stack([crank, theta_1, theta_2], axis=-1)


def speed_ratios(q: Array) -> Array:
    """Speeds (..., 3) at unit crank speed: closure's velocity, solved by Cramer's rule."""
    l_0, l_1, l_2 = LENGTHS
    first, second, third = (q[..., i] for i in range(3))
    bend = np.sin(third - second)
    return np.stack(
        [
            np.ones_like(first),
            -l_0 * np.sin(third - first) / (l_1 * bend),
            -l_0 * np.sin(first - second) / (l_2 * bend),
        ],
        axis=-1,
    )


def joints(q: Array) -> Array:
    """O, p_1, p_2, p_3 and the centres: (..., 7, 3) m; p_3 is the rocker's own end."""
    links = [length * direction(q[..., i]) for i, length in enumerate(LENGTHS)]
    ends = np.cumsum([np.zeros_like(links[0]), *links], axis=0)
    return np.stack([*ends, *((ends[:-1] + ends[1:]) / 2)], axis=-2)


def potential(q: Array) -> Array:
    """Of gravity, J, zero where all centres lie on the ground line."""
    return np.asarray(G * (MASSES * joints(q)[..., 4:, 1]).sum(axis=-1))


def kinetic(q: Array, u: Array) -> Array:
    """Thin rods: each carries m v²/2 of its centre and m l² u²/24 about it."""
    swept = [u[..., i : i + 1] * length * normal(q[..., i]) for i, length in enumerate(LENGTHS)]
    ends = np.cumsum([np.zeros_like(swept[0]), *swept], axis=0)
    centres = (ends[:-1] + ends[1:]) / 2
    translation = sum(m * (v**2).sum(axis=-1) for m, v in zip(MASSES, centres, strict=True))
    spin = (MASSES * np.square(LENGTHS) * u**2).sum(axis=-1) / 12
    return np.asarray((translation + spin) / 2)


@cache
def time_series(nodes: int = 96) -> Array:
    """Cosine coefficients of dt/ds, (nodes,) s, from its values between the turning points."""
    middle, amplitude = (LAST + FIRST) / 2, (LAST - FIRST) / 2
    s = np.pi * (np.arange(nodes) + 0.5) / nodes
    q = configuration(middle - amplitude * np.cos(s))
    drop = potential(configuration(np.array(FIRST))) - potential(q)
    speed = np.sqrt(drop / kinetic(q, speed_ratios(q)))
    table = np.cos(np.outer(np.arange(nodes), s)) @ (amplitude * np.sin(s) / speed) * 2 / nodes
    table[0] /= 2
    return np.asarray(table)


def exact_state(t: Array) -> Array:
    """The true motion: (..., 6), angles in rad and speeds in rad/s."""
    table, order = time_series(), np.arange(1, len(time_series()))
    t = np.asarray(t, dtype=float)
    s = np.pi * t / HALF_PERIOD
    for _ in range(12):
        angles = s[..., None] * order
        elapsed = table[0] * s + (np.sin(angles) * table[1:] / order).sum(axis=-1)
        s = s - (elapsed - t) / (table[0] + (np.cos(angles) * table[1:]).sum(axis=-1))
    amplitude = (LAST - FIRST) / 2
    q = configuration((LAST + FIRST) / 2 - amplitude * np.cos(s))
    rate = table[0] + (np.cos(s[..., None] * order) * table[1:]).sum(axis=-1)
    crank_speed = amplitude * np.sin(s) / rate
    return np.concatenate([q, crank_speed[..., None] * speed_ratios(q)], axis=-1)


def quantities(units: Mapping[str, str]) -> dict[str, Any]:
    """Quantities of these units, with the kinds that the compiler gives them."""
    kinds = {unit: Kind(str(mechc.Quantity(unit, "").kind)) for unit in units.values()}
    return {name: SimpleNamespace(unit=u, kind=kinds[u]) for name, u in units.items()}


@dataclass(frozen=True)
class FakeModel:
    """What the drawing modules ask of a system."""

    name: str = "four_bar"
    title: str = "Planar four-bar linkage"
    coordinates: tuple[str, ...] = ("theta_0", "theta_1", "theta_2")
    speeds: tuple[str, ...] = ("omega_0", "omega_1", "omega_2")
    units: Mapping[str, str] = field(
        default_factory=lambda: {
            **{f"theta_{i}": "rad" for i in range(3)},
            **{f"omega_{i}": "rad/s" for i in range(3)},
        }
    )
    point_names: tuple[str, ...] = ("O", "p_1", "p_2", "p_3", "g_0", "g_1", "g_2")
    skeleton: tuple[tuple[str, tuple[str, ...]], ...] = (
        ("crank", ("O", "p_1")),
        ("coupler", ("p_1", "p_2")),
        ("rocker", ("p_2", "p_3")),
    )
    ground: tuple[str, ...] = ("O", "p_3")
    traced: tuple[str, ...] = ("p_1", "p_2", "g_1")
    view: tuple[str, str] | None = None
    joint_names: tuple[str, ...] = ()
    constrained: bool = True
    tilt: tuple[tuple[float, float, float], ...] | None = None

    @property
    def quantities(self) -> Mapping[str, Any]:
        return quantities(self.units)

    @property
    def picture(self) -> Picture:
        drawn = self.skeleton, self.ground, self.traced, self.view
        return Picture(self.point_names, *drawn, self.points)

    @property
    def picture_in_space(self) -> Picture:
        return self.picture

    def points(self, y: Array, params: Any = None, t: Any = 0.0) -> Array:
        flat = joints(y[..., :3])[..., : len(self.point_names), :]
        return flat if self.tilt is None else flat @ np.array(self.tilt).T

    def kinetic_energy(self, y: Array, params: Any = None, t: Any = 0.0) -> Array:
        return kinetic(y[..., :3], y[..., 3:])

    def potential_energy(self, y: Array, params: Any = None, t: Any = 0.0) -> Array:
        return potential(y[..., :3])

    def energy(self, y: Array, params: Any = None, t: Any = 0.0) -> Array:
        return np.asarray(self.kinetic_energy(y) + self.potential_energy(y))

    def constraints(self, y: Array, params: Any = None, t: Any = 0.0) -> Array:
        gap = joints(y[..., :3])[..., 3, :2] - [GROUND, 0.0]
        return gap if self.constrained else gap[..., :0]

    def velocity_constraints(self, y: Array, params: Any = None, t: Any = 0.0) -> Array:
        links = zip(LENGTHS, range(3), strict=True)
        rates = [y[..., 3 + i : 4 + i] * length * normal(y[..., i]) for length, i in links]
        speed = np.sum(rates, axis=0)[..., :2]
        return np.asarray(speed if self.constrained else speed[..., :0])


@dataclass(frozen=True)
class FakeChangePoint:
    t: float
    q: tuple[float, ...] = (np.pi, 0.0, 0.0)


@dataclass(frozen=True)
class FakeSolution:
    """A run whose dense output is the exact motion."""

    system: FakeModel
    t: Array
    change_points: tuple[FakeChangePoint, ...] = ()
    status: Any = "The run reached its end time."
    stats: Mapping[str, int] = field(default_factory=lambda: {"steps": 0})
    events: tuple[Any, ...] = ()
    event_titles: tuple[str, ...] = ()
    segments: tuple[Any, ...] = ()

    def __call__(self, t: Array, /) -> Array:
        return exact_state(t)

    @property
    def span(self) -> tuple[float, float]:
        return float(self.t[0]), float(self.t[-1])

    @property
    def y(self) -> Array:
        return exact_state(self.t)

    def values_along(self, t: Array) -> Array:
        return self.params

    @property
    def params(self) -> Array:
        return np.array([*LENGTHS, GROUND, *MASSES, G])

    @property
    def energy(self) -> Array:
        return np.asarray(self.system.energy(self.y))

    @property
    def work(self) -> Array:
        return np.zeros(len(self.t))

    def work_until(self, times: Array) -> Array:
        return np.zeros(len(times))

    @property
    def closure(self) -> Array:
        return np.asarray(np.abs(self.system.constraints(self.y)).max(axis=-1, initial=0.0))

    @property
    def velocity_closure(self) -> Array:
        residual = np.abs(self.system.velocity_constraints(self.y))
        return np.asarray(residual.max(axis=-1, initial=0.0))


def run(t_end: float = 4.0, steps: int = 81, **changes: Any) -> FakeSolution:
    """A run from rest; `changes` replace fields of the system."""
    return FakeSolution(replace(FakeModel(), **changes), np.linspace(0.0, t_end, steps))


@dataclass(frozen=True)
class Faster(FakeSolution):
    """The motion in a fraction of the time, in two long steps, as a method of high order takes."""

    faster: float = 16.0

    def __call__(self, t: Any, /) -> Any:
        rates = np.repeat([1.0, self.faster], 3)
        return rates * super().__call__(self.faster * np.asarray(t))
