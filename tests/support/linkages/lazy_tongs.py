"""Lazy tongs: pairs of bars, pinned at their middles and ends; the first middle is on the ground.

Two sheets of configurations cross where all pairs are closed.  On the regular one the bars of a
pair stand apart, two angles in all; on the collapsed one they lie on each other, a pendulum of as
many links as pairs, and of the rows of each pair beyond the second one depends on the others.
"""

from dataclasses import dataclass

import numpy as np
import sympy.physics.mechanics as me

import mechc

LENGTH, GRAVITY = 0.7, 9.81
MASSES, INERTIAS = (1.0, 2.0), (0.2, 0.9)  # of the bars of the two chains


@dataclass(frozen=True)
class Tongs:
    """Two chains of `pairs` bars; angles are relative, those of the first bars to the ground."""

    pairs: int

    def compiled(self, **options):
        n, t = self.pairs, me.dynamicsymbols._t
        q, u = me.dynamicsymbols(f"a_0:{n} b_0:{n}"), me.dynamicsymbols(f"ua_0:{n} ub_0:{n}")
        rates = dict(zip([c.diff(t) for c in q], u, strict=True))
        ground, origin = me.ReferenceFrame("N"), me.Point("O")
        origin.set_vel(ground, 0)
        bodies, loads, middles = [], [], []
        for chain, (mass, across) in enumerate(zip(MASSES, INERTIAS, strict=True)):
            frame, joint, own = ground, origin, []
            for i in range(n):
                turned = me.ReferenceFrame(f"F{chain}{i}")
                turned.orient_axis(frame, q[chain * n + i], ground.z)
                turned.set_ang_vel(ground, sum(u[chain * n : chain * n + i + 1]) * ground.z)
                middle = joint
                if i:
                    middle = joint.locatenew(f"M{chain}{i}", LENGTH * turned.x)
                    middle.v2pt_theory(joint, ground, turned)
                joint = middle.locatenew(f"E{chain}{i}", LENGTH * turned.x)
                joint.v2pt_theory(middle, ground, turned)
                central = (me.inertia(turned, 0, 0, across), middle)
                bodies.append(me.RigidBody(f"B{chain}{i}", middle, turned, mass, central))
                loads.append((middle, -GRAVITY * mass * ground.y))
                own.append(middle)
                frame = turned
            middles.append(own)
        apart = [a.pos_from(b) for a, b in zip(*middles, strict=True)][1:]
        gaps = [gap.dot(axis) for gap in apart for axis in (ground.x, ground.y)]
        kane = me.KanesMethod(
            ground, q_ind=q[:2], u_ind=u[:2], q_dependent=q[2:], u_dependent=u[2:],
            kd_eqs=[speed - rate for rate, speed in rates.items()], configuration_constraints=gaps,
            velocity_constraints=[gap.diff(t).subs(rates) for gap in gaps],
        )  # fmt: skip
        kane.kanes_equations(bodies, loads)
        return mechc.compile(kane, **options)

    def collapsed(self, angles, speeds):
        """The state with both bars of pair i at angles[i] (rad) to the ground."""
        turned, turning = np.diff(angles, prepend=0.0), np.diff(speeds, prepend=0.0)
        return np.concatenate([turned, turned, turning, turning])

    def regular(self, angles, speeds):
        """The state with the bars of every pair at two angles, which the chains take in turn."""

        def rows(values):
            chains = [[values[(i + k) % 2] for i in range(self.pairs)] for k in range(2)]
            return np.diff(chains, prepend=0.0).ravel()

        return np.concatenate([rows(angles), rows(speeds)])

    def pendulum_rates(self, angles, speeds):
        """Angular accelerations of the pendulum that the collapsed tongs are, in closed form."""
        n, mass = self.pairs, sum(MASSES)
        reach = np.zeros((n, n))  # of pair i's middle by link k
        for i in range(1, n):
            reach[i, : i + 1] = 2 * LENGTH
            reach[i, [0, i]] = LENGTH
        moment, apart = mass * reach.T @ reach, angles[:, None] - angles
        inertia = moment * np.cos(apart) + sum(INERTIAS) * np.eye(n)
        weight = mass * GRAVITY * reach.sum(axis=0) * np.cos(angles)
        return np.linalg.solve(inertia, -(moment * np.sin(apart)) @ speeds**2 - weight)

    def regular_rates(self, angles, speeds):
        """Those of the two angles on the regular sheet."""
        i = np.arange(self.pairs)
        moment, apart = sum(MASSES) * LENGTH**2 * (i**2).sum(), angles[:, None] - angles
        own = [sum(INERTIAS[(k + m) % 2] for m in i) for k in range(2)]
        weight = sum(MASSES) * GRAVITY * LENGTH * i.sum() * np.cos(angles)
        inertia = moment * np.cos(apart) + np.diag(own)
        return np.linalg.solve(inertia, -(moment * np.sin(apart)) @ speeds**2 - weight)
