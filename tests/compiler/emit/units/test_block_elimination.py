"""Rows eliminated block by block, against the exact solution of the same equations."""

import ctypes
import subprocess
from pathlib import Path

import mpmath
import numpy as np
import pytest
from mechc_codegen.emit.row_blocks import BlockForm, find_blocks
from mechc_codegen.emit.units.block_elimination import BlockElimination
from mechc_codegen.extension.flags import FLAGS, RUNTIME

from mechc.compilation import toolchain

COMPILER = toolchain.find_compiler() or ["cc"]
LANES = 4
pytestmark = pytest.mark.slow
# Of the rows those, the last, that constrain speeds alone.
OF_SPEEDS = {"bicycle": 4}
DRAWS = {"bicycle": 80}  # of which few are well conditioned
# Entries of each row of J, groups of speeds that M couples.
FORMS = {
    "Andrews": ([(0, 1, 2)] * 2 + [(0, 1, 3, 4)] * 2 + [(0, 1, 5, 6)] * 2,
                [(0, 1), (2,), (3, 4), (5, 6)]),
    "two four-bars on a carriage": ([(0, 1, 2)] * 2 + [(3, 4, 5)] * 2, [(0, 1, 2, 3, 4, 5, 6)]),
    "bicycle": ([(0, 2, 6), (1, 3, 4, 6), (3, 4), (2, 3, 4, 5, 6, 7), (0, 2, 3, 4, 5, 6, 7)],
                [(0, 1, 2, 3, 4, 5, 6, 7)]),
    "single rows": ([(0,), (0, 1, 2), (2, 3, 4), (1, 4, 5)], [(0, 1, 2, 3, 4, 5)]),
}  # fmt: skip
SIZES = """#define MECHC_NQ {nu}
#define MECHC_NU {nu}
#define MECHC_NH {nc}
#define MECHC_NC {nc}
#define MECHC_NP 0
#define MECHC_NK 0
#define MECHC_LINKS 0
#define MECHC_MULTIPLIERS 1
#define MECHC_ROW_BLOCKS {blocks}
#define MECHC_BLOCKS_KEPT {kept}
"""
PROGRAM = """#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_SCENE_PROGRAM_VECTOR : !defined MECHC_SCENE_PROGRAM_SCALAR
#if R_VECTOR
#define MECHC_SCENE_PROGRAM_VECTOR
#else
#define MECHC_SCENE_PROGRAM_SCALAR
#endif
#include "dynamics/sizes.h"
{text}
#endif
"""
SOLVE = """
{include}
#include "dynamics/loops/blocks.h"
static void {name}_solve(const {real} *terms, {real} *out)
{{
    static {prefix}_solver solver;
    const {real} *mass = terms + MECHC_NC * MECHC_NU, *forcing = mass + MECHC_NU * MECHC_NU;
    const {prefix}_motion_terms motion = {{mass, terms, forcing, forcing + MECHC_NU, R(MECHC_NC),
                                           R(1.0)}};
    {prefix}_prepare_rows(terms, mass, R(1.0), R(MECHC_NC), R(0.0), 0, &solver);
    {prefix}_solve_motion(&motion, &solver, out, out + MECHC_NU);
    {prefix}_least_step(terms, mass, &solver, motion.gamma, out + MECHC_NU + MECHC_NC);
    out[2 * MECHC_NU + MECHC_NC] =
        {prefix}_conditioning_squared(terms, mass, R(1.0), R(0.0), &solver);
    out[2 * MECHC_NU + MECHC_NC + 1] = R_SELECT(solver.clear, R(1.0), R(0.0));
    out[2 * MECHC_NU + MECHC_NC + 2] = R_SELECT(solver.apart, R(1.0), R(0.0));
}}
#include "simd/unbind.h"
"""
ENTRY = """
void alone(const double *terms, double *out) { scalar_solve(terms, out); }
void side_by_side(const double *terms, double *out)
{
    mechc_vector given[MECHC_NC * MECHC_NU + MECHC_NU * MECHC_NU + MECHC_NU + MECHC_NC];
    mechc_vector found[2 * MECHC_NU + MECHC_NC + 3];
    memcpy(given, terms, sizeof given);
    vector_solve(given, found);
    memcpy(out, found, sizeof found);
}
"""


class Solver:
    """The compiled elimination of one form."""

    def __init__(self, name: str, folder: Path) -> None:
        rows, coupled = FORMS[name]
        self.name = name
        self.rows, self.nu = rows, sum(map(len, coupled))
        mass = [set(next(g for g in coupled if k in g)) for k in range(self.nu)]
        entries = tuple(map(frozenset, rows))
        of_speeds = OF_SPEEDS.get(name, 0)
        blocks = find_blocks(entries, self.nu, of_speeds)
        assert blocks
        form = BlockForm(blocks, entries, tuple(map(frozenset, mass)), of_speeds)
        code = BlockElimination(form)
        sizes = SIZES.format(nu=self.nu, nc=len(rows), blocks=len(blocks), kept=code.kept)
        (folder / "scene_sizes.h").write_text(sizes)
        (folder / "scene_program.h").write_text(PROGRAM.replace("{text}", code.text()))
        parts = [
            SOLVE.format(
                name=n, prefix=f"mechc_{n}", real=real, include=f'#include "simd/bind_{n}.h"'
            )
            for n, real in (("scalar", "double"), ("vector", "mechc_vector"))
        ]
        source = "#include <math.h>\n#include <string.h>\n" + "".join(parts) + ENTRY
        (folder / "solve.c").write_text(source)
        command = [*COMPILER, *FLAGS, "-Wno-psabi", "-fvisibility=default", "-shared", "-fPIC",
                   f"-DMECHC_LANES={LANES}", f"-I{RUNTIME}", "-I."]  # fmt: skip
        subprocess.run([*command, "solve.c", "-lm", "-o", "solve.so"], cwd=folder, check=True)
        self.library = ctypes.CDLL(str(folder / "solve.so"))
        self.coupled, self.blocks, self.of_speeds = coupled, blocks, of_speeds

    def terms(self, rng: np.random.Generator, parallel: float) -> list[np.ndarray]:
        """J, M, F, gamma; in its speeds a block's last row is nearly a multiple of the first."""
        jacobian, mass = np.zeros((len(self.rows), self.nu)), np.zeros((self.nu, self.nu))
        for i, columns in enumerate(self.rows):
            jacobian[i, list(columns)] = rng.normal(size=len(columns))
        for block in self.blocks:
            own = np.ix_(block.rows[-1:], block.speeds)
            jacobian[own] *= parallel
            if len(block.rows) > 1:
                jacobian[own] += rng.normal() * jacobian[np.ix_(block.rows[:1], block.speeds)]
        for group in self.coupled:
            half = rng.normal(size=(len(group), len(group))) + 2 * np.eye(len(group))
            mass[np.ix_(group, group)] = half @ half.T * 10 ** rng.uniform(-1, 1)
        return [jacobian, mass, rng.normal(size=self.nu), rng.normal(size=len(self.rows))]

    def solved(self, function: str, terms: np.ndarray) -> np.ndarray:
        lanes = terms.shape[1:]
        out = np.zeros((2 * self.nu + len(self.rows) + 3, *lanes))
        self.library[function](*(np.ascontiguousarray(a).ctypes for a in (terms,)), out.ctypes)
        return out


@pytest.fixture(scope="module", params=FORMS)
def solver(request, tmp_path_factory):
    return Solver(request.param, tmp_path_factory.mktemp("blocks"))


def exact(jacobian, mass, forcing, gamma):
    """Accelerations and multipliers, 40 digits; with no force the least change."""
    nu, nc = len(mass), len(jacobian)
    with mpmath.workdps(40):
        whole = mpmath.matrix(nu + nc)
        whole[:nu, :nu] = mpmath.matrix(mass.tolist())
        whole[nu:, :nu] = mpmath.matrix(jacobian.tolist())
        whole[:nu, nu:] = whole[nu:, :nu].T
        found = []
        for force in (forcing, 0 * forcing):
            right = mpmath.matrix([*force.tolist(), *gamma.tolist()])
            found.append(np.array([float(x) for x in mpmath.lu_solve(whole, right)]))
        return found[0], found[1][:nu]


def conditioning(jacobian, mass):
    """Of J in the metric of M's diagonal, rows as they are."""
    values = np.linalg.svd(jacobian / np.sqrt(np.diag(mass)), compute_uv=False)
    return values[-1] / values[0]


@pytest.mark.parametrize("parallel", [1.0, 0.3, 1e-2, 1e-4])
def test_solutions_are_as_good_as_the_rows_allow(solver, parallel):
    """Errors beside the exact solution, in the metric of M, over what rounding of J does."""
    rng, nu, nc = np.random.default_rng(5), solver.nu, len(solver.rows)
    apart, draws = 0, DRAWS.get(solver.name, 10)
    for _ in range(draws):
        jacobian, mass, forcing, gamma = terms = solver.terms(rng, parallel)
        out = solver.solved("alone", np.concatenate([a.ravel() for a in terms]))
        motion, step = exact(*terms)
        root = np.linalg.cholesky(mass).T
        allowed = 400 * np.finfo(float).eps / conditioning(jacobian, mass)
        size = np.linalg.norm(root @ motion[:nu]) + np.linalg.norm(root @ step)
        size += np.linalg.norm(np.linalg.solve(root.T, forcing))
        assert np.linalg.norm(root @ (out[:nu] - motion[:nu])) <= allowed * size
        found = out[nu + nc : 2 * nu + nc]
        if out[-1]:  # other lanes take the least in the metric of M's diagonal
            assert np.linalg.norm(root @ (found - step)) <= allowed * size
        assert np.abs(jacobian @ found - gamma).max() <= allowed * (size + np.abs(found).max())
        forces = np.linalg.solve(root.T, jacobian.T @ (out[nu : nu + nc] - motion[nu:]))
        assert np.linalg.norm(forces) <= allowed * size * np.sqrt(np.linalg.cond(mass))
        apart += int(out[-1])
    assert apart > 1 if parallel == 1.0 else apart < draws


def test_lanes_are_solved_as_alone(solver):
    """Lanes that are eliminated block by block beside others that are not."""
    rng = np.random.default_rng(6)
    mixed = 0
    for _ in range(20):
        each = [
            np.concatenate([a.ravel() for a in solver.terms(rng, by)]) for by in (1, 1e-3, 0.3, 1)
        ]
        alone = np.array([solver.solved("alone", terms) for terms in each]).T
        together = solver.solved("side_by_side", np.array(each).T)
        assert together == pytest.approx(alone, rel=1e-9, abs=1e-9)
        assert (together[-1] == alone[-1]).all()
        mixed += 0 < alone[-1].sum() < LANES
    assert mixed > 5


def test_conditioning_is_the_distance_of_the_nearest_row(solver):
    """Of the row nearest to the span of the others, in the metric of M's diagonal."""
    rng = np.random.default_rng(7)
    for _ in range(40):
        jacobian, mass, *_ = terms = solver.terms(rng, 1.0)
        out = solver.solved("alone", np.concatenate([a.ravel() for a in terms]))
        if not out[-1]:
            continue
        rows = jacobian / np.sqrt(np.diag(mass))
        distances = 1 / np.sqrt(np.diag(np.linalg.inv(rows @ rows.T)))
        expected = distances.min() / np.linalg.norm(rows, axis=1).max()
        assert np.sqrt(out[-3]) == pytest.approx(expected, rel=0.07)  # the weights' rounding


def test_clear_of_critical_configurations(solver):
    """Nothing is clear where a row of coordinates is short beside the other one of its block, or a
    single one beside the others."""
    rng, clear = np.random.default_rng(8), 0
    configuration = range(len(solver.rows) - solver.of_speeds)
    for _ in range(200):
        jacobian, mass, *_ = terms = solver.terms(rng, 1.0)
        out = solver.solved("alone", np.concatenate([a.ravel() for a in terms]))
        assert out[-1] or not out[-2]
        clear += int(out[-2])
        lengths = np.linalg.norm(jacobian / np.sqrt(np.diag(mass)), axis=1)
        for block in solver.blocks:
            if not block.rows or block.rows[0] not in configuration:
                continue
            row, *second = block.rows
            others = second or [k for k in configuration if k != row]
            if not others:
                continue  # a row by itself is compared with what it is elsewhere, by the monitor
            near = jacobian.copy()
            near[row] *= 0.05 / lengths[row] * lengths[others].max()
            short = [near, *terms[1:]]
            assert not solver.solved("alone", np.concatenate([a.ravel() for a in short]))[-2]
    assert clear > 5
