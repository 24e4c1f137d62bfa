"""The examples of the guide run as they stand, page by page, and every public name has one."""

import re
import runpy

import numpy as np
import pytest

import mechc
from mechc.results.sampling import PlaneView
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
    "sympy_objects.md",
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


@pytest.mark.slow(cases=1)
def test_the_messages_of_the_page_are_those_that_its_code_gives(capsys):
    page = (DOCS / "how_to" / "messages.md").read_text("utf-8")
    shown = re.findall(r"^```python\n(.*?)^```(?:\n\n```text\n(.*?)^```)?", page, re.S | re.M)
    assert len([told for _, told in shown if told]) == page.count("```text")
    names = {}
    for block, told in shown:
        try:
            exec(compile(block, "messages.md", "exec"), names)
            said = capsys.readouterr().out
        except mechc.MechcError as error:
            said = f"{type(error).__name__}: {error}"
        assert rounded(said) == rounded(told)


def rounded(text):
    """Words and numbers of three digits; what is rounding of zero is zero."""

    def short(number):
        value = float(number[0])
        return f"{value:.3g}" if value > 1e-12 else "0"

    return re.sub(r"\d+(?:\.\d+)?(?:e[+-]\d+)?", short, " ".join(text.split()))


def test_every_public_name_has_an_example_that_is_run():
    shown = "\n".join(block for page in PAGES for block in examples(page))
    shown += "".join(path.read_text("utf-8") for path in (ROOT / "examples").rglob("*.py"))
    messages = (DOCS / "how_to" / "messages.md").read_text("utf-8")
    named = {*re.findall(r"mechc\.(\w+)", shown), *re.findall(r"^(\w+): ", messages, re.M)}
    assert {*mechc.__all__, "compile", "open"} - named == set()


def test_every_page_is_reached_from_the_start_page():
    start = (DOCS / "index.md").read_text("utf-8")
    pages = {p.relative_to(DOCS).with_suffix("").as_posix() for p in DOCS.rglob("*.md")}
    assert {page for page in pages - {"index"} if f"\n{page}\n" not in start} == set()


def test_the_page_on_citing_has_the_version() -> None:
    assert f"version = {{{mechc.__version__}}}" in (DOCS / "cite.md").read_text("utf-8")


def test_the_start_page_includes_the_readme_from_mark_to_mark() -> None:
    """All of it but its title, how to test, and its last line."""
    readme = (ROOT / "README.md").read_text("utf-8")
    marks = re.findall(
        r'{include} \.\./README\.md\n:start-after: "(.*)"\n:end-before: "(.*)"',
        (DOCS / "index.md").read_text("utf-8"),
    )
    left_out = readme
    for begin, end in marks:
        assert readme.count(begin) == 1
        left_out = left_out.replace(readme.split(begin)[1].split(end)[0].strip(), "")
    assert len(marks) == 4
    left_out = left_out.replace("[How to cite](docs/cite.md)", "")
    assert not any(part in left_out for part in ("](", "```python", "|---|", "mechc run"))


def test_the_speeds_of_the_readme_are_those_measured() -> None:
    """In the last table of ratios, by ``auto``, to two digits."""
    known = {
        "four-bar": "four_bar_regular", "four-bar through change points": "four_bar_change_point",
        "five windows in a row": "windows_5", "slider-crank": "slider_crank",
        "pendulum": "pendulum_1", "ten pendulums in a row": "pendulum_10",
        "Andrews' mechanism": "andrews", "bicycle": "bicycle",
        "stiff governor": "flyball_governor", "heavy top": "heavy_top",
    }  # fmt: skip
    words = {"no peer": "only mechc", "not reached": "neither"}
    measured = {
        row[0]: row[2:]
        for row in table_rows(DOCS / "benchmarks.md")
        if len(row) == 7 and row[1] == "auto"
    }
    told = {row[0]: row[1:] for row in table_rows(ROOT / "README.md")[2:]}
    assert [*told] == [*known]
    for name, cells in told.items():
        for cell, ratio in zip(cells, measured[known[name]], strict=True):
            if ratio in words:
                assert cell == words[ratio], name
            else:
                assert float(cell) == float(f"{float(ratio.strip('†')):.2g}"), name


def table_rows(page):
    lines = page.read_text("utf-8").splitlines()
    rows = (line.strip("|").split("|") for line in lines if line.startswith("|"))
    return [[cell.strip() for cell in row] for row in rows]


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


@pytest.mark.slow
def test_a_moving_picture_of_the_gallery_shows_a_spatial_motion_aslant(tmp_path):
    pictures = runpy.run_path(str(ROOT / "docs" / "extensions" / "moving_pictures.py"))
    sol = mechc.load("heavy_top").simulate(1.0, {"theta": 0.5, "w_z": 20.0})
    view, run = pictures["seen"](sol)
    depth = next(k for k, axis in enumerate("xyz") if axis not in "".join(view.axes))
    assert view.projected
    aslant = view.positions - PlaneView.of(view, run.positions)
    np.testing.assert_allclose(aslant, run.positions[..., depth, None] * pictures["SLANT"])
    pictures["write"](sol, str(tmp_path / "motion.gif"))
    assert (tmp_path / "motion.gif").stat().st_size > 1000
