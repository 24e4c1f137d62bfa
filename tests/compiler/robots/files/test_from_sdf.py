"""One linkage in SDFormat, URDF and MJCF moves alike, and the shell takes it."""

import numpy as np
import pytest

import mechc
from mechc.cli.own_models import own_object

LINKS = {"a": (0, 0, 0), "b": (0, 0, 1), "c": (2, 0, 0)}
CENTRE, ROLL = (0.1, 0.2, 0.3), 0.4
INERTIA = {"ixx": 0.3, "iyy": 0.4, "izz": 0.2}
JOINTS = (("A", "g", "a", (0, 0, 0)), ("B", "a", "b", (0, 0, 1)), ("D", "g", "c", (2, 0, 0)),
          ("C", "c", "b", (2, 0, 1.5)))  # fmt: skip


def words(numbers):
    return " ".join(map(repr, numbers))


def minus(one, other):
    return [x - y for x, y in zip(one, other, strict=True)]


def urdf(folder):
    inertia = " ".join(f'{key}="{x}"' for key, x in INERTIA.items())
    links = "".join(
        f'<link name="{name}"><inertial><origin xyz="{words(CENTRE)}" rpy="{ROLL} 0 0"/>'
        f'<mass value="1.5"/><inertia {inertia}/></inertial></link>'
        for name in LINKS
    )
    joints = "".join(
        f'<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{words(minus(at, LINKS.get(parent, (0, 0, 0))))}"/><axis xyz="0 1 0"/>'
        '<dynamics damping="0.1"/></joint>'
        for name, parent, child, at in JOINTS[:3]
    )
    name, parent, child, at = JOINTS[3]
    joints += (
        f'<loop_joint name="{name}" type="revolute"><link1 link="{parent}" '
        f'xyz="{words(minus(at, LINKS[parent]))}"/><link2 link="{child}" '
        f'xyz="{words(minus(at, LINKS[child]))}"/><axis xyz="0 1 0"/></loop_joint>'
    )
    path = folder / "bars.urdf"
    path.write_text(f'<robot name="bars"><link name="g"/>{links}{joints}</robot>')
    return mechc.from_urdf(path)


def sdf(folder):
    """Links lie askew in the file's own axes where their joints and mass centres are the same."""
    inertia = "".join(f"<{key}>{x}</{key}>" for key, x in INERTIA.items())
    links = "".join(
        f'<link name="{name}"><pose relative_to="at_{name}">0 0 0 0 0 0</pose><inertial>'
        f"<pose>{words(CENTRE)} {ROLL} 0 0</pose><mass>1.5</mass><inertia>{inertia}</inertia>"
        f'</inertial></link><frame name="at_{name}"><pose relative_to="yard">{words(place)} 0 0 0'
        "</pose></frame>"
        for name, place in LINKS.items()
    )
    frames = '<frame name="yard"><pose degrees="true">5 6 7 0 0 90</pose></frame>'
    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent>{"world" if parent == "g" else parent}'
        f"</parent><child>{child}</child><pose>{words(minus(at, LINKS[child]))} 0.3 0.2 0.1</pose>"
        f'<axis><xyz expressed_in="at_{child}">0 1 0</xyz>{DAMPED * (name != "C")}</axis></joint>'
        for name, parent, child, at in JOINTS
    )
    path = folder / "bars.sdf"
    path.write_text(
        '<sdf version="1.9"><world name="w"><gravity>0 0 -9.81</gravity><model name="m">'
        f"{links}{frames}{joints}</model></world></sdf>"
    )
    return mechc.from_sdf(path, cut="m::C")


DAMPED = "<dynamics><damping>0.1</damping></dynamics>"


def mjcf(folder):
    pytest.importorskip("mujoco")
    diagonal = words(INERTIA.values())
    inertial = (
        f'<inertial pos="{words(CENTRE)}" euler="{ROLL} 0 0" mass="1.5" diaginertia="{diagonal}"/>'
    )
    body = '<body name="{}" pos="{}"><joint name="{}" axis="0 1 0" damping="0.1"/>' + inertial
    path = folder / "bars.xml"
    path.write_text(
        '<mujoco model="bars"><compiler angle="radian"/><option gravity="0 0 -9.81"/><worldbody>'
        + body.format("a", "0 0 0", "A")
        + body.format("b", "0 0 1", "B")
        + "</body></body>"
        + body.format("c", "2 0 0", "D")
        + '</body></worldbody><equality><connect name="C" body1="b" body2="c" anchor="2 0 0.5"/>'
        "</equality></mujoco>"
    )
    return mechc.from_mjcf(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bars")


def accelerations(mechanism, prefix=""):
    model = mechc.compile(mechanism, outputs=("energy",))
    names = [f"{letter}_{prefix}{joint}" for letter in "qu" for joint in "ABD"]
    start = {f"q_{prefix}A": 0.2}, {f"u_{prefix}A": 0.7}
    state = model.assemble(*start)
    order = [(*model.coordinates, *model.speeds).index(name) for name in names]
    return np.array(state)[order], np.array(model.rhs(0.0, state))[order]


@pytest.fixture(scope="module")
def of_urdf(folder):
    return accelerations(urdf(folder))


@pytest.mark.parametrize(("form", "prefix"), [(sdf, "m::"), (mjcf, "")])
def test_the_same_linkage_has_the_same_accelerations(folder, of_urdf, form, prefix):
    state, rates = accelerations(form(folder), prefix)
    np.testing.assert_allclose(state, of_urdf[0], atol=1e-12)
    np.testing.assert_allclose(rates, of_urdf[1], atol=1e-12)


def test_the_shell_takes_it(folder):
    mechanism = sdf(folder)
    found = own_object(str(folder / "bars.sdf"), (("cut", "m::C"),))
    assert (found.q, found.cuts) == (mechanism.q, ("m::C",))
