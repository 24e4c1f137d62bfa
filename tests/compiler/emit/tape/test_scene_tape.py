"""Tapes from anybody: one that is changed is refused, or gives other numbers and no more."""

import os
import shlex
import struct
import subprocess
import sys

import numpy as np
import pytest
from mechc_codegen import build_scene, shipped_mechanism
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.emit.tape.scene_tape import whole_tape
from mechc_codegen.emit.units.general import kind_flags, unit_sources
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.extension.flags import GENERAL_FLAGS, GENERAL_INCLUDES
from mechc_codegen.library.catalogue import SHIPPED
from sympy import Symbol, tanh
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.closed_loops import bennett
from benchmarks.problems.window_row import window_row
from mechc.compilation import entries, toolchain
from tests.support import ROOT, scenes

LEG = ROOT / "examples" / "gallery" / "robots" / "leg.urdf"
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g1")
# Each changed tape is read from memory of exactly its size; its functions run on such arrays.
MAIN = r"""
#include <stdio.h>
static uint64_t drawn = 88172645463325252u;
static uint64_t draw(uint64_t below)
{
    drawn ^= drawn << 13, drawn ^= drawn >> 7, drawn ^= drawn << 17;
    return drawn % below;
}
const mechc_part mechc_general, mechc_series_00, mechc_series_01, mechc_series_10, mechc_series_11;

static double *numbers(ptrdiff_t count) /* of exactly that size, so that one more is seen */
{
    double *array = malloc((size_t)count * sizeof *array + !count);
    for (ptrdiff_t k = 0; k < count; k++) array[k] = 0.1 * (double)k - 0.3;
    return array;
}

static void run_as(int32_t tape, int function, int width)
{
    int sizes[MECHC_TAPE_MOST_ARRAYS];
    double *arrays[MECHC_TAPE_MOST_ARRAYS] = {0}, scalars[3] = {0.5, 0.25, 1.0};
    static mechc_scalar_given given;
    const mechc_series_counts *series = &mechc_series_of_scene;
    const int count = mechc_tape_arrays(&mechc_of_scene, series, function, width, sizes);
    double *turns = numbers(3 * mechc_of_scene.turns);
    for (int i = 0; i < count; i++) arrays[i] = numbers(sizes[i] & (MECHC_TAPE_WRITTEN - 1));
    mechc_scalar_run_tape(&mechc_of_tapes.code, tape, arrays, scalars, &given, turns, (int)draw(2));
    for (int i = 0; i < count; i++) free(arrays[i]);
    free(turns);
}

/* Derivatives over two steps by nodes and by stages, forwards and backwards. */
static void differentiate(const mechc_model *model, double *y, double *p)
{
    enum { STEPS = 2, ROWS = 9 };
    const mechc_unit *unit = model->derivatives->unit;
    const int width = model->coordinates + model->speeds;
    const int along = model->parameters + model->inputs;
    double t[] = {0.5, 0.51, 0.52};
    unsigned char methods[] = {MECHC_GAUSS8, MECHC_DOP853};
    double *states = numbers((STEPS + 1) * width), *ends = numbers((STEPS + 1) * width * width);
    double *dense = calloc((size_t)(STEPS * width * ROWS), sizeof *dense);
    double *directions = numbers(along * width), *gradient = numbers(along);
    double *covector = numbers(width);
    for (int i = 0; i <= STEPS; i++) memcpy(states + i * width, y, (size_t)width * sizeof *y);
    const mechc_trajectory record = {
        .count = STEPS + 1, .width = width, .dense_rows = ROWS, .t = t, .y = states, .dense = dense,
        .methods = methods};
    const mechc_variation forwards = {
        .trajectory = &record, .p = p, .last = STEPS, .columns = width, .project = 1,
        .directions = directions, .ends = ends};
    const mechc_covariation backwards = {
        .trajectory = &record, .p = p, .last = STEPS, .covector = covector, .columns = along,
        .gradient = gradient};
    unit->vary(&forwards);
    unit->covary(&backwards);
    free(states), free(ends), free(dense), free(directions), free(gradient), free(covector);
}

static void run_all(const mechc_model *model)
{
    static const unsigned char given[MECHC_NP_MAX];
    const mechc_unit *unit = model->select(NULL);
    const double t = 0.5;
    double *y = numbers(model->coordinates + model->speeds), *p = numbers(model->parameters);
    mechc_scalar_given *prepared = malloc(unit->given_size);
    for (int f = 0; f < MECHC_TAPE_OF_plain; f++) {
        if (mechc_tape_is_called(&mechc_of_scene, &mechc_series_of_scene, f))
            run_as(mechc_of_tapes.called[f], f, 0);
    }
    const mechc_counts *c = &mechc_of_scene;
    const int states = c->nq + c->nu, motion = c->nu + c->nc;
#define RUN(name, function, width, needed)                    \
    if (mechc_of_tapes.named[MECHC_TAPE_NAMED_##name] >= 0) \
        run_as(mechc_of_tapes.named[MECHC_TAPE_NAMED_##name], MECHC_TAPE_OF_##function, width);
    MECHC_TAPE_NAMED(RUN)
    model->complete(given, p);
    for (int i = 0; i < unit->output_count; i++) {
        if (strlen(unit->outputs[i].name) > 1000000) exit(5);
        double *out = numbers(unit->outputs[i].width);
        unit->outputs[i].evaluate(1, (mechc_rows){&t, 0}, (mechc_rows){y, 0}, (mechc_rows){p, 0},
                                  NULL, MECHC_NO_FORCES, out);
        free(out);
    }
    unit->give(p, NULL, (mechc_given *)prepared);
    double *mass = numbers(model->speeds * model->speeds);
    if (unit->mass) unit->mass(t, y, (mechc_given *)prepared, mass);
    if (model->derivatives && draw(5) == 0) differentiate(model, y, p);
    if (strlen(model->metadata) + strlen(model->texts) > 100000000) exit(5);
    free(mass), free(prepared), free(p), free(y);
}

int main(int argc, char **argv)
{
    const long count = argc > 1 ? atol(argv[1]) : 0;
    static unsigned char whole[1 << 22];
    const size_t size = fread(whole, 1, sizeof whole, stdin);
    long refused = 0, ran = 0;
    for (long n = 0; n <= count; n++) {
        size_t own = size;
        if (n && n % 5 == 0) own = (size_t)draw(size);
        unsigned char *bytes = malloc(own + 1);
        memcpy(bytes, whole, own);
        for (uint64_t k = n ? 1 + draw(3) : 0; k && own; k--) {
            const size_t at = 16 + (size_t)draw(own > 16 ? own - 16 : 1);
            if (at >= own) continue;
            if (draw(2)) bytes[at] ^= (unsigned char)(1u << draw(8));
            else if (at + 8 < own && draw(2)) memset(bytes + (at & ~7u), draw(2) ? 0xff : 0x7f, 8);
            else bytes[at] = (unsigned char)draw(256);
        }
        const char *why;
        const mechc_model *model = mechc_open_tape(bytes, own, &why);
        if (!model) refused++;
        else ran++, run_all(model);
        if (n == 0 && !model) return printf("%s\n", why), 6;
        free(bytes);
    }
    printf("%ld refused, %ld ran\n", refused, ran);
    return 0;
}
"""


q, f = dynamicsymbols("q"), Symbol("f")


@pytest.mark.parametrize(
    "expressions",
    [
        {f"x_{n}": n * q for n in range(140)},
        {"many": sum(tanh(n * q) for n in range(1, 840))},
    ],
)
def test_what_no_tape_holds_is_compiled(expressions):
    build = build_scene(
        scenes.bead_with(f * q), (BASELINE,), OutputRequest(expressions=expressions)
    )
    assert build.tape == b""
    assert build.kind == ""
    assert "scene_program.h" in build.texts


def test_a_name_that_reads_like_a_count_is_none():
    name = "#define MECHC_NQ 9"
    mechanism, expressions = scenes.bead_with(f * q), {"x": q}
    build = build_scene(
        mechanism, (BASELINE,), OutputRequest(expressions=expressions, names={"x": name})
    )
    assert name in build.texts["scene_sizes.h"]
    assert struct.pack("16i", 1, 1, 0, 0, 1, *[0] * 9, 1, 0) in build.tape  # the counts


TWICE = """
import hashlib
from mechc_codegen import build_scene
from tests.support import ROOT, scenes
print(hashlib.sha256(build_scene(scenes.swing(guided=True)).tape).hexdigest())
"""


@pytest.mark.slow
def test_a_scene_has_the_same_tape_in_every_process():
    found = {
        subprocess.run(
            [sys.executable, "-c", TWICE], cwd=ROOT, check=True, capture_output=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2", "3")
    }  # fmt: skip
    assert len(found) == 1


@pytest.mark.slow
def test_a_scene_with_more_rows_than_speeds_runs_by_its_tape():
    model = mechc.compile(bennett())
    assert model.system.scene.evaluator.serves_runs
    jacobian = model.output("constraint_jacobian", model.assemble())
    assert jacobian.shape[-2] > jacobian.shape[-1]
    assert np.isfinite(model.rhs(0.0, model.assemble())).all()


def test_whole_powers_are_products_whatever_their_type():
    """Compilers choose for ``pow(x, 2.0)``, each in its own way."""
    build = build_scene(scenes.bead_with(f * q**2.0 + q**-1.0 + q**-3.0), (BASELINE,))
    assert "pow" not in build.texts["scene_program.h"]


@pytest.mark.parametrize("unit", ["/tmp", "../" + "0" * 64 + ".general", "0" * 64, "\0", "é"])
def test_the_name_of_its_unit_leads_nowhere_else(tmp_path, unit):
    (tmp_path / "scene.so").write_bytes(whole_tape(b"", unit, "{}"))
    with pytest.raises(ImportError):
        entries.model_of(tmp_path / "scene.so")


def leg():
    return mechc.from_urdf(LEG, limits="ignore")


def harness(folder, mechanism):
    """A program that reads a tape from its input and changes it so many times; and the tape."""
    outputs = frozenset({"energy", "state_jacobian", "parameter_jacobian", "sensitivities"})
    build = build_scene(mechanism, (BASELINE,), OutputRequest(outputs))
    assert build.tape
    sources = unit_sources(build.kind, BASELINE.lanes, "baseline")
    (folder / "hostile.c").write_text(sources["tapes.c"] + MAIN, "utf-8")
    (folder / "derivatives.c").write_text(sources["derivatives.c"], "utf-8")
    command = [*toolchain.compiler(), *GENERAL_FLAGS, *SANITIZED, *kind_flags(build.kind)]
    command += [f"-I{folder}" for folder in GENERAL_INCLUDES]
    command += [str(folder / name) for name in ("hostile.c", "derivatives.c")]
    command += ["-lm", "-o", str(folder / "hostile")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode and "sanitize" in done.stderr:
        pytest.skip("no sanitizers here")
    assert done.returncode == 0, done.stderr
    return folder / "hostile", whole_tape(build.tape, "0" * 64 + ".general", "{}")


def hostile(folder, mechanism, count):
    program, tape = harness(folder, mechanism)
    done = subprocess.run(
        ["sh", "-c", f"ulimit -s 262144; {shlex.quote(str(program))} {count}"],
        input=tape, capture_output=True, check=False,
        env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()[:3000] + done.stdout.decode()
    refused, ran = (int(word.split()[0]) for word in done.stdout.decode().split(","))
    assert refused + ran == count + 1
    assert refused > count / 5
    assert ran > count / 20


@pytest.mark.parametrize(
    "described",
    [
        scenes.bead_over_tables,
        pytest.param(lambda: shipped_mechanism("four_bar"), marks=pytest.mark.slow(cases=4)),
        pytest.param(lambda: shipped_mechanism("heavy_top"), marks=pytest.mark.slow(cases=4)),
        pytest.param(lambda: scenes.swing(guided=True), marks=pytest.mark.slow(cases=4)),
        pytest.param(
            lambda: SHIPPED["planar_chain"].build(links=12), marks=pytest.mark.slow(cases=4)
        ),
        pytest.param(lambda: window_row(3), marks=pytest.mark.slow(cases=4)),
        pytest.param(leg, marks=pytest.mark.slow(cases=4)),
    ],
)
def test_a_changed_tape_stays_within_its_arrays(tmp_path, described):
    hostile(tmp_path, described(), 2000)


@pytest.mark.parametrize(
    "count",
    [
        pytest.param(20_000, marks=pytest.mark.slow),
        pytest.param(100_000, marks=pytest.mark.thorough),
    ],
)
def test_many_changed_tapes(tmp_path, count):
    hostile(tmp_path, shipped_mechanism("andrews"), count)
