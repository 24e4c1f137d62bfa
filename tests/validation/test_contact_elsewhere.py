"""Published motions with contact are the same alone, in a batch, step by step and in a unit.

The examples have the models and compare `simulate` with what was published.
"""

import runpy

import numpy as np
import pytest

import mechc
from tests.support import ROOT

PIECES = 60  # of a motion that is advanced step by step


NAMES = {  # example -> its model and its stops; its last motion is `sol`
    "woodpecker": ("model", "stops"), "slider_clearance": ("model", "stops"),
    "stick_and_slip": ("discs", "pressed"),
}  # fmt: skip
# Two corners hit at once: rounding decides which is the first.
SENSITIVE = ("slider_clearance",)


@pytest.fixture(scope="module", params=NAMES)
def published(request, tmp_path_factory):
    """What an example computes, and the SymPy object that it compiles."""
    described, compiled = {}, mechc.compile

    def recorded(thing, **options):
        described.update(thing=thing, options=options)
        return compiled(thing, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("example"))
        patch.setattr(mechc, "compile", recorded)
        found = runpy.run_path(str(ROOT / "examples" / f"{request.param}.py"))
    model, stops = (found[name] for name in NAMES[request.param])
    return model, found["sol"], stops() if callable(stops) else stops, described


@pytest.fixture
def repeated(published, request):
    """One whose motion does not depend on rounding."""
    if request.node.callspec.params["published"] in SENSITIVE:
        pytest.skip("two corners hit at once: rounding decides")
    return published


def far(sol, t):
    """Whether a time is at no jump."""
    return min(np.abs(found.t - t).min(initial=1.0) for found in sol.events) > 1e-6


@pytest.mark.slow
def test_a_member_of_a_batch_is_the_motion_to_the_last_bit(published):
    model, sol, stops, _ = published
    policy = {"events": stops, "rtol": sol.policy.rtol, "lockstep": False}
    batch = model.simulate_batch(sol.t[-1], np.tile(sol.y[0], (3, 1)), progress=False, **policy)
    assert batch.ok.all()
    for k in range(3):
        assert np.array_equal(batch.y[k], sol.y[-1])
        assert batch.event_counts[k].tolist() == [len(found.t) for found in sol.events]


@pytest.mark.slow
def test_a_stepper_follows_the_motion(repeated):
    model, sol, stops, _ = repeated
    stepper = model.stepper(sol.y[0], events=stops, rtol=sol.policy.rtol)
    times = np.linspace(sol.t[0], sol.t[-1], PIECES + 1)
    scale = np.abs(sol.y).max(axis=0)
    for k in range(1, PIECES):
        state = stepper.step(times[k] - stepper.t)
        if far(sol, times[k]):
            np.testing.assert_allclose(state / scale, sol(times[k]) / scale, atol=1e-5)


@pytest.mark.slow
def test_a_unit_follows_the_motion(repeated, tmp_path):
    fmpy = pytest.importorskip("fmpy")
    _, sol, stops, described = repeated
    names = (*sol.model.coordinates, *sol.model.speeds)
    file = mechc.export_fmu(
        described["thing"], tmp_path / "unit.fmu", name="unit", y0=sol.y[0], events=stops,
        params=dict(sol.model.defaults), rtol=sol.policy.rtol, derivatives=False,
    )  # fmt: skip
    record = fmpy.simulate_fmu(
        str(file), stop_time=sol.t[-1], output_interval=sol.t[-1] / PIECES, output=list(names),
        relative_tolerance=sol.policy.rtol,
    )  # fmt: skip
    scale = np.abs(sol.y).max(axis=0)
    for row in record[:-1]:
        t, *state = row.tolist()
        if far(sol, t):
            np.testing.assert_allclose(np.array(state) / scale, sol(t) / scale, atol=1e-5)
