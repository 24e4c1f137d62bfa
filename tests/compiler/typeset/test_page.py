"""What ``show`` prints is what was derived, complete, and safe whatever a symbol is called."""

from __future__ import annotations

import random
import re
from functools import cache
from typing import Any
from xml.etree import ElementTree

import pytest
from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.derive.kane import derive
from mechc_codegen.description.mechanism import (
    Constraint,
    Coordinate,
    Mechanism,
    Parameter,
    Quantity,
    Speed,
    printed_name,
)
from mechc_codegen.library.catalogue import shipped_mechanism
from mechc_codegen.typeset.formula import formula, latex, latex_text, mathml, name, visible
from mechc_codegen.typeset.page import Derivation, derivation, html_page, latex_document
from mechc_codegen.typeset.sections import join_angles
from sympy import (
    Derivative,
    Float,
    Function,
    IndexedBase,
    Matrix,
    MatrixBase,
    MatrixSymbol,
    Piecewise,
    Rational,
    S,
    Symbol,
    cos,
    exp,
    pi,
    sin,
    sqrt,
    symbols,
)
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, dynamicsymbols
from sympy.physics.vector import Vector

SECTIONS = [
    "Rotation matrices",
    "Angular velocities",
    "Kinematic differential equations",
    "Positions of the points",
    "Velocities of the points",
    "Positions of the mass centres",
    "Velocities of the mass centres",
    "Configuration constraints",
    "Velocity constraints",
    "Constraint Jacobian",
    "Linear momenta",
    "Angular momenta",
    "Energy",
    "Loads",
    "Generalized active forces",
    "Generalized inertia forces",
    "Mass matrix",
    "Forcing",
    "Equations of motion",
]
EVERYTHING = {
    "crank_torque": True,
    "crank_speed": "2 + t",
    "friction": True,
    "coupler_point": True,
}
HOSTILE = [
    "</math><script>alert(1)</script>",
    r"$\input{x}$",
    r"\end{align*}}{{",
    "a\"'&amp;<!--",
    "line\nbreak\x07\u202e",
    "${title}$sections",
    "θ_0^%#~|",
]


@cache
def shown(everything: bool = False) -> Derivation:
    return derivation(shipped_mechanism("four_bar", EVERYTHING if everything else {}))


def items(title: str, everything: bool = False) -> Any:
    (section,) = [s for s in shown(everything).sections if s.title == title]
    return section.items


def hostile(text: str) -> Mechanism:
    """A pendulum bob on a rod where everything that can have a name has this one."""
    q, u = Function(text)(dynamicsymbols._t), dynamicsymbols("speed")
    length, mass = Symbol(text + "1"), Symbol(text + "2")
    r = ReferenceFrame(text)
    origin, bob = Point(text), Point(text + "3")
    origin.set_vel(r, 0)
    bob.set_pos(origin, length * (sin(q) * r.x - cos(q) * r.y))
    bob.set_vel(r, length * u * (cos(q) * r.x + sin(q) * r.y))
    quantity = Quantity(text, text)
    return Mechanism(
        name=text,
        title=text,
        frame=r,
        origin=origin,
        coordinates=(Coordinate(q, quantity),),
        speeds=(Speed(u, quantity),),
        kinematics=(u,),
        parameters=(Parameter(length, 1.0, quantity), Parameter(mass, length * 2, quantity)),
        bodies=(Particle(text, bob, mass),),
        loads=((bob, -mass * 9.81 * r.y),),
        motion_constraints=(Constraint(text, u - length, text),),
        points=(bob, origin),
        frames=(r,),
        notes=lambda values: [(text, text)],
        skipped=(text,),
    )


def without_text_and_escapes(document: str) -> str:
    return re.sub(r"\\[\\{}]", "", document)


@pytest.mark.parametrize("everything", [False, True])
def test_every_section_is_there_in_both_documents(everything: bool) -> None:
    page, document = html_page(shown(everything)), latex_document(shown(everything))
    for title in ["Scene", "Symbols", *SECTIONS, "Notes"]:
        assert f"<h2>{title}</h2>" in page
        assert f"\\section{{{title}}}" in document


def test_sections_without_equations_are_left_out() -> None:
    mechanism = hostile("m")
    titles = [s.title for s in derivation(mechanism).sections]
    assert "Configuration constraints" not in titles
    assert "Mass matrix" in titles


@pytest.mark.parametrize("everything", [False, True])
@pytest.mark.parametrize(
    ("output", "title", "index"),
    [
        ("mass_matrix", "Mass matrix", 0),
        ("forcing", "Forcing", 0),
        ("constraint_jacobian", "Constraint Jacobian", 0),
        ("gamma", "Constraint Jacobian", 1),
        ("kinetic_energy", "Energy", 0),
        ("potential_energy", "Energy", 1),
        ("constraints", "Configuration constraints", None),
        ("velocity_constraints", "Velocity constraints", None),
        ("coordinate_rates", "Kinematic differential equations", None),
        ("points", "Positions of the points", None),
        ("point_velocities", "Velocities of the points", None),
        ("linear_momenta", "Linear momenta", None),
        ("angular_momenta", "Angular momenta", None),
    ],
)
def test_printed_right_hand_sides_are_the_derived_ones(
    everything: bool, output: str, title: str, index: int | None
) -> None:
    """Equal at a random state with random parameters, whatever form they are printed in."""
    mechanism = shown(everything).mechanism
    derived = differentiate(derive(mechanism))
    elements = list(derived.outputs[output].elements)
    if output.startswith("point"):  # mass centres have a section of their own
        centres = {body.masscenter.name for body in mechanism.bodies}
        keep = [k for k, p in enumerate(mechanism.points) if p.name not in centres]
        elements = [elements[3 * k + axis] for k in keep for axis in range(3)]
    chosen = items(title, everything)
    chosen = chosen if index is None else chosen[index : index + 1]
    printed = [entry for item in chosen for entry in _entries(item.right, mechanism.frame)]
    values = _values(mechanism, derived)
    assert len(printed) == len(elements)
    for mine, theirs in zip(printed, elements, strict=True):
        assert _number(mine, values) == pytest.approx(_number(theirs, values), rel=1e-12, abs=1e-12)


def _entries(thing: Any, frame: ReferenceFrame) -> list[Any]:
    if isinstance(thing, Vector):
        return list(thing.to_matrix(frame))
    return list(thing) if isinstance(thing, MatrixBase) else [thing]


def _values(mechanism: Mechanism, derived: Any) -> dict[Any, float]:
    rng = random.Random(7)
    symbols_ = derived.symbols
    plain = [*symbols_.q, *symbols_.u, *symbols_.parameters, symbols_.time]
    user = [*mechanism.q, *mechanism.u, *(p.symbol for p in mechanism.parameters)]
    user.append(dynamicsymbols._t)
    values: dict[Any, float] = {}
    for one, other in zip(plain, user, strict=True):
        values[one] = values[other] = Float(rng.uniform(0.3, 1.3))
    for u in mechanism.u:
        values[u.diff(dynamicsymbols._t)] = Float(rng.uniform(0.3, 1.3))
    return values


def _number(expression: Any, values: dict[Any, float]) -> float:
    return float(S(expression).xreplace(values))


@pytest.mark.parametrize("everything", [False, True])
def test_kanes_equations_balance(everything: bool) -> None:
    """F_r + F_r* = forcing - M u', with F_r* formed without the loads."""
    mechanism = shown(everything).mechanism
    derived = differentiate(derive(mechanism))
    values = _values(mechanism, derived)
    rates = Matrix([u.diff(dynamicsymbols._t) for u in mechanism.u])
    (mass,), (forcing,) = items("Mass matrix", everything), items("Forcing", everything)
    residual = forcing.right - mass.right * rates
    active = items("Generalized active forces", everything)
    inertia = items("Generalized inertia forces", everything)
    for k in range(len(mechanism.u)):
        balance = _number(active[k].right + inertia[k].right, values)
        assert balance == pytest.approx(_number(residual[k], values), rel=1e-12)


def test_rotation_matrices_are_rotations_of_the_named_frames() -> None:
    item = items("Rotation matrices")[1]
    theta = shown().mechanism.q[1]
    expected = [cos(theta), -sin(theta), 0, sin(theta), cos(theta), 0, 0, 0, 1]
    assert list(item.right) == expected
    assert "θ" in mathml(formula(item.right))


def test_page_is_self_contained() -> None:
    page = html_page(shown(True))
    assert set(re.findall(r"https?://[^\s\"'<]*", page)) == {"http://www.w3.org/1998/Math/MathML"}
    assert "<script" not in page
    assert not re.search(r"\bsrc=|@import|url\(", page)
    for anchor in re.findall(r'href="#(\w+)"', page):
        assert f'id="{anchor}"' in page


def test_page_prints_values_units_and_formulas() -> None:
    values = {"l_0": 2.0, "m_0": 6.0}
    page = html_page(shown(), values)
    inertia = re.search(r"moment of inertia of the crank.*?</tr>", page, re.S)
    assert inertia is not None
    assert "<td>kg⋅m²</td><td>&gt; 0</td>" in inertia[0]
    assert "<mn>12</mn>" in inertia[0]  # the default as a formula
    assert "<td>2</td>" in inertia[0]  # 6 * 2^2 / 12 follows the values given
    assert "<td>85</td>" in page  # where a run starts, in degrees
    assert "Grashof class" in page


def test_notes_follow_the_values_given() -> None:
    assert "change-point linkage" in html_page(shown())
    assert "crank-rocker" in html_page(shown(), {"l_3": 3.5})
    assert "crank-rocker" in latex_document(shown(), {"l_3": 3.5})


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_names_stay_text_in_html(text: str) -> None:
    page = html_page(derivation(hostile(text)))
    assert "<script" not in page
    assert "<!--" not in page.replace("<!DOCTYPE html>", "")
    page.encode("utf-8")
    for element in re.findall(r"<math .*?</math>", page, re.S):
        ElementTree.fromstring(element)
    ElementTree.fromstring(page[page.index("<body>") : page.index("</html>")])


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_names_stay_text_in_latex(text: str) -> None:
    document = latex_document(derivation(hostile(text)))
    assert document.isascii()
    _check_latex(document)
    assert "\\input" not in document
    assert document.count("\\end{document}") == 1


def test_hostile_names_are_still_readable() -> None:
    script, command = HOSTILE[:2]
    assert visible("\ud800\0") == "\ufffd" * 2
    assert latex_text(command) == r"\$\textbackslash{}input\{x\}\$"
    words = ElementTree.fromstring(f"<math>{mathml(name(script))}</math>").itertext()
    assert "".join(words) == script


@pytest.mark.parametrize("everything", [False, True])
def test_markup_is_well_formed(everything: bool) -> None:
    page = html_page(shown(everything))
    elements = re.findall(r"<math .*?</math>", page, re.S)
    assert len(elements) > 60
    for element in elements:
        ElementTree.fromstring(element)
    _check_latex(latex_document(shown(everything)))


def _check_latex(document: str) -> None:
    depth = 0
    for sign in re.findall(r"[{}]", without_text_and_escapes(document)):
        depth += 1 if sign == "{" else -1
        assert depth >= 0
    assert depth == 0
    begun = re.findall(r"\\(begin|end)\{([a-z*]+)\}", document)
    stack: list[str] = []
    for word, environment in begun:
        if word == "begin":
            stack.append(environment)
        else:
            assert stack.pop() == environment
    assert not stack
    assert document.count(r"\left") == document.count(r"\right")
    assert document.count(r"\(") == document.count(r"\)")


x, y, z = symbols("x y z")
theta = dynamicsymbols("theta_0")
t = dynamicsymbols._t


@pytest.mark.parametrize(
    ("thing", "expected"),
    [
        (x - y, r"x - y"),
        (-x, r"- x"),
        (x * (y - z), r"x \, \left(y - z\right)"),
        (-2 * z * (x + y), r"- 2 \, z \, \left(x + y\right)"),
        (x / y, r"\frac{x}{y}"),
        (Rational(-3, 2) * x, r"- \frac{3 \, x}{2}"),
        ((x + y) ** 2, r"\left(x + y\right)^{2}"),
        ((-x) ** y, r"\left(- x\right)^{y}"),
        (x ** (-2), r"\frac{1}{x^{2}}"),
        (sqrt(x), r"\sqrt{x}"),
        (sin(x) ** 2, r"\sin^{2}{\left(x \right)}"),
        (exp(-x), r"e^{- x}"),
        (Float(-2.5) * x, r"- 2.5 \, x"),
        (Float(1e-9), r"1.0 \cdot 10^{-9}"),
        (2 * pi, r"2 \, \pi"),
        (theta, r"\theta_{0}"),
        (theta**2, r"\theta_{0}^{2}"),
        (theta.diff(t), r"\dot{\theta}_{0}"),
        (theta.diff(t, 2), r"\ddot{\theta}_{0}"),
        (Symbol("q1"), r"q_{1}"),
        (Symbol("lambda"), r"\lambda"),
        (Symbol("I_xy_0"), r"I_{\text{xy},0}"),
        (Symbol("two words"), r"\text{two words}"),
        (Vector(0), r"\mathbf{0}"),
    ],
)
def test_expressions_print_as_written_by_hand(thing: Any, expected: str) -> None:
    assert latex(formula(thing)) == expected


def test_vectors_carry_hats_and_signs() -> None:
    frame = ReferenceFrame("e_0")
    hat = r"\hat{\mathbf{e}}_{0,x}"
    assert latex(formula(frame.x)) == hat
    assert latex(formula(-frame.x)) == f"- {hat}"
    assert latex(formula((x - y) * frame.x)) == rf"\left(x - y\right) \, {hat}"


@pytest.mark.parametrize(
    "odd",
    [
        Piecewise((x, x > 0), (0, True)),
        Function("f")(x, t),
        Derivative(Function("f")(x, t), x),
        x**y,
        S.ImaginaryUnit * S.Exp1,
    ],
)
def test_what_is_seldom_seen_prints_well_formed(odd: Any) -> None:
    ElementTree.fromstring(f"<math>{mathml(formula(odd))}</math>")
    _check_latex(latex(formula(odd)))


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_names_stay_text_wherever_an_expression_can_hold_one(text: str) -> None:
    f, g = Function(text), Function(text)(t)
    odd = [f(x, t) ** 2, g.diff(t, 5), Derivative(f(x, t), x), g**2 * Symbol(text) ** -2]
    frame = ReferenceFrame(text)
    for thing in [*odd, MatrixSymbol(text, 2, 2), IndexedBase(text)[1], g.diff(t) * frame.y]:
        shown = latex(formula(thing))
        assert "\\input" not in shown
        _check_latex(shown)
        ElementTree.fromstring(f"<math>{mathml(formula(thing))}</math>")
        assert "<script" not in mathml(formula(thing))


def test_angles_are_joined_exactly() -> None:
    a, b, c = symbols("a b c")
    assert join_angles(sin(a) * sin(b) + cos(a) * cos(b)) == cos(a - b)
    assert join_angles(c * cos(a) * cos(b) - c * sin(a) * sin(b)) == c * cos(a + b)
    assert join_angles(sin(a) * sin(b) - cos(a) * cos(b)) == -cos(a + b)
    assert join_angles(sin(a) * cos(b) - cos(a) * sin(b)) == sin(a - b)
    assert join_angles(sin(a) * cos(b) + cos(a) * sin(b)) == sin(a + b)
    apart = 2 * sin(a) * sin(b) + cos(a) * cos(b)
    assert join_angles(apart) == apart


def test_nothing_is_lost_between_the_two_printers() -> None:
    """Both documents name every parameter, body and point."""
    mechanism = shown(True).mechanism
    page, document = html_page(shown(True)), latex_document(shown(True))
    for parameter in mechanism.parameters:
        symbol = name(printed_name(parameter.symbol))
        assert mathml(symbol) in page
        assert latex(symbol) in document
    for thing in (*mechanism.points, *mechanism.bodies):
        assert mathml(name(thing.name)) in page
        assert latex(name(thing.name)) in document


def test_points_that_were_given_no_velocity_are_shown_with_that_of_their_place() -> None:
    """SymPy would warn of the ways to find it, and keep what it finds in the user's point."""
    row = shipped_mechanism("windows", {"count": 1})
    sections = {section.title: section for section in derivation(row).sections}
    velocities = sections["Velocities of the points"].items
    assert len(velocities) == len(row.points)
    far = row.points[1]
    assert row.frame not in far._vel_dict
    expected = far.pos_from(row.origin).dt(row.frame).xreplace(row.rates)
    assert velocities[1].right.dot(row.frame.x) - expected.dot(row.frame.x) == 0
