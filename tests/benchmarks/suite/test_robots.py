"""The table of robots: figures of those that are compiled, the reason of those that are refused."""

import numpy as np
import pytest

from benchmarks.suite import robots
from benchmarks.timing import results

SWING = """<robot name="swing"><link name="post"/><link name="arm">
  <inertial><origin xyz="0 0 -0.4"/><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="post"/><child link="arm"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


@pytest.mark.thorough
def test_a_robot_is_measured_and_another_refused(tmp_path, monkeypatch, out, capsys):
    pytest.importorskip("pinocchio", reason="pip install 'mechc[robots]'")
    (tmp_path / "swing.urdf").write_text(SWING)
    (tmp_path / "post.urdf").write_text(SWING.replace("revolute", "fixed"))
    monkeypatch.setattr(robots, "robots_folder", lambda: tmp_path)
    assert robots.main([]) == 0
    found = results.read(out / "robots.json")["robots"]
    swing = found["swing.urdf"]
    assert (swing["joints"], swing["speeds"]) == (1, 1)
    assert all(swing[name] > 0 for name in robots.FIGURES)
    assert "no joint of the file moves" in found["post.urdf"]["refused"]
    assert "no joint of the file moves" in capsys.readouterr().out


def test_a_difference_above_rounding_is_told():
    row = {**dict.fromkeys(robots.GAPS, 1e-15), "accelerations": 1e-10, "condition": 1e4}
    assert not robots.above_rounding(row)
    assert not robots.above_rounding({"refused": "why"})
    for wrong in (1e-3, np.nan, np.inf):
        assert robots.above_rounding(row | {"torques": wrong})
        assert robots.above_rounding(row | {"accelerations": wrong})
