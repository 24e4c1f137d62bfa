"""The equations of a tree of links with cut joints.

Input: a mechanism whose frames and points form a tree.  Output: equations with the tree's data in
place of mass matrix and forcing.  Invariant: the number of statements grows with the links, that of
the Jacobian's entries with the paths that the cuts join.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sympy import Expr, S, sympify
from sympy.physics.mechanics import Point
from sympy.physics.vector import Vector

from mechc_codegen.derive import outputs
from mechc_codegen.derive.equations import Equations, Output, Symbols, Tree
from mechc_codegen.derive.joint_reactions import reaction_outputs, refuse_unknown_reactions
from mechc_codegen.derive.state_symbols import StateSymbols, state_symbols
from mechc_codegen.derive.tree.bodies import LinkBodies
from mechc_codegen.derive.tree.cuts import AT_REST, cut_rows
from mechc_codegen.derive.tree.frames import Frames, Local, NotATreeError
from mechc_codegen.derive.tree.gradients import gradients
from mechc_codegen.derive.tree.links import Link, LinkAccelerations, Links, moving_columns
from mechc_codegen.derive.tree.mass_matrix import composite_equations
from mechc_codegen.derive.tree.residual import Residual
from mechc_codegen.derive.tree.tape import V3, Tape, vanishes
from mechc_codegen.derive.tree.velocities import SAME, SAMPLES, at_random, refuse_other_velocities
from mechc_codegen.derive.tree.written_rows import Row, WrittenRow, written_rows
from mechc_codegen.description.joints.tree import Body
from mechc_codegen.description.mechanism import Mechanism, is_rigid, printed_name
from mechc_codegen.description.placement import dot
from mechc_codegen.description.request import DEFAULT_REQUEST, OutputRequest

# Speeds, of which some move several links: M and F of fewer run faster written out: docs/growth.md
LEAST_SHARED = 24


def derive_tree(
    mechanism: Mechanism,
    request: OutputRequest = DEFAULT_REQUEST,
    *,
    written: bool = False,
    in_a_row: int = 0,
) -> Equations:
    """Derive the equations link by link.

    M and F are written out, over statements that the links share, in place of the tree's data where
    a speed moves no link, or one moves several and there are few; and where this is asked for by
    ``written``.  ``in_a_row``: the least number of links in a row, in space, for which that is
    done, and in a plane for which constraints that are written out are walked.

    Raises
    ------
    NotATreeError
        Where the mechanism cannot be described as a tree of links; the message says why.
    """
    _refuse_others(mechanism)
    return _TreeDerivation(mechanism, request, written, in_a_row).equations()


def _refuse_others(mechanism: Mechanism) -> None:
    reasons = {
        "it is described by a Lagrangian": mechanism.lagrangian is not None,
        "its equations are given": mechanism.equations is not None,
        "speeds are auxiliary": bool(mechanism.auxiliary),
    }
    for reason, given in reasons.items():
        if given:
            raise NotATreeError(reason)


class _TreeDerivation:
    def __init__(
        self, mechanism: Mechanism, request: OutputRequest, written: bool, in_a_row: int
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
        held, free = mechanism.configuration_constraints, mechanism.motion_constraints
        self.cuts: list[Row] = [
            *written_rows(held, self.links, False, self._plain),
            *cut_rows(mechanism, self.links, self._plain),
        ]
        self.moving_rows: list[Row] = [*written_rows(free, self.links, True, self._plain)]
        self.rows = [*self.cuts, *self.moving_rows]
        self._refuse_states()
        if request.includes("reactions"):  # before the links are counted
            refuse_unknown_reactions(mechanism)
            for joint in mechanism.joints:
                self.links.motion(joint.child_point)
        self._refuse_idle()
        moving = [speed for link in self.links.links for speed in moving_columns(link)]
        shared, speeds = len(moving) > len({*moving}), len(self.symbols.u)
        in_space = bool(self.rows) and not self._planar(self.links.links)
        self.written = len({*moving}) < speeds
        self.written |= written and not in_space
        self.written |= shared and not self.rows and speeds < LEAST_SHARED
        self._refuse_few(in_a_row if written or self._rows_are_written else 0)

    def equations(self) -> Equations:
        mechanism, includes = self.mechanism, self.request.includes
        links = self.links.links
        planar = self._planar(links)
        kinetics = TreeKinetics(mechanism, self.links, self.loaded, self.symbols)
        if self.written:
            motion = composite_equations(self.loaded, self.symbols)
            motion.append(outputs.array("motion_constraints", "constraints on the speeds", (), ()))
        else:
            motion = self._tree_outputs(links, planar)
        derived = [
            *motion,
            *self._kinematics(),
            *self._closures(planar),
            *(self._energies() if includes("energy") else ()),
            *(self._momenta() if includes("momenta") else ()),
            *(self._points() if includes("points") else ()),
            *(self._accelerations() if includes("accelerations") else ()),
            *(self._residual() if self.request.includes_jacobian and not self.written else ()),
            *(reaction_outputs(mechanism, kinetics) if includes("reactions") else ()),
            *self._scalars(),
        ]
        return Equations(
            symbols=self.symbols,
            outputs={o.name: o for o in derived},
            parameter_defaults=self.to_symbols.defaults(mechanism),
            holonomic=len(self.cuts),
            nonholonomic=len(self.moving_rows),
            identity_kinematics=mechanism.has_identity_kinematics,
            states=len(mechanism.states),
            speed_names=tuple(printed_name(u) for u in mechanism.u),
            mass_scale=sum((b.mass for b in self.loaded.bodies), S.Zero),
            intermediates=tuple(self.tape.statements),
            tree=None
            if self.written
            else Tree(
                tuple(link.parent for link in links),
                tuple(tuple(moving_columns(link)) for link in links),
                planar,
                tuple(
                    tuple((one, other) for (one, _), (other, _) in (p.ends for p in row.pairs))
                    for row in self.rows
                ),
                self._moments,
                self._several_loops,
            ),
        )

    def _plain(self, expression: Expr) -> Expr:
        return self.to_symbols.expression(sympify(expression).xreplace(self.mechanism.rates))

    @property
    def _several_loops(self) -> bool:
        written = (row for row in self.cuts if isinstance(row, WrittenRow))
        return len(self.mechanism.closures) + sum(len(row.partials) > 1 for row in written) > 1

    @property
    def _rows_are_written(self) -> bool:
        return any(isinstance(row, WrittenRow) for row in self.rows)

    def _refuse_few(self, in_a_row: int) -> None:
        """Refuse to write out M and F where that is impossible, and both that and rows that are
        written out where another way is shorter."""
        if self.written and self.rows:
            raise NotATreeError("speeds are constrained, and M and F are to be written out")
        links = self.links.links
        few = max((len(self.links.path(k)) for k in range(len(links))), default=0) < in_a_row
        planar = in_a_row > 0 and self._planar(links)
        if (self.written and (few or planar)) or (planar and few):
            raise NotATreeError("few links in a row, or a plane: partial velocities are shorter")

    def _refuse_states(self) -> None:
        """Refuse states in configuration constraints: no speed moves them."""
        states = {*self.symbols.q[len(self.mechanism.q) :]}
        for row in self.cuts:
            if isinstance(row, WrittenRow) and row.expression.free_symbols & states:
                raise NotATreeError(f"{row.label} contains a state")

    def _refuse_idle(self) -> None:
        """Refuse rows that no speed changes, and speeds that move no body, where there are rows:
        they are told from rounding where the equations are written out."""
        if not self.rows:
            return
        rates = [row.rate(self.tape) for row in self.rows]
        found = (at_random(self.tape, rates, seed) for seed in range(SAMPLES))
        if any(max(map(abs, each)) < SAME for each in zip(*found, strict=True)):
            raise NotATreeError("no speed changes some row")
        carrying = {k for body in self.loaded.bodies for k in self.links.path(body.centre.link)}
        moved = (k for k, link in enumerate(self.links.links) if moving_columns(link))
        if not carrying.issuperset(moved):
            raise NotATreeError("a speed moves no body")

    # -- the tree ---------------------------------------------------------------------------

    def _planar(self, links: Sequence[Link]) -> bool:
        """Whether every link turns about z and moves along x and y alone."""
        motions = [c for link in links for c in link.columns.values()]
        return all(vanishes((*angular[:2], linear[2])) for angular, linear in motions) and all(
            vanishes((*link.bias[0][:2], link.bias[1][2])) for link in links
        )

    def _tree_outputs(self, links: Sequence[Link], planar: bool) -> list[Output]:
        numbers = range(len(links))
        columns = [c for link in links for c in moving_columns(link).values()]
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

    def _closures(self, planar: bool) -> list[Output]:
        tape, labels = self.tape, tuple(cut.label for cut in self.cuts)
        along = (*(f"rate of {label}" for label in labels), *(r.label for r in self.moving_rows))
        gamma = tuple(-row.second_rate(tape, AT_REST) for row in self.rows)
        values = [cut.value(tape) for cut in self.cuts]
        bias = tuple(row.rate_at_rest(tape) for row in self.rows)
        found = [
            outputs.constraints(values, labels),
            *outputs.rates_of_constraints([row.rate(tape) for row in self.rows], gamma, along),
            *(self._row_outputs(planar) if self.rows else ()),
            *([] if vanishes(bias) else [outputs.velocity_bias(bias, along)]),
        ]
        if self.cuts and not self.mechanism.has_identity_kinematics:
            rows = gradients(tape, values, self.symbols.q)
            found.append(outputs.constraint_gradient(rows, labels))
        return found

    def _row_outputs(self, planar: bool) -> list[Output]:
        """Outputs from which the runtime forms the rows of J."""
        size = 2 if planar else 3
        references = [link.reference[:size] for link in self.links.links]
        pairs = [pair for row in self.rows for pair in row.pairs]
        rows = [(*p.ends[0][1][:size], *p.ends[1][1][:size], *p.force[:size]) for p in pairs]
        if self._moments:
            moments = (p.moment[2:] if planar else p.moment for p in pairs)
            rows = [(*row, *moment) for row, moment in zip(rows, moments, strict=True)]
        return [
            _data_output("tree_reference", "positions of the links' reference points", references),
            _data_output("tree_cut", "both ends of each cut, and the force along its row", rows),
        ]

    @property
    def _moments(self) -> bool:
        return not all(vanishes(pair.moment) for row in self.rows for pair in row.pairs)

    # -- other outputs ----------------------------------------------------------------------

    def _kinematics(self) -> list[Output]:
        return [
            outputs.coordinate_rates(self.mechanism, self.rates),
            outputs.kinematic_matrix(self.rates, self.symbols.u, len(self.mechanism.q)),
        ]

    def _energies(self) -> list[Output]:
        tape, mechanism = self.tape, self.mechanism
        kinetic = S.Zero
        for body in self.loaded.bodies:
            omega, v = self.links.frame_of(body.centre.link).omega, body.centre.velocity
            spin = dot(omega, tape.transform(body.inertia, omega))
            kinetic += tape.keep(body.mass * dot(v, v) / 2 + spin / 2)
        kinetic = tape.keep(kinetic)
        if mechanism.unknown_potentials:
            return outputs.energies(mechanism, kinetic, S.Zero)
        given = mechanism.potential
        if given is None:
            given = sum((sympify(b.potential_energy) for b in mechanism.bodies), S.Zero)
        potential = self._plain(given)
        for body in self.loaded.bodies:
            potential -= body.mass * dot(self.loaded.gravity, body.centre.position)
        return outputs.energies(mechanism, kinetic, tape.keep(potential))

    def _momenta(self) -> list[Output]:
        tape, linear, angular = self.tape, [], []
        for body in self.loaded.bodies:
            momentum = tape.scale(body.mass, body.centre.velocity)
            omega = self.links.frame_of(body.centre.link).omega
            own = tape.transform(body.inertia, omega)
            linear.append(momentum)
            angular.append(tape.total(tape.cross(body.centre.position, momentum), own))
        return outputs.momenta(self.mechanism, linear, angular)

    def _points(self) -> list[Output]:
        motions = [self.links.motion(point) for point in self.mechanism.points]
        return outputs.points(
            self.mechanism, (m.position for m in motions), (m.velocity for m in motions)
        )

    def _residual(self) -> list[Output]:
        """The residual that Jacobians are derived from instead of M and F; it is not emitted."""
        elements = tuple(Residual(self.loaded, self.rows, self.symbols).elements())
        labels = (f"residual[{i}]" for i in range(len(elements)))
        equation = "M u' + J^T lambda - F and J u' - gamma"
        return [outputs.array("residual", equation, elements, labels)]

    def _accelerations(self) -> list[Output]:
        moving = LinkAccelerations(self.links, self.symbols)
        found = [moving.of_point(self.links.motion(p)) for p in self.mechanism.points]
        return [outputs.point_accelerations(self.mechanism, found)]

    def _scalars(self) -> list[Output]:
        own = outputs.user_outputs(self.request, {})
        scalars = [self.to_symbols.motion_output(output) for output in own]
        axes = self.mechanism.aligned_axes
        if axes:
            found = [self.tape.dot(*map(self.frames.along, pair)) for _, *pair in axes]
            scalars.append(outputs.cut_directions(self.mechanism, found))
        if self.mechanism.preference is not None:
            scalars.append(outputs.preference(self._plain(self.mechanism.preference)))
        return scalars


def _motion(pair: tuple[V3, V3], planar: bool) -> list[Expr]:
    angular, linear = pair
    return [angular[2], *linear[:2]] if planar else [*angular, *linear]


def _data_output(name: str, equation: str, rows: Sequence[Iterable[Expr]]) -> Output:
    values = [tuple(row) for row in rows]
    width = len(values[0])
    labels = tuple(f"{name}[{i}, {j}]" for i in range(len(values)) for j in range(width))
    return Output(name, equation, tuple(v for r in values for v in r), (len(values), width), labels)


class TreeKinetics:
    """Positions and momentum rates for joint reactions, link by link, as values on the tape."""

    def __init__(
        self, mechanism: Mechanism, links: Links, loaded: LinkBodies, symbols: Symbols
    ) -> None:
        self.mechanism, self.links, self.symbols = mechanism, links, symbols
        self.bodies = dict(zip(mechanism.bodies, loaded.bodies, strict=True))
        self.moving = LinkAccelerations(links, symbols)
        tape = links.tape
        self.total, self.difference = tape.total, tape.difference
        self.cross, self.scale = tape.cross, tape.scale

    def along(self, vector: Vector) -> V3:
        return self.links.frames.along(vector.xreplace(self.mechanism.rates))

    def position(self, point: Point) -> V3:
        return self.links.motion(point).position

    def multiplier(self, row: int) -> Expr:
        return self.symbols.multipliers[row]

    def momentum_rates(self, body: Body) -> tuple[V3, V3]:
        tape, on = self.links.tape, self.bodies[body]
        omega = self.links.frame_of(on.centre.link).omega
        momentum = tape.transform(on.inertia, omega)
        turning = tape.transform(on.inertia, self.moving.of_frame(on.centre.link))
        linear = tape.scale(on.mass, self.moving.of_point(on.centre))
        return linear, tape.total(turning, tape.cross(omega, momentum))
