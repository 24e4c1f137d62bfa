"""The import law: data flows one way through the compiler, and the runtime stays light."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMPILER = {
    ".".join(p.relative_to(ROOT / "codegen").with_suffix("").parts).removesuffix(".__init__"): p
    for p in (ROOT / "codegen").rglob("*.py")
}
RUNTIME = sorted((ROOT / "src" / "mechc").rglob("*.py"))

FACE = {"__init__", "extension"}
BASE = {"errors"}
JOINTS = {"constraints", "joints", "cuts", "jointed", "placement"}
DATA = BASE | {"terms", "mechanism", "equations", "program", "wishes", "source", "plain"} | JOINTS
DATA |= {"choices"}
STAGES = {"derive", "differentiate", "lower", "optimize", "sensitivity", "emit_c", "emit_numpy"}
STAGES |= {"metadata"}
ALLOWED = {
    "errors": set[str](),
    "wishes": BASE,
    "source": {"terms", "joints"},
    "terms": BASE,
    "expression": BASE,
    "constraints": set[str](),
    "placement": set[str](),
    "joints": BASE,
    "cuts": BASE | {"constraints", "joints"},
    "jointed": BASE | JOINTS,
    "mechanism": BASE | {"terms"} | JOINTS,
    "equations": BASE,
    "program": BASE | {"equations"},
    "optimize": DATA | {"passes"},
    "passes": DATA | {"passes"},
    "printer": BASE,
    "functions": set[str](),
    "closing": DATA,
    "layout": DATA | {"closing"},
    "metadata": DATA | {"layout"},
    "emit_c": DATA | {"printer", "functions", "layout"},
    "emit_numpy": DATA | {"printer", "functions", "layout"},
    "tree": DATA | {"tree", "reactions"},
    "carriers": DATA,
    "reactions": DATA | {"carriers"},
    "written_kinetics": DATA,
    "derive": DATA | {"reactions", "written_kinetics"},
    "mechanisms": BASE | {"mechanism", "mechanisms", "expression", "joints", "cuts"},
}
READERS = {"from_kane", "from_lagrange", "from_system"}
CONVERSION = DATA | {
    "accelerations",
    "algebra",
    "kinematics",
    "loads",
    "at_rest",
    "potential",
    "split",
    "walk",
}
ALLOWED |= dict.fromkeys((*READERS, "split", "convert", "accelerations", "potential"), CONVERSION)
ALLOWED |= {"from_system": CONVERSION | READERS, "from_sympy": CONVERSION | READERS}
ALLOWED |= {"from_sympy_joints": CONVERSION | READERS | {"convert"}}
ALLOWED |= {"scene": CONVERSION | {"convert", "from_sympy", "wishing"}}
ALLOWED |= {"wishing": CONVERSION | {"convert", "reactions"}, "signature": set()}
TYPESET = DATA | {"derive", "differentiate"}


def imported(path: Path, *, top_level: bool = False) -> Iterator[str]:
    """Modules that a file imports, by full name; only those of the module's own level or all."""
    tree = ast.parse(path.read_text("utf-8"))
    guarded = {id(n) for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) for n in ast.walk(f)}
    for node in ast.walk(tree):
        if top_level and id(node) in guarded:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are written in full"
            yield str(node.module)


def part(module: str) -> str:
    """mechc_codegen.passes.fold -> passes."""
    return [*module.split("."), "__init__"][1]


@pytest.mark.parametrize("module", COMPILER)
def test_a_stage_imports_data_and_never_another_stage(module: str) -> None:
    ours = {part(m) for m in imported(COMPILER[module]) if m.startswith("mechc_codegen")}
    mine = part(module)
    if mine in FACE:
        return
    if mine.startswith("typeset"):
        assert {p for p in ours if not p.startswith("typeset")} <= TYPESET
    else:
        assert ours <= ALLOWED.get(mine, DATA), f"{module} reaches beyond its stage"


def test_the_compiler_knows_sympy_and_the_standard_library_only() -> None:
    for path in COMPILER.values():
        roots = {m.split(".")[0] for m in imported(path)}
        assert roots <= {"sympy", "mechc_codegen", *sys.stdlib_module_names}, path


def test_no_module_is_imported_by_what_it_imports() -> None:
    within = {
        name: {m for m in imported(path) if m in COMPILER} - {"mechc_codegen"}
        for name, path in COMPILER.items()
    }
    order = list(TopologicalSorter(within).static_order())
    assert order.index("mechc_codegen.errors") < order.index("mechc_codegen.extension")


def test_only_jit_knows_the_compiler_and_only_inside_functions() -> None:
    for path in RUNTIME:
        assert not any(m.startswith("mechc_codegen") for m in imported(path, top_level=True)), path
        if path.name != "jit.py":
            assert not any(m.startswith("mechc_codegen") for m in imported(path)), path


@pytest.mark.parametrize("lines", [
    "import mechc",
    "import mechc; mechc.mechanisms()",
    "from mechc.cli import main; main(['list'])",
    "import mechc; mechc.load('four_bar').rhs(0.0, [1.0] * 6)",
])  # fmt: skip
def test_the_runtime_loads_light(lines: str) -> None:
    heavy = ["sympy", "scipy.integrate", "matplotlib", "xarray", "mechc_codegen", "Cython"]
    script = f"import sys; {lines}; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr


def test_the_stages_are_all_there() -> None:
    """Renaming a stage must not quietly take it out of this test."""
    assert {part(name) for name in COMPILER} >= STAGES
