"""Rows of a cut between two moving links, by articulated bodies, against the exact solution."""

import ctypes
import subprocess

import mpmath
import numpy as np
import pytest
from mechc_codegen import build_scene
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.extension.flags import FLAGS, RUNTIME

from benchmarks.costs.growth import ring
from mechc.compilation import toolchain

pytestmark = pytest.mark.slow  # exact solutions with 40 digits
LINKS, ROWS = 24, 2
SOURCE = """
#define MECHC_LANES 2
#include "simd/bind_scalar.h"
#include "dynamics/stage.h"
void solved(const double *q, const double *p, double *wrench, const double *values, double *x,
            double *step, double *mass, double *jacobian, double *forcing, double *apart)
{
    static mechc_scalar_given given;
    static mechc_scalar_place place;
    static mechc_scalar_solver solver;
    double copy[MECHC_LINKS * MECHC_DIM];
    memcpy(copy, wrench, sizeof copy);
    mechc_give(p, 0, &given);
    mechc_scalar_locate_all(0.0, q, &given, &place);
    memcpy(mass, place.mass, sizeof place.mass);
    memcpy(jacobian, place.jacobian, sizeof place.jacobian);
    mechc_scalar_along_speeds(place.saved, copy, forcing);
    mechc_scalar_prepare_rows(place.saved, place.jacobian, place.mass, MECHC_NC, &solver);
    mechc_scalar_solve_motion(place.saved, &solver, wrench, values, x, 0);
    mechc_scalar_least_step(place.saved, &solver, values, step);
    *apart = solver.apart ? 1.0 : 0.0;
}
"""


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ring")
    texts = build_scene(ring(LINKS), (BASELINE,)).texts
    assert "#define MECHC_MOVING_CUTS 1" in texts["scene_sizes.h"]
    for name in ("scene_sizes.h", "scene_program.h"):
        (folder / name).write_text(texts[name])
    (folder / "solve.c").write_text(SOURCE)
    compiler = toolchain.find_compiler() or ["cc"]
    command = [*compiler, *FLAGS, "-fvisibility=default", "-shared", "-fPIC", f"-I{RUNTIME}", "-I."]
    subprocess.run([*command, "solve.c", "-lm", "-o", "solve.so"], cwd=folder, check=True)
    function = ctypes.CDLL(str(folder / "solve.so")).solved

    def solve(q, wrench, values):
        sizes = (LINKS, LINKS, LINKS * LINKS, ROWS * LINKS, LINKS, 1)
        out = [np.zeros(size) for size in sizes]
        given = [q, np.array([1.0, 1.0, 9.81]), wrench.copy(), values]
        function(*(ctypes.c_void_p(a.ctypes.data) for a in (*given, *out)))
        return out

    return solve


@pytest.mark.parametrize(("bent", "walked"), [(1.0, 1), (0.3, 1), (1e-3, 0), (1e-6, 0)])
def test_solutions_are_as_good_as_the_rows_allow(solved, bent, walked):
    """A chain that is bent less and less: in line its two rows are one."""
    rng = np.random.default_rng(3)
    for _ in range(3):
        q = bent * rng.normal(size=LINKS)
        wrench, values = rng.normal(size=3 * LINKS), rng.normal(size=ROWS)
        x, step, mass, rows, forcing, apart = solved(q, wrench, values)
        assert apart == walked
        mass, rows = mass.reshape(LINKS, LINKS), rows.reshape(ROWS, LINKS)
        with mpmath.workdps(40):
            whole = mpmath.matrix(LINKS + ROWS)
            whole[:LINKS, :LINKS] = mpmath.matrix(mass.tolist())
            whole[LINKS:, :LINKS] = mpmath.matrix(rows.tolist())
            whole[:LINKS, LINKS:] = whole[LINKS:, :LINKS].T
            exact = [
                np.array([float(v) for v in mpmath.lu_solve(whole, mpmath.matrix([*f, *values]))])[
                    :LINKS
                ]
                for f in (forcing, 0 * forcing)
            ]
        root = np.linalg.cholesky(mass).T
        lengths = np.linalg.svd(np.linalg.solve(root.T, rows.T), compute_uv=False)
        # J and M are rounded themselves: what follows from them by as much times cond(M)^(1/2)
        given = np.finfo(float).eps * np.sqrt(np.linalg.cond(mass))
        allowed = 20 * given * lengths[0] / lengths[-1]
        size = sum(np.linalg.norm(root @ each) for each in exact)
        size += np.linalg.norm(np.linalg.solve(root.T, forcing))
        for found, expected in zip((x, step), exact, strict=True):
            assert np.linalg.norm(root @ (found - expected)) <= allowed * size
