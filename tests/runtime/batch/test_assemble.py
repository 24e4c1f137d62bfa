"""Members that are assembled start where ``model.assemble`` starts them."""

import numpy as np
import pytest

import mechc
from mechc.errors import AssemblyError
from tests.support.linkages.loops import spatial_four_bar
from tests.support.linkages.peaucellier import RODS, cell

CRANKS = np.linspace(-0.5, 0.5, 4)  # y_B, m


@pytest.fixture(scope="module")
def folding():
    return cell()


def starts(model, start, params=None):
    """A batch so short that only its starts matter."""
    return model.simulate_batch(0.001, start, params, threads=1)


@pytest.mark.slow
@pytest.mark.parametrize("guess", [{}, {"x_B": 1.9}, {"x_B": 1.9, "x_C": 2.7, "y_C": 1.0}])
def test_on_no_sheet_where_the_mechanism_is_folded(folding, guess):
    """The cell has infinitely many configurations for a place of B, on a sheet with C on D."""
    batch = starts(folding, mechc.Assembly({"y_B": CRANKS}, guess=guess))
    assert batch.ok.all()
    for member, crank in enumerate(CRANKS):
        at = dict(zip(folding.coordinates, batch.y0[member], strict=False))
        apart = np.hypot(at["x_C"] - at["x_D"], at["y_C"] - at["y_D"])
        assert apart > 1e-3
        assert np.hypot(at["x_C"], at["y_C"]) == pytest.approx(RODS["OC"], abs=1e-12)
        alone = folding.assemble({"y_B": crank}, guess=guess)
        np.testing.assert_array_equal(batch.y0[member], alone)


@pytest.mark.slow
def test_where_all_are_folded_it_says_so(folding):
    x, y = 3.0 * np.cos(0.3), 3.0 * np.sin(0.3)
    held = {"x_C": x, "y_C": y, "x_D": x, "y_D": y}
    with pytest.warns(mechc.CollapsedSheetWarning, match="no other was found"):
        batch = starts(folding, mechc.Assembly(held, guess={"y_B": 0.4}))
    at = dict(zip(folding.coordinates, batch.y0[0], strict=False))
    assert (at["x_C"], at["y_C"]) == (at["x_D"], at["y_D"]) == (x, y)
    assert np.hypot(at["x_B"] - x, at["y_B"] - y) == pytest.approx(RODS["BC"], abs=1e-12)


def test_at_a_change_point_speeds_follow_the_branch_that_takes_them(model):
    """All links in line: omega_1 / omega_2 is -3 - sqrt(6) or -3 + sqrt(6), by branch."""
    ratio = -3.0 + np.sqrt(6.0)
    on_branch = 2.0 * ratio / (2.0 * ratio + 3.0)  # omega_0 = 2 omega_1 + 3 omega_2 = 0
    given = {"omega_0": 2.0, "omega_1": np.array([on_branch, on_branch + 0.1])}
    batch = starts(model, mechc.Assembly({"theta_0": np.pi}, given))
    alone = model.assemble({"theta_0": np.pi}, {"omega_0": 2.0, "omega_1": on_branch})
    np.testing.assert_allclose(batch.y0[0], alone, atol=1e-12)
    with pytest.raises(AssemblyError):
        model.assemble({"theta_0": np.pi}, {"omega_0": 2.0, "omega_1": on_branch + 0.1})
    assert batch.status(1).code == "not assembled"


@pytest.mark.slow
def test_quaternions_in_a_loop_begin_unturned():
    """The coupler may spin: without a guess of its attitude nothing would decide how far."""
    model = mechc.compile(spatial_four_bar(by_quaternion=True))
    crank = np.array([-1.25, -0.75, 1.5])
    batch = starts(model, mechc.Assembly({"a": crank}))
    for member, angle in enumerate(crank):
        np.testing.assert_array_equal(batch.y0[member], model.assemble({"a": angle}))


def test_members_beside_singular_ones_stay_as_they_are(model):
    """A dead point and a change point among regular members change nothing for these."""
    theta = np.array([1.4, np.pi, 1.9, 2.4])
    batch = starts(model, mechc.Assembly({"theta_0": theta}))
    for member in (0, 2, 3):
        alone = model.assemble({"theta_0": theta[member]})
        np.testing.assert_array_equal(batch.y0[member], alone)


@pytest.mark.parametrize("order", [[0], [0, 1], [1, 0]])
def test_a_member_at_a_change_point_starts_as_alone_whatever_the_others_are(model, order):
    """The other member closes in one configuration alone, so the rank elsewhere is not its own."""
    theta, length = np.array([np.pi, 0.0])[order], np.array([4.0, 6.0])[order]
    batch = starts(model, mechc.Assembly({"theta_0": theta}, {"omega_0": 1.0}), {"l_3": length})
    with pytest.raises(AssemblyError, match="2 branches"):
        model.assemble({"theta_0": np.pi}, {"omega_0": 1.0}, params={"l_3": 4.0})
    assert batch.status(order.index(0)).code == "not assembled"
    if 1 in order:
        alone = model.assemble({"theta_0": 0.0}, {"omega_0": 1.0}, params={"l_3": 6.0})
        np.testing.assert_array_equal(batch.y0[order.index(1)], alone)
