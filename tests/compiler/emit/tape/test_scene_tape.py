"""Tapes from anybody: one that is changed is refused, or gives other numbers and no more."""

import os
import subprocess

import pytest
from mechc_codegen import build_scene, shipped_mechanism
from mechc_codegen.emit.tape.scene_tape import whole_tape
from mechc_codegen.emit.units.general import tapes_source
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.extension.flags import IN_PLACE_OF_SCENE, RUNTIME

from mechc.compilation import toolchain
from tests.support import scenes

SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-O1", "-g1")
# Each changed tape is read from memory of exactly its size; its functions run on such arrays.
MAIN = r"""
#include <stdio.h>
static uint64_t drawn = 88172645463325252u;
static uint64_t draw(uint64_t below)
{
    drawn ^= drawn << 13, drawn ^= drawn >> 7, drawn ^= drawn << 17;
    return drawn % below;
}
extern const mechc_part mechc_general, mechc_series;
const mechc_part mechc_general, mechc_series;

static void run_as(int32_t tape, int function, int width)
{
    int sizes[MECHC_TAPE_MOST_ARRAYS];
    double *arrays[MECHC_TAPE_MOST_ARRAYS] = {0}, scalars[3] = {0.5, 0.25, 1.0};
    static mechc_scalar_given given;
    const int count = mechc_tape_arrays(&mechc_of_scene, &mechc_series_of_scene, function, width,
                                        sizes);
    double *turns = calloc(3 * (size_t)mechc_of_scene.turns + 1, sizeof *turns);
    for (int i = 0; i < count; i++) {
        arrays[i] = malloc((size_t)sizes[i] * sizeof(double) + 1);
        for (int k = 0; k < sizes[i]; k++) arrays[i][k] = 0.1 * k - 0.3;
    }
    mechc_scalar_run_tape(tape, arrays, scalars, &given, turns, (int)draw(2));
    for (int i = 0; i < count; i++) free(arrays[i]);
    free(turns);
}

static void run_all(void)
{
    for (int f = 0; f < MECHC_TAPE_OF_output; f++) {
        const int of_series = f >= MECHC_TAPE_OF_series_start;
        if (of_series && !MECHC_KIND_SERIES) continue;
        if (!of_series && f >= MECHC_TAPE_OF_factor_blocks && !MECHC_KIND_BLOCKS) continue;
        if (f == MECHC_TAPE_OF_series_solve && !MECHC_KIND_MOMENTA) continue;
        run_as(mechc_of_tapes.called[f], f, 0);
    }
    for (int i = 0; i < mechc_of_tapes.output_count; i++) {
        const mechc_tape_output *o = mechc_of_tapes.outputs + i;
        if (strlen(mechc_of_tapes.names + o->name) > 1000000) exit(5);
        if (o->way != MECHC_BY_TAPE && o->way != MECHC_BY_SOLVED) continue;
        run_as(o->tape, MECHC_TAPE_OF_output, o->width);
    }
    for (int i = 0; i < mechc_of_tapes.default_count; i++) {
        const int32_t tape = mechc_of_tapes.defaults[i].tape;
        if (tape >= 0) run_as(tape, MECHC_TAPE_OF_output, 1);
    }
    if (strlen(mechc_of_tapes.metadata) + strlen(mechc_of_tapes.texts) > 100000000) exit(5);
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
        mechc_reader.counts = &mechc_of_scene;
        mechc_reader.series = &mechc_series_of_scene;
        const char *why = mechc_read_tape(bytes, own, MECHC_TAPE_MOST_OUTPUTS, &mechc_reader,
                                          &mechc_of_tapes);
        if (why) refused++;
        else ran++, run_all();
        if (n == 0 && why) return printf("%s\n", why), 6;
        free(bytes);
    }
    printf("%ld refused, %ld ran\n", refused, ran);
    return 0;
}
"""


def harness(folder, mechanism):
    """A program that reads a tape from its input and changes it so many times; and the tape."""
    build = build_scene(mechanism, (BASELINE,))
    assert build.tape
    source = tapes_source(BASELINE.lanes, "baseline") + MAIN
    (folder / "hostile.c").write_text(source, "utf-8")
    command = [
        *toolchain.compiler(),
        "-std=gnu11",
        *SANITIZED,
        "-fno-math-errno",
        "-ffp-contract=off",
    ]
    command += [*build.kind, *build.tape_kind, f"-I{IN_PLACE_OF_SCENE}", f"-I{RUNTIME}"]
    command += [str(folder / "hostile.c"), "-lm", "-o", str(folder / "hostile")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode and "sanitize" in done.stderr:
        pytest.skip("no sanitizers here")
    assert done.returncode == 0, done.stderr
    return folder / "hostile", whole_tape(build.tape, "0" * 64 + ".general", "{}")


def hostile(folder, mechanism, count):
    program, tape = harness(folder, mechanism)
    done = subprocess.run(
        [program, str(count)], input=tape, capture_output=True, check=False,
        env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()[:3000] + done.stdout.decode()
    refused, ran = (int(word.split()[0]) for word in done.stdout.decode().split(","))
    assert refused + ran == count + 1
    assert refused > count / 5
    assert ran > count / 20


@pytest.mark.parametrize("name", ["four_bar", "heavy_top", "swing"])
def test_a_changed_tape_stays_within_its_arrays(tmp_path, name):
    mechanism = scenes.swing(guided=True) if name == "swing" else shipped_mechanism(name)
    hostile(tmp_path, mechanism, 2000)


@pytest.mark.slow
def test_a_hundred_thousand_changed_tapes(tmp_path):
    hostile(tmp_path, shipped_mechanism("andrews"), 100_000)
