"""``model.synthesize``: linkages found again from what they do, conditions, and its errors."""

import json

import numpy as np
import pytest
import sympy as sm
import sympy.physics.mechanics as me

import mechc
from tests.support.linkages.synthesis import LENGTHS, bounds, coupler_points, four_bar
from tests.support.pendulums import bob_of_a_moved_pivot

KNOWN = {
    "l_0": 0.5, "l_1": 1.2, "l_2": 1.1, "l_3": 1.4, "x_C": 0.7, "y_C": 0.6, "x_O": -0.2,
    "y_O": 0.1, "alpha": 0.3,
}  # fmt: skip
CRANK = np.linspace(0.0, 5.6, 9)
FREE = bounds(2.0)


@pytest.fixture(scope="module")
def timed():
    """Designs for points of a known linkage at given crank angles."""
    points, _ = coupler_points(KNOWN, CRANK)
    return four_bar().synthesize(
        {"C": points, "theta_0": CRANK}, FREE, turns=True, samples=256, refined=8
    )


@pytest.mark.slow
def test_a_linkage_is_found_again_from_points_at_given_crank_angles(timed):
    best = timed[0]
    assert not best.warnings
    assert best.errors["C"] < 1e-12
    assert {name: best.params[name] for name in KNOWN} == pytest.approx(KNOWN, abs=1e-9)


def test_a_design_is_a_model_with_parameters(timed):
    best = timed[0]
    y = best.assemble()
    place = best.model.system.point_names.index("C")
    assert best.model.points(y, best.params)[place, :2] == pytest.approx(
        coupler_points(KNOWN, 0.0)[0][0]
    )
    assert best.sweep.points[0, place, :2] == pytest.approx(coupler_points(KNOWN, 0.0)[0][0])
    assert np.ptp(best.sweep.values) == pytest.approx(2 * np.pi)


def test_designs_are_ranked_and_printed(timed):
    missing = [bool(one.warnings) for one in timed]
    assert missing == sorted(missing)
    costs = [one.cost for one in timed if not one.warnings]
    assert costs == sorted(costs)
    assert str(timed).startswith(f"{len(timed)} designs, of which {len(costs)} meet all conditions")
    assert "l_0 = 0.5 m" in str(timed)
    assert timed.to_json()["designs"][0]["values"]["l_3"] == pytest.approx(1.4)
    assert timed.plot().axes


def test_all_designs_are_saved(timed, tmp_path):
    told = json.loads(timed.save(tmp_path / "designs.json").read_text())
    assert told["tried"] == timed.tried
    for k, one in enumerate(timed):
        assert told["designs"][k] == json.loads(one.save(tmp_path / "one.json").read_text())


def test_positions_are_looked_for_within_the_span():
    """The rocker takes its angles once on its way there and once on its way back."""
    there = np.array([2.0, 2.5, 3.0])
    rocker = four_bar().sweep_positions("theta_0", there, params=KNOWN)["theta_2"]
    rest = {name: value for name, value in KNOWN.items() if name != "l_1"}
    for span in ((1.2, 4.0), (4.4, 7.2)):
        best = four_bar().synthesize(
            {"theta_2": rocker}, {"l_1": (1.1999, 1.2001)}, params=rest, span=span, samples=4,
            refined=2,
        )[0]  # fmt: skip
        assert best.errors["theta_2"] < 1e-8
        assert (best.driven > span[0]).all()
        assert (best.driven < span[1]).all()


def test_the_tolerance_ends_a_refinement():
    """Points of which one is put elsewhere are met by none: the least cost is not zero."""
    points, _ = coupler_points(KNOWN, CRANK)
    points[4] += 0.1
    costs = [
        four_bar()
        .synthesize(
            {"C": points, "theta_0": CRANK}, FREE, turns=True, samples=64, refined=2, tol=tol
        )[0]
        .cost
        for tol in (0.5, 1e-2, 1e-12)
    ]
    assert costs[0] > 1.001 * costs[1] > 1.001**2 * costs[2]


def test_constraints_hold_at_the_time():
    """A bob at the distance l from a pivot that has moved by 0.2 m after 2 s."""
    model = mechc.compile(
        bob_of_a_moved_pivot()[0], outputs=("points", "sensitivities"),
        defaults={"m": 2.0, "l": 1.3},
    ).with_inputs({"r": "0.1*t"})  # fmt: skip
    x = np.array([0.3, 0.5])
    y = -np.sqrt(1.5**2 - (x - 0.2) ** 2)
    given = {"free": {"l": (0.5, 3.0)}, "span": (-1.0, 1.0), "samples": 32, "refined": 2}
    best = model.synthesize({"x": x, "y": y}, t=2.0, **given)[0]
    assert best.values == pytest.approx({"l": 1.5}, abs=1e-10)
    np.testing.assert_allclose(best.y0[:2], [x[0], y[0]], atol=1e-10)
    assert model.synthesize({"x": x, "y": y}, **given)[0].errors["y"] > 1e-3


def test_the_seed_decides():
    points, _ = coupler_points(KNOWN, CRANK)
    targets = {"C": points, "theta_0": CRANK}
    options = {"samples": 32, "refined": 2, "seed": 5}
    first, second = (four_bar().synthesize(targets, FREE, **options) for _ in range(2))
    assert [one.params for one in first] == [one.params for one in second]


@pytest.mark.slow
def test_poses_of_the_coupler_are_met():
    """Five poses of a body determine a four-bar (Burmester 1888)."""
    places, angles = coupler_points(KNOWN, CRANK[:5])
    found = four_bar().synthesize(
        {"C": places, "theta_1": angles}, FREE, ordered=False, one_assembly=False, samples=512,
        refined=8,
    )  # fmt: skip
    assert found[0].errors["C"] < 1e-10
    assert found[0].errors["theta_1"] < 1e-10


@pytest.mark.slow
def test_conditions_hold_by_the_position_sweep():
    angles = {"theta_0": CRANK[:6], "theta_2": 0.15 * np.sin(CRANK[:6])}
    free = {**dict.fromkeys(LENGTHS[:3], (0.2, 2.0)), "theta_0": None, "theta_2": None}
    found = four_bar().synthesize(
        angles, free, params={"l_3": 1.0}, turns=True, samples=256, refined=6,
        transmission_angle=("p_1", "p_2", "p_3", "40deg"), box=((-1.5, 2.5), (-2.0, 2.0)),
    )  # fmt: skip
    model, best = found[0].model, found[0]
    assert not best.warnings
    assert model.limits("theta_0", best.params) == ((-np.pi, np.pi),)
    names = model.coordinates
    guess = {name: best.q[0, names.index(name)] for name in ("theta_1", "theta_2")}
    turn = best.driven[0] + np.linspace(0, 2 * np.pi, 721)
    sweep = model.sweep_positions("theta_0", turn, guess=guess, params=best.params)
    least = np.degrees(sweep.transmission_angle("p_1", "p_2", "p_3").min())
    assert least > 39.9
    without = four_bar().synthesize(
        angles, free, params={"l_3": 1.0}, turns=True, samples=256, refined=6
    )
    assert without[0].cost <= best.cost * (1 + 1e-9)


def test_a_slider_crank_is_found_from_its_slider():
    model = mechc.load("slider_crank", outputs=("points", "sensitivities"))
    driven, slider = model.coordinates[0], model.coordinates[-1]
    lengths = [name for name in model.parameters if model.quantities[name].kind == "length"]
    given = {name: model.defaults[name] for name in lengths}
    crank = np.linspace(-1.0, 1.0, 7)
    sweep = model.sweep_positions(driven, crank)
    found = model.synthesize(
        {driven: crank, slider: sweep[slider]},
        {name: (0.5 * value, 2.0 * value) for name, value in given.items() if value}, driven,
        samples=64, refined=4,
    )  # fmt: skip
    assert found[0].errors[slider] < 1e-12


def spatial_four_bar():
    """A crank about z and a rocker about x, point masses at their ends, and a rod between them."""
    phi, psi, u_1, u_2 = me.dynamicsymbols("phi psi u_1 u_2")
    a, b, l = sm.symbols("a b l", positive=True)
    frame, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(frame, 0)
    crank = frame.orientnew("crank", "Axis", (phi, frame.z))
    rocker = frame.orientnew("rocker", "Axis", (psi, frame.x))
    pivot = origin.locatenew("pivot", 0.4 * frame.x + 0.7 * frame.y)
    ends = origin.locatenew("A", a * crank.x), pivot.locatenew("B", b * rocker.z)
    rates = {phi.diff(): u_1, psi.diff(): u_2}
    for end in ends:
        end.set_vel(frame, end.pos_from(origin).dt(frame).subs(rates))
    rod = ends[1].pos_from(ends[0])
    gap = rod.dot(rod) - l**2
    kane = me.KanesMethod(
        frame, q_ind=[phi], u_ind=[u_1], kd_eqs=[rate - u for rate, u in rates.items()],
        q_dependent=[psi], u_dependent=[u_2], configuration_constraints=[gap],
        velocity_constraints=[gap.diff(me.dynamicsymbols._t).subs(rates)],
    )  # fmt: skip
    kane.kanes_equations([me.Particle(f"end {k}", end, 1.0) for k, end in enumerate(ends)])
    return mechc.compile(kane, outputs=("points", "sensitivities"))


@pytest.mark.slow
def test_a_spatial_linkage_is_found_from_its_function():
    """Three lengths, and the two zeros of the angles, from eight pairs of angles."""
    model = spatial_four_bar()
    given = {"a": 0.2, "b": 0.6, "l": 0.9}
    crank = np.linspace(0.3, 2.6, 8)
    rocker = model.sweep_positions("phi", crank, params=given)["psi"]
    found = model.synthesize(
        {"phi": crank - 0.3, "psi": rocker - 0.1},
        {"a": (0.05, 0.5), "b": (0.2, 1.2), "l": (0.4, 1.5), "phi": None, "psi": None},
        samples=256, refined=8,
    )  # fmt: skip
    assert found[0].errors["psi"] < 1e-10
    same = [one for one in found if abs(one.params["a"] - 0.2) < 1e-6]
    assert same
    assert same[0].params == pytest.approx(given, abs=1e-6)
    assert same[0].zeros == pytest.approx({"phi": 0.3, "psi": 0.1}, abs=1e-6)


@pytest.mark.slow
def test_what_cannot_be_met_is_said():
    far = [(9.0, 9.0), (9.5, 9.0), (9.0, 9.5)]
    found = four_bar().synthesize(
        {"C": far}, bounds(1.0), transmission_angle=("p_1", "p_2", "p_3", "89.9deg"), turns=True,
        samples=256, refined=2,
    )  # fmt: skip
    assert found[0].errors["C"] > 5
    assert "the transmission angle at p_2 is" in str(found)


GOOD = {"C": [(0.0, 0.0), (1.0, 1.0)]}


@pytest.mark.parametrize(
    ("targets", "free", "options", "message"),
    [
        (GOOD, {}, {}, "nothing is free"),
        (GOOD, {"l_9": (1, 2)}, {}, "no parameter.*'l_9'"),
        (GOOD, {"l_0": None}, {}, "both its bounds"),
        (GOOD, {"l_0": (2, 1)}, {}, "must be below"),
        (GOOD, {"theta_1": None}, {}, "no parameter.*'theta_1'"),
        (GOOD, {"l_0": (1, 2)}, {"params": {"l_0": 1.0}}, "both free and given"),
        ({"D": [(0, 0)]}, {"l_0": (1, 2)}, {}, "no coordinate, point or output.*'D'"),
        ({"C": [0, 1]}, {"l_0": (1, 2)}, {}, r"rows \(x, y\)"),
        ({"theta_0": [0, 1]}, {"l_0": (1, 2)}, {}, "no target besides the driven"),
        ({**GOOD, "theta_0": [0]}, {"l_0": (1, 2)}, {}, "as many rows"),
        (GOOD, {"l_0": (1, 2)}, {"driven": "phi"}, "no coordinate.*'phi'"),
        (GOOD, {"l_0": (1, 2)}, {"tolerances": {"E": 1}}, "no target.*'E'"),
        (GOOD, {"l_0": (1, 2)}, {"tolerances": {"C": -1}}, "tolerance of C"),
        (GOOD, {"l_0": (1, 2)}, {"transmission_angle": ("O", "p_1")}, "transmission_angle is"),
        (GOOD, {"l_0": (1, 2)}, {"box": ((1, 0), (0, 1))}, "box is"),
        (GOOD, {"l_0": (1, 2)}, {"samples": 0}, "samples"),
        (GOOD, {"l_0": (1, 2)}, {"span": (1, 0)}, "span of theta_0 must rise"),
    ],
)
def test_wrong_arguments(targets, free, options, message):
    with pytest.raises(mechc.MechcError, match=message):
        four_bar().synthesize(targets, free, **options)


def test_where_no_linkage_closes_it_says_so():
    with pytest.raises(mechc.AssemblyError, match="none of 64 linkages drawn closes"):
        four_bar().synthesize(
            GOOD, {"l_0": (0.1, 0.2), "l_1": (0.1, 0.2)}, params={"l_2": 0.1, "l_3": 9.0},
            samples=64,
        )  # fmt: skip


def test_a_crank_that_goes_back_is_followed_back():
    """From 1.2 to 0.2 rad, not on through where it cannot go."""
    short = {**KNOWN, "l_3": 0.9}
    crank = np.array([1.2, 0.7, 0.2])
    points, _ = coupler_points(short, crank)
    given = {name: short[name] for name in (*LENGTHS, "x_O", "y_O", "alpha")}
    place = {"x_C": (-1.0, 1.0), "y_C": (-1.0, 1.0)}
    found = four_bar().synthesize(
        {"C": points, "theta_0": crank}, place, params=given, samples=16, refined=4
    )
    assert not found[0].warnings
    assert found[0].errors["C"] < 1e-9


@pytest.mark.slow
def test_a_point_in_one_direction_alone():
    points, _ = coupler_points(KNOWN, CRANK)
    points[:, 0] = np.nan
    found = four_bar().synthesize(
        {"C": points, "theta_0": CRANK}, FREE, turns=True, samples=64, refined=4
    )
    assert np.isfinite(found[0].cost)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"coordinates": {"zz": 1.0}}, "zz"),
        ({"coordinates": {"theta_0": 1.0}}, "theta_0 drives the linkage"),
        ({"transmission_angle": ("P_0", "P_1", "P_2", 40)}, "."),
        ({"span": 2.0}, "the span of theta_0"),
    ],
)
def test_more_wrong_arguments(options, message):
    points, _ = coupler_points(KNOWN, CRANK)
    with pytest.raises(mechc.MechcError, match=message):
        four_bar().synthesize({"C": points}, FREE, **options)
