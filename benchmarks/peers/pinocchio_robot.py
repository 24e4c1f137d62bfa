"""Pinocchio's model of a robot in URDF, with states and answers in mechc's variables.

mechc's speeds u are the rates of the joints that move by themselves; of a floating base the
velocity of its origin in the axes of the ground, and its angular velocity in those of the base.
Pinocchio has both in the axes of the base, its quaternions end with the scalar, and here every
joint that mimics another moves by itself, since its recursive algorithm knows no mimics.  So
v = T(q) u and v' = T u' + c, and generalized forces are T^T times Pinocchio's.  Pinocchio reads the
damping of joints and does not apply it: here it is applied.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]
WORLD, BASE = "world", "base"  # in mechc what a floating base is joined to, and its joint


@dataclass(frozen=True)
class State:
    """q and v of Pinocchio, with T and c of v' = T u' + c."""

    q: Array
    v: Array
    T: Array
    c: Array


class PinocchioRobot:
    """The robot of a file.

    Parameters
    ----------
    path
        The URDF file.
    coordinates, speeds
        Those of mechc's model, whose states [q, u] are asked about.

    Raises
    ------
    ImportError
        Without Pinocchio.
    ValueError, RuntimeError, KeyError
        For a file that Pinocchio cannot read, or whose mimics lead to no joint.
    """

    def __init__(self, path: Path, coordinates: Sequence[str], speeds: Sequence[str]) -> None:
        import pinocchio

        self.floating = f"vx_{BASE}" in speeds
        root = [pinocchio.JointModelFreeFlyer()] if self.floating else []
        self.engine = pinocchio
        self.model = pinocchio.buildModelFromUrdf(str(path), *root)
        self.data = self.model.createData()
        self.names, self.speeds = (*coordinates, *speeds), tuple(speeds)
        self._mimics = {
            joint.get("name"): joint.find("mimic")
            for joint in ElementTree.parse(path).getroot().findall("joint")
        }

    @property
    def joints(self) -> list[tuple[str, Any]]:
        """Name and model of the joints with one speed in Pinocchio."""
        pairs = list(zip(self.model.names, self.model.joints, strict=True))
        return [(name, joint) for name, joint in pairs[1:] if joint.nv == 1]  # 0: the universe

    @property
    def has_mimics(self) -> bool:
        return self.model.nv > len(self.speeds)

    def state(self, y: Array) -> State:
        """The state of one of mechc (nq + nu,)."""
        at = dict(zip(self.names, y.tolist(), strict=True))
        q, nv = self.engine.neutral(self.model), self.model.nv
        T, c = np.zeros((nv, len(self.speeds))), np.zeros(nv)
        for name, joint in self.joints:
            own, ratio, offset = self._followed(name)
            position = ratio * at[f"q_{own}"] + offset
            turned = joint.nq == 2  # a continuous joint has cosine and sine
            q[joint.idx_q : joint.idx_q + joint.nq] = (
                (np.cos(position), np.sin(position)) if turned else position
            )
            T[joint.idx_v, self.speeds.index(f"u_{own}")] = ratio
        if self.floating:
            self._float(at, q, T)
        v = T @ y[-len(self.speeds) :]
        if self.floating:
            c[:3] = -np.cross(v[3:6], v[:3])
        return State(q, v, T, c)

    def _float(self, at: dict[str, float], q: Array, T: Array) -> None:
        attitude = np.array([at[f"q{k}_{BASE}"] for k in (1, 2, 3, 0)])
        q[:7] = *(at[f"{axis}_{BASE}"] for axis in "xyz"), *(attitude / np.linalg.norm(attitude))
        axes = self.engine.Quaternion(q[3:7]).toRotationMatrix()
        linear, angular = (
            [self.speeds.index(f"{letter}{axis}_{BASE}") for axis in "xyz"] for letter in "vw"
        )
        T[:3, linear], T[3:6, angular] = axes.T, np.eye(3)

    def _followed(self, name: str) -> tuple[str, float, float]:
        """The joint that it follows, itself where it mimics none, with multiplier and offset."""
        mimic = self._mimics[name]
        if mimic is None:
            return name, 1.0, 0.0
        own, ratio, offset = self._followed(mimic.get("joint", ""))
        factor = float(mimic.get("multiplier", 1.0))
        return own, factor * ratio, factor * offset + float(mimic.get("offset", 0.0))

    def mass_matrix(self, state: State) -> Array:
        upper = np.triu(self.engine.crba(self.model, self.data, state.q))
        mass = upper + upper.T - np.diag(np.diag(upper))
        found: Array = state.T.T @ mass @ state.T
        return found

    def torques(self, state: State, accelerations: Array) -> Array:
        """Inverse dynamics: the generalized forces that produce u', those of damping in them."""
        rates = state.T @ accelerations + state.c
        needed = self.engine.rnea(self.model, self.data, state.q, state.v, rates)
        found: Array = state.T.T @ (needed + self.model.damping * state.v)
        return found

    def accelerations(self, state: State, torques: Array) -> Array:
        """u' by ``aba``; with mimics by mass matrix and bias."""
        if self.has_mimics:
            bias = self.torques(state, np.zeros_like(torques))
            return np.linalg.solve(self.mass_matrix(state), torques - bias)
        applied = np.linalg.solve(state.T.T, torques) - self.model.damping * state.v
        rates = self.engine.aba(self.model, self.data, state.q, state.v, applied)
        return np.linalg.solve(state.T, rates - state.c)

    def positions(self, state: State, links: Sequence[str]) -> Array:
        """The origins of the links (links, 3) in the ground."""
        self.engine.framesForwardKinematics(self.model, self.data, state.q)
        ground, kind = np.zeros(3), self.engine.FrameType.BODY
        return np.array([
            ground if self.floating and link == WORLD
            else self.data.oMf[self.model.getFrameId(link, kind)].translation
            for link in links
        ])  # fmt: skip
