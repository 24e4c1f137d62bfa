"""MuJoCo runs in a process of its own: files on which it fails are refused in words."""

import signal
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import pytest
from mechc_codegen.mjcf import read

import mechc
from tests.compiler.mjcf.reference import write_model

pytest.importorskip("mujoco")
pytestmark = pytest.mark.filterwarnings("ignore::mechc.SkippedPartWarning")  # contacts

BODY = '<body name="b"><joint name="j"/><geom size="1"/></body>'
WORLD = f"<worldbody>{BODY}</worldbody>"
ENDLESS = (
    '<mujoco><compiler><lengthrange useexisting="false" uselimit="false" inttotal="1e12" '
    f'timestep="1e-9"/></compiler>{WORLD}<actuator><muscle joint="j"/></actuator></mujoco>'
)
FATAL = {
    "a model that contains itself": (
        '<mujoco><asset><model name="m" file="model.xml"/></asset><worldbody>'
        '<attach model="m" prefix="p"/></worldbody></mujoco>', r"ended by the signal \d+"),
    "15 GB of heights": (
        '<mujoco><asset><hfield name="h" nrow="40000" ncol="40000" size="1 1 1 1"/></asset>'
        f"{WORLD}</mujoco>", "fails on the file: "),
    "a texture of 5 GB": (
        '<mujoco><asset><texture name="t" type="2d" builtin="flat" width="40000" height="40000"/>'
        f"</asset>{WORLD}</mujoco>", "Could not allocate memory for texture"),
    "a size beyond memory": (
        f'<mujoco><size nuser_body="1000000000"/>{WORLD}</mujoco>', "fails on the file: "),
    "no end": (ENDLESS, "does not compile the file within 4 s"),
}  # fmt: skip


@pytest.mark.parametrize("what", FATAL)
def test_files_on_which_mujoco_fails_are_refused(what, tmp_path, monkeypatch):
    text, words = FATAL[what]
    monkeypatch.setattr(read, "TIME", 4 if what == "no end" else 60)
    with pytest.raises(mechc.MechanismError, match=words):
        mechc.from_mjcf(write_model(tmp_path, text))


def test_what_mujoco_prints_is_not_taken_for_its_answer(tmp_path, monkeypatch):
    """Nor does its process read what is typed, or stay."""
    noisy = tmp_path / "mujoco_noise"
    noisy.mkdir()
    (noisy / "sitecustomize.py").write_text("print('hello'); import sys; sys.stderr.write('well')")
    monkeypatch.syspath_prepend(noisy)
    found = mechc.from_mjcf(write_model(tmp_path, f"<mujoco>{WORLD}</mujoco>"))
    assert [joint.name for joint in found.joints] == ["j"]


def test_of_what_a_failing_mujoco_prints_only_the_end_is_read(tmp_path, monkeypatch):
    endless = "import os\nfor _ in range(64): os.write(2, b'x' * 2**20)\nos.write(2, b'  why')"
    (tmp_path / "mujoco.py").write_text(f"{endless}\nos._exit(3)")
    monkeypatch.syspath_prepend(tmp_path)
    path = write_model(tmp_path, "<mujoco/>")
    tracemalloc.start()
    with pytest.raises(mechc.MechanismError, match=r"code 3, .* x{290,300} why"):
        mechc.from_mjcf(path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 2**24


@pytest.mark.parametrize("group", [-3, 40, 2_000_000_000])
def test_groups_of_actuators_that_no_file_disables(group, tmp_path):
    motor = f'<actuator><motor joint="j" name="m" group="{group}"/></actuator>'
    path = write_model(tmp_path, f"<mujoco>{WORLD}{motor}</mujoco>")
    assert [*map(str, mechc.from_mjcf(path, driven="all").inputs)] == ["ctrl_m(t)"]


@pytest.mark.skipif(sys.platform != "linux", reason="finds the process in /proc")
def test_ctrl_c_ends_mujoco_and_the_call(tmp_path):
    path = write_model(tmp_path, ENDLESS)
    program = f"import mechc; print(1, flush=True); mechc.from_mjcf({str(path)!r})"
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline()
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        wait_until(lambda: children.read_text().split())
        (child,) = children.read_text().split()
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=10)
    assert "KeyboardInterrupt" in told
    wait_until(lambda: not Path(f"/proc/{child}").exists())


def wait_until(answer):
    end = time.monotonic() + 60
    while not answer():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_package_that_cannot_be_imported_is_not_called_missing(tmp_path, monkeypatch):
    broken = tmp_path / "broken" / "mujoco"
    broken.mkdir(parents=True)
    (broken / "__init__.py").write_text("raise OSError('libmujoco.so.4: file too short')")
    monkeypatch.syspath_prepend(broken.parent)
    with pytest.raises(mechc.MechanismError, match=r"cannot be imported: OSError: libmujoco\.so"):
        mechc.from_mjcf(write_model(tmp_path, f"<mujoco>{WORLD}</mujoco>"))
