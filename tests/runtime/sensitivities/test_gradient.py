"""Gradients of objectives: the adjoint of the steps is the transposed of the forward columns."""

import numpy as np
import pytest
from mechc_codegen.library.chains.rods import planar_chain
from mechc_codegen.library.chains.windows import windows

import mechc
from tests.runtime.sensitivities.test_loops import REGULAR, START, bar
from tests.runtime.sensitivities.test_run import GIVEN, T, swing
from tests.support import scenes

__all__ = ["bar", "swing"]  # compiled scenes of other tests
BY = ["l_0", "l_3", "m_1", "I_2", "g", "theta_0", "omega_0"]


def total(sol, output, name):
    """The integral of a sensitivity, by quadrature on every step."""
    s, w = np.polynomial.legendre.leggauss(8)
    t, h = sol.record.states()[0], np.diff(sol.record.states()[0])
    points = (t[:-1, None] + h[:, None] * (0.5 + 0.5 * s)).reshape(-1)
    found = sol.sensitivity_of(output, name, points).reshape(len(h), len(s))
    return (h[:, None] * found * 0.5 * w).sum()


@pytest.mark.parametrize("method", ["gauss8", "dop853", "dopri5", "radau5"])
def test_forward_and_backward_agree_to_rounding(bar, method):
    sol = bar.simulate(1.5, START, REGULAR, method=method, rtol=1e-7, sensitivities=BY)
    of_end = sol.gradient(end={"theta_1": 2.0, "kinetic_energy": -0.1}, by=BY)
    of_all = sol.gradient(integral="potential_energy", by=BY)
    for name in BY:
        wanted = 2.0 * sol.sensitivity[name][-1, 1]
        wanted -= 0.1 * sol.sensitivity_of("kinetic_energy", name)[-1]
        size = np.abs(sol.sensitivity[name][-1]).max() + abs(wanted)
        assert abs(of_end[name] - wanted) < 1e-11 * size
        wanted = total(sol, "potential_energy", name)
        assert abs(of_all[name] - wanted) < 1e-10 * max(abs(wanted), 1.0)
    T_end = bar.kinetic_energy(sol.y[-1], sol.params)
    assert abs(of_end.value - (2.0 * sol["theta_1"][-1] - 0.1 * T_end)) < 1e-12 * abs(T_end)


OTHERS = {
    "tree": (lambda: planar_chain(4), {"q_0": 0.3}),
    "tree with loops": (lambda: windows(2), None),
    "speeds that are no rates": (
        lambda: scenes.swing(guided=True),
        {"x": 0.2, "phi": 0.3, "s": 0.1},
    ),
}


@pytest.mark.parametrize("scene", OTHERS)
def test_forward_and_backward_agree_in_every_form_of_the_equations(scene):
    build, start = OTHERS[scene]
    model = mechc.compile(build(), outputs=("sensitivities",))
    y0 = model.assemble(start)
    weights = np.cos(np.arange(len(y0)))
    by = [*model.parameters, "y0"]
    for method in ("gauss8", "dop853", "radau5"):
        sol = model.simulate(0.7, y0, method=method, rtol=1e-6, sensitivities=by)
        found = sol.gradient(end=weights, by=by)
        for name in by:
            wanted = weights @ sol.sensitivity[name][-1]
            limit = 1e-11 * np.nanmax(np.abs(sol.sensitivity[name][-1]), initial=1.0)
            np.testing.assert_allclose(found[name], wanted, rtol=0, atol=limit, err_msg=method)


def test_an_array_is_the_derivative_by_the_end(bar):
    sol = bar.simulate(1.0, START, REGULAR, sensitivities=["y0"])
    weights = np.arange(1.0, 7.0)
    found = sol.gradient(end=weights, by=["y0"])["y0"]
    np.testing.assert_allclose(found, weights @ sol.sensitivity["y0"][-1], rtol=1e-11)


def test_until_a_terminal_event_and_past_a_kink(swing):
    """The end lies within a step; an input jumps on the way."""
    push = mechc.Signal([0.0, 0.4, 0.9, 3.0], [0.3, -0.8, 0.5, 0.5], "previous")
    low = mechc.Event(lambda t, y: t - 1.7, terminal=True)
    by = ["l", "c", "q"]
    sol = swing.simulate(T, {"q": 0.7, "u": -0.5}, GIVEN, inputs={"F": push}, events=low,
                         sensitivities=by)  # fmt: skip
    of_end, of_all = (sol.gradient(**{k: "kinetic_energy"}, by=by) for k in ("end", "integral"))
    plain = swing.simulate((0.0, sol.t[-1]), {"q": 0.7, "u": -0.5}, GIVEN, inputs={"F": push},
                           sensitivities=by, rtol=1e-12)  # fmt: skip
    for name in by:
        wanted = sol.sensitivity_of("kinetic_energy", name)[-1]
        assert abs(of_end[name] - wanted) < 1e-11 * max(abs(wanted), 1.0)
        assert abs(of_all[name] - total(plain, "kinetic_energy", name)) < 1e-7


def test_past_a_change_point_lengths_have_none(bar):
    sol = bar.simulate(2.0, {"theta_0": np.radians(85)}, rtol=1e-9)
    found = sol.gradient(end="theta_0", by=["l_3", "m_1", "theta_0"])
    assert np.isnan(found["l_3"])
    assert np.isfinite([found["m_1"], found["theta_0"]]).all()
    (note,) = found.notes
    assert "by l_3" in note


def test_what_is_no_objective_is_refused(bar, swing):
    moved = swing.simulate(0.1, {"q": 0.7, "u": -0.5}, inputs={"F": 0.3})
    with pytest.raises(mechc.MechcError, match="one of its numbers"):
        moved.gradient(end="points")
    sol = bar.simulate(0.1, START, REGULAR)
    with pytest.raises(mechc.MechcError, match=r"shape \(3,\)"):
        sol.gradient(end=np.ones(3))
    with pytest.raises(mechc.UnknownNameError, match="speedo"):
        sol.gradient(integral="speedo")
    with pytest.raises(TypeError):
        sol.gradient(integral=["theta_0"])
