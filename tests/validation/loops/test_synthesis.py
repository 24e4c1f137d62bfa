"""Published problems of linkage synthesis: found, and redrawn by the driven mechanism.

- Nine points: problem 3 of Wampler, Morgan & Sommese, Complete solution of the nine-point path
  synthesis problem for four-bar linkages, J. Mech. Des. 114 (1992) 153-159, by Roth & Freudenstein
  (1963).  Its points and the number of its real solutions, 64 curves of six linkages each, as in
  the certified solutions of Hauenstein & Sottile, Algorithm 921, ACM TOMS 38 (2012).
- Hoeken's straight line, of which R. L. Norton, Design of Machinery, has tables: over half a turn
  of a crank of 1, lengths 2.2, 2.8, 2.8 and 5.6 give a stroke of 4.181 with 0.096 % of it off the
  line, by the closed form of the coupler's path.
- Function generators: F. Freudenstein, Approximate synthesis of four-bar linkages, Trans. ASME 77
  (1955) 853-861: his equation at three precision points, here with Chebyshev's spacing.
"""

import runpy

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.support import ROOT
from tests.support.linkages.synthesis import bounds, four_bar

NINE = np.array(
    [(0.25, 0), (0.52, 0.1), (0.8, 0.7), (1.2, 1.0), (1.4, 1.3), (1.1, 1.48), (0.7, 1.4),
     (0.2, 1.0), (0.02, 0.4)]
)  # fmt: skip


def simulated_path(design, times, speeds, target):
    """The positions (n, 3) of a point by a simulation of the driven linkage."""
    model, params = design.model, {**design.params, **speeds}
    near = dict(zip(model.coordinates, design.q[0], strict=True))
    driven = {"theta_0": near.pop("theta_0")}
    start = model.assemble(driven, guess=near, params=params)
    sol = model.simulate((0.0, times[-1]), start, params, t_eval=times, rtol=1e-11)
    return model.points(sol.y, params)[:, model.system.point_names.index(target)]


def cognate(params, q):
    """Roberts' cognate that shares the pivot O: its parameters, and its angles at those of q."""
    ratio = (params["x_C"] + 1j * params["y_C"]) / params["l_1"]
    turn, size = np.angle(ratio), abs(ratio)
    lengths = [size * params[f"l_{k}"] for k in (1, 0, 2, 3)]
    point = params["l_0"] * np.exp(-1j * turn)
    found = {
        **params, **{f"l_{k}": lengths[k] for k in range(4)}, "x_C": point.real, "y_C": point.imag,
        "alpha": params["alpha"] + turn,
    }  # fmt: skip
    return found, q[:, [1, 0, 2]] + turn


@pytest.fixture(scope="module")
def nine():
    return four_bar().synthesize({"C": NINE}, bounds(3.0), samples=2048, refined=24, most=20)


@pytest.mark.slow
@pytest.mark.thorough
def test_several_four_bars_pass_through_nine_points(nine):
    exact = [one for one in nine if one.errors["C"] < 1e-12]
    assert 4 <= len(exact) <= 384
    model, place = four_bar(), four_bar().system.point_names.index("C")
    for one in exact:
        params, q = cognate(one.params, one.q)
        y = np.hstack([q, np.zeros((9, 3))])
        assert np.abs(model.constraints(y, params)).max() < 1e-12
        assert model.points(y, params)[:, place, :2] == pytest.approx(NINE, abs=1e-12)


@pytest.mark.slow
@pytest.mark.thorough
def test_the_best_passes_the_nine_points_in_order_when_it_is_driven(nine):
    best = nine[0]
    assert not best.warnings
    assert best.errors["C"] < 1e-12
    speed = np.sign(best.driven[-1] - best.driven[0])
    times = np.abs(best.driven - best.driven[0])
    drawn = simulated_path(best, times, {"Omega_0": speed}, "C")
    assert drawn[:, :2] == pytest.approx(NINE, abs=1e-8)


@pytest.mark.slow
def test_hoekens_linkage_is_found_from_a_straight_line():
    crank = np.radians(np.linspace(0, 180, 19))
    line = np.full((19, 2), np.nan)
    line[:, 1], line[[0, -1], 0] = 0.0, (-2.0905, 2.0905)
    free = {name: ends for name, ends in bounds(6.0).items() if name not in ("l_0", "y_C")}
    found = four_bar().synthesize(
        {"C": line, "theta_0": crank}, {**free, "theta_0": None},
        params={"l_0": 1.0, "y_C": 0.0}, turns=True, samples=1024, tolerances={"C": 1.0},
    )  # fmt: skip
    best = found[0]
    assert not best.warnings
    lengths = [best.params[name] for name in ("l_1", "l_2", "l_3", "x_C")]
    assert lengths == pytest.approx([2.8, 2.8, 2.2, 5.6], rel=0.03)
    drawn = simulated_path(best, np.linspace(0.0, np.pi, 361), {"Omega_0": 1.0}, "C")
    assert np.ptp(drawn[:, 1]) < 1.02 * 0.00096 * np.ptp(drawn[:, 0])
    assert np.ptp(drawn[:, 0]) == pytest.approx(4.181, abs=1e-2)


def output_angles(lengths, phi, side):
    """The output angles of a four-bar with a ground of 1 at crank angles, by Freudenstein's
    equation; ``side``: the assembly."""
    a, b, c = lengths
    p, r = np.sin(phi), np.cos(phi) - 1.0 / a
    s = (1.0 + a**2 + c**2 - b**2) / (2 * a * c) - np.cos(phi) / c
    return np.arctan2(p, r) + side * np.arccos(s / np.hypot(p, r))


def freudensteins(phi, psi):
    """Lengths (crank, coupler, rocker) for three pairs of angles, by his linear equations.

    k_1 cos phi - k_2 cos psi + k_3 = cos(phi - psi) with k_1 = 1/c, k_2 = 1/a,
    k_3 = (1 + a^2 - b^2 + c^2) / (2 a c).
    """
    rows = np.column_stack([-np.cos(phi), np.cos(psi), np.ones(3)])
    k = np.linalg.solve(rows, np.cos(phi - psi))
    c, a = 1 / k[0], 1 / k[1]
    return a, np.sqrt(1.0 + a**2 + c**2 - 2 * a * c * k[2]), c


@pytest.mark.slow
def test_a_logarithm_is_generated_better_than_by_freudensteins_three_points():
    """y = log10(x) for x in 1 ... 2 over 60 degrees of crank and rocker."""
    x = np.linspace(1.0, 2.0, 31)
    turn = np.radians(60.0)
    phi, psi = turn * (x - 1.0), -turn * np.log10(x) / np.log10(2.0)
    free = {**dict.fromkeys(("l_0", "l_1", "l_2"), (0.1, 5.0)), "theta_0": None, "theta_2": None}
    found = four_bar().synthesize(
        {"theta_0": phi, "theta_2": psi}, free, params={"l_3": 1.0}, samples=1024, refined=12
    )
    best = found[0]
    assert not best.warnings
    ours = np.ptp(best.deviations["theta_2"]) / 2
    assert np.degrees(ours) < 0.002

    exact = 1.5 + 0.5 * np.cos(np.radians([30.0, 90.0, 150.0]))  # Chebyshev's spacing
    at, to = turn * (exact - 1.0), -turn * np.log10(exact) / np.log10(2.0)

    def error(zeros):
        with np.errstate(invalid="ignore"):
            lengths = freudensteins(at + zeros[0], to + zeros[1])
            every = [
                output_angles(lengths, phi + zeros[0], side) - psi - zeros[1] for side in (1, -1)
            ]
        least = [np.ptp(np.unwrap(each)) / 2 for each in every]
        return float(np.nanmin([1.0, *least]))

    given = [best.zeros["theta_0"], best.zeros["theta_2"]]
    theirs = error(given)  # his linkage with our zeros, with usual ones, and with the best ones
    assert 1e-6 < theirs < np.radians(1.0)
    assert ours < 0.02 * error(np.radians([45.0, -45.0]))
    suited = minimize(error, given, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-9})
    assert ours <= suited.fun * 1.2
    assert ours <= theirs


@pytest.mark.slow
@pytest.mark.thorough
def test_a_six_bar_dwells_for_a_third_of_a_turn():
    """The scene of the gallery: its lever is where it was asked to rest, as its crank coasts."""
    scene = runpy.run_path(str(ROOT / "examples" / "gallery" / "linkages" / "dwell.py"))
    best, sol = scene["best"], scene["sol"]
    resting = (sol["q_crank"] - best.driven[0]) % (2 * np.pi) < np.radians(120.0)
    assert resting.sum() > 3
    lever = np.degrees(sol["q_lever"][resting] - best.zeros["q_lever"])
    assert np.abs((lever + 180) % 360 - 180).max() < 0.1
