"""Faults that are put into mechc one at a time, to see which tests find them.

Each is a file, a text that it has once, and what stands there instead: a sign, a bound off by one,
a missing term, a swapped index, a stale memory, a threshold that is another.
"""

from __future__ import annotations

from typing import NamedTuple

RUNTIME, CODEGEN, FACE = "codegen/mechc_codegen/runtime", "codegen/mechc_codegen", "src/mechc"


class Fault(NamedTuple):
    """A place, and what it says instead."""

    path: str
    says: str
    instead: str


FAULTS = [
    # -- derivation and emission
    Fault(
        f"{CODEGEN}/derive/kane.py",
        "dot(self.angular_velocity, self.spin) / 2",
        "dot(self.angular_velocity, self.spin)",
    ),
    Fault(
        f"{CODEGEN}/derive/kane.py",
        "dot(force_rate, linear[row]) + dot(moment_rate, angular[row])",
        "dot(force_rate, linear[row]) - dot(moment_rate, angular[row])",
    ),
    Fault(
        f"{CODEGEN}/derive/joint_reactions.py",
        "self._weighted_sum(turning, row + len(axes))",
        "self._weighted_sum(turning, row)",
    ),
    Fault(
        f"{CODEGEN}/derive/auxiliary_reactions.py",
        "_product(rows[k][k + 1 : size], found)",
        "_product(rows[k][k + 1 : size], found[1:])",
    ),
    Fault(
        f"{CODEGEN}/ir/sensitivity.py",
        "sum((rows[k * size + j] * a[j] for j in range(size)), -gamma[k])",
        "sum((rows[k * size + j] * a[j] for j in range(size)), gamma[k])",
    ),
    Fault(f"{CODEGEN}/ir/definitions.py", "e.diff(symbols.time) + S.Zero", "S.Zero"),
    Fault(
        f"{CODEGEN}/ir/switching.py",
        "(pi / 2 if isinstance(wave, sin) else 0)",
        "(pi / 2 if isinstance(wave, cos) else 0)",
    ),
    Fault(f"{CODEGEN}/ir/knots.py", "_shifted(left, width, m) - right[m]", "left[m] - right[m]"),
    Fault(
        f"{CODEGEN}/emit/printer.py",
        'return f"(1.0/R_SQRT({self.real(base)}))"',
        'return f"R_SQRT({self.real(base)})"',
    ),
    Fault(
        f"{CODEGEN}/emit/printer.py",
        'select(chosen.compared("!=", 0.0), one, other)',
        'select(chosen.compared("!=", 0.0), other, one)',
    ),
    Fault(
        f"{CODEGEN}/emit/tape/assembler.py",
        "return self._operation(_TURNED[type(sign)], [right, left])",
        "return self._operation(_TURNED[type(sign)], [left, right])",
    ),
    Fault(f"{CODEGEN}/emit/tape/assembler.py", "if last[value] == i:", "if last[value] >= i:"),
    # -- what runs
    Fault(
        f"{RUNTIME}/tape/run.h",
        "MECHC_TAPE_DO(FNMA, R_FNMA(r[o->a], r[o->b], r[o->c]))",
        "MECHC_TAPE_DO(FNMA, R_FMS(r[o->a], r[o->b], r[o->c]))",
    ),
    Fault(f"{RUNTIME}/simd/lookup.h", "if (x >= starts[middle])", "if (x > starts[middle])"),
    Fault(
        f"{RUNTIME}/simd/lookup.h",
        "for (int k = 0; k < order; k++) term *= n - k;\n        sum = n == degree",
        "for (int k = 0; k < order; k++) term *= n;\n        sum = n == degree",
    ),
    Fault(
        f"{RUNTIME}/tape/read.h",
        "case MECHC_TAPE_LOAD: return o->b < size;",
        "case MECHC_TAPE_LOAD: return o->b <= size;",
    ),
    Fault(
        f"{RUNTIME}/hybrid/driver.h",
        "hybrid->crossings += mechc_crossings_until(hybrid, cut);",
        "hybrid->crossings = mechc_crossings_until(hybrid, cut);",
    ),
    Fault(f"{RUNTIME}/hybrid/driver.h", "all->rejected += more->rejected;", ""),
    Fault(
        f"{RUNTIME}/hybrid/driver.h",
        "if (hybrid->keeps && hybrid->max_bytes <= 0.0) return MECHC_MEMORY_LIMIT;",
        "",
    ),
    Fault(f"{RUNTIME}/hybrid/events/resets.h", "return motion->sense * rate;", "return rate;"),
    Fault(f"{RUNTIME}/hybrid/events/resets.h", "        mechc_motion_renew(motion);\n", ""),
    Fault(
        f"{RUNTIME}/hybrid/events/resets.h",
        "double rate = slopes[0], terms",
        "double rate = 0.0, terms",
    ),
    Fault(
        f"{RUNTIME}/hybrid/events/resets.h",
        "return mechc_onto_constraints(motion, t, y, watch->room);",
        "return 1;",
    ),
    # -- contact
    Fault(
        f"{RUNTIME}/hybrid/contact/impulses.h",
        "b[i] = (1.0 + e[i]) * w[i];",
        "b[i] = (1.0 + e[0]) * w[i];",
    ),
    Fault(
        f"{RUNTIME}/hybrid/contact/impulses.h",
        "restored[i] = (1.0 + e[i]) * p[i];",
        "restored[i] = e[i] * p[i];",
    ),
    Fault(
        f"{RUNTIME}/hybrid/contact/impulses.h",
        "rate += 0.5 * a[i * n + k] * p[k];",
        "rate += a[i * n + k] * p[k];",
    ),
    Fault(
        f"{RUNTIME}/hybrid/contact/impulses.h",
        "pressing[next] ? 0 : vain[i] || i == next",
        "vain[i] || i == next",
    ),
    Fault(
        f"{RUNTIME}/hybrid/contact/decide.h",
        "slip[k] > 0.0 ? MECHC_SLIDES_ON : MECHC_SLIDES_BACK",
        "slip[k] < 0.0 ? MECHC_SLIDES_ON : MECHC_SLIDES_BACK",
    ),
    Fault(
        f"{RUNTIME}/hybrid/contact/decide.h",
        "demands->still[k] && way * answer->sliding[k] < -small",
        "0",
    ),
    Fault(
        f"{RUNTIME}/hybrid/contact/decide.h",
        "choices->contacts - 1; k >= 0; k--",
        "choices->contacts - 1; k > 0; k--",
    ),
    Fault(
        f"{RUNTIME}/hybrid/contact/decide.h",
        "fmax(change, fabs(answer->sliding[k]",
        "fmax(0.0 * change, fabs(answer->sliding[k]",
    ),
    # -- derivatives
    Fault(
        f"{RUNTIME}/variational/linearise.h",
        "R(i == MECHC_NU + k ? -1.0 : 0.0)",
        "R(i == MECHC_NU + k ? 1.0 : 0.0)",
    ),
    Fault(
        f"{RUNTIME}/variational/linearise.h",
        "MECHC_PUT_SLOPES(by_inputs, MECHC_NI, MECHC_NX + MECHC_NP);",
        "MECHC_PUT_SLOPES(by_inputs, MECHC_NI, MECHC_NX);",
    ),
    Fault(
        f"{RUNTIME}/variational/vary.h",
        "    memcpy(end, w->room, (size_t)(MECHC_NX * w->directions.width) * sizeof *end);\n",
        "",
    ),
    Fault(
        f"{FACE}/sensitivities/events.py",
        "by_state @ found + by_parameters @ columns.parameters",
        "by_state @ found",
    ),
    Fault(
        f"{FACE}/sensitivities/events.py",
        "changed - np.outer(system.rates(jump.after, values, t), later)",
        "changed",
    ),
    Fault(
        f"{FACE}/sensitivities/gradient.py",
        "    fall = before - after\n",
        "    fall = after - before\n",
    ),
    Fault(f"{FACE}/sensitivities/rules.py", "/ (4 * n + 2)", "/ (4 * n + 1)"),
    Fault(
        f"{FACE}/sensitivities/start.py",
        "bad = (size > 0) & (left > OPENS * size)",
        "bad = (size > 0) & (left > 1e12 * OPENS * size)",
    ),
    Fault(
        f"{FACE}/sensitivities/run.py",
        "start = _end(sol.record, number - 1, found[-1])",
        "start = _end(sol.record, number - 1, found[0])",
    ),
    # -- batches
    Fault(
        f"{RUNTIME}/batch/reductions.h",
        "if (!reducer->known[i] || probe->sign * value <",
        "if (probe->sign * value <",
    ),
    Fault(
        f"{RUNTIME}/batch/reductions.h",
        "mechc_reduce_beside(probe, i, f[n], f[n - 1], f[n - 2]);",
        "",
    ),
    Fault(
        f"{RUNTIME}/batch/reductions.h", "return value - probe->quantity->level;", "return value;"
    ),
    Fault(
        f"{FACE}/batch/results.py",
        "values = parameter_rows(self.system, self.recipe.cut(place, place + 1))[0]",
        "values = parameter_rows(self.system, self.recipe.cut(0, 1))[0]",
    ),
    Fault(f"{FACE}/batch/spec.py", "keep_states and len(t_eval) > 0", "len(t_eval) > 0"),
    Fault(
        f"{FACE}/batch/assemble.py",
        "dependent[i] = not 0 < rank_elsewhere(system, values[i], t) <= rank",
        "dependent[i] = False",
    ),
    # -- readers
    Fault(f"{CODEGEN}/robots/geometry.py", "2 * (x * y - w * z)", "2 * (x * y + w * z)"),
    Fault(
        f"{CODEGEN}/robots/geometry.py",
        "part.mass * (square * IDENTITY[i][j] - arm[i] * arm[j])",
        "part.mass * square * IDENTITY[i][j]",
    ),
    Fault(f"{CODEGEN}/robots/files/sdf_joints.py", "offset - multiplier * reference", "offset"),
    Fault(f"{CODEGEN}/robots/files/read_sdf.py", "min(minors) >= least * size", "True"),
    Fault(
        f"{CODEGEN}/robots/files/read_urdf.py", "if damping < 0 or friction < 0:", "if damping < 0:"
    ),
    Fault(
        f"{CODEGEN}/robots/mechanism.py",
        '-sympify(self.values.acting("damping", joint, f"{effort} s/{unit}")) * motion.rate',
        'sympify(self.values.acting("damping", joint, f"{effort} s/{unit}")) * motion.rate',
    ),
    Fault(f"{CODEGEN}/robots/bounds.py", 'joint.limits["lower"] < joint.limits["upper"]', "True"),
    Fault(
        f"{CODEGEN}/convert/classify_constraints.py",
        "slopes[k][i][j] - slopes[j][i][k]",
        "slopes[k][i][j] - slopes[i][j][k]",
    ),
    Fault(
        f"{CODEGEN}/convert/potential.py",
        "others = tuple(load for load in source.loads if load not in weights)",
        "others = tuple(source.loads)",
    ),
    # -- the face
    Fault(
        f"{FACE}/system/units.py",
        "Unit(PREFIXES[word[0]]).times(_named(word[1:]))",
        "_named(word[1:])",
    ),
    Fault(f"{FACE}/system/quantities.py", "[n - 1 for n in shape]", "[*shape]"),
    Fault(f"{FACE}/inputs/sampled.py", "changes = instants + sampled.delay", "changes = instants"),
    Fault(
        f"{FACE}/inputs/signals.py",
        "since, value = t - knots[piece], np.zeros(t.shape)",
        "since, value = t - knots[0], np.zeros(t.shape)",
    ),
    Fault(
        f"{FACE}/simulation/trajectory.py",
        "self.system.energy(y, p, t) - self.work_until(t)",
        "self.system.energy(y, p, t)",
    ),
    Fault(f"{FACE}/simulation/stepper.py", "        t = self.t + dt\n", "        t = dt\n"),
    Fault(
        f"{FACE}/simulation/events/contact_laws.py", "return diff(value, t) + sum(", "return sum("
    ),
    Fault(
        f"{FACE}/simulation/events/run_events.py",
        "if known is None or key[0] is None or known[0] != key:",
        "if known is None or key[0] is None:",
    ),
    Fault(f"{FACE}/fitting/losses.py", "-2 * z / (1 + z * z) ** 2", "2 * z / (1 + z * z) ** 2"),
    Fault(
        f"{FACE}/fitting/statistics.py", "float(slope.var()) / mean**2", "float(slope.var()) / mean"
    ),
    Fault(
        f"{FACE}/analysis/inverse_dynamics.py",
        "    return np.asarray(columns - carried)\n",
        "    return np.asarray(columns)\n",
    ),
    Fault(
        f"{FACE}/analysis/linearize.py",
        "rank = rows.shape[1] - len(offered)",
        "rank = len(offered)",
    ),
    Fault(
        f"{FACE}/assembly/positions.py",
        "(np.square(parts).sum(axis=2) - 1.0) / 2.0",
        "np.square(parts).sum(axis=2) - 1.0",
    ),
    Fault(
        f"{FACE}/compilation/build.py",
        "compiler_signature(digest, *environment(), files)",
        "compiler_signature(digest, *environment())",
    ),
]
