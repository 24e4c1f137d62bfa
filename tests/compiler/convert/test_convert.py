"""SymPy's objects become mechanisms: nothing guessed, every refusal says what to add."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Any

import pytest
from mechc_codegen.compiler import build_scene
from mechc_codegen.convert.convert import convert
from mechc_codegen.convert.kinematics import coordinate_rates
from mechc_codegen.derive.derive_equations import drop_parameters
from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.derive.kane import derive
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.description.terms import multiplier
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from mechc_codegen.frontend.read import read, readable
from sympy import Abs, Expr, Function, Symbol, cos, sin, sqrt, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    System,
    dynamicsymbols,
    inertia,
)
from sympy.solvers.solveset import NonlinearError

from tests.support import scenes
from tests.support.sympy_objects import four_bar_kane, four_bar_system, slider, windows_kane

t = dynamicsymbols._t
x, y = dynamicsymbols("x y")
v, w = dynamicsymbols("v w")


def mechanism(thing: Any, **settings: Any) -> Mechanism:
    return convert(read(thing), ConversionSettings(**settings))


def described(thing: Any, fix: Any = (), outputs: Any = None, **settings: Any) -> Any:
    return CompileRequest(
        thing, CompileOptions(ConversionSettings(**settings), dict(fix), outputs)
    ).description()


# -- what is read ---------------------------------------------------------------------------------


def test_the_ground_is_no_body_and_its_symbols_are_nobodys_business() -> None:
    system = four_bar_system()
    names = {p.name for p in build_parameters(system)}
    assert names == {"l_0", "l_1", "l_2", "l_3", "rho", "g"}
    assert [b.name for b in mechanism(system).bodies] == ["rod_0", "rod_1", "rod_2"]


def build_parameters(thing: Any) -> list[Symbol]:
    """The parameters that a compiled scene has."""
    made, request = described(thing)
    kept, _ = drop_parameters(made, differentiate(derive(made, request)), request)
    return [p.symbol for p in kept]


def test_redundant_constraints_of_a_system_are_kept() -> None:
    assert len(mechanism(four_bar_system(redundant=True)).configuration_constraints) == 3


def test_rates_of_configuration_constraints_are_told_from_nonholonomic_ones() -> None:
    """KanesMethod keeps them in one list: here two are rates and none stands alone."""
    kane = four_bar_kane()
    assert len(kane._k_nh.row(0)) == 3
    made = mechanism(kane)
    assert len(made.configuration_constraints) == 2
    assert made.motion_constraints == ()


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("count", [1, 2])
def test_loops_that_rods_of_no_length_would_close_are_told_at_rods_of_some_length(
    count: int,
) -> None:
    made = mechanism(windows_kane(count))
    assert len(made.configuration_constraints) == 2 * count
    assert made.motion_constraints == ()


def test_a_nonholonomic_row_beside_a_rate_is_found() -> None:
    """One row is the rate of x^2 + y^2 = 1; the other, mixed with it, says something else."""
    rate = x * v + y * w
    kane = slider(
        q_ind=[x], q_dependent=[y], u_ind=[], u_dependent=[v, w],
        configuration_constraints=[x**2 + y**2 - 1], velocity_constraints=[rate, v + 3 * rate],
    )  # fmt: skip
    (row,) = mechanism(kane, configuration_constraints=[]).motion_constraints
    assert row.expression.expand() == (v + 3 * rate).expand()


def test_auxiliary_speeds_are_zero_and_contact_forces_on_them_are_not_asked_for() -> None:
    aux, contact = dynamicsymbols("aux N_c")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    point = origin.locatenew("P", x * frame.x)
    point.set_vel(frame, v * frame.x + aux * frame.y)
    kane = KanesMethod(frame, [x], [v], kd_eqs=[x.diff(t) - v], u_auxiliary=[aux])
    kane.kanes_equations(
        [Particle("B", point, Symbol("m"))], [(point, contact * frame.y - aux * frame.x)]
    )
    forcing = build_scene(*build_arguments(described(kane))).texts["scene_program.h"]
    assert "0.0" in forcing
    assert [s.name for s in build_parameters(kane)] == ["m"]


def build_arguments(pair: Any) -> Any:
    """build_scene takes (mechanism, sets, request)."""
    return pair[0], None, pair[1]


def test_turning_coordinates_are_radians_and_others_unknown_until_told() -> None:
    made = mechanism(four_bar_system())
    assert {c.quantity.unit for c in made.coordinates} == {"rad"}
    assert {s.quantity.unit for s in made.speeds} == {"rad/s"}
    assert [c.quantity.unit for c in mechanism(slider()).coordinates] == ["", ""]
    told = mechanism(slider(), units={"x": "m", y: "m", "m": "kg"})
    assert [c.quantity.unit for c in told.coordinates] == ["m", "m"]
    assert [s.quantity.unit for s in told.speeds] == ["m/s", "m/s"]
    assert told.parameters[0].quantity.unit == "kg"


# -- kinematics -----------------------------------------------------------------------------------


def test_implicit_kinematics_are_solved_without_dividing_by_what_may_vanish() -> None:
    """Elimination in a fixed order would divide by cos x, which is 0 at a regular place."""
    rates = coordinate_rates(
        [cos(x) * x.diff(t) + sin(x) * y.diff(t) - v, -sin(x) * x.diff(t) + cos(x) * y.diff(t) - w],
        [x, y],
    )
    found = [r.subs({x: 1.5707963267948966, v: 2.0, w: 3.0}) for r in rates]
    assert found == pytest.approx([-3.0, 2.0], abs=1e-12)


def test_rates_are_not_divided_by_what_vanishes_on_the_constraints() -> None:
    """On x^2 + y^2 = 1 with x y' - y x' = v, x' = w: solved for y' they divide by x."""
    norm = x**2 + y**2 - 1
    rates = coordinate_rates([x * y.diff(t) - y * x.diff(t) - v, x.diff(t) - w], [x, y], [norm])
    turning = {x: 0, y: 1, v: 2, w: -2}
    assert [r.xreplace(turning) for r in rates] == [-2, 0]
    speeds_off = {x: 0, y: 1, v: 2, w: 1}  # the norm then changes, so projected speeds keep it
    assert norm.diff(t).xreplace({x.diff(t): rates[0], y.diff(t): rates[1]}).xreplace(speeds_off)
    for place in ({x: 0.6, y: 0.8}, {x: -0.28, y: 0.96}):
        kept = place | {v: 1.5, w: -1.5 * place[y]}
        found = [float(r.xreplace(kept)) for r in rates]
        assert found == pytest.approx([-1.5 * place[y], 1.5 * place[x]], abs=1e-15)


def test_rates_that_are_the_same_everywhere_are_left_alone() -> None:
    plain = [x.diff(t) - v, y.diff(t) - w]
    assert coordinate_rates(plain, [x, y], [x**2 + y**2 - 1]) == (v, w)


@pytest.mark.parametrize(
    ("equations", "match"),
    [
        ([x.diff(t) - v], "as many kinematic"),
        ([x.diff(t) - v, 2 * x.diff(t) - w], "do not determine the rates of"),
        ([x.diff(t) ** 2 - v, y.diff(t) - w], "not linear"),
    ],
)
def test_kinematics_that_cannot_be_solved_are_refused(equations: Any, match: str) -> None:
    with pytest.raises(MechanismError, match=match):
        coordinate_rates(equations, [x, y])


# -- what cannot be known is refused --------------------------------------------------------------


def test_equations_not_formed_are_refused_with_what_to_call() -> None:
    with pytest.raises(MechanismError, match=r"call kanes_equations\(bodies, loads\)"):
        mechanism(slider(formed=False))
    with pytest.raises(MechanismError, match="form_lagranges_equations"):
        mechanism(LagrangesMethod(x.diff(t) ** 2, [x]))


def test_missing_configuration_constraints_are_asked_for_unless_there_are_none() -> None:
    """x v + y w = 0 is the rate of a circle that was not given."""
    velocity = {"u_ind": [v], "u_dependent": [w], "velocity_constraints": [x * v + y * w]}
    with pytest.raises(MechanismError, match=r"add configuration_constraints=\[...\]"):
        mechanism(slider(**velocity))
    circle = mechanism(slider(**velocity), configuration_constraints=[x**2 + y**2 - 1])
    assert len(circle.configuration_constraints) == 1
    assert circle.motion_constraints == ()
    as_they_are = mechanism(slider(**velocity), configuration_constraints=[])
    assert len(as_they_are.motion_constraints) == 1


def test_an_integrable_velocity_constraint_is_asked_for_in_lagranges_method_and_a_system_too() -> (
    None
):
    """With the same words; x v + y w = 0 beside its circle is no constraint of its own."""
    row, circle = x * x.diff(t) + y * y.diff(t), x**2 + y**2 - 1
    energy = x.diff(t) ** 2 + y.diff(t) ** 2

    def lagrange(**constraints: Any) -> LagrangesMethod:
        method = LagrangesMethod(energy, [x, y], frame=ReferenceFrame("N"), **constraints)
        method.form_lagranges_equations()
        return method

    system = four_bar_system()
    rates = [gap.diff(t) for gap in system.holonomic_constraints]
    system.holonomic_constraints = []
    speeds = {q.diff(t): u for q, u in zip(system.q, system.u, strict=True)}
    system.add_nonholonomic_constraints(*(rate.xreplace(speeds) for rate in rates))
    for thing, place in ((lagrange(nonhol_coneqs=[row]), "hol_coneqs"), (system, "holonomic con")):
        words = rf"rates of configuration constraints that were not given.*add {place}"
        with pytest.raises(MechanismError, match=words):
            mechanism(thing)
        kept = mechanism(thing, configuration_constraints=[])
        assert len(kept.motion_constraints) == (1 if thing is not system else 2)
    both = mechanism(lagrange(hol_coneqs=[circle], nonhol_coneqs=[row]))
    assert (len(both.configuration_constraints), len(both.motion_constraints)) == (1, 0)


@pytest.mark.parametrize("power", [1, 2])
def test_a_velocity_constraint_that_is_not_linear_is_refused(power: int) -> None:
    """SymPy before 1.15 refuses it in a KanesMethod alone.  (1 + t x) x' - y' is linear, and not
    integrable."""
    method = LagrangesMethod(
        x.diff(t) ** 2 + y.diff(t) ** 2, [x, y], frame=ReferenceFrame("N"),
        nonhol_coneqs=[(1 + t * x) * x.diff(t) ** power - y.diff(t)],
    )  # fmt: skip
    try:
        method.form_lagranges_equations()
    except NonlinearError:
        assert power == 2
        return
    if power == 1:
        assert len(mechanism(method, configuration_constraints=[]).motion_constraints) == 1
        return
    with pytest.raises(MechanismError, match="constraint 1 of this LagrangesMethod is not linear"):
        mechanism(method)


RATE = x.diff(t)


@pytest.mark.parametrize(
    ("energy", "quadratic"),
    [
        (-sqrt(1 - RATE**2), False),
        (RATE**2 + RATE**4, False),
        (RATE**2 + Abs(RATE), False),
        ((1 + x**2) * RATE**2 + sin(t) * RATE, True),
        ((RATE + 1) ** 3 - (RATE - 1) ** 3, True),  # 6 RATE**2 + 2
    ],
)
def test_a_lagrangian_that_is_not_quadratic_in_the_speeds_is_refused(
    energy: Expr, quadratic: bool
) -> None:
    method = LagrangesMethod(energy - x**2, [x])
    method.form_lagranges_equations()
    if not quadratic:
        with pytest.raises(MechanismError, match=r"not quadratic in the speeds: .* the speed x'"):
            mechanism(method)
        return
    equations = derive(mechanism(method))
    (entry,) = equations.outputs["mass_matrix"].elements
    assert not entry.has(*equations.symbols.u)


@pytest.mark.parametrize("inertial", [False, True])
def test_a_body_whose_mass_depends_on_speeds_is_refused(inertial: bool) -> None:
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    P = O.locatenew("P", x * N.x)
    P.set_vel(N, v * N.x)
    body: Any = Particle("pearl", P, 1 + v**2)
    if inertial:
        body = RigidBody("pearl", P, N, 1, (inertia(N, 0, 0, 1 + v**2), P))
    kane = KanesMethod(N, [x], [v], kd_eqs=[x.diff(t) - v])
    kane.kanes_equations([body], [])
    words = "inertia" if inertial else "mass"
    with pytest.raises(MechanismError, match=f"the {words} of pearl contains the speed v"):
        mechanism(kane)


def test_configuration_constraints_that_velocity_constraints_do_not_imply_are_refused() -> None:
    """SymPy's equations have the freedom that velocity constraints leave."""
    circle = x**2 + y**2 - 1
    kane = slider(q_ind=[x], q_dependent=[y], configuration_constraints=[circle])
    with pytest.raises(MechanismError, match="degrees of freedom: 2, with these rates: 1"):
        mechanism(kane)
    kept = mechanism(kane, configuration_constraints=[circle])
    assert (len(kept.configuration_constraints), len(kept.motion_constraints)) == (1, 0)


def test_a_prescribed_speed_needs_no_configuration_constraint() -> None:
    driven = slider(u_ind=[w], u_dependent=[v], velocity_constraints=[v - sin(t)])
    assert len(mechanism(driven).motion_constraints) == 1


@pytest.mark.parametrize(
    ("configuration", "velocity", "match"),
    [
        (x**2 + y**2 - 1, v - w, "no motion satisfies both"),
        (x - 3, v - 1, "no speeds satisfy both"),
        (x - sin(t), v - 2 * cos(t), "no speeds satisfy both"),
        (x - Function("r")(t), v - 2 * Function("r")(t).diff(t), "no speeds satisfy both"),
    ],
)
def test_constraints_that_contradict_each_other_are_refused(configuration, velocity, match) -> None:
    kane = slider(
        q_ind=[y], q_dependent=[x], u_ind=[w], u_dependent=[v],
        configuration_constraints=[configuration], velocity_constraints=[velocity],
    )  # fmt: skip
    with pytest.raises(MechanismError, match=match):
        mechanism(kane)


@pytest.mark.parametrize(
    ("configuration", "velocity"),
    [(x - sin(t), v - cos(t)), (x - Function("r")(t), v - Function("r")(t).diff(t))],
)
@pytest.mark.parametrize("inputs", [{}, {"r": 2 * sin(t)}])
def test_rates_of_driven_configuration_constraints_are_recognised(
    configuration, velocity, inputs
) -> None:
    kane = slider(
        q_ind=[y], q_dependent=[x], u_ind=[w], u_dependent=[v],
        configuration_constraints=[configuration], velocity_constraints=[velocity],
    )  # fmt: skip
    given = inputs if configuration.has(Function("r")) else {}
    assert mechanism(kane, inputs=given).motion_constraints == ()


def test_reading_leaves_the_points_of_the_user_as_they_are() -> None:
    """A load where two bodies meet: SymPy would keep a velocity there, and warn that it chose."""
    system = four_bar_system()
    meeting = system.joints[1].child_point
    system.add_loads((meeting, Symbol("F") * system.x))
    for point in (meeting, system.joints[1].parent_point):
        point._vel_dict.clear()
    mechanism(system)
    assert not meeting._vel_dict


def test_a_point_whose_velocity_nothing_says_is_refused() -> None:
    method = slider(None)
    method._forcelist = [(Point("lost"), Symbol("F") * method._inertial.x)]
    with pytest.raises(MechanismError, match=r"velocity of point lost in frame N is not known: gi"):
        mechanism(method)


def test_a_potential_energy_in_a_system_not_formed_is_ambiguous() -> None:
    system = four_bar_system()
    system.bodies[1].potential_energy = Symbol("k") * dynamicsymbols("q_0") ** 2
    with pytest.raises(MechanismError, match=r"acts by Lagrange's method and does not by Kane's"):
        mechanism(system)


def test_two_symbols_printed_alike_are_refused_where_both_are_meant() -> None:
    twins = slider(lambda q, u, N: -Symbol("m", positive=True) * q[0] * N.x)
    with pytest.raises(MechanismError, match="more than one symbol is printed as 'm'"):
        mechanism(twins)


def test_specified_inputs_are_left_open_or_expressions_that_may_hold_the_state() -> None:
    force = Function("F_0")(t)
    pushed = slider(lambda q, u, N: force * N.x)
    made, request = described(pushed)
    assert made.open_inputs == (force,)
    texts = build_scene(made, None, request).texts
    assert "#define MECHC_NI 1 " in texts["scene_sizes.h"]
    assert "FN(read_inputs)(t, q, u, given, 0, 1, inputs)" in texts["scene_program.h"]
    for key in ("F_0", force):
        made, request = described(pushed, inputs={key: 3 * sin(t) - 2 * v + Symbol("k") * x})
        assert {p.symbol.name for p in made.parameters} == {"m", "k"}
        build_scene(made, None, request)


def test_an_input_whose_rate_is_needed_must_be_of_time_alone() -> None:
    lift = Function("h")(t)
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    point = origin.locatenew("P", x * frame.x + lift * frame.y)
    point.set_vel(frame, v * frame.x + lift.diff(t) * frame.y)
    kane = KanesMethod(frame, [x], [v], kd_eqs=[x.diff(t) - v])
    kane.kanes_equations([Particle("B", point, 2)], [(point, -(lift**2) * frame.y)])
    with pytest.raises(MechanismError, match=r"rate of h is needed.*not of x"):
        build_scene(*build_arguments(described(kane, inputs={"h": sin(x)})))
    build_scene(*build_arguments(described(kane, inputs={"h": sin(3 * t)})))


@pytest.mark.parametrize("argument", ["defaults", "units", "inputs"])
def test_names_that_do_not_exist_are_told_with_those_that_do(argument: str) -> None:
    with pytest.raises(MechanismError, match=f"{argument}: there is no .*'nothing'"):
        mechanism(slider(), **{argument: {"nothing": 1}})


def test_what_is_no_number_is_refused() -> None:
    for value in ("nine", float("nan"), float("inf")):
        with pytest.raises(MechanismError, match="is not a"):
            mechanism(slider(), defaults={"m": value})


def test_outputs_that_do_not_exist_or_cannot_be_known_are_refused() -> None:
    with pytest.raises(MechanismError, match="'enery' is not one of energy, momenta"):
        described(slider(), outputs=("enery",))
    with pytest.raises(MechanismError, match="fix: there is no parameter 'g'"):
        described(slider(), fix={"g": 0})
    for strange in (Symbol("a"), Function("f")(t), v.diff(t, 2), multiplier(0)):
        with pytest.raises(MechanismError, match="outputs: 'own' contains"):
            described(slider(), outputs=({"own": x + strange},))
    adrift = slider()
    adrift.bodies[0].point._pos_dict.clear()
    with pytest.raises(MechanismError, match="need positions, and that of B"):
        described(adrift, outputs=("points",))


def test_an_acceleration_set_by_hand_must_be_the_velocitys_own() -> None:
    """KanesMethod would take it as it is set, right or wrong."""
    right, wrong = slider(), slider()
    for kane, factor in ((right, 1), (wrong, 2)):
        frame = kane._inertial
        kane.bodies[0].point.set_acc(frame, factor * v.diff(t) * frame.x + w.diff(t) * frame.y)
    mechanism(right)
    with pytest.raises(MechanismError, match="acceleration that was set for P is not the"):
        mechanism(wrong)


def test_an_acceleration_may_use_the_constraints() -> None:
    """On x^2 + y^2 = 1 the radial acceleration is known without the accelerations."""
    kane = slider(
        q_ind=[x], q_dependent=[y], u_ind=[v], u_dependent=[w],
        configuration_constraints=[x**2 + y**2 - 1], velocity_constraints=[x * v + y * w],
    )  # fmt: skip
    point, frame = kane.bodies[0].point, kane._inertial
    along = (x * w.diff(t) - y * v.diff(t)) * (x * frame.y - y * frame.x)
    point.set_acc(frame, along - (v**2 + w**2) * (x * frame.x + y * frame.y))
    mechanism(kane)
    point.set_acc(frame, along)
    with pytest.raises(MechanismError, match="acceleration that was set for P is not the"):
        mechanism(kane)


# -- potential energy -----------------------------------------------------------------------------


def test_weight_and_a_spring_have_their_potential_and_a_whirl_does_not_pass_for_none() -> None:
    g, k = symbols("g k")
    heavy = mechanism(slider(lambda q, u, N: -Symbol("m") * g * N.y - 3 * u[0] * N.x))
    assert heavy.potential == Symbol("m") * g * y
    assert heavy.unknown_potentials == ()
    sprung = mechanism(slider(lambda q, u, N: -k * q[0] * N.x))
    assert (sprung.potential, sprung.unknown_potentials) == (k * x**2 / 2, ())
    whirled = mechanism(slider(lambda q, u, N: -k * q[0] * N.y))
    assert whirled.unknown_potentials == ("the load on P",)
    told = slider(lambda q, u, N: -k * q[0] * N.y)
    told.bodies[0].potential_energy = k * x**2 / 2
    assert mechanism(told).potential == k * x**2 / 2


def test_other_things_are_not_readable() -> None:
    assert not any(map(readable, ("four_bar", None, Symbol("x"), random.Random())))
    assert readable(System())


@pytest.mark.parametrize(
    ("unit", "instead"),
    [("deg", "rad"), ("°", "rad"), ("mm", "m"), ("cm^2", "m"), ("rad/min", "s"), ("rpm", "rad/s")],
)
def test_a_unit_that_is_not_the_sis_is_refused_with_the_one_to_use(unit: str, instead: str) -> None:
    with pytest.raises(MechanismError, match=f"Give its values in {instead} instead of"):
        convert(read(slider()), ConversionSettings(units={"x": unit}))


@pytest.mark.parametrize("unit", ["m", "kg m^2", "N s/m", "rad", "1", "of a beard"])
def test_others_are_words_for_people(unit: str) -> None:
    made = convert(read(slider()), ConversionSettings(units={"x": unit}))
    assert made.coordinates[0].quantity.unit == unit


@pytest.mark.parametrize("unit", ["mm", "deg", "kN/mm"])
def test_a_mechanism_in_other_units_is_refused_too(unit: str) -> None:
    described = scenes.bead_with(Symbol("f"))
    (parameter,) = described.parameters
    other = replace(parameter, quantity=parameter.quantity.with_unit(unit))
    with pytest.raises(MechanismError, match=f"f in '{unit}': all values are in SI units"):
        replace(described, parameters=(other,))
