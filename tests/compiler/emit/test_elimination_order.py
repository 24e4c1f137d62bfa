"""The order in which rows of cuts are eliminated, and rows that are eliminated otherwise."""

import ctypes
import subprocess
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from mechc_codegen import build_scene
from mechc_codegen.derive.equations import Tree
from mechc_codegen.emit.elimination_order import plan_rows, walks_moving_cuts
from mechc_codegen.emit.units.instruction_sets import BASELINE, WIDER, with_fitting_lanes
from mechc_codegen.extension.flags import FLAGS, RUNTIME

from benchmarks.costs.growth import ring
from mechc.compilation import toolchain

CHAIN = tuple(range(-1, 9))
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


def chain(links, *cuts, planar=True):
    rows = tuple((ends,) for ends in cuts)
    return Tree(CHAIN[:links], tuple((k,) for k in range(links)), planar, rows)


def test_every_row_has_one_pivot():
    """Two loops on a chain of seven: four rows, the last of each loop's links first."""
    tree = chain(7, (2, -1), (2, -1), (6, -1), (6, -1))
    plan = plan_rows(tree)
    pivots = [k for k, place in enumerate(plan.pivot) if place >= 0]
    assert len(pivots) == 4
    assert pivots == [1, 2, 5, 6]


def test_rows_are_passed_to_places_of_their_own():
    tree = chain(5, (4, -1), (4, -1), (1, -1))
    plan = plan_rows(tree)
    assert plan.first == (0, 0, 1, 1, 2, 4)
    ends = set(plan.cut_place)
    assert len(ends) == 3
    for link, parent in enumerate(tree.parents):
        if parent >= 0 and plan.first[link + 1] - plan.first[link] > 1:
            assert plan.first[parent] <= plan.passed_to[link] < plan.first[parent + 1]


def test_factors_are_kept_for_each_row_that_waits():
    plan = plan_rows(chain(6, (5, -1), (5, -1)))
    widths = [b - a for a, b in zip(plan.first_factor, plan.first_factor[1:], strict=False)]
    assert widths == [0, 0, 0, 0, 0, 1]


@pytest.mark.parametrize("cuts", [
    [(6, 2), (6, 2)],  # between two links that move
    [(1, -1), (1, -1), (1, -1), (1, -1)],  # more rows than speeds
    [],
])  # fmt: skip
def test_other_trees_are_left_to_the_dense_solution(cuts):
    assert plan_rows(chain(7, *cuts)) is None


def test_a_link_of_several_speeds_eliminates_as_many_rows():
    tree = Tree((-1, 0), ((0,), (1, 2, 3)), False, (((1, -1),),) * 3)
    plan = plan_rows(tree)
    assert plan.pivot == (-1, 2, 1, 0)
    assert plan.first == (0, 0, 3)


@pytest.mark.parametrize(("speeds", "rows", "lanes"), [
    (11, 10, 8), (81, 80, 8), (161, 160, 2), (161, 0, 8), (400, 2, 2),
])  # fmt: skip
def test_scenes_of_very_many_speeds_have_fewer_lanes(speeds, rows, lanes):
    """Rows that are solved together need factors of all lanes on the stack."""
    symbols = SimpleNamespace(u=(None,) * speeds)
    equations = SimpleNamespace(holonomic=rows, nonholonomic=0, symbols=symbols)
    assert with_fitting_lanes(WIDER[-1], equations).lanes == lanes


def test_long_rings_are_walked_and_short_ones_are_not():
    ring_of_12, ring_of_40 = (
        Tree(tuple(range(-1, n - 1)), tuple((k,) for k in range(n)), True, (((n - 1, 0),),) * 2)
        for n in (12, 40)
    )
    assert not walks_moving_cuts(ring_of_12)
    assert walks_moving_cuts(ring_of_40)


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


@pytest.mark.slow  # exact solutions with 40 digits
@pytest.mark.parametrize(("bent", "walked"), [(1.0, 1), (0.3, 1), (1e-3, 0), (1e-6, 0)])
def test_solutions_are_as_good_as_the_rows_allow(solved, bent, walked):
    """Rows between two moving links; in line, where a chain is bent less, they are one."""
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
