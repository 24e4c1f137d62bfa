"""Errors of a description come back with a short traceback, bugs with all of it."""

from __future__ import annotations

import os
import subprocess
import sys
import traceback

import pytest
from mechc_codegen.errors import InternalError
from sympy.physics.mechanics import PinJoint, RigidBody

import mechc
from mechc.compilation.one_at_a_time import TRACEBACK, one_at_a_time
from mechc.errors import CompilerError, MechcError, UnknownNameError

SCRIPT = """
import mechc
from sympy.physics.mechanics import PinJoint, RigidBody
arm = mechc.from_joints("arm", [PinJoint("pin", RigidBody("ground"), RigidBody("arm"))])
def test_it():
    mechc.compile(arm, outputs=("energi",))
"""


def error_of(work):
    with pytest.raises(Exception) as raised:  # noqa: PT011
        work()
    return raised.value, [frame.name for frame in traceback.extract_tb(raised.value.__traceback__)]


@one_at_a_time
def deep(depth: int, error: Exception) -> None:
    if depth:
        return deep.__wrapped__(depth - 1, error)
    raise error


@pytest.mark.parametrize("error", [MechcError("no"), UnknownNameError("name", "a", ["b"])])
def test_an_error_of_a_user_ends_at_the_door(error, monkeypatch):
    monkeypatch.delenv(TRACEBACK, raising=False)
    cause = KeyError("why")
    error.__cause__ = cause
    found, frames = error_of(lambda: deep(20, error))
    assert found is error
    assert found.__cause__ is cause
    assert found.__context__ is not error
    assert frames[2:] == ["alone"]
    monkeypatch.setenv(TRACEBACK, "full")
    assert error_of(lambda: deep(20, MechcError("no")))[1][-21:] == ["deep"] * 21


@pytest.mark.parametrize(
    "error", [InternalError("no"), CompilerError("no"), ZeroDivisionError(), KeyboardInterrupt()]
)
def test_what_may_be_a_bug_keeps_all_of_it(error):
    with pytest.raises(type(error)) as raised:
        deep(20, error)
    frames = [frame.name for frame in traceback.extract_tb(raised.value.__traceback__)]
    assert frames[-21:] == ["deep"] * 21


def test_compiling_and_typed_expressions_have_it():
    arm = mechc.from_joints("arm", [PinJoint("pin", RigidBody("ground"), RigidBody("arm"))])
    model = mechc.load("four_bar")
    start = model.assemble({"theta_0": 1.4})
    for work, most in (
        (lambda: mechc.compile(arm, outputs=("energi",)), 2),
        (lambda: mechc.compile(arm, units={"nope": "m"}), 2),
        (lambda: mechc.load("four_bar", frictions=True), 3),
        (lambda: model.simulate(1.0, start, events=["thet > 1"]), 9),
    ):
        _, frames = error_of(work)
        assert len(frames) - 2 <= most, frames


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    "command",
    [
        [sys.executable, "run_it.py"],
        [sys.executable, "-m", "IPython", "--no-banner", "--colors=NoColor", "run_it.py"],
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", "test_it.py"],
    ],
    ids=["python", "ipython", "pytest"],
)
def test_the_message_stands_below_the_line_of_the_user(command, tmp_path):
    (tmp_path / "test_it.py").write_text(SCRIPT, "utf-8")
    (tmp_path / "run_it.py").write_text(f"{SCRIPT}\ntest_it()", "utf-8")
    paths = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "IPYTHONDIR": str(tmp_path)}
    for more, whole in (({}, False), ({TRACEBACK: "full"}, True)):
        env = {**{k: x for k, x in os.environ.items() if k != TRACEBACK}, **paths, **more}
        done = subprocess.run(
            command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False
        )
        said = done.stdout + done.stderr
        message = said.index("MechanismError: outputs: 'energi' is not one of energy, momenta")
        line = said.rindex('mechc.compile(arm, outputs=("energi",))', 0, message)
        between = said[line:message]
        assert ("read_request" in between) is whole, said
        assert len(between.splitlines()) < 12 or whole, said
