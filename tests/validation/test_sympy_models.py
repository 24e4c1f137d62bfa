"""SymPy's own models, compiled: rates and constraint forces as SymPy itself evaluates them."""

from itertools import product

import numpy as np
import pytest
from sympy import cos, symbols
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols
from sympy.physics.mechanics.models import multi_mass_spring_damper, n_link_pendulum_on_cart

import mechc
from tests.support import sympy_models
from tests.support.actuators import ACTUATED
from tests.support.marks import slow_among

STATES = 3


def check(thing):
    """Rates and constraint forces are SymPy's at random states on the constraints."""
    inputs = sympy_models.stand_ins(thing)
    model = mechc.compile(thing, inputs=inputs, outputs=("multipliers",))
    for found in sympy_models.pairs(model, thing, inputs, STATES, seed=7):
        assert sympy_models.difference(found) < 1e-12


# -- sympy.physics.mechanics.models -----------------------------------------------------------

YES_OR_NO = (False, True)


@pytest.mark.parametrize(("n", "gravity", "force"), [*product((1, 2, 5), *[YES_OR_NO] * 2)])
def test_masses_with_springs_and_dampers(n, gravity, force):
    check(multi_mass_spring_damper(n, gravity, force))


@pytest.mark.parametrize(("n", "force", "torques"), [
    *product((1, 2), *[YES_OR_NO] * 2),
    *(pytest.param(4, *case, marks=pytest.mark.slow) for case in product(*[YES_OR_NO] * 2)),
])  # fmt: skip
def test_pendulums_on_a_cart(n, force, torques):
    check(n_link_pendulum_on_cart(n, force, torques))


MODELS = {
    "springs and dampers": lambda: multi_mass_spring_damper(3, True, True),
    "a long chain of springs and dampers": lambda: multi_mass_spring_damper(10, True, True),
    "pendulums on a cart": lambda: n_link_pendulum_on_cart(3, True, True),
}


@pytest.mark.parametrize("by", [sympy_models.by_lagrange, sympy_models.by_system])
@pytest.mark.parametrize("name", slow_among(MODELS, {"a long chain of springs and dampers"}))
def test_they_move_alike_by_lagranges_method_and_as_systems(name, by):
    check(by(MODELS[name]()))


# -- SymPy's tests ----------------------------------------------------------------------------

IN_SYMPYS_TESTS = {
    "pendulum of two coordinates": ("test_linearize", "test_linearize_pendulum_kane_nonminimal"),
    "pendulum of two coordinates, by Lagrange": ("test_lagrange", "test_nonminimal_pendulum"),
    "rolling disc": ("test_kane", "test_rolling_disc"),
    "rolling disc, dependent and auxiliary speeds": ("test_kane2", "test_aux_dep"),
    "rolling disc, speeds without mass": ("test_kane5", "test_kane_rolling_disc_lu"),
    "rolling disc, six coordinates": ("test_linearize", "test_linearize_rolling_disc_kane"),
    "rolling disc, by Lagrange": ("test_lagrange", "test_rolling_disc"),
    "disc on an incline, by Lagrange": ("test_lagrange", "test_disc_on_an_incline_plane"),
    "quaternion": ("test_kane", "test_implicit_kinematics"),
    "inertia about another point": ("test_kane2", "test_non_central_inertia"),
    "speeds of their own": ("test_kane2", "test_sub_qdot"),
    "coordinates' rates in forces": ("test_kane4", "test_replace_qdots_in_force"),
    "double pendulum by Lagrange": ("test_lagrange", "test_dub_pen"),
    "four-bar by joints": ("test_jointsmethod", "test_four_bar_linkage_with_manual_constraints"),
    "chaos pendulum by joints": ("test_jointsmethod", "test_chaos_pendulum"),
    "cart and pendulum as a System": (
        "test_system_class",
        "TestSystemExamples.test_cart_pendulum_kanes",
    ),
    "constrained cart and pendulum as a System": (
        "test_system_class",
        "TestSystemExamples.test_cart_pendulum_kanes",
        1,
    ),
    "cart and pendulum as a System, by Lagrange": (
        "test_system_class",
        "TestSystemExamples.test_cart_pendulum_lagrange",
    ),
    "constrained cart and pendulum as a System, by Lagrange": (
        "test_system_class",
        "TestSystemExamples.test_cart_pendulum_lagrange",
        1,
    ),
    "box on the ground, with auxiliary speeds": (
        "test_system_class",
        "TestSystemExamples.test_box_on_ground",
    ),
}


SLOW = {
    "quaternion", "rolling disc, speeds without mass", "rolling disc, six coordinates",
    "rolling disc, by Lagrange", "inertia about another point", "pendulum of two coordinates",
    "constrained cart and pendulum as a System", "speeds of their own",
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::sympy.utilities.exceptions.SymPyDeprecationWarning")
@pytest.mark.parametrize("name", slow_among(IN_SYMPYS_TESTS, SLOW))
def test_what_sympys_own_tests_form(name):
    check(sympy_models.caught(*IN_SYMPYS_TESTS[name]))


# -- actuators and what they pull along -------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", ACTUATED)
def test_systems_with_actuators(name):
    check(ACTUATED[name]())


# -- what is refused --------------------------------------------------------------------------


def test_what_contradicts_itself_is_refused_and_rightly():
    """A disc's acceleration by the theorem of two points, from a contact that has none: SymPy's
    rates do not keep the energy.  Without it they are those of the velocities, which do."""
    method = sympy_models.caught("test_kane", "test_aux", 1)
    reference = sympy_models.Reference(method, {})
    with pytest.raises(mechc.MechcError, match=r"set for Dmc is not the derivative.*omit it"):
        mechc.compile(method)
    (disc,) = method.bodies
    disc.masscenter._acc_dict.clear()
    disc.potential_energy = disc.mass * symbols("g") * symbols("r") * cos(method.q[1])
    model = mechc.compile(method)
    t, y, values = sympy_models.random_state(model, reference, np.random.default_rng(2))
    mine = {p: values[p] for p in model.parameters}

    def power(rates):
        ahead, behind = (model.energy(y + h * rates, mine) for h in (1e-4, -1e-4))
        return (ahead - behind) / 2e-4

    assert abs(power(model.rhs(t, y, mine))) < 1e-6
    assert abs(power(reference.rates(t, y, values)[0])) > 1e-2


def test_forces_without_a_body_are_no_mechanism():
    method = sympy_models.caught("test_kane2", "test_sub_qdot2")
    with pytest.raises(mechc.MechcError, match="needs at least one body"):
        mechc.compile(method)


def test_configuration_constraints_that_no_velocity_constraint_implies_are_refused_or_derived():
    """A bead on z = x^2 with y' = z x', where the rate of the first is left out."""
    q, u = dynamicsymbols("x y z"), dynamicsymbols("u v w")
    frame, place = ReferenceFrame("N"), Point("P")
    axes = (frame.x, frame.y, frame.z)
    place.set_vel(frame, sum((s * axis for s, axis in zip(u, axes, strict=True)), 0 * frame.x))
    on_curve = [q[2] - q[0] ** 2]

    def formed(coordinates, **constraints):
        kane = KanesMethod(
            frame, coordinates, [u[0], u[2]], [x.diff() - s for x, s in zip(q, u, strict=True)],
            u_dependent=[u[1]], velocity_constraints=[u[1] - q[2] * u[0]], **constraints,
        )  # fmt: skip
        kane.kanes_equations([Particle("bead", place, 2.0)], [(place, -2 * 9.81 * frame.z)])
        return kane

    with pytest.raises(mechc.MechcError, match="degrees of freedom: 2, with these rates: 1"):
        mechc.compile(formed(q[:2], q_dependent=q[2:], configuration_constraints=on_curve))
    model = mechc.compile(formed(q), configuration_constraints=on_curve)
    for x, s in ((0.4, 1.0), (-1.5, 0.3)):
        y = model.assemble({"x": x, "y": 0.2}, {"u": s}, guess={"z": x**2})
        assert y == pytest.approx([x, 0.2, x**2, s, 2 * x * s, x**2 * s], rel=1e-14)
        rate = -(2 * x**3 * s**2 + 4 * x * s**2 + 2 * 9.81 * x) / (1 + x**4 + 4 * x**2)
        second = 2 * x * s**2 + x**2 * rate
        expected = [s, x**2 * s, 2 * x * s, rate, 2 * s**2 + 2 * x * rate, second]
        assert model.rhs(0.0, y) == pytest.approx(expected, rel=1e-13)
