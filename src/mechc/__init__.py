"""mechc: mechanisms compiled to C, simulated fast and right.

>>> import mechc
>>> model = mechc.load("four_bar")
>>> sol = model.simulate((0, 20), model.assemble({"theta_0": 1.4835}))
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import mechc.interrupts  # noqa: F401  # first: it imports NumPy whole
from mechc.errors import (
    AssemblyError,
    CacheError,
    CacheWarning,
    ChangePointError,
    CollapsedSheetWarning,
    CompilerError,
    EventError,
    InputError,
    MechcError,
    MissingInputError,
    MissingPackageError,
    MissingParameterError,
    RunInterrupt,
    StepError,
    UnavailableOutputError,
    UndeterminedReactionWarning,
    UnknownNameError,
    UnusedValueWarning,
    ValueOutOfBoundsError,
)
from mechc.load import compile as compile
from mechc.load import get_include, load, mechanisms
from mechc.model import Model
from mechc.open import open_saved as open  # noqa: F401
from mechc.open import open_view
from mechc.outputs import Momenta, Reactions
from mechc.results.solution import Solution
from mechc.simulation.events.event import Event, EventRecord
from mechc.simulation.events.friction import DryFriction
from mechc.simulation.events.stops import Stop
from mechc.simulation.status import ChangePoint, Status

if TYPE_CHECKING:
    from mechc.assembly.initial_values import Assembly
    from mechc.compilation.table import Table
    from mechc.differentiable.casadi_model import casadi
    from mechc.differentiable.jax_function import jax
    from mechc.differentiable.torch_function import torch
    from mechc.export import export_c, export_fmu, export_wasm
    from mechc.inputs.sampled import Sampled
    from mechc.inputs.signals import Signal
    from mechc.results.check import Check
    from mechc.simulation.stepper import Stepper
    from mechc.system.c_interface import CFunction
    from mechc.verdict.verdict import Verdict, judge

__version__ = "0.1.0"

# Not ``compile`` and ``open``: a star import must not replace Python's own.
__all__ = [
    "Assembly",
    "AssemblyError",
    "BallJoint",
    "CFunction",
    "CacheError",
    "CacheWarning",
    "ChangePoint",
    "ChangePointError",
    "Check",
    "Closure",
    "CollapsedSheetWarning",
    "CompilerError",
    "Constraint",
    "Coordinate",
    "Coupling",
    "Cut",
    "Drawing",
    "DryFriction",
    "Event",
    "EventError",
    "EventRecord",
    "FreeJoint",
    "InputError",
    "Joint",
    "Kind",
    "Mechanism",
    "MechanismError",
    "MechcError",
    "MissingInputError",
    "MissingPackageError",
    "MissingParameterError",
    "Model",
    "Momenta",
    "Motor",
    "Parameter",
    "Quantity",
    "Reactions",
    "RunInterrupt",
    "Sampled",
    "ScrewJoint",
    "Signal",
    "SkippedPartWarning",
    "Solid",
    "Solution",
    "Speed",
    "State",
    "Status",
    "StepError",
    "Stepper",
    "Stop",
    "Table",
    "UnavailableOutputError",
    "UndeterminedReactionWarning",
    "UniversalJoint",
    "UnknownNameError",
    "UnusedValueWarning",
    "ValueOutOfBoundsError",
    "Verdict",
    "casadi",
    "export_c",
    "export_fmu",
    "export_wasm",
    "from_equations",
    "from_joints",
    "from_mjcf",
    "from_sdf",
    "from_urdf",
    "get_include",
    "jax",
    "judge",
    "load",
    "mechanisms",
    "multiplier",
    "open_view",
    "torch",
    "with_motors",
]


_LATER = {
    "Assembly": "mechc.assembly.initial_values",
    "CFunction": "mechc.system.c_interface",
    "Check": "mechc.results.check",
    "Sampled": "mechc.inputs.sampled",
    "Signal": "mechc.inputs.signals",
    "Stepper": "mechc.simulation.stepper",
    "Table": "mechc.compilation.table",
    "Verdict": "mechc.verdict.verdict",
    "casadi": "mechc.differentiable.casadi_model",
    "export_c": "mechc.export",
    "export_fmu": "mechc.export",
    "export_wasm": "mechc.export",
    "jax": "mechc.differentiable.jax_function",
    "judge": "mechc.verdict.verdict",
    "torch": "mechc.differentiable.torch_function",
}


def __getattr__(name: str) -> Any:
    """Import a name at first use: few programs use these names, or they need SymPy."""
    if name in _LATER:
        return getattr(import_module(_LATER[name]), name)
    if name in __all__:  # for describing mechanisms
        from mechc.compilation.compiler import of_compiler

        return of_compiler(name)
    raise AttributeError(f"module 'mechc' has no attribute {name!r}")


def __dir__() -> list[str]:
    """The public names, and those that Python itself needs."""
    return sorted({*__all__, "compile", "open", *(n for n in globals() if n.startswith("__"))})
