"""The package's door: its names, its errors, what it loads."""

from __future__ import annotations

import pickle
import subprocess
import sys

import pytest

import mechc


def test_dir_lists_what_is_for_users_and_nothing_else():
    shown = {name for name in dir(mechc) if not name.startswith("__")}
    assert shown == {*mechc.__all__, "compile", "open"}
    assert {"Mechanism", "from_joints", "Cut", "Joint"} <= shown
    assert all(hasattr(mechc, name) for name in shown)


def test_what_is_wrong_with_a_mechanism_is_an_error_of_mechc_and_a_value_error():
    for kind in (mechc.MechanismError, mechc.MechcError, ValueError):
        with pytest.raises(kind) as caught:
            mechc.Drawing(view=("x", "x"))
        assert type(caught.value) is mechc.MechanismError
    again = pickle.loads(pickle.dumps(mechc.MechanismError("m_0 is not positive")))
    assert type(again) is mechc.MechanismError
    assert str(again) == "m_0 is not positive"


def test_errors_of_the_compiler_keep_their_place_in_its_own_family():
    from mechc_codegen import errors

    assert issubclass(mechc.MechanismError, errors.MechanismError)
    with pytest.raises(errors.MechanismError):
        raise errors.MechanismError("as the compiler raises it")
    assert isinstance(errors.InternalError("nothing is left"), mechc.MechcError)
    assert "bug in mechc" in str(errors.InternalError("nothing is left"))


def test_a_typed_load_that_cannot_be_read_is_an_error_of_mechc():
    with pytest.raises(mechc.MechcError):
        mechc.load("four_bar", crank_torque="__import__('os')")


LANES = """
import sys
from mechc.compilation.toolchain.processor import native
native()
print([name for name in sys.modules if name.startswith("mechc._scenes.")])
"""


def test_the_lanes_of_this_processor_are_known_without_a_compiled_mechanism():
    from mechc.compilation.toolchain.processor import native

    done = subprocess.run([sys.executable, "-c", LANES], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert native().lanes == mechc.load("four_bar").system.scene.lanes


def test_a_pickled_model_is_the_same_one(model):
    assert pickle.loads(pickle.dumps(model)) is model
    assert mechc.load("four_bar") is model
