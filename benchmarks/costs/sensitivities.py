"""Run times with sensitivities over those without, at the same steps.

    mechc bench sensitivities [--rounds N] [--only SCENE ...]
    mechc bench sensitivities --peers [SCENE ...] [--rounds N]
    mechc bench sensitivities --memory [SECONDS ...]

Of every scene: seconds of the plain run, and of the same run with derivatives by all that is named;
the least of many, turn by turn, and their ratio.  Of the chain, which is compiled when it is asked
for, the same of the plain run and of one gradient by all its parameters, backwards.  With --peers
the run times of other tools at equal error: peers/equal_error.py.  With --memory what a run of the
regular four-bar over so many seconds and its gradient by all parameters add to the memory of a
process, and their seconds, with checkpoints and without.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.library.parts import fixed_point, joint_angles, parameter
from sympy import Symbol
from sympy.physics.mechanics import ReferenceFrame, RigidBody, dynamicsymbols, inertia

import mechc

from ..peers.equal_error import MECHANISMS, table
from ..timing.processes import least_of_rounds, said
from ..timing.results import command_parser

OUTPUTS = ("energy", "sensitivities")
RTOLS = (1e-6, 1e-9, 1e-12)
TEN = (*(f"l_{k}" for k in range(4)), *(f"m_{k}" for k in range(3)), "I_0", "I_1", "I_2")


def four_bar() -> tuple[Any, ...]:
    """The regular four-bar over 20 s, by its ten lengths, masses and inertias."""
    model, params = mechc.load("four_bar", outputs=OUTPUTS), {"l_3": 3.5}
    y0 = model.assemble({"theta_0": np.radians(85)}, params=params)
    return model, y0, params, 20.0, TEN


def pendulum() -> tuple[Any, ...]:
    """A simple pendulum over 20 s, by length, gravity and the whole start."""
    model = mechc.load("pendulum", outputs=OUTPUTS)
    return model, np.array([1.0, 0.5]), None, 20.0, ("l_0", "g", "y0")


LINKS = 20  # of the chain
OF_EACH = {"l": 0.5, "c": 0.2, "m": 1.0, "I": 0.05, "d": 0.1}  # length, centre, damping of a link


def chain_of(links: int) -> Mechanism:
    """Links in a plane, hinged and damped, each with five parameters of its own."""
    q, u = dynamicsymbols(f"q_0:{links}"), dynamicsymbols(f"u_0:{links}")
    r = ReferenceFrame("r")
    on, bodies, loads, parameters = r, [], [], []
    origin = end = fixed_point("O", r)
    for k in range(links):
        length, centre, mass, about, damping = given = [Symbol(f"{x}_{k}") for x in OF_EACH]
        frame = on.orientnew(f"link_{k}", "Axis", (q[k], r.z))
        frame.set_ang_vel(on, u[k] * r.z)
        at = end.locatenew(f"centre_{k}", centre * frame.x)
        bodies.append(RigidBody(f"link_{k}", at, frame, mass, (inertia(frame, 0, 0, about), at)))
        torque = damping * u[k] * r.z
        loads += [(frame, -torque), (on, torque)][: 2 if k else 1]
        parameters += [
            parameter(s, v, "", str(s)) for s, v in zip(given, OF_EACH.values(), strict=True)
        ]
        end, on = end.locatenew(f"E_{k}", length * frame.x), frame
    return Mechanism(
        name="damped_chain", title=f"Damped chain of {links} links", frame=r, origin=origin,
        **joint_angles(q, u, [f"at hinge {k}" for k in range(links)]),
        parameters=tuple(parameters), bodies=tuple(bodies), loads=tuple(loads),
        gravity=-9.81 * r.y,
    )  # fmt: skip


def chain() -> tuple[Any, ...]:
    """The damped chain of 20 links over 1 s, by its 100 parameters."""
    model = mechc.compile(chain_of(LINKS), outputs=OUTPUTS)
    y0 = {name: 0.3 - 0.01 * k for k, name in enumerate(model.coordinates)}
    return model, y0, None, 1.0, tuple(model.parameters)


GRADIENT = """
import time, mechc
model = mechc.load("four_bar", outputs={outputs})
model.wait_compiled()
given = {{"theta_0": 1.4835}}, {{"l_3": 3.5}}
model.simulate(1.0, *given).gradient(end="theta_0")
before, began = peak_bytes(), time.perf_counter()
sol = model.simulate({span}, *given, checkpoints={checkpoints})
ran = time.perf_counter()
sol.gradient(end="theta_0")
ended = time.perf_counter()
print(json.dumps([sol.stats["steps"], peak_bytes() - before, ran - began, ended - ran]))
"""
SPANS = (1e3, 1e4, 5e4)
BOUND = 16e6  # bytes


def memory(spans: Sequence[float]) -> Iterator[str]:
    """Of gradients over long times, each in a process of its own."""
    yield f"{'seconds':>8} {'steps':>9} {'checkpoints':>12} {'memory':>10} {'run':>8}  gradient"
    for span in spans:
        for bound in (None, BOUND):
            given = {"outputs": OUTPUTS, "span": span, "checkpoints": bound}
            steps, added, ran, back = said(GRADIENT.format(**given))
            kept = f"{bound / 1e6:.0f} MB" if bound else "none"
            yield (
                f"{span:8.0f} {steps:9d} {kept:>12} {added / 1e6:7.1f} MB {ran:6.2f} s "
                f"{back:7.2f} s"
            )


SCENES: dict[str, Callable[[], tuple[Any, ...]]] = {"four_bar": four_bar, "pendulum": pendulum}
BACKWARDS = {"chain": chain}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("sensitivities", __doc__)
    parser.add_argument("--rounds", type=int, default=30, metavar="N", help="[30]")
    parser.add_argument("--only", nargs="*", choices=[*SCENES, *BACKWARDS], default=list(SCENES))
    parser.add_argument("--peers", nargs="*", choices=list(MECHANISMS), metavar="SCENE",
                        help=f"other tools at equal error: {', '.join(MECHANISMS)}")  # fmt: skip
    parser.add_argument(
        "--memory", nargs="*", type=float, metavar="SECONDS",
        help=f"of gradients over long times: {', '.join(f'{t:g}' for t in SPANS)}",
    )  # fmt: skip
    chosen = parser.parse_args(arguments)
    if chosen.memory is not None:
        lines = memory(chosen.memory or SPANS)
    elif chosen.peers is not None:
        lines = table(chosen.peers or list(MECHANISMS), chosen.rounds)
    else:
        lines = ratios(chosen.only, chosen.rounds)
    for line in lines:
        print(line, flush=True)
    return 0


def ratios(names: Sequence[str], rounds: int) -> Iterator[str]:
    """The table of run times with derivatives over those without."""
    yield (f"{'scene':10} {'method':7} {'rtol':>6} {'steps':>6} {'by':>3} {'plain':>9} "
           f"{'with':>9} {'ratio':>6}")  # fmt: skip
    for name in names:
        yield from _rows(name, rounds)


def _rows(name: str, rounds: int) -> Iterator[str]:
    """Columns forwards with the run, or one gradient backwards after it."""
    model, y0, params, t, names = (SCENES | BACKWARDS)[name]()
    model.wait_compiled()
    for method in ("gauss8", "dop853"):
        for rtol in RTOLS:
            run = partial(model.simulate, t, y0, params, rtol=rtol, method=method)
            if name in SCENES:
                more = partial(run, sensitivities=names)
                sol, count = run(), more().sensitivity.columns.count
            else:
                sol, count = run(), len(names)
                more = partial(sol.gradient, end=model.coordinates[0], by=names)
            plain, with_it = least_of_rounds(rounds, run, more)
            yield _row(name, method, rtol, sol.stats["steps"], count, plain, with_it)


def _row(
    name: str, method: str, rtol: float, steps: int, count: int, plain: float, more: float
) -> str:
    return (
        f"{name:10} {method:7} {rtol:6.0e} {steps:6d} {count:3d} {1e3 * plain:6.2f} ms "
        f"{1e3 * more:6.2f} ms {more / plain:6.1f}"
    )
