"""Limits, dry friction and effort of a file: taken as asked for, or named with the line to write.

A wheel that a motor drives, and one that turns twice as far: u' = tau / I.
"""

import pickle
from math import sqrt

import numpy as np
import pytest
from mechc_codegen.robots.bounds import take_bounds
from mechc_codegen.robots.mechanism import mechanism_of

import mechc
from mechc.cli.commands import main
from mechc.export import _events
from tests.compiler.robots.loops import four_bar

INERTIA = 0.5 + 2**2 * 0.2
LINK = """<link name="{0}"><inertial><mass value="2"/>
  <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="{1}"/></inertial></link>"""
WHEELS = f"""<robot name="wheels"><link name="post"/>{LINK.format("w", 0.5)}{LINK.format("v", 0.2)}
<joint name="w" type="revolute"><parent link="post"/><child link="w"/><axis xyz="0 0 1"/>
  <dynamics friction="0.5"/><limit lower="-1" upper="3" effort="2" velocity="1"/></joint>
<joint name="v" type="revolute"><parent link="post"/><child link="v"/><axis xyz="0 0 1"/>
  <limit lower="-2" upper="6" effort="9" velocity="1"/><mimic joint="w" multiplier="2"/></joint>
</robot>"""
ALL = {"limits": "stop", "friction": "dry", "effort": "saturate"}
TORQUE = "0.1 + 0.5*t"  # begins to turn at 0.8 s, and is that of the file at 3.8 s


def wheels(folder, text=WHEELS, **options):
    path = folder / "wheels.urdf"
    path.write_text(text)
    return mechc.from_urdf(path, driven="w", **options)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheels")
    return mechc.compile(wheels(folder, symbolic=["limits", ("w", "friction")], **ALL))


def time_at(angle, friction=0.5, effort=2.0):
    """The time at which the wheel has turned so far."""
    begin, full = (friction - 0.1) / 0.5, (effort - 0.1) / 0.5
    angle_then = 0.5 * (full - begin) ** 3 / 6 / INERTIA
    speed_then = 0.5 * (full - begin) ** 2 / 2 / INERTIA
    if angle <= angle_then:
        return begin + (12 * angle * INERTIA) ** (1 / 3)
    rate = (effort - friction) / INERTIA
    return full + (sqrt(speed_then**2 + 2 * rate * (angle - angle_then)) - speed_then) / rate


@pytest.mark.parametrize(
    "values",
    [{}, {"upper_w": 1.0}, {"upper_v": 1.0}, {"f_w": 0.3, "effort_w": 1.1}],
)
def test_the_wheel_sticks_is_driven_and_stops(model, values):
    sol = model.simulate(8.0, {"q_w": 0.0}, values, inputs={"tau_w": TORQUE})
    given = {"upper_w": 3.0, "upper_v": 6.0, "f_w": 0.5, "effort_w": 2.0} | values
    stop = min(given["upper_w"], given["upper_v"] / 2)
    hit = time_at(stop, given["f_w"], given["effort_w"])
    _, at_w, breaks, _, at_v = sol.events
    assert (at_v if "upper_v" in values else at_w).t[0] == pytest.approx(hit, rel=1e-8)
    assert breaks.t[0] == pytest.approx((given["f_w"] - 0.1) / 0.5, rel=1e-9)
    assert sol["q_w"][-1] == pytest.approx(stop, rel=1e-12)
    assert sol["u_w"][-1] == pytest.approx(0.0, abs=1e-12)


def test_batches_steppers_and_events_of_the_run_have_them_too(model):
    one = model.simulate(5.0, {"q_w": 0.0}, inputs={"tau_w": TORQUE}, events="q_w - 1")
    assert one.events[0].t == pytest.approx([time_at(1.0)], rel=1e-8)
    assert len(one.events) == 6
    batch = model.simulate_batch(
        5.0, {"q_w": np.zeros(2)}, {"upper_w": np.array([3.0, 1.0])}, inputs={"tau_w": TORQUE}
    )
    assert batch.y[:, 0] == pytest.approx([one["q_w"][-1], 1.0], rel=1e-8)
    stepper = model.stepper({"q_w": 0.0}, inputs={"tau_w": 1.7})
    stepper.step(5.0)
    assert stepper.y[0] == pytest.approx(3.0)


def test_exported_units_have_them(model):
    names = [[each["name"] for each in model.system.data[kind]]
             for kind in ("coordinates", "speeds", "parameters")]  # fmt: skip
    events, contacts = _events((), model.system.data, *names)
    assert len(events) == 5
    assert [*contacts.has_friction] == [0, 0, 1, 0, 0]


def test_by_default_one_warning_has_the_lines_to_write(tmp_path):
    with pytest.warns(mechc.SkippedPartWarning) as told:
        found = wheels(tmp_path)
    (words,) = [str(each.message) for each in told]
    for line in ("limits='stop'", "friction='dry'", "effort='saturate'"):
        assert line in words
    assert [each.rpartition(": ")[2] for each in found.skipped] == [
        "w -1 to 3.0, v -2.0 to 6.0", "w 0.5", "w 2.0"
    ]  # fmt: skip
    assert found.contacts == ()


def test_dry_friction_that_the_file_does_not_have_begins_at_zero(tmp_path):
    found = wheels(tmp_path, symbolic=["friction"], **ALL)
    assert {str(each.symbol): each.default for each in found.parameters} == {
        "f_w": 0.5, "f_v": 0.0, "g": 9.81,
    }  # fmt: skip


def test_what_is_left_is_silent(tmp_path):
    found = wheels(tmp_path, limits="ignore", friction="ignore", effort="ignore")
    assert found.skipped == found.contacts == ()
    assert found.limits["w"].upper == 3.0
    with pytest.raises(mechc.MechanismError, match="limits='stops' is none of 'warn', 'ignore' an"):
        wheels(tmp_path, limits="stops")


def test_bounds_without_room_are_named_and_not_taken(tmp_path):
    """As exporters write them that know no bounds."""
    text = WHEELS.replace('lower="-1" upper="3" effort="2"', 'lower="0" upper="0" effort="0"')
    with pytest.warns(mechc.SkippedPartWarning):
        found = wheels(tmp_path, text, **ALL)
    assert found.skipped == (
        "the limits of the joint w, both 0",
        "the effort of the joint w, 0, with which its motor never acts",
    )
    assert len(found.contacts) == 3


def test_a_joint_of_a_loop_that_stops_is_not_cut():
    plain = four_bar(B={"limits": {"lower": -1.0, "upper": 1.0}})
    stopped = mechanism_of(take_bounds(plain, limits="stop"))
    assert mechanism_of(take_bounds(plain, limits="ignore")).cuts == ("B",)
    assert stopped.cuts == ("C",)
    assert len(stopped.contacts) == 2


def test_what_is_read_again_is_that_motion(model, tmp_path):
    sol = model.simulate(8.0, {"q_w": 0.0}, inputs={"tau_w": TORQUE})
    again = pickle.loads(pickle.dumps(sol))
    sol.save(tmp_path / "wheels.nc")
    for one in (again, mechc.open(tmp_path / "wheels.nc")):
        np.testing.assert_allclose(one.y, sol.y, rtol=0, atol=1e-14)
        assert [each.contacts for each in one.segments] == [each.contacts for each in sol.segments]


def test_the_law_of_restitution_is_that_of_the_stops_given(model):
    stop = mechc.Stop("2.5 - q_w", 0.2, law="poisson")
    sol = model.simulate(8.0, {"q_w": 0.0}, inputs={"tau_w": TORQUE}, events=stop)
    assert sol.status.ok
    assert sol["q_w"].max() < 2.5 + 1e-9


def test_inverse_dynamics_refuses_what_a_motor_cannot_give(model):
    given = {"params": {"effort_w": 10.0}, "inputs": ["tau_w"]}
    asked = model.inverse_dynamics([0.5, 0.0], [1.0], **given)
    assert asked.inputs[0] == pytest.approx(INERTIA)
    with pytest.raises(mechc.MechcError, match=r"not linear in tau_w up to 13\b.*saturate"):
        model.inverse_dynamics([0.5, 0.0], [10.0], **given)


def test_exported_c_says_that_it_has_none(model, tmp_path):
    with pytest.warns(mechc.SkippedPartWarning, match="without its 5 stops and places"):
        mechc.export_c(model, tmp_path / "c")


def test_a_start_is_between_the_stops(tmp_path):
    away = WHEELS.replace('lower="-1"', 'lower="0.5"')
    assert wheels(tmp_path, away, **ALL).start == {"q_w": 0.5}
    assert wheels(tmp_path, away, limits="ignore", friction="ignore", effort="ignore").start == {}


def test_in_the_shell(tmp_path, capsys):
    path = tmp_path / "wheels.urdf"
    path.write_text(WHEELS)
    bounds = ["--with", "limits=stop", "--with", "friction=dry", "--with", "effort=ignore"]
    assert main(["run", str(path), *bounds, "--t-end", "0.1", "--start", "q_w=1", "--json"]) == 0
    assert main(["run", str(path), "--with", "wings"]) != 0
    assert "limits, friction, effort" in capsys.readouterr().err
