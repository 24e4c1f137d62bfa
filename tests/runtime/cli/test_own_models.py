"""Models of the user's own files, by FILE.py:NAME."""

import json
import math

import pytest

from mechc.cli.commands import main
from tests.support.command_line import complaint, without_progress

MODEL = '''
import mechc

ROD = 0.5  # m
compiled = mechc.load("four_bar")
number = 3


def pushed():
    """A cart that a force F pushes."""
    import sympy as sm
    import sympy.physics.mechanics as me

    x, v, F = me.dynamicsymbols("x v F")
    m, c = sm.symbols("m c")
    N, O = me.ReferenceFrame("N"), me.Point("O")
    O.set_vel(N, 0)
    P = O.locatenew("P", x * N.x)
    P.set_vel(N, v * N.x)
    kane = me.KanesMethod(N, [x], [v], [x.diff() - v])
    kane.kanes_equations([me.Particle("cart", P, m)], [(P, (F - c * v) * N.x)])
    return mechc.compile(kane, defaults={"m": 2.0, "c": 0.5})


def swing():
    """A pendulum from SymPy, derived at each call."""
    import sympy as sm
    import sympy.physics.mechanics as me

    q, u = me.dynamicsymbols("q u")
    m, l, g = sm.symbols("m l g")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", (q, N.z))
    A.set_ang_vel(N, u * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    tip = O.locatenew("tip", -l * A.y)
    tip.v2pt_theory(O, N, A)
    kane = me.KanesMethod(N, [q], [u], [q.diff() - u])
    kane.kanes_equations([me.Particle("bob", tip, m)], [(tip, -m * g * N.y)])
    return kane
'''
VALUES = ("--set", "m=1", "--set", "l=0.5", "--set", "g=9.81", "--start", "q=1")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(MODEL, "utf-8")
    return tmp_path


def test_a_compiled_model_runs(capsys):
    assert main(["run", "own.py:compiled", "--t-end", "0.5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["mechanism"] == "four_bar"


def test_a_function_that_returns_a_sympy_object_runs_and_is_shown_and_exported(capsys, here):
    assert main(["run", "own.py:swing", *VALUES, "--t-end", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert abs(found["energy_drift"]) < 1e-9
    assert main(["show", "own.py:swing", "--out", "page.html"]) == 0
    assert "<math" in (here / "page.html").read_text("utf-8")
    assert main(["export", "own.py:swing", "--c", *VALUES, "--out", "c"]) == 0
    assert "{1.0, 0.0}" in (here / "c" / "main.c").read_text("utf-8")
    assert (here / "c" / "swing.h").is_file()


@pytest.mark.parametrize(("name", "told"), [
    ("none.py:swing", "there is no file none.py"),
    ("own.py:none", "own.py defines no 'none'"),
    ("own.py:number", "own.py:number is of type int"),
])  # fmt: skip
def test_what_cannot_be_a_model_is_told(capsys, name, told):
    assert main(["run", name]) == 2
    assert told in capsys.readouterr().err


def test_options_are_of_the_library(capsys):
    assert main(["run", "own.py:swing", "--with", "friction"]) == 2
    assert "has no such option" in capsys.readouterr().err


def test_a_compiled_model_is_exported_from_its_description(here):
    start = ["--start", "theta_0=60deg", "--out", "c"]
    assert main(["export", "own.py:compiled", "--c", *start]) == 0
    assert (here / "c" / "compiled.h").is_file()


@pytest.mark.parametrize(("name", "own"), [("own.py:swing", "/* l"), ("own.py:compiled", "/* l_3")])
def test_the_c_of_an_own_model_is_printed(capsys, name, own):
    assert main(["emit", name]) == 0
    assert own in capsys.readouterr().out


def test_inputs_are_numbers_and_expressions(capsys):
    run = ("run", "own.py:pushed", "--t-end", "4", "--json")
    assert main([*run, "--input", "F=3"]) == 0
    assert json.loads(capsys.readouterr().out)["u_end"] == pytest.approx([6 * (1 - math.exp(-1))])
    assert main([*run, "--input", "F=c*v + 2*t"]) == 0
    assert json.loads(capsys.readouterr().out)["u_end"] == pytest.approx([8.0])


def test_values_of_an_own_model_have_its_units_or_any(capsys, here):
    run = ("run", "own.py:pushed", "--t-end", "4", "--input", "F=0 N", "--start", "x=10cm")
    assert main([*run, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["q_end"] == [0.1]
    text = (here / "own.py").read_text("utf-8")
    units = '"c": 0.5}, units={"x": "m", "v": "m/s", "m": "kg"})'
    (here / "measured.py").write_text(text.replace('"c": 0.5})', units), "utf-8")
    measured = ("run", "measured.py:pushed", *run[2:], "--set", "m=500g", "--json")
    assert main(measured) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["q_end"], found["parameters"]["m"]) == ([0.1], 0.5)
    wrong = ("run", "measured.py:pushed", *run[2:-1], "x=10kg")
    assert "x: 'kg' in '10kg' is not one of its units; use m or cm" in complaint(capsys, *wrong)


def test_a_summary_without_units_has_no_stray_blanks(capsys):
    values = ("--set", "m=1.5", "--start", "x=1", "--input", "F=0", "--out", "out")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mechc.cli.commands._write", lambda *_, **__: None)
        assert main(["run", "own.py:pushed", "--t-end", "1", *values]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "parameters     m = 1.5" in lines
    assert "x between      1 and 1" in lines


def test_a_sweep_has_the_same_inputs_for_all(capsys):
    sweep = ("sweep", "own.py:pushed", "--t-end", "4", "--vary", "m=1:4:2", "--reduce", "final(v)")
    assert main([*sweep, "--input", "F=c*v + 2*t", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["reductions"]["final(v)"]
    assert (found["min"], found["max"]) == (pytest.approx(4.0), pytest.approx(16.0))


@pytest.mark.parametrize(("given", "told"), [
    ((), "these inputs have no value: F. Give each as a number or an expression: --input F=2"),
    (("--input", "G=1"), "no input is called 'G'; known are F"),
    (("--input", "F=1", "--input", "F=2"), "F is given twice"),
    (("--input", "F=sin(w*t)"), "'w' is not known here"),
    (("--input", "F"), "should read NAME=VALUE"),
])  # fmt: skip
def test_wrong_inputs_are_told_in_words_of_the_shell_and_leave_no_folder(capsys, here, given, told):
    assert main(["run", "own.py:pushed", *given]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert "simulate(" not in said
    assert not list(here.glob("mechc_*"))


@pytest.mark.parametrize("command", ["run", "show", "sweep", "export", "fit"])
def test_a_file_without_a_name_is_told_what_it_defines(capsys, command):
    more = {"fit": ("data.csv", "--free", "m"), "export": ("--c",)}
    said = complaint(capsys, command, "own.py", *more.get(command, ()))
    assert "own.py: say which model of the file, own.py:swing" in said
    assert said.endswith("it defines compiled, pushed, swing\n")


def test_a_file_that_is_not_there_is_told(capsys):
    assert complaint(capsys, "run", "nix.py") == "mechc: there is no file nix.py\n"
    assert "own.py:swing" in complaint(capsys, "run", "own.py:")


ROBOT = """<robot name="swing"><link name="post"/>
<link name="arm"><inertial><mass value="2"/><origin xyz="0 0 -0.5"/>
  <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="post"/><child link="arm"/><axis xyz="0 1 0"/>
</joint></robot>"""


def test_a_robot_runs_by_its_file(here, capsys):
    (here / "swing.urdf").write_text(ROBOT, "utf-8")
    run = ("run", "swing.urdf", "--t-end", "1", "--start", "q_hinge=0.01rad", "--json")
    assert main(run) == 0
    (end,) = json.loads(capsys.readouterr().out)["q_end"]
    assert end == pytest.approx(0.01 * math.cos(math.sqrt(9.81 / 0.5)), rel=1e-4)
    assert complaint(capsys, "run", "other.urdf") == "mechc: there is no file other.urdf\n"


def test_show_judges_a_robot_without_compiling_it(here, capsys, monkeypatch):
    monkeypatch.setattr("mechc.compile", lambda *_, **__: pytest.fail("compiled"))
    long = ROBOT.replace("hinge", "hinge_of_the_long_arm").replace("<mass", "<mass ")
    heavy = long.replace('iyy="0"', 'iyy="1"').replace("swing", "odd")
    (here / "odd.urdf").write_text(heavy, "utf-8")
    assert main(["show", "odd.urdf", "--set", "g=1.6"]) == 0
    said = capsys.readouterr().out
    assert "rad: q_hinge_of_the_long_arm\n" in said
    assert "1.6 m/s^2" in said
    assert "odd: 1 degree of freedom" in said
    assert "  arm: 1 > 0 + 0 kg m^2, by 1" in said


@pytest.mark.filterwarnings("always::mechc.SkippedPartWarning")
def test_a_warning_is_told_in_one_line(here, capsys):
    rough = ROBOT.replace("</joint>", '<dynamics friction="0.1"/></joint>')
    (here / "rough.urdf").write_text(rough, "utf-8")
    assert main(["show", "rough.urdf"]) == 0
    told = without_progress(capsys.readouterr().err)
    assert told.startswith("mechc: swing: not taken from the file")
    assert told.count("\n") == 1
