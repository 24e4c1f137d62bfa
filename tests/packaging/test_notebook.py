"""The example notebook runs as it stands, and every cell shows what it should."""

import ast
import re

import pytest

from tests.support import ROOT

NOTEBOOK = ROOT / "examples" / "four_bar.ipynb"
PACKAGES = {"mechc", "numpy", "scipy", "sympy"}

# For each code cell, in their order, what is to be found in its output.
SHOWN = (
    (),  # imports
    (r"\[cos\(theta_0\(t\)\), -sin\(theta_0\(t\)\), 0\]", r"cos\(theta_2\(t\)\)"),
    (r"l_0\*e_0\.x \+ l_1/2\*e_1\.x", r"l_0\*omega_0\(t\)\*e_0\.y \+ l_1\*omega_1\(t\)/2\*e_1\.y"),
    (r"l_0\*cos\(theta_0\(t\)\) .* - l_3\]", r"l_0\*sin\(theta_0\(t\)\)"),
    (r"I_0 \+ l_0\*\*2\*m_0/4 \+ l_0\*\*2\*m_1 \+ l_0\*\*2\*m_2",),
    (r"\[-l_0\*sin\(theta_0\(t\)\), -l_1\*sin\(theta_1\(t\)\), -l_2\*sin\(theta_2\(t\)\)\]",),
    (r"<mechc\.Model four_bar: 3 coordinates, 3 speeds, 2 constraints", r"length of the crank"),
    (r"operations an evaluation", r"constraint jacobian +\d+ +\d+"),
    (r"array\(\[-9\.62535\d*, +5\.79581\d*, +3\.56102\d*\]\)",),
    (r"85\. +, +31\.30265\d*, -42\.72165\d*\]", r"85\. +, -59\.87029\d*, +14\.15401\d*\]"),
    (r"array\(\[ *(-?\d\.\d*e-1[5-9]|0\.(0*e\+00)?) *, *(-?\d\.\d*e-1[5-9]|0\.(0*e\+00)?) *\]\)",),
    (r"<mechc\.Solution of four_bar: \d+ states, finished: reached t = 20 s>",),
    (r"<image/png>",),
    (r"762\.1436\d*",),
    (r"rtol 1e-12: .* loop open by", r"mechc: +crank up to +762\.14 deg \(exact: 762\.14\)"),
    (r"<iframe",),
    (r"energy from 71\.420 J to 6\.477 J", r"<image/png>"),
    (r"<xarray\.Dataset>", r"theta_0 +\(time"),
)


@pytest.fixture(scope="module")
def notebook():
    nbformat = pytest.importorskip("nbformat")
    return nbformat.read(NOTEBOOK, as_version=4)


def code_of(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def test_it_is_kept_without_outputs(notebook):
    assert not any(cell.outputs or cell.execution_count for cell in code_of(notebook))


def test_it_needs_nothing_of_mechc_but_mechc(notebook):
    imported = set()
    for cell in code_of(notebook):
        for node in ast.walk(ast.parse(cell.source)):
            if isinstance(node, ast.Import):
                imported |= {name.name for name in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(node.module)
    assert "mechc" in imported
    assert {name for name in imported if name.startswith("mechc")} == {"mechc"}
    assert {name.split(".")[0] for name in imported} <= PACKAGES


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.slow
def test_every_cell_shows_what_it_should(notebook, tmp_path, monkeypatch):
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    where = {"metadata": {"path": tmp_path}}
    nbclient.NotebookClient(notebook, timeout=300, resources=where).execute()
    for cell, wanted in zip(code_of(notebook), SHOWN, strict=True):
        shown = shown_by(cell)
        assert bool(shown) == bool(wanted), cell.source
        for pattern in wanted:
            assert re.search(pattern, shown), f"{cell.source}\n shows no {pattern}\n{shown[:2000]}"


def shown_by(cell):
    """Texts that the cell printed or displays, and the kinds of its pictures."""
    parts = []
    for output in cell.outputs:
        parts.append(output.get("text", ""))
        for kind, content in output.get("data", {}).items():
            parts.append(content if kind.startswith("text/") else f"<{kind}>")
    return "\n".join(parts)
