"""Constants of the C runtime have names, reasons and a line in docs/theory/thresholds.md."""

import os
import re
import subprocess
import sys

import pytest

from benchmarks.thresholds.command import MARKS, write_page
from benchmarks.thresholds.constants import bare_literals, constants
from benchmarks.thresholds.varied import FILE_VARIABLE, compiler, write_factors, write_headers
from benchmarks.timing.processes import environment
from tests.support import ROOT

PAGE = ROOT / "docs" / "theory" / "thresholds.md"
FIELDS = "double growth; /* of a step */\n"
HEADER = """\
/* A reason of
 * two lines. */
#define MECHC_A 1e-3
#define MECHC_B 0.7 /* its own */
#define MECHC_PI 3.14159265358979 /* mathematics */

/* 0.123 in a comment */
static double twice(double x) { return 2.0 * x + 0.7 * MECHC_A; }
"""
SCRIPT = """
import sys
from pathlib import Path
import mechc
from benchmarks.thresholds.varied import write_factors
factors, count, place = sys.argv[1:]
from mechc_codegen.library.chains.pendulum import pendulum
model = mechc.compile(pendulum(1))
model.wait_compiled()
for factor in (1.0, 1.0, 0.5):
    write_factors(Path(factors), int(count), int(place), factor)
    print(model.simulate(1.0, {model.coordinates[0]: 1.0}, method="dopri5").y[-1, 0].hex())
"""


@pytest.fixture
def runtime(tmp_path):
    for name, text in (("run/method.h", FIELDS), ("dynamics/some.h", HEADER)):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text, "utf-8")
    return tmp_path


def test_no_floating_constant_of_the_runtime_is_without_a_name():
    assert bare_literals() == []


@pytest.mark.thorough
def test_a_factor_changes_what_a_scene_compiled_with_them_does(tmp_path):
    every, factors = constants(), tmp_path / "factors"
    write_headers(every, tmp_path)
    write_factors(factors, len(every))
    variables = {
        "CC": compiler(tmp_path, f"{os.environ.get('CC', 'cc')} -Werror"),
        "MECHC_CACHE_DIR": str(tmp_path / "cache"),
        FILE_VARIABLE: str(factors),
    }
    place = 1 + [each.name for each in every].index("MECHC_FIRST_ERROR")
    command = [sys.executable, "-c", SCRIPT, str(factors), str(len(every)), str(place)]
    told = subprocess.run(
        command, env=environment(**variables), cwd=ROOT, check=True, capture_output=True, text=True
    )
    first, again, other = told.stdout.split()
    assert first == again != other


def test_every_constant_of_the_runtime_has_a_reason():
    assert [each.name for each in constants() if not each.reason.strip()] == []


def test_the_page_has_every_constant_with_its_value():
    table = PAGE.read_text("utf-8").partition(MARKS[0])[2].partition(MARKS[1])[0]
    listed = re.findall(r"^\| `(\S+)` \| `([^`]+)` \|", table, re.M)
    assert listed == [(each.name, each.value) for each in constants()]


def test_names_values_and_reasons_are_read_from_headers(runtime):
    found = [(each.name, each.value, each.reason) for each in constants(runtime)]
    assert found == [
        ("MECHC_A", "1e-3", "A reason of two lines."),
        ("MECHC_B", "0.7", "its own"),
    ]


def test_a_bare_literal_is_seen(runtime):
    assert bare_literals(runtime) == ["dynamics/some.h:8: 0.7"]


def test_rows_take_the_place_of_those_before_unless_they_were_not_measured_now(tmp_path):
    page = tmp_path / "page.md"
    old = "| `A` | `1` | why | a | b |\n| `B` | `2` | why | c | d |\n| `C` | `3` | why | e | f |\n"
    page.write_text(f"before{MARKS[0]}{old}{MARKS[1]}after", "utf-8")
    none = "not measured | not measured |\n"
    write_page(page, [
        "| `A` | `1` | why | new | new |\n", f"| `B` | `2` | because | {none}",
        f"| `C` | `4` | why | {none}",
    ])  # fmt: skip
    text = page.read_text("utf-8")
    assert text.startswith(f"before{MARKS[0]}")
    assert text.endswith(
        "| `A` | `1` | why | new | new |\n| `B` | `2` | because | c | d |\n"
        f"| `C` | `4` | why | {none}{MARKS[1]}after"
    )
