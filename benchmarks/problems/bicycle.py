"""The bicycle without hands, nonlinear, from a general state at a speed at which it is stable."""

from __future__ import annotations

from mechc_codegen.library.spatial.bicycle import bicycle, values

from .data import values_at
from .problem import Problem

# The independent ones; pitch and the other speeds follow from the constraints.
COORDINATES = {"x": 0.0, "y": 0.0, "yaw": 0.3, "roll": 0.1, "rear": 0.0, "steer": 0.15,
               "front": 0.0}  # fmt: skip
SPEEDS = {"roll_rate": 0.5, "rear_rate": -4.6 / 0.3, "steer_rate": -0.4}
NAMES = (
    *(*COORDINATES, "pitch"),
    *(*SPEEDS, "x_rate", "y_rate", "yaw_rate", "pitch_rate", "front_rate"),
)


def without_hands() -> Problem:
    """Two seconds, 9 m, compared in all coordinates and speeds."""
    return Problem(
        name="bicycle", title="Bicycle", mechanism=bicycle,
        start=values_at("bicycle_motion", 0.0, NAMES), t_end=2.0, quantities=NAMES,
        exact=values_at("bicycle_motion", 2.0, NAMES),
        compile_options={"defaults": values(), "outputs": ()},
        note="one holonomic and four nonholonomic constraints; errors of the start grow 20 times",
    )  # fmt: skip
