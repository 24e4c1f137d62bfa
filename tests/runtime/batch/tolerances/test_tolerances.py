"""``model.tolerances``: slopes against closed forms and differences, and words where they end."""

import numpy as np
import pytest
from scipy.special import ellipk

import mechc
from tests.support.pendulums import pendulum

SPAN, START = 3.0, {"theta_0": "85deg"}
OF = ["max(theta_2)", "range(theta_1)", "mean(abs(omega_0))", "final(energy)", "min(abs(omega_2))",
      "first(theta_0 > 180deg)", "max(norm(points))"]  # fmt: skip
PARTS = {"l_1": "1 mm", "l_2": 1e-3, "l_3": "0.1cm", "m_1": "10 g", "theta_0": "0.2deg"}


@pytest.fixture(scope="module")
def found(model):
    return model.tolerances(PARTS, OF, SPAN, START, {"l_3": 3.5}, count=200, seed=1)


def rocker(lengths):
    """Largest angle of the rocker: crank and coupler in line, by the law of cosines."""
    l_1, l_2, l_3 = lengths
    return -np.arccos((l_3**2 + l_2**2 - (l_1 - 1.0) ** 2) / (2 * l_3 * l_2))


@pytest.mark.slow
def test_the_end_of_a_rocker_follows_the_law_of_cosines(found):
    lengths, h = np.array([2.0, 3.0, 3.5]), 1e-6
    assert found.nominal[0] == pytest.approx(rocker(lengths), abs=1e-13)
    exact = [(rocker(lengths + e) - rocker(lengths - e)) / (2 * h) for e in h * np.eye(3)]
    np.testing.assert_allclose(found.slopes[0], [*exact, 0.0, 0.0], atol=1e-8)
    effects = np.abs(exact) * 1e-3
    assert found.worst_case[0] == pytest.approx(effects.sum())
    assert found.root_sum_square[0] == pytest.approx(np.linalg.norm(effects))
    np.testing.assert_allclose(found.shares[0, :3], effects**2 / (effects**2).sum(), rtol=1e-6)
    members = np.array([rocker(point[:3]) for point in found.points])
    np.testing.assert_allclose(found.batch["max(theta_2)"], members, atol=1e-10)


def test_slopes_are_differences_of_motions(model, found):
    h, nominal = 1e-5, found.nominal_parts
    for k, name in enumerate(found.names):
        points = np.tile(nominal, (4, 1))
        points[:, k] += h * np.array([-2, -1, 1, 2])
        values = dict(zip(found.names, points.T, strict=True))
        start = mechc.Assembly({"theta_0": values.pop("theta_0")})
        batch = model.simulate_batch(SPAN, start, values, reduce=OF, rtol=1e-12, progress=False)
        for i, text in enumerate(found.results):
            v = batch[text]
            slope = (v[0] - 8 * v[1] + 8 * v[2] - v[3]) / (12 * h)
            size = max(abs(found.nominal[i]), abs(slope), 1.0)
            corner = 3e-3 if "abs" in text else 1e-5  # of which differences of a quadrature are
            assert found.slopes[i, k] == pytest.approx(slope, abs=corner * size), (text, name)


@pytest.mark.slow
def test_the_period_of_a_pendulum_follows_its_length():
    model, down = mechc.compile(pendulum()), -np.pi / 2
    parts = {"l": "1 mm", "m": "1 g", "q": 0.01}
    asked = f"first(q < {down})", 1.0, [down + 0.8, 0.0], {"l": 0.7}
    found = model.tolerances(parts, *asked, count=50)
    quarter = np.sqrt(0.7 / 9.81) * ellipk(np.sin(0.4) ** 2)
    assert found.nominal[0] == pytest.approx(quarter, rel=1e-12)
    wider, narrower = (ellipk(np.sin(0.5 * (0.8 + e)) ** 2) for e in (1e-5, -1e-5))
    by_start = np.sqrt(0.7 / 9.81) * (wider - narrower) / 2e-5
    exact = [quarter / 1.4, 0.0, by_start]
    np.testing.assert_allclose(found.slopes[0], exact, rtol=1e-6, atol=1e-10)
    assert found.departure[0] < 0.05 * found.sigma[0]
    assert "not linear" not in str(found)


def test_inputs_that_are_numbers_have_tolerances(pushed):
    """2 kg from rest: F t^2 / (2 m)."""
    still = {"k": 0.0}
    found = pushed.tolerances(
        {"F": 0.1, "m": 0.02}, "final(q)", 1.0, [0.0, 0.0], still, inputs={"F": 3.0}, count=10
    )
    np.testing.assert_allclose(found.slopes, [[0.25, -0.375]], rtol=1e-8)
    members = found.points[1:, 0] / (2 * found.points[1:, 1])
    np.testing.assert_allclose(found["final(q)"], members, rtol=1e-9)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(("distribution", "deviations"), [("normal", 3.0), ("uniform", 3**0.5)])
def test_parts_are_drawn_as_told(model, distribution, deviations):
    asked = {"l_1": 1e-3, "m_0": 1e-2}, ["max(theta_2)"], SPAN, START, {"l_3": 3.5}
    first, again, other = (
        model.tolerances(*asked, count=2000, distribution=distribution, seed=seed)
        for seed in (3, 3, 4)
    )
    over = (first.points[1:] - first.nominal_parts) / first.tolerances
    np.testing.assert_allclose(over.std(axis=0), 1 / deviations, rtol=0.05)
    np.testing.assert_allclose(over.mean(axis=0), 0.0, atol=0.03)
    assert (np.abs(over).max() > 1.0) == (distribution == "normal")
    assert first.sigma[0] == pytest.approx(first.root_sum_square[0] / deviations)
    assert first.drawn.std() == pytest.approx(first.sigma[0], rel=0.05)
    np.testing.assert_array_equal(first.points, again.points)
    assert not np.array_equal(first.points, other.points)


def test_at_a_change_point_lengths_have_no_first_order_and_it_says_so(model):
    """With exactly these lengths the links come in line; with no others they do."""
    parts = {"l_1": "0.1 mm", "m_1": "1 g"}
    found = model.tolerances(parts, ["max(theta_2)", "final(energy)"], 2.0, START, count=20)
    assert np.isnan(found.slopes[0, 0])
    assert np.isfinite(found.slopes[0, 1])
    told = str(found)
    assert "no first order by l_1: none from t =" in told
    assert "20 of 20 drawn motions have other numbers of change points than the nominal" in told
    found.plot()


def test_bounces_have_a_first_order_until_others_bounce(ball):
    """Down to the stop h, up with e of the speed; then a stop that only some motions meet."""
    end, g = 0.6, 9.81

    def height(e, h, q):
        falls = np.sqrt(2 * (q - h) / g)
        return h + e * g * falls * (end - falls) - g / 2 * (end - falls) ** 2

    parts = {"e": 0.01, "h": 1e-3, "q_0": 1e-3}
    floor = mechc.Stop("q_0 - h", "e")
    asked = ["final(q_0)", "min(q_0)", "mean(u_0)", "max(u_0)"]
    found = ball.tolerances(parts, asked, end, [1.0, 0.0], count=20, events=floor)
    at, step = np.array([0.5, 0.0, 1.0]), 1e-6
    exact = [(height(*(at + d)) - height(*(at - d))) / (2 * step) for d in step * np.eye(3)]
    np.testing.assert_allclose(found.slopes[0], exact, rtol=1e-6)
    assert np.isnan(found.slopes[1:]).all()
    assert "min(q_0): no first order, it lies at an impact or a reset" in str(found)
    assert "mean(u_0): no first order, a mean over impacts" in str(found)

    ceiling = mechc.Stop("h - q_0", 0.5)
    rises = {"q_0": 0.0, "u_0": np.sqrt(2 * g * 0.999)}
    near = ball.tolerances({"h": 0.01}, ["final(q_0)"], end, rises, {"h": 1.0}, events=ceiling)
    assert near.slopes[0, 0] == 0.0
    met = near.batch["event_counts"][1:, 0] == 1
    assert 0.3 < met.mean() < 0.5  # of h below 0.999, which are 0.1 of a tolerance away
    assert f"{met.sum()} of 1000 drawn motions have other numbers of impacts" in str(near)
    assert "final(q_0) is not linear within these tolerances" in str(near)


def test_motions_that_do_not_end_are_counted_with_their_reason(model):
    """Of four bars in line: some do not close."""
    lengths, start = {"l_3": 5.9996}, {"theta_0": 0.02}
    found = model.tolerances({"l_3": 3e-4}, "final(theta_1)", 0.01, start, lengths, count=100)
    lost = int(np.isnan(found.drawn).sum())
    assert 0 < lost < 100
    assert f"{lost} of 100 drawn motions: " in str(found)
    assert "final(theta_1) is not linear within these tolerances" in str(found)


def test_tables(found):
    table = found.to_dict()["max(theta_2)"]
    assert table["nominal"] == found.nominal[0]
    assert table["parts"]["l_1"]["effect"] == found.effects[0, 0]
    assert table["drawn_max"] == found["max(theta_2)"].max()
    pandas = pytest.importorskip("pandas")
    frame = found.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert frame.loc[("max(theta_2)", "l_3"), "slope"] == found.slopes[0, 2]
    rows = str(found).splitlines()
    assert rows[0] == "tolerances of four_bar: 200 drawn motions, normal, a tolerance is 3 sigma"
    assert rows[1] == "max(theta_2) = -15.3589 °"
    assert [row.split()[0] for row in rows[4:7]] == ["l_1", "l_3", "l_2"]  # by their shares
    assert rows[4].split()[1:3] == ["+-0.001", "m"]


def test_the_picture_has_a_row_for_each_result(found):
    figure = found.plot()
    assert len(figure.axes) == 2 * len(OF)
    bars = figure.axes[0].patches
    assert max(bar.get_width() for bar in bars) == pytest.approx(
        2 * np.degrees(np.abs(found.effects[0]).max())
    )


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"tolerances": {}}, "nothing has a tolerance"),
        ({"tolerances": {"l_9": 1.0}}, "no parameter, coordinate or speed is called 'l_9'"),
        ({"tolerances": {"l_1": -1.0}}, "the tolerance of l_1 = -1.0 must be positive"),
        ({"tolerances": {"l_1": "1 kg"}}, "'kg' in '1 kg' is not one of its units"),
        ({"of": []}, "of which results?"),
        ({"of": "largest(theta_2)"}, "no reduction is called 'largest'"),
        ({"distribution": "beta"}, "distribution = 'beta' is one of 'normal', 'uniform'"),
        ({"count": 0}, "count = 0 must be positive"),
        ({"y0": np.zeros(6)}, "y0 is a mapping of coordinates and speeds"),
        ({"params": {"l_3": 9.0}, "y0": START}, "no configuration was found"),
    ],
)
def test_wrong_arguments_are_refused(model, change, told):
    asked = {"tolerances": {"l_1": 1e-3}, "of": "max(theta_2)", "t_span": 0.1, **change}
    with pytest.raises(mechc.MechcError, match=told.replace("?", r"\?")):
        model.tolerances(**asked)
