"""The library for the runtime: names, titles, duration of a run; needs no compiler.

The mechanisms themselves are in ``mechc_codegen.library.catalogue``, with the same titles.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from mechc._scenes import NAMES

COMPILED_AT_INSTALL = NAMES


class Entry(NamedTuple):
    """A mechanism of the library; ``seconds``: the duration of a run by default."""

    title: str
    seconds: float


LIBRARY: Mapping[str, Entry] = MappingProxyType(
    {
        "four_bar": Entry("Planar four-bar linkage", 20.0),
        "andrews": Entry("Andrews' squeezing mechanism", 0.03),
        "bicycle": Entry("Whipple's bicycle", 5.0),
        "car_axis": Entry("Car axis on a bumpy road", 3.0),
        "flyball_governor": Entry("Flyball governor", 10.0),
        "heavy_top": Entry("Heavy top", 2.0),
        "pendulum": Entry("Pendulum: simple, double, of any number of links", 10.0),
        "planar_chain": Entry("Chain of rods in a plane", 5.0),
        "rigid_body": Entry("Free rigid body", 20.0),
        "slider_crank": Entry("Slider-crank", 1.0),
        "spatial_chain": Entry("Chain of bars in space", 5.0),
        "windows": Entry("Four-bar windows in a row", 10.0),
    }
)
