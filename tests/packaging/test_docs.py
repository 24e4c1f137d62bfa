"""The examples of the guide run as they stand, page by page, and every public name has one."""

import re

import pytest

import mechc
from tests.support import ROOT

DOCS = ROOT / "docs"
PAGES = (
    "../README.md",
    "coming_from/multibody_engine.md",
    "coming_from/pydy.md",
    "coming_from/solve_ivp.md",
    "differentiable.md",
    "fitting.md",
    "how_to/check.md",
    "how_to/drives.md",
    "how_to/equations_by_hand.md",
    "how_to/save_and_share.md",
    "how_to/speed.md",
    "how_to/tolerances.md",
    "hybrid.md",
    "inputs.md",
    "library.md",
    "mechanism.md",
    "mjcf.md",
    "optimal.md",
    "outputs.md",
    "periodic.md",
    "positions.md",
    "reference/examples.md",
    "sdf.md",
    "synthesis.md",
    "theory/batches.md",
    "theory/change_points.md",
    "theory/error_control.md",
    "tour.md",
    "tutorial/1_first_motion.md",
    "tutorial/2_your_own_model.md",
    "tutorial/3_joints_and_loops.md",
    "tutorial/4_forces_and_control.md",
    "tutorial/5_many_motions.md",
    "urdf.md",
)  # whose examples are whole programs
LONG = ("library.md", "reference/examples.md")  # compile what other tests compile too
NEEDS = {"mjcf.md": "mujoco"}


def examples(page):
    return re.findall(r"^```python\n(.*?)^```", (DOCS / page).read_text("utf-8"), re.S | re.M)


@pytest.mark.slow(cases=len(PAGES))
@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=pytest.mark.thorough) if p in LONG else p for p in PAGES]
)
def test_the_examples_of_a_page_run(page, tmp_path, monkeypatch):
    if package := NEEDS.get(page):
        pytest.importorskip(package)
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in examples(page):
        exec(compile(block, page, "exec"), names)
    assert names


def test_every_public_name_has_an_example_that_is_run():
    shown = "\n".join(block for page in PAGES for block in examples(page))
    shown += "".join(path.read_text("utf-8") for path in (ROOT / "examples").rglob("*.py"))
    named = {*re.findall(r"mechc\.(\w+)", shown)}
    assert {*mechc.__all__, "compile", "open"} - named == set()


def test_every_page_is_reached_from_the_start_page():
    start = (DOCS / "index.md").read_text("utf-8")
    pages = {p.relative_to(DOCS).with_suffix("").as_posix() for p in DOCS.rglob("*.md")}
    assert {page for page in pages - {"index"} if f"\n{page}\n" not in start} == set()


def test_the_start_page_has_the_speeds_of_the_readme() -> None:
    """Of four rows, from 1e-4 to 1e-10: the least and the largest."""
    rows = {}
    for line in (ROOT / "README.md").read_text("utf-8").splitlines():
        name, *cells = [cell.strip().strip("*") for cell in line.strip("|").split("|")]
        rows[name] = cells[:4]
    rows["ten"] = [cell.split(", ")[-1].strip("*") for cell in rows["pendulum of 1, 2, 10 links"]]
    known = ("four-bar", "ten", "governor, stiff", "heavy top")
    told = [sorted(rows[name], key=float) for name in known]
    cells = " | ".join(f"{row[0]} to {row[-1]}" for row in told)
    assert f"| {cells} |" in (DOCS / "index.md").read_text("utf-8")


@pytest.mark.parametrize(
    ("page", "described", "left_out"),
    [
        (
            "model", mechc.Model,
            {"array_elements", "gap_unit", "judge_rates", "knows_energy", "of_reference",
             "of_system"},
        ),
        (
            "solution", mechc.Solution,
            {"asked_events", "differentiated_within_tolerance", "event_titles", "has_energy",
             "joined", "output_along", "quantity_along", "values_along", "work_until"},
        ),
        ("solution", mechc.Stepper, set()),
    ],
)  # fmt: skip
def test_the_table_of_a_class_names_its_public_attributes(page, described, left_out):
    text = (DOCS / "reference" / f"{page}.md").read_text("utf-8")
    named = re.findall(rf"`(\w+) <mechc\.{described.__name__}\.\1>`", text)
    named += re.findall(r":(?:meth|attr):`(\w+)`", described.__doc__)
    public = {name for name in dir(described) if not name.startswith("_")}
    assert {*named} == public - left_out
