"""Constants of the C runtime have names, reasons and a line in docs/theory/thresholds.md."""

import re

import pytest

from benchmarks.thresholds.command import MARKS, write_page
from benchmarks.thresholds.constants import bare_literals, constants
from benchmarks.thresholds.varied import RUNTIME, write_headers
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


@pytest.fixture
def runtime(tmp_path):
    for name, text in (("run/method.h", FIELDS), ("dynamics/some.h", HEADER)):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text, "utf-8")
    return tmp_path


def test_no_floating_constant_of_the_runtime_is_without_a_name():
    assert bare_literals() == []


def test_headers_with_factors_find_their_neighbours(tmp_path):
    write_headers(constants(), tmp_path)
    written = list(tmp_path.rglob("*.h"))
    assert any(path.parent.name == "abi" for path in written)
    for path in written:
        for name in re.findall(r'^#include "(\w+\.h)"', path.read_text("utf-8"), re.M):
            assert not (RUNTIME / path.parent.relative_to(tmp_path) / name).exists(), path


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
