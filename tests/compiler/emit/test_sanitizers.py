"""The same generated C under the address and undefined-behaviour sanitizers: no access out of
bounds, no undefined operation, and the values that the installed model gives."""

from __future__ import annotations

import math
import os
import subprocess
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from mechc_codegen import Build, build_scene
from mechc_codegen.emit.units.instruction_sets import InstructionSet, instruction_sets
from mechc_codegen.extension.flags import FLAGS, RUNTIME, STRICT

import mechc
from mechc.compilation import toolchain
from mechc.simulation.settings import METHODS
from tests.support import LOCKSTEP, by, scenes
from tests.support.exact_values import Array, Reference, printed

SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-O0", "-g1")
STATES, BROKEN = 203, 4  # no multiple of any number of lanes
SECONDS = 2.0  # past the first change point

# Of single runs, without series of the program, which a scene has only where they are asked for.
WHOLE_UNIT = ("dopri5", "dop853", "radau5", "gauss8", LOCKSTEP)  # that of scenes with loops
NAMES = [name.replace(LOCKSTEP, "gauss8_lockstep") for name in WHOLE_UNIT]  # of their code
METHOD_NUMBERS = "-DMETHOD_NUMBERS=" + ",".join(str(METHODS[name]) for name in NAMES)

MAIN = r"""
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "scene_sizes.h"
#include "abi/model.h"
#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#endif

extern const mechc_model mechc_scene;

#define NX (MECHC_NQ + MECHC_NU)

static double *heap(ptrdiff_t doubles) /* of exactly that size, so that one more is seen */
{
    double *array = malloc((size_t)doubles * sizeof(double) + !doubles);
    if (!array) exit(3);
    return array;
}

static double *read_doubles(ptrdiff_t count)
{
    double *array = heap(count);
    if (fread(array, sizeof(double), (size_t)count, stdin) != (size_t)count) exit(4);
    return array;
}

static void say(const char *what, const double *values, ptrdiff_t count)
{
    printf("%s", what);
    for (ptrdiff_t i = 0; i < count; i++) printf(" %a", values[i]);
    printf("\n");
}

static mechc_rows rows(const double *data, ptrdiff_t stride)
{
    mechc_rows all = {data, stride};
    return all;
}

static void outputs(const mechc_unit *unit, ptrdiff_t n, const double *t, const double *y,
                    const double *p)
{
    for (int i = 0; i < unit->output_count; i++) {
        const mechc_output *output = &unit->outputs[i];
        const mechc_rows one_time = rows(t, 0), one_set = rows(p, 0);
        double *out = heap(n * output->width);
        output->evaluate(n, rows(t, 1), rows(y, NX), rows(p, MECHC_NP), NULL, MECHC_NO_FORCES,
                         out);
        printf("%s", output->name);
        say("", out, n * output->width);
        free(out);
        for (ptrdiff_t few = 0; few <= unit->lanes + 1; few++) { /* blocks that are not full */
            double *some = heap(few * output->width);
            output->evaluate(few, one_time, rows(y, NX), one_set, NULL, MECHC_NO_FORCES, some);
            free(some);
        }
    }
}

static void scalar_rates(const mechc_unit *unit, ptrdiff_t n, const double *t, const double *y,
                         const double *p)
{
    mechc_given *given = malloc(unit->given_size);
    double *out = heap(n * NX);
    for (ptrdiff_t i = 0; i < n; i++) {
        double *state = heap(NX);
        memcpy(state, y + i * NX, NX * sizeof(double));
        unit->give(p + i * MECHC_NP, NULL, given);
        unit->rates(t[i], state, given, out + i * NX);
        free(state);
    }
    say("scalar_rates", out, n * NX);
    free(given);
    free(out);
}

/* A run from y0, its end and its dense output in the middle. */
static void simulate(const mechc_unit *unit, int method, double seconds, double rtol,
                     const double *y0, const double *p, int print)
{
    double *scale = heap(NX), *middle = heap(3 * NX), times[3] = {0.0, 0.5 * seconds, seconds};
    for (int i = 0; i < NX; i++) scale[i] = 1.0;
    mechc_options options;
    memset(&options, 0, sizeof options);
    options.t1 = seconds;
    options.y0 = y0;
    options.p = p;
    options.rtol = rtol;
    options.scale = scale;
    options.max_step = HUGE_VAL;
    options.max_steps = 100000;
    options.method = method;
    options.dense = 1;
    mechc_run *run = calloc(1, unit->run_size);
    unit->start(run, &options);
    while (unit->advance(run, 7) == MECHC_RUNNING) {}
    const mechc_trajectory *record = &run->trajectory;
    if (print) {
        printf("status %d\n", run->status);
        say("end", record->y + (record->count - 1) * NX, NX);
        unit->interpolate(method, record, p, NULL, 3, times, middle);
        say("dense", middle, 3 * NX);
    }
    unit->release(run);
    free(run);
    free(scale);
    free(middle);
}

int main(int count, char **arguments)
{
    const mechc_unit *unit = mechc_scene.select(count > 1 ? arguments[1] : 0);
#ifdef _WIN32
    _setmode(0, _O_BINARY);
#endif
    if (!unit) return 77;
    if (mechc_scene.abi != MECHC_ABI || mechc_scene.select("no such set")) return 5;
    const ptrdiff_t n = N_STATES;
    double *t = read_doubles(n), *y = read_doubles(n * NX), *p = read_doubles(n * MECHC_NP);
    double *start = read_doubles(NX), *defaults = heap(MECHC_NP);
    unsigned char given[MECHC_NP + 1] = {0};
    mechc_scene.complete(given, defaults);
    say("defaults", defaults, MECHC_NP);
    outputs(unit, n, t, y, p);
    scalar_rates(unit, n, t, y, p);
    static const int methods[] = {METHOD_NUMBERS};
    for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
        const int method = methods[k];
        simulate(unit, method, SECONDS, 1e-9, start, defaults, 1);
        simulate(unit, method, 0.0, 1e-9, start, defaults, 0);
        simulate(unit, method, -0.5, 1e-6, start, defaults, 0);
        for (int i = 0; i < 4; i++) /* open loops, NaN and a huge state end with a status */
            simulate(unit, method, 0.1, 1e-6, y + (n - 1 - i) * NX, p + i * MECHC_NP, 0);
    }
    for (ptrdiff_t i = 0; i < n; i++) {
        double moved[2], state[NX];
        memcpy(state, y + i * NX, sizeof state);
        unit->project(t[i], state, p + i * MECHC_NP, NULL, moved);
    }
    free(t), free(y), free(p), free(start), free(defaults);
    return 0;
}
"""


def sanitizers_missing(folder: Path) -> str:
    """Why there are none here, or nothing."""
    (folder / "probe.c").write_text("int main(void) { return 0; }\n")
    command = [*toolchain.compiler(), *SANITIZED, "probe.c", "-o", "probe"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        done = subprocess.run([str(folder / "probe")], capture_output=True, text=True, check=False)
    return done.stderr.strip()[-300:] if done.returncode else ""


@cache
def reference() -> Reference:
    return Reference("four_bar", STATES - BROKEN)


@cache
def sets() -> dict[str, InstructionSet]:
    return {each.name: each for each in instruction_sets() if each.name != "avx512"}


def build_sanitized(build: Build, folder: Path) -> Path:
    """The scene's own sources and the program above, one executable."""
    build.write(folder)
    numbers_ = (f"-DN_STATES={STATES}", METHOD_NUMBERS, f"-DSECONDS={SECONDS}")
    (folder / "main.c").write_text(MAIN)
    sources = [(name, (*FLAGS, *STRICT, *flags, *SANITIZED)) for name, flags in build.flags.items()]
    sources.append(("main.c", (*FLAGS, *STRICT, *SANITIZED, *numbers_)))
    objects = toolchain.compile_all(folder, sources, (str(RUNTIME), str(folder)))
    program = folder / "scene"
    command = [*toolchain.compiler(), *SANITIZED, *map(str, objects), "-lm", "-o", str(program)]
    subprocess.run(command, check=True)
    return program


def with_broken_states(at: Reference, start: Array) -> tuple[Array, Array, Array]:
    """Times, states and parameters; the last states are not fit to be simulated."""
    broken = np.tile(start, (BROKEN, 1))
    broken[0, 1], broken[1, 4], broken[2, 0] = 1e17, np.inf, np.nan
    y, p = np.vstack([at.y, broken]), np.vstack([at.p, at.p[:BROKEN]])
    return np.append(at.t, at.t[:BROKEN]), y, p


def run_sanitized(program: Path, instruction_set: str, inputs: Sequence[Array]) -> list[list[str]]:
    data = b"".join(np.ascontiguousarray(a, dtype=np.float64).tobytes() for a in inputs)
    environment = {**os.environ, "UBSAN_OPTIONS": "print_stacktrace=1"}
    done = subprocess.run(
        [str(program), instruction_set],
        input=data,
        env=environment,
        capture_output=True,
        check=False,
    )
    if done.returncode == 77:
        pytest.skip(f"this processor has no {instruction_set}")
    assert done.returncode == 0, done.stderr.decode()[:6000]
    assert done.stderr == b""
    return [line.split() for line in done.stdout.decode().splitlines()]


def numbers(words: list[str]) -> Array:
    return np.array([float.fromhex(word.partition("(")[0]) for word in words])


def checked_outputs(at: Reference, named: Mapping[str, Array]) -> list[Array]:
    """Accelerations, two ways, after what was printed has been compared with exact values."""
    good = slice(0, len(at.t))
    for name in at.names:
        at.check(name, printed(named, name, STATES)[good])
    multipliers = named["multipliers"].reshape(STATES, -1)
    ways = [named[rates].reshape(STATES, -1)[:, 3:] for rates in ("rates", "scalar_rates")]
    for accelerations in ways:
        at.check_motion(np.hstack([accelerations, multipliers])[good])
    return ways


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sanitized")
    if why := sanitizers_missing(folder):
        pytest.skip(f"no sanitizers: {why}")
    build = build_scene(scenes.SCENES["four_bar"](), tuple(sets().values()))
    return build_sanitized(build, folder)


@pytest.mark.parametrize("instruction_set", sets())
@pytest.mark.thorough
def test_the_four_bar_is_sound_and_gives_the_installed_models_values(
    sanitized: Path, instruction_set: str
) -> None:
    try:
        model = mechc.load("four_bar", instruction_set=instruction_set)
    except ValueError:
        pytest.skip(f"this processor has no {instruction_set}")
    start = model.assemble({"theta_0": math.radians(85)})
    at = reference()
    t, y, p = with_broken_states(at, start)
    lines = run_sanitized(sanitized, instruction_set, (t, y, p, start))
    named = {words[0]: numbers(words[1:]) for words in lines if words[0] not in ("status", "end")}
    np.testing.assert_allclose(named["defaults"], [*model.defaults.values()], rtol=1e-15)
    assert set(model.system.scene.outputs) <= set(named)
    for accelerations in checked_outputs(at, named):
        assert np.isnan(accelerations[len(at.t) + 2]).all()  # NaN in, NaN out
    ends = [words for words in lines if words[0] in ("status", "end", "dense")]
    for k, method in enumerate(WHOLE_UNIT):
        (_, status), (_, *end), (_, *dense) = ends[3 * k : 3 * k + 3]
        sol = model.simulate(SECONDS, start, rtol=1e-9, **by(method))
        assert (status, sol.status.ok) == ("1", True)
        np.testing.assert_allclose(numbers(end), sol.y[-1], atol=1e-6)
        middle = sol(np.array([0.0, SECONDS / 2, SECONDS]))
        np.testing.assert_allclose(numbers(dense).reshape(3, 6), middle, atol=1e-6)
