"""What is no path, no array, no name and no truth is refused in words, at each door that takes one.

The messages are mechc's: those of Python and NumPy name neither the argument nor what to give.
"""

import decimal

import numpy as np
import pytest

import mechc

WRONG = [None, 3, ["a.nc"], b"a.nc", ..., np.zeros(2), len]


@pytest.fixture(scope="module")
def sol():
    model = mechc.load("four_bar")
    return model.simulate(0.1, model.assemble({"theta_0": 1.4}))


@pytest.mark.parametrize("given", WRONG, ids=repr)
def test_what_is_no_path_is_refused(given, sol):
    doors = (
        mechc.open, mechc.from_urdf, mechc.from_sdf, mechc.from_mjcf, sol.save, sol.animate().save,
        sol.view().save,
    )  # fmt: skip
    for door in doors:
        with pytest.raises(TypeError, match=r"a path is a text or a pathlib\.Path, not"):
            door(given)


def test_an_array_that_cannot_hold_the_rates_is_refused(sol):
    locked = np.zeros(6)
    locked.flags.writeable = False
    for out in (np.zeros((7,)), np.zeros((2, 5)), locked):
        with pytest.raises(mechc.MechcError, match="out cannot hold the rates: "):
            sol.model.rhs(0.0, np.ones(6), out=out)


@pytest.mark.parametrize("given", [np.zeros(2), np.zeros(0), "yes", 3], ids=repr)
def test_truth_is_true_or_false(given, sol):
    for option in ("states", "lockstep"):
        with pytest.raises(TypeError, match=f"{option} is True or False, not"):
            sol.model.simulate_batch(0.1, {"theta_0": [1.4, 1.5]}, **{option: given})


def test_mechanisms_and_outputs_of_the_library_are_names():
    for given in (np.ma.masked, [], np.zeros(2)):
        with pytest.raises(mechc.UnknownNameError, match="no mechanism is called"):
            mechc.load(given)
    for given in (NotImplemented, 3, len, np.array(None)):
        with pytest.raises(TypeError, match="requested by name"):
            mechc.load("four_bar", outputs=given)


def test_frames_a_second_may_be_any_number(sol):
    for number in (decimal.Decimal("30"), np.float32(30)):
        assert sol.animate(fps=number).data == sol.animate(fps=30.0).data
