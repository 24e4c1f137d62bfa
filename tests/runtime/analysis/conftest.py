"""The four-bar with a torque at its crank and all Jacobians."""

import pytest
from mechc_codegen import shipped_mechanism
from sympy import Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc

t = dynamicsymbols._t


@pytest.fixture(scope="session")
def four_bar():
    """With a torque at the crank, and outputs that hold accelerations and multipliers."""
    mechanism = shipped_mechanism("four_bar", {"crank_torque": True})
    u = dynamicsymbols("omega_0")
    own = {"alpha": u.diff(t), "pull": mechc.multiplier(0) + Symbol("g") * u}
    jacobians = ("state_jacobian", "parameter_jacobian")
    return mechc.compile(mechanism, outputs=("multipliers", "energy", *jacobians, own))


@pytest.fixture(scope="session")
def torque(four_bar):
    return next(name for name in four_bar.parameters if four_bar.units[name] == "N m")
