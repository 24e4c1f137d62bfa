"""The name of a scene is made of what decides it, and is the same in every process."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from typing import Any

import pytest
from mechc_codegen import shipped_mechanism
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from sympy import Symbol
from sympy.physics.mechanics import ReferenceFrame, dynamicsymbols

from tests.support import ROOT
from tests.support.sympy_objects import slider

x, y = dynamicsymbols("x y")

DIGEST = """
from tests.support.sympy_objects import four_bar_kane
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from mechc_codegen.description.source import ConversionSettings
settings = ConversionSettings(defaults={"rho": 2.0, "g": 9.81})
print(CompileRequest(four_bar_kane(), CompileOptions(settings)).digest)
"""


@pytest.mark.slow
def test_the_name_is_the_same_in_every_process() -> None:
    names = {
        subprocess.run(
            [sys.executable, "-c", DIGEST], capture_output=True, check=True, text=True,
            env={**os.environ, "PYTHONHASHSEED": seed}, cwd=ROOT,
        ).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert len(names) == 1


def test_whatever_decides_the_scene_changes_its_name() -> None:
    def push(q: Any, u: Any, N: ReferenceFrame) -> Any:
        return -Symbol("m") * Symbol("g") * N.y

    def name(thing: Any, fix: Any = (), outputs: Any = None, **settings: Any) -> str | None:
        return CompileRequest(
            thing, CompileOptions(ConversionSettings(**settings), dict(fix), outputs)
        ).digest

    heavy = slider(push)
    turned = slider(lambda q, u, N: push(q, u, N.orientnew("A", "Axis", (Symbol("a"), N.z))))
    names = [
        name(heavy), name(slider()), name(turned), name(slider(push, mass=Symbol("M"))),
        name(slider(push, mass=Symbol("m", positive=True))), name(slider(push, mass=2)),
        name(slider(push, mass=2.0)), name(heavy, name="slider"), name(heavy, {"g": 0}),
        name(heavy, {"g": 1}), name(heavy, {"m": 1}), name(heavy, outputs=()),
        name(heavy, outputs=("energy",)), name(heavy, outputs=({"p": x},)),
        name(heavy, outputs=({"p": y},)), name(heavy, defaults={"g": 1.0}),
        name(heavy, units={"g": "m"}), name(heavy, configuration_constraints=[]),
    ]  # fmt: skip
    assert len(set(names)) == len(names)
    assert name(heavy) == name(slider(push))


def test_whatever_decides_a_mechanism_changes_its_name_and_building_it_again_does_not() -> None:
    def name(made: Mechanism, **options: Any) -> str | None:
        return CompileRequest(made, CompileOptions(ConversionSettings(), **options)).digest

    linkage = shipped_mechanism("four_bar", {})
    gravity, torque = (shipped_mechanism("four_bar", o) for o in ({}, {"crank_torque": True}))
    first, force = linkage.parameters[0], ((linkage.points[0], linkage.frame.x),)

    def with_default(value: Any) -> Mechanism:
        parameters = (replace(first, default=value), *linkage.parameters[1:])
        return replace(linkage, parameters=parameters)

    others = [
        linkage, torque, replace(linkage, name="other"), replace(linkage, start={"theta_0": 1.0}),
        with_default(2 * linkage.parameters[1].symbol),
        replace(linkage, points=linkage.points[:-1]), replace(linkage, joints=()),
        replace(linkage, bodies=linkage.bodies[::-1]), replace(linkage, loads=force),
        replace(linkage, gravity=linkage.frame.x), replace(linkage, preference=None),
    ]  # fmt: skip
    names = [*map(name, others), name(linkage, fix={"g": 0}), name(linkage, outputs=())]
    assert len({*names}) == len(names)
    assert name(linkage) == name(gravity) == name(with_default(7.5))
    assert name(replace(linkage, start={"theta_0": range(3)})) is None  # type: ignore[dict-item]
