"""The numbers that C and Python share are those of abi/codes.h, each written there alone."""

import re

import numpy as np
import pytest
from mechc.native._motion import Motion, Request
from mechc_codegen.extension.flags import RUNTIME

import mechc
from mechc.native import _codes as codes
from mechc.simulation.settings import Policy
from mechc.simulation.status import CODES
from tests.support import ROOT

HEADER = (RUNTIME / "abi" / "codes.h").read_text("utf-8")
NUMBERS = {
    name: int(number) for name, number in re.findall(r"\bMECHC_(\w+) = (\d+)", HEADER)
}  # fmt: skip
ROWS = re.findall(r"    X\((\w+), (\w+), (\d+), \w+, ", HEADER)  # of methods


def members(enumeration: str) -> set[int]:
    """The numbers of one enumeration."""
    (text,) = (
        body for body, name in re.findall(r"enum \{(.*?)\} (\w+);", HEADER, re.S)
        if name == f"mechc_{enumeration}"
    )  # fmt: skip
    return {NUMBERS[name] for name in re.findall(r"MECHC_(\w+) =", text)}


def test_python_has_the_numbers_of_the_header():
    exported = {name: value for name, value in vars(codes).items() if isinstance(value, int)}
    assert len(exported) > 20
    assert {name: NUMBERS[name] for name in exported} == exported
    assert {name: int(number) for name, _, number in ROWS} == codes.METHODS
    assert sorted(codes.METHODS.values()) == list(range(len(ROWS)))
    assert [name.upper() for name, _, _ in ROWS] == [macro for _, macro, _ in ROWS]
    assert sorted(codes.COUNTERS.values()) == list(range(NUMBERS["COUNTS"]))
    assert sorted(codes.LEAST.values()) == list(range(NUMBERS["LEASTS"]))
    assert set(codes.CHANGE_POINT_POLICIES.values()) == members("change_point_policy")


def test_every_end_of_a_run_has_words():
    ends = (members("status") - {codes.RUNNING}) | members("driver_status")
    assert set(CODES) == ends


@pytest.mark.parametrize("name", ["METHODS", "COUNTERS", "CODES", "RUNNING", "FINISHED"])
def test_no_module_types_a_number_again(name: str):
    """Names of codes are imported, or are keys: none is assigned a number in Python."""
    again = re.compile(rf"^{name}\b[^=\n]*= *(\d|range|\{{\s*(\"\w+\": *)?\d)", re.M)
    found = [p for p in (ROOT / "src").rglob("*.py") if again.search(p.read_text("utf-8"))]
    assert found == []
    assert again.search(f"{name} = 7")


def test_what_a_run_counts_has_the_names_of_the_struct():
    text = (RUNTIME / "abi" / "run.h").read_text("utf-8")
    body = re.search(r"typedef struct \{([^}]*)\} mechc_stats;", text)
    assert body is not None
    plain = re.sub(r"/\*.*?\*/", "", body[1], flags=re.S)
    fields = [n.strip() for line in re.findall(r"(?:long|double|int) ([^;]*);", plain)
              for n in line.split(",")]  # fmt: skip
    model = mechc.load("four_bar")
    scene, y = model.system.scene, model.assemble({"theta_0": 1.4})
    p = np.array(list(model.defaults.values()))
    policy = Policy(1e-8, None, "dop853", 0.0, 1.0, 10, False, "stop", False)
    motion = Motion(Request(scene, model.system.sizes, policy, p), 0.0, 1e-3, y)
    assert sorted(motion.stats()) == sorted(fields)


def test_rates_are_timed_without_python_in_between():
    """What the benchmarks of one evaluation call."""
    model = mechc.load("four_bar")
    y, p = model.assemble({"theta_0": 1.4}), np.array(list(model.defaults.values()))
    assert 0.0 < model.system.scene.rates_seconds(0.0, y, p, 100) < 10.0
