"""A four-bar whose coupler point passes through ten points, found with the curve's derivatives.

    python examples/coupler_curve.py

The points are the path of a walking machine's foot: straight on the ground, an arc above it.  Free
are the lengths of crank, coupler and rocker, the distance of the pivots, the coupler point, and
where the frame stands and how it is turned.  Linkages drawn at random are swept at once; from the
best of them SciPy's least squares descends.  Of each point the distance from the curve is taken
along the curve's normal; its derivative by a length is that of the curve there, since moving along
the curve changes no distance.
Writes coupler_curve.png.
"""

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import least_squares

import mechc

SWING = np.linspace(0.0, np.pi, 7)[1:-1]
STANCE = np.linspace(-0.8, 0.8, 5)
TARGETS = np.vstack(
    [
        np.column_stack([STANCE, 0.0 * STANCE]),
        np.column_stack([0.95 * np.cos(SWING), 0.12 + 0.4 * np.sin(SWING)]),
    ]
)
NAMES = ("l_0", "l_1", "l_2", "l_3", "x_C", "y_C")  # then the frame's place x, y and angle
LOWER = np.array([0.2, 0.3, 0.3, 0.3, -3.0, -3.0, -3.0, -3.0, -np.pi])
UPPER = np.array([1.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, np.pi])
CRANK = np.linspace(0.0, 2.0 * np.pi, 181)
DRAWN, REFINED = 2000, 4

model = mechc.load("four_bar", coupler_point=True, outputs=("energy", "points", "sensitivities"))
POINT = model.point_names.index("C")


def swept(designs, cranks):
    """The linkages of designs (..., 9), followed through the crank angles."""
    lengths = np.moveaxis(designs, -1, 0)[: len(NAMES)]
    return model.sweep_positions("theta_0", cranks, params=dict(zip(NAMES, lengths, strict=True)))


def turned(designs, vectors):
    """Vectors (..., n, 2) of the linkage in the frame of the targets."""
    c, s = np.cos(designs[..., 8, None]), np.sin(designs[..., 8, None])
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def curves(designs, sweep):
    """Paths (..., n, 2) of the coupler point in the frame of the targets."""
    return turned(designs, sweep.points[..., POINT, :2]) + designs[..., None, 6:8]


def distances(curve):
    """Of the targets from the points of curves (..., n, 2): (..., 10, n)."""
    return np.linalg.norm(curve[..., None, :, :] - TARGETS[:, None], axis=-1)


def foot_points(design):
    """Crank angles (10,) at which the curve comes nearest to the targets, and its directions."""
    curve = curves(design, swept(design, CRANK))
    if np.isnan(curve).any():
        raise mechc.AssemblyError("the crank does not turn fully")
    slope = np.gradient(curve, CRANK, axis=0)
    at = distances(curve).argmin(axis=-1)
    along = np.sum((TARGETS - curve[at]) * slope[at], axis=1) / np.sum(slope[at] ** 2, axis=1)
    along = np.clip(along, -CRANK[1], CRANK[1])
    bend = np.gradient(slope, CRANK, axis=0)
    return CRANK[at] + along, slope[at] + along[:, None] * bend[at]


def at_targets(design):
    """The sweep at the foot points, which of its places they are, and the curve's normals."""
    cranks, slope = foot_points(design)
    sweep = swept(design, np.unique(cranks))
    normal = np.column_stack([-slope[:, 1], slope[:, 0]]) / np.linalg.norm(slope, axis=1)[:, None]
    return sweep, np.searchsorted(sweep.values, cranks), normal


def miss(design):
    """Distances (10,) of the targets from the curve, along its normals; else infinite."""
    try:
        sweep, place, normal = at_targets(design)
    except mechc.AssemblyError:
        return np.full(len(TARGETS), np.inf)
    return np.sum(normal * (curves(design, sweep)[place] - TARGETS), axis=1)


def slopes(design):
    """Derivatives (10, 9) of the distances by the design."""
    sweep, place, normal = at_targets(design)
    moved = [turned(design, sweep.point_sensitivity(name)[place, POINT, :2]) for name in NAMES]
    from_frame = curves(design, sweep)[place] - design[6:8]
    moved += [np.array([1.0, 0.0]), np.array([0.0, 1.0])]
    moved += [np.column_stack([-from_frame[:, 1], from_frame[:, 0]])]
    return np.stack([np.sum(normal * each, axis=1) for each in moved], axis=1)


def drawn(count):
    """The best of many designs drawn at random whose cranks turn fully: one sweep of all."""
    designs = np.random.default_rng(4).uniform(LOWER, UPPER, (count, len(LOWER)))
    costs = (distances(curves(designs, swept(designs, CRANK[::3]))).min(axis=-1) ** 2).sum(axis=-1)
    return designs[np.argsort(costs)[:REFINED]]  # NaN, where a crank stops, comes last


def synthesised():
    """The design that comes nearest to the targets, and SciPy's result."""
    found = [
        least_squares(miss, first, slopes, bounds=(LOWER, UPPER), x_scale=1.0, max_nfev=60)
        for first in drawn(DRAWN)
    ]
    return min(found, key=lambda one: one.cost)


def picture(design):
    """The targets, the curve, and the linkage in three positions."""
    sweep = swept(design, CRANK)
    curve = curves(design, sweep)
    figure = Figure(figsize=(7.0, 6.0), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(*curve.T, color="#0072B2", label="coupler curve")
    axes.plot(*TARGETS.T, "o", color="#D55E00", label="ten points")
    names = [
        model.point_names.index(name) for name in ("O", "p_1", "C", "p_2", "p_1", "p_2", "p_3")
    ]
    for place in (20, 80, 140):
        links = turned(design, sweep.points[place, names, :2]) + design[6:8]
        axes.plot(*links.T, color="#6b7280", linewidth=1.0, alpha=0.7)
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    axes.legend(frameon=False)
    return figure


if __name__ == "__main__":
    result = synthesised()
    lengths = dict(zip(NAMES, result.x, strict=False))
    print("  ".join(f"{name} = {value:.4f} m" for name, value in lengths.items()))
    print(f"largest distance of a point from the curve: {1e3 * np.abs(result.fun).max():.2f} mm")
    picture(result.x).savefig("coupler_curve.png", dpi=120)
