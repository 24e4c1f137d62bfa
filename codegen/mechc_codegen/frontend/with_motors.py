"""A mechanism and motors -> the same mechanism, driven by them: :func:`with_motors`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from sympy import Symbol

from mechc_codegen.convert.convert import chosen_inputs
from mechc_codegen.description.joints.motors import Motor, drives_of
from mechc_codegen.description.mechanism import Mechanism, Parameter, as_mapping
from mechc_codegen.description.source import Key
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.sympy_joints import constants_in, leaves_of, parameters_of


def with_motors(
    mechanism: Mechanism,
    motors: Iterable[Motor],
    *,
    parameters: Mapping[Key, Any] | Iterable[Parameter] = (),
    inputs: Mapping[Key, Any] | Iterable[Key] = (),
) -> Mechanism:
    """The same mechanism with motors at its joints: of a robot file, or of joints.

    Parameters
    ----------
    mechanism
        One that has joints, as of ``mechc.from_urdf``, ``from_sdf``, ``from_mjcf`` or
        ``from_joints``.  What drives its joints already goes on to do so.
    motors
        :class:`mechc.Motor` objects.
    parameters
        Values of the symbols in the motors that are no parameters of the mechanism, in SI units
        or with one, ``"30 mm"``, or :class:`mechc.Parameter` objects.  Those without one need a
        value at every use.
    inputs
        Functions of time in the motors -> expressions; those without one are given with a run,
        ``model.simulate(..., inputs={...})``.

    Returns
    -------
    Mechanism
        With the outputs ``NAME_torque`` (or ``NAME_force``) and ``NAME_power`` of each motor.

    Raises
    ------
    MechanismError
        If the mechanism has no joints, or a motor does not fit its joint; the message names both.

    Examples
    --------
    >>> arm = mechc.from_urdf("arm.urdf")
    >>> driven = mechc.with_motors(arm, [mechc.Motor("elbow", angle=0.5 * sympy.sin(3 * t))])
    >>> mechc.compile(driven).simulate(2.0).plot("elbow_torque")
    """
    if not mechanism.joints:
        raise MechanismError(
            f"{mechanism.name} has no joints for motors: its description is of bodies and loads, "
            "so add the torque to the loads, or the motion to the constraints"
        )
    pairs = zip(mechanism.q, mechanism.kinematics, strict=True)
    rates = {q: rate for q, rate in pairs if rate in mechanism.u}
    drives = drives_of(motors, mechanism.joints, rates, mechanism.rows)
    rotors = [joint.child for joint in drives.rotors if joint.child is not None]
    held, moving = drives.configuration_constraints, drives.motion_constraints
    expressions = [*drives.factors, *(row.expression for row in (*held, *moving))]
    ground = mechanism.frame, mechanism.origin
    leaves = leaves_of(ground, rotors, [load for _, load in drives.loads], expressions)
    known = {p.symbol for p in mechanism.parameters}
    constants = [symbol for symbol in constants_in(leaves) if symbol not in known]
    states = {*mechanism.q, *mechanism.u, *mechanism.x, *mechanism.inputs}
    functions = sorted((x for x in leaves - states if not isinstance(x, Symbol)), key=str)
    return replace(
        mechanism,
        loads=(*mechanism.loads, *drives.loads),
        bodies=(*mechanism.bodies, *rotors),
        joints=(*mechanism.joints, *drives.rotors),
        parameters=(
            *mechanism.parameters,
            *parameters_of(parameters, constants, {}, drives.quantities),
        ),
        inputs={**mechanism.inputs, **chosen_inputs(functions, as_mapping(inputs))},
        outputs={**mechanism.outputs, **drives.outputs},
        configuration_constraints=(*mechanism.configuration_constraints, *held),
        motion_constraints=(*mechanism.motion_constraints, *moving),
    )
