"""The equations of a tree of links with cut joints.

Input: a mechanism whose frames and points form a tree.  Output: equations with the tree's data in
place of mass matrix and forcing.  Invariant: the number of statements grows with the links, that of
the Jacobian's entries with the paths that the cuts join.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from sympy import Expr, S, sympify

from mechc_codegen.derive.equations import Equations, Output, Tree
from mechc_codegen.derive.joint_reactions import reaction_outputs, refuse_unknown_reactions
from mechc_codegen.derive.state_symbols import StateSymbols, state_symbols
from mechc_codegen.derive.tree.accelerations import LinkAccelerations
from mechc_codegen.derive.tree.bodies import Body, LinkBodies
from mechc_codegen.derive.tree.frames import Frames, Local, NotATreeError
from mechc_codegen.derive.tree.links import Link, Links, PointMotion, every_speed_has_its_link
from mechc_codegen.derive.tree.mass_matrix import equations_of_motion
from mechc_codegen.derive.tree.reactions import TreeKinetics
from mechc_codegen.derive.tree.residual import Residual
from mechc_codegen.derive.tree.tape import V3, Tape, dot, vanishes
from mechc_codegen.derive.tree.velocities import refuse_other_velocities
from mechc_codegen.description.mechanism import Mechanism, is_rigid, printed_name
from mechc_codegen.description.request import DEFAULT_REQUEST, OutputRequest

AXES = ("x", "y", "z")


def derive_tree(
    mechanism: Mechanism,
    request: OutputRequest = DEFAULT_REQUEST,
    *,
    least_written: int | None = None,
) -> Equations:
    """Derive the equations link by link.

    M and F are written out, over statements that the links share, in place of the tree's data where
    a speed moves several links; and with ``least_written``, which is the least number of links in a
    row, in space, for which this is done; 0: always.

    Raises
    ------
    NotATreeError
        Where the mechanism cannot be described as a tree of links; the message says why.
    """
    _refuse_others(mechanism)
    return _Derivation(mechanism, request, least_written).equations()


def _refuse_others(mechanism: Mechanism) -> None:
    reasons = {
        "constraints are written out as expressions": bool(
            mechanism.configuration_constraints or mechanism.motion_constraints
        ),
        "it is described by a Lagrangian": mechanism.lagrangian is not None,
        "speeds are auxiliary": bool(mechanism.auxiliary),
        "closures hold directions": any(c.perpendicular for c in mechanism.closures),
    }
    for reason, given in reasons.items():
        if given:
            raise NotATreeError(reason)


@dataclass(frozen=True)
class _Cut:
    """One row of a closure: two points that coincide along an axis."""

    label: str
    point: PointMotion
    target: PointMotion
    axis: V3


class _Derivation:
    def __init__(
        self, mechanism: Mechanism, request: OutputRequest, least_written: int | None
    ) -> None:
        self.mechanism, self.request = mechanism, request
        self.symbols = state_symbols(mechanism)
        self.to_symbols = StateSymbols(mechanism, self.symbols, request)
        self.tape = Tape(self.symbols.parameters)
        rates = (*mechanism.kinematics, *(state.rate for state in mechanism.states))
        self.rates = [self._plain(rate) for rate in rates]
        local = Local(self.symbols, self.rates, self._plain)
        self.frames = Frames(mechanism.frame, self.tape, local)
        frames = [body.frame for body in mechanism.bodies if is_rigid(body)]
        self.links = Links(mechanism.origin, self.frames, frames)
        self.loaded = LinkBodies(mechanism, self.links)
        refuse_other_velocities(mechanism, self.links)
        self.cuts = self._cuts()
        if request.includes("reactions"):  # before the links are counted
            refuse_unknown_reactions(mechanism)
            for joint in mechanism.joints:
                self.links.motion(joint.child_point)
        shared = not every_speed_has_its_link(self.links.links, len(self.symbols.u))
        self.written = shared or least_written is not None
        self._refuse_written(least_written)

    def equations(self) -> Equations:
        mechanism, includes = self.mechanism, self.request.includes
        links = self.links.links
        planar = self._planar(links)
        outputs = [
            *(self._written() if self.written else self._tree_outputs(links, planar)),
            *self._kinematics(),
            *self._closures(planar),
            *(self._energies() if includes("energy") else ()),
            *(self._momenta() if includes("momenta") else ()),
            *(self._points() if includes("points") else ()),
            *(self._accelerations() if includes("accelerations") else ()),
            *(self._residual() if self.request.includes_jacobian and not self.written else ()),
            *(self._reactions() if includes("reactions") else ()),
            *self._scalars(),
        ]
        return Equations(
            symbols=self.symbols,
            outputs={o.name: o for o in outputs},
            parameter_defaults=tuple(
                self.to_symbols.default(p.default) for p in mechanism.parameters
            ),
            holonomic=len(self.cuts),
            nonholonomic=0,
            identity_kinematics=self._plain_kinematics(),
            states=len(mechanism.states),
            speed_names=tuple(printed_name(u) for u in mechanism.u),
            mass_scale=sum((b.mass for b in self.loaded.bodies), S.Zero),
            intermediates=tuple(self.tape.statements),
            tree=None
            if self.written
            else Tree(
                tuple(link.parent for link in links),
                tuple(tuple(link.columns) for link in links),
                planar,
                tuple((cut.point.link, cut.target.link) for cut in self.cuts),
            ),
        )

    def _plain_kinematics(self) -> bool:
        """Whether the speeds are the coordinates' rates, without states and auxiliary speeds."""
        mechanism = self.mechanism
        return tuple(mechanism.kinematics) == mechanism.u and not mechanism.states

    def _plain(self, expression: Expr) -> Expr:
        return self.to_symbols.expression(sympify(expression).xreplace(self.mechanism.rates))

    def _refuse_written(self, least: int | None) -> None:
        """Refuse to write out M and F where that is impossible or another way is shorter."""
        if self.written and self.cuts:
            raise NotATreeError("loops are closed, and M and F are to be written out")
        links = self.links.links
        if least and (
            self._planar(links) or max(len(self.links.path(k)) for k in range(len(links))) < least
        ):
            raise NotATreeError("few links in a row, or a plane: partial velocities are shorter")

    # -- the tree ---------------------------------------------------------------------------

    def _planar(self, links: Sequence[Link]) -> bool:
        """Whether every link turns about z and moves along x and y alone."""
        motions = [c for link in links for c in link.columns.values()]
        return all(vanishes((*angular[:2], linear[2])) for angular, linear in motions) and all(
            vanishes((*link.bias[0][:2], link.bias[1][2])) for link in links
        )

    def _written(self) -> list[Output]:
        """The outputs M and F in place of the tree's data, and the constraints on the speeds."""
        names = [printed_name(u) for u in self.mechanism.u]
        return [
            *equations_of_motion(self.loaded, self.symbols, names),
            Output("motion_constraints", "constraints on the speeds", (), (0,), ()),
        ]

    def _tree_outputs(self, links: Sequence[Link], planar: bool) -> list[Output]:
        numbers = range(len(links))
        columns = [c for link in links for c in link.columns.values()]
        wrenches = [self.loaded.wrench(k) for k in numbers]
        return [
            _data_output(
                "tree_offset",
                "from the reference point of the link before to that of each link",
                [link.offset[:2] if planar else link.offset for link in links],
            ),
            _data_output(
                "tree_subspace",
                "partial angular velocity and velocity against the link before, by each speed",
                [_motion(c, planar) for c in columns],
            ),
            _data_output(
                "tree_inertia",
                "mass, mass times arm, inertia about the reference point",
                [self._inertia(k, planar) for k in numbers],
            ),
            _data_output(
                "tree_bias",
                "acceleration against the link before that is free of u'",
                [_motion(link.bias, planar) for link in links],
            ),
            _data_output(
                "tree_wrench",
                "moment about the reference point and force, less inertia free of u'",
                [_motion(w, planar) for w in wrenches],
            ),
        ]

    def _inertia(self, link: int, planar: bool) -> list[Expr]:
        mass, moment, about = self.loaded.inertia(link)
        if planar:
            return [mass, *moment[:2], about[2][2]]
        return [mass, *moment, *(about[i][j] for i in range(3) for j in range(i + 1))]

    # -- constraints ------------------------------------------------------------------------

    def _cuts(self) -> list[_Cut]:
        cuts = []
        for closure in self.mechanism.closures:
            point, target = self.links.motion(closure.point), self.links.motion(closure.target)
            for label, vector in zip(closure.names, closure.axes, strict=True):
                axis = self.frames.along(vector)
                if not self.frames.local.constant(axis):
                    raise NotATreeError(f"an axis of {closure.name} turns")
                cuts.append(_Cut(label, point, target, axis))
        return cuts

    def _closures(self, planar: bool) -> list[Output]:
        labels = tuple(cut.label for cut in self.cuts)
        along = tuple(f"rate of {label}" for label in labels)
        count = (len(labels),)
        if self.cuts and not self._plain_kinematics():
            raise NotATreeError("loops are closed, and speeds are not the coordinates' rates")
        gamma = tuple(-value for value in self._across("bias"))
        return [
            Output(
                "constraints",
                "configuration constraints: the loop closes where these vanish",
                self._across("position"),
                count,
                labels,
            ),
            Output("velocity_constraints", "J u + b = 0", self._across("velocity"), count, along),
            Output("gamma", "J u' = gamma", gamma, count, along),
            *(self._cut_outputs(planar) if self.cuts else ()),
        ]

    def _across(self, what: str) -> tuple[Expr, ...]:
        """The distance of the two ends of each cut along its axis."""
        tape = self.tape
        gaps = [tape.difference(getattr(c.point, what), getattr(c.target, what)) for c in self.cuts]
        return tuple(tape.dot(gap, cut.axis) for gap, cut in zip(gaps, self.cuts, strict=True))

    def _cut_outputs(self, planar: bool) -> list[Output]:
        """Outputs from which the runtime forms the rows of J."""
        size = 2 if planar else 3
        references = [link.reference[:size] for link in self.links.links]
        rows = [
            (*c.point.position[:size], *c.target.position[:size], *c.axis[:size]) for c in self.cuts
        ]
        return [
            _data_output("tree_reference", "positions of the links' reference points", references),
            _data_output("tree_cut", "both ends of each cut, and the axis of its constraint", rows),
        ]

    # -- other outputs ----------------------------------------------------------------------

    def _kinematics(self) -> list[Output]:
        names = [printed_name(q) for q in (*self.mechanism.q, *self.mechanism.x)]
        labels = tuple(f"rate of {name}" for name in names)
        size = len(self.symbols.u)
        coordinates = len(self.mechanism.q)  # displacements do not change the states after them
        matrix = tuple(
            rate.diff(u) if k < coordinates else S.Zero
            for k, rate in enumerate(self.rates)
            for u in self.symbols.u
        )
        return [
            Output(
                "coordinate_rates",
                "kinematic differential equations: rates of the coordinates",
                tuple(self.rates),
                (len(names),),
                labels,
            ),
            Output(
                "kinematic_matrix",
                "N: derivative of the coordinates' rates by the speeds",
                matrix,
                (len(names), size),
                tuple(f"N[{r}, {c}]" for r in range(len(names)) for c in range(size)),
            ),
        ]

    def _energies(self) -> list[Output]:
        tape, mechanism = self.tape, self.mechanism
        kinetic = sum((self._kinetic(body) for body in self.loaded.bodies), S.Zero)
        equation = "T = sum of m v.v/2 + omega.I.omega/2"
        energies = [Output("kinetic_energy", equation, (tape.keep(kinetic),), (), ("T",))]
        if mechanism.unknown_potentials:
            return energies
        given = mechanism.potential
        if given is None:
            given = sum((sympify(b.potential_energy) for b in mechanism.bodies), S.Zero)
        potential = self._plain(given)
        for body in self.loaded.bodies:
            potential -= body.mass * dot(self.loaded.gravity, body.centre.position)
        equation = "V, of the loads that have one"
        return [
            *energies,
            Output("potential_energy", equation, (tape.keep(potential),), (), ("V",)),
        ]

    def _kinetic(self, body: Body) -> Expr:
        omega = self.links.frame_of(body.centre.link).omega
        spin = dot(omega, self.tape.transform(body.inertia, omega))
        speed = dot(body.centre.velocity, body.centre.velocity)
        return self.tape.keep(body.mass * speed / 2 + spin / 2)

    def _momenta(self) -> list[Output]:
        tape, linear, angular = self.tape, [], []
        for body in self.loaded.bodies:
            momentum = tape.scale(body.mass, body.centre.velocity)
            omega = self.links.frame_of(body.centre.link).omega
            own = tape.transform(body.inertia, omega)
            linear.append(momentum)
            angular.append(tape.total(tape.cross(body.centre.position, momentum), own))
        names = [body.name for body in self.loaded.bodies]
        return [
            _vectors("linear_momenta", "m v of each body", names, linear),
            _vectors(
                "angular_momenta",
                "r x m v + I . omega of each body, about the origin",
                names,
                angular,
            ),
        ]

    def _points(self) -> list[Output]:
        points = self.mechanism.points
        names = [point.name for point in points]
        motions = [self.links.motion(point) for point in points]
        positions = [m.position for m in motions]
        return [
            _vectors("points", "positions of the named points", names, positions),
            _vectors(
                "point_velocities",
                "velocities of the named points",
                names,
                [m.velocity for m in motions],
            ),
        ]

    def _residual(self) -> list[Output]:
        """The residual that Jacobians are derived from instead of M and F; it is not emitted."""
        elements = tuple(Residual(self.loaded, self.cuts, self.symbols).elements())
        labels = tuple(f"residual[{i}]" for i in range(len(elements)))
        equation = "M u' + J^T lambda - F and J u' - gamma"
        return [Output("residual", equation, elements, (len(elements),), labels)]

    def _accelerations(self) -> list[Output]:
        points, moving = self.mechanism.points, LinkAccelerations(self.links, self.symbols)
        found = [moving.of_point(self.links.motion(point)) for point in points]
        equation, names = "accelerations of the named points", [point.name for point in points]
        return [_vectors("point_accelerations", equation, names, found)]

    def _reactions(self) -> list[Output]:
        kinetics = TreeKinetics(self.mechanism, self.links, self.loaded, self.symbols)
        return reaction_outputs(self.mechanism, kinetics)

    def _scalars(self) -> list[Output]:
        equation = "of several assemblies the one where this is largest is taken"
        own = [
            Output(n, "user-defined output", (e,), (), (n,))
            for n, e in self.request.expressions.items()
        ]
        scalars = [self.to_symbols.motion_output(output) for output in own]
        if self.mechanism.preference is not None:
            value = self._plain(self.mechanism.preference)
            scalars.append(Output("preference", equation, (value,), (), ("preference",)))
        return scalars


def _motion(pair: tuple[V3, V3], planar: bool) -> list[Expr]:
    angular, linear = pair
    return [angular[2], *linear[:2]] if planar else [*angular, *linear]


def _data_output(name: str, equation: str, rows: Sequence[Iterable[Expr]]) -> Output:
    values = [tuple(row) for row in rows]
    width = len(values[0])
    labels = tuple(f"{name}[{i}, {j}]" for i in range(len(values)) for j in range(width))
    return Output(name, equation, tuple(v for r in values for v in r), (len(values), width), labels)


def _vectors(name: str, equation: str, of: list[str], vectors: Sequence[V3]) -> Output:
    labels = tuple(f"{what} along {axis}" for what in of for axis in AXES)
    return Output(name, equation, tuple(c for v in vectors for c in v), (len(of), 3), labels)
