"""MuJoCo: joint coordinates, loops closed by soft constraints, steps of one size.

A model is MJCF text made from the problem's numbers.  ``tol`` of a case is its timestep (s).
Loops are ``connect`` constraints, springs and dampers that fade with the timestep: MuJoCo gives
them a time constant, of no less than two timesteps, and an impedance, of no more than 0.9999.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..formulations.rigid_bodies import GROUND, Anchor, Bodies, Body
from ..formulations.rigid_scenes import rigid_bodies
from ..problems.problem import Array, Problem
from ..timing.cases import Case
from . import Built, NotExpressibleError

TOOLS = ("MuJoCo",)
STEPS = tuple(250 * 4**k for k in range(7))  # 250 ... 1,024,000
STAGES = {"RK4": 4}
LONGEST = 1_200_000  # evaluations times one more than the bodies in a run: three seconds
# With equality constraints alone Newton's first iteration solves the quadratic problem; neither a
# warm start nor a search for islands makes up for its own time.
FLAGS = (
    '<flag contact="disable" energy="disable" autoreset="disable" island="disable" '
    'warmstart="disable"/>'
)
# Critically damped; with half of it, the least that is allowed, Runge-Kutta errs three to ten times
# more on the four-bar, the slider-crank and Andrews' mechanism, with twice of it about as much.
TIME_CONSTANT = 4  # timesteps
IMPEDANCE = 0.9999
LEAST_INERTIA = 2e-15  # kg m^2; MuJoCo refuses bodies that have less than 1e-15
ROLLING = "the wheels roll without slip, and MuJoCo has no such constraint, only friction"


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """Cases of every integrator over timesteps; tolerances are nothing to a fixed-step engine.

    Raises
    ------
    ImportError
        If MuJoCo is not installed.
    NotExpressibleError
        If the problem is not one of rigid bodies on joints, or has rolling wheels.
    """
    import mujoco

    mujoco.set_mju_user_warning(lambda text: None)  # the default writes a file
    if problem.name == "bicycle":
        raise NotExpressibleError(ROLLING)
    bodies = rigid_bodies(problem)
    start = time.perf_counter()
    cases = [
        _case(bodies, problem, integrator, steps)
        for integrator in _integrators(bodies)
        for steps in _step_counts(bodies, integrator, quick)
    ]
    compiled = (time.perf_counter() - start) / len(cases)
    return Built(cases, {"MuJoCo": {"derive": 0.0, "compile": compiled}})


def _integrators(bodies: Bodies) -> tuple[str, ...]:
    """``implicitfast`` treats damping alone implicitly; without any its steps are Euler's."""
    damped = any(spring.damping for spring in bodies.springs)
    return ("RK4", "implicitfast", "Euler") if damped else ("RK4", "Euler")


def _step_counts(bodies: Bodies, integrator: str, quick: bool) -> list[int]:
    evaluations = STAGES.get(integrator, 1) * (len(bodies.bodies) + 1)
    counts = [steps for steps in STEPS if steps * evaluations <= LONGEST]
    return counts[1:4] if quick else counts


def _case(bodies: Bodies, problem: Problem, integrator: str, steps: int) -> Case:
    import mujoco

    timestep = problem.t_end / steps
    model = mujoco.MjModel.from_xml_string(mjcf(bodies, timestep, integrator))
    data = mujoco.MjData(model)
    q, u = bodies.joints(problem.start)

    def prepare() -> None:
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:], data.qfrc_applied[0] = q, u, bodies.torque

    def state(_: Any) -> Array | None:
        if _failure(data):
            return None
        return problem.observe(bodies.state(np.array(data.qpos), np.array(data.qvel)))

    return Case(
        "MuJoCo", f"{integrator}, h", timestep, lambda: mujoco.mj_step(model, data, steps),
        state, lambda _: _failure(data) or "finished", prepare,
    )  # fmt: skip


def _failure(data: Any) -> str:
    """What MuJoCo warned of in the steps since the last reset."""
    import mujoco

    for kind in range(mujoco.mjtWarning.mjNWARNING.value):
        if data.warning[kind].number:
            return f"warning {mujoco.mjtWarning(kind).name}"
    return ""


def mjcf(bodies: Bodies, timestep: float, integrator: str) -> str:
    """The model as MuJoCo's XML; nothing in it but numbers and the names of parts."""
    sites = _sites(bodies)
    options = (
        f'<option timestep="{timestep!r}" integrator="{integrator}" solver="Newton" '
        f'iterations="1" tolerance="1e-15" gravity="{_text(bodies.gravity)}">{FLAGS}</option>'
    )
    tree = "".join(_site(sites, anchor) for anchor in sites if anchor[0] == GROUND)
    tree += "".join(_branch(bodies, sites, k) for k in _carried(bodies, GROUND))
    return (
        f'<mujoco><compiler angle="radian" autolimits="false"/>{options}'
        f"<worldbody>{tree}</worldbody>"
        f"<equality>{_loops(bodies, sites, timestep)}</equality>"
        f"<tendon>{_springs(bodies, sites)}</tendon></mujoco>"
    )


def _sites(bodies: Bodies) -> dict[Anchor, str]:
    """A name for every point that a loop or a spring is fastened to."""
    pairs = (*bodies.loops, *(spring.ends for spring in bodies.springs))
    anchors = dict.fromkeys(anchor for pair in pairs for anchor in pair)
    return {anchor: f"site_{k}" for k, anchor in enumerate(anchors)}


def _carried(bodies: Bodies, on: int) -> list[int]:
    return [k for k, body in enumerate(bodies.bodies) if body.on == on]


def _branch(bodies: Bodies, sites: dict[Anchor, str], k: int) -> str:
    """A body with all that it carries."""
    body = bodies.bodies[k]
    own = "".join(_site(sites, anchor) for anchor in sites if anchor[0] == k)
    carried = "".join(_branch(bodies, sites, child) for child in _carried(bodies, k))
    return f'<body pos="{_text(body.place)}">{_joint(body)}{_inertial(body)}{own}{carried}</body>'


def _joint(body: Body) -> str:
    axis = "" if body.joint == "ball" else f' axis="{_text(body.axis)}"'
    return f'<joint type="{body.joint}"{axis}/>'


def _inertial(body: Body) -> str:
    """Moments about axes out of a plane matter alone; those left out are made admissible."""
    inertia = np.maximum(body.inertia, LEAST_INERTIA)
    return (
        f'<inertial mass="{body.mass!r}" pos="{_text(body.centre)}" '
        f'diaginertia="{_text(inertia.tolist())}"/>'
    )


def _site(sites: dict[Anchor, str], anchor: Anchor) -> str:
    return f'<site name="{sites[anchor]}" pos="{_text(anchor[1])}"/>'


def _loops(bodies: Bodies, sites: dict[Anchor, str], timestep: float) -> str:
    reference = f'solref="{TIME_CONSTANT * timestep!r} 1"'
    impedance = f'solimp="{IMPEDANCE} {IMPEDANCE} 0.001 0.5 1"'
    return "".join(
        f'<connect site1="{sites[a]}" site2="{sites[b]}" {reference} {impedance}/>'
        for a, b in bodies.loops
    )


def _springs(bodies: Bodies, sites: dict[Anchor, str]) -> str:
    return "".join(
        f'<spatial stiffness="{spring.stiffness!r}" damping="{spring.damping!r}" '
        f'springlength="{spring.length!r}">'
        + "".join(f'<site site="{sites[end]}"/>' for end in spring.ends)
        + "</spatial>"
        for spring in bodies.springs
    )


def _text(numbers: Sequence[float]) -> str:
    return " ".join(map(repr, numbers))
