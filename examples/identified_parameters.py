"""Masses, friction and starts of a four-bar, identified from three noisy recordings.

    python examples/identified_parameters.py

The crank's angle is recorded with noise of half a degree, the coupler's with one degree and gaps.
mechc.Model.fit finds two masses and the friction of the crank's pivot, which are the same in all
recordings, and of each recording its start, with their uncertainty.  Writes
identified_parameters.png.
"""

import numpy as np

import mechc

TIMES = np.linspace(0.0, 2.5, 251)
TRUTH = {"l_3": 3.5, "m_1": 1.4, "m_2": 2.5, "c_0": 0.8}
STARTS = (
    {"theta_0": 1.5, "omega_0": 0.0},
    {"theta_0": 0.6, "omega_0": 2.0},
    {"theta_0": 2.2, "omega_0": -1.0},
)
NOISE = {"theta_0": np.radians(0.5), "theta_1": np.radians(1.0)}

model = mechc.load("four_bar", friction=True, outputs=("energy", "points", "sensitivities"))


def recorded(start, draw):
    """A motion as sensors give it: with noise, and without the coupler's angle for a while."""
    sol = model.simulate(TIMES[-1], start, TRUTH, t_eval=TIMES)
    data = {name: sol[name] + sigma * draw.normal(size=len(TIMES)) for name, sigma in NOISE.items()}
    data["theta_1"][80:140] = np.nan
    return {"t": TIMES, **data}


def identified():
    """The fit of all three recordings."""
    draw = np.random.default_rng(0)
    return model.fit(
        [recorded(start, draw) for start in STARTS],
        free={
            "m_1": (0.1, 10.0),
            "m_2": (0.1, 10.0),
            "c_0": (0.0, 5.0),
            "theta_0": None,
            "omega_0": (-5.0, 5.0),
        },
        measured=NOISE,
        params={"l_3": TRUTH["l_3"]},
    )


if __name__ == "__main__":
    result = identified()
    print(result)
    for name in ("m_1", "m_2", "c_0"):
        low, high = result.intervals[name]
        print(f"{name} = {TRUTH[name]} lies {'within' if low < TRUTH[name] < high else 'outside'}")
    result.plot().savefig("identified_parameters.png", dpi=120)
