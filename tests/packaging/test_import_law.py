"""The import law: data flows one way through the compiler, and the runtime stays light."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from tests.support import ROOT

COMPILER = {
    ".".join(p.relative_to(ROOT / "codegen").with_suffix("").parts).removesuffix(".__init__"): p
    for p in (ROOT / "codegen").rglob("*.py")
}
RUNTIME = sorted((ROOT / "src" / "mechc").rglob("*.py"))

EVERYWHERE = ("errors", "files", "interrupts", "progress")
# A folder or module of the runtime -> those that it may import besides these.
RUNTIME_LAW = {
    "system": {"native"},
    "inputs": {"native", "system"},
    "outputs": {"system", "inputs"},
    "assembly": {"native", "system", "outputs"},
    "compilation": {"_scenes", "native", "system", "inputs"},
    "simulation": {"native", "system", "assembly"},
    "analysis": {"native", "system", "inputs", "outputs", "assembly", "simulation",
                 "sensitivities"},
    "sensitivities": {"native", "system", "inputs", "assembly", "simulation"},
    "questions": {"system", "assembly"},
    "fitting": {"system", "outputs", "assembly", "simulation", "questions", "results"},
    "synthesis": {"system", "outputs", "assembly", "simulation", "analysis", "sensitivities",
                  "questions", "results"},
    "results": {"system", "simulation", "analysis", "sensitivities", "questions"},
    "batch": {"native", "system", "inputs", "outputs", "assembly", "compilation", "simulation",
              "sensitivities", "questions", "results"},
    "periodic": {"system", "outputs", "compilation", "analysis", "simulation", "questions",
                 "results"},
    "prescribed": {"system", "inputs", "outputs", "assembly", "compilation", "simulation",
                   "analysis", "results"},
    "differentiable": {"system", "inputs", "outputs", "assembly", "simulation", "sensitivities",
                       "questions"},
    "optimal": {"system", "inputs", "outputs", "assembly", "compilation", "simulation",
                "sensitivities", "questions", "results", "differentiable"},
    "model": {"system", "outputs", "assembly", "compilation", "simulation", "analysis", "results",
              "batch", "differentiable", "fitting", "optimal", "periodic", "prescribed",
              "synthesis"},
    "load": {"model", "system", "compilation"},
    "verdict": {"load", "model", "system", "assembly", "compilation", "analysis", "results"},
    "export": {"compilation", "results", "simulation"},
    "open": {"model", "system", "simulation", "results", "batch"},
    "cli": {"__init__", "export", "open", "system", "assembly", "compilation", "results", "batch",
            "fitting"},
}  # fmt: skip

# A folder of the compiler -> the folders that it may import; of those in DATA, these modules alone.
COMPILER_LAW = {
    "errors": set[str](),
    "description": {"errors"},
    "joints": {"errors", "description"},
    "library": {"errors", "description"},
    "robots": {"errors", "description", "joints"},
    "mjcf": {"errors", "description", "robots"},
    "drawing": {"errors", "description"},
    "convert": {"errors", "description"},
    "derive": {"errors", "description"},
    "frontend": {"errors", "description", "convert", "derive"},
    "ir": {"errors", "description", "derive"},
    "emit": {"errors", "description", "derive", "ir"},
    "extension": {"emit"},
    "export": {"errors", "description", "drawing", "derive", "ir", "emit", "extension"},
    "typeset": {"errors", "description", "derive"},
}
DATA = {
    ("ir", "derive"): {"derive.equations"},
    ("emit", "derive"): {"derive.equations"},
    ("emit", "ir"): {"ir.program"},
    ("extension", "emit"): {"emit.units.instruction_sets"},
    ("export", "drawing"): {"drawing.plan"},
    ("export", "derive"): {"derive.equations"},
    ("export", "ir"): {"ir.program"},
    ("export", "extension"): {"extension.flags"},
    ("frontend", "derive"): {"derive.joint_reactions"},
    ("typeset", "derive"): {"derive.equations", "derive.kane", "derive.differentiate"},
}
DOORS = {"__init__", "compiler"}
LIBRARIES = {  # besides SymPy: for the pages that the compiler prints
    "mechc_codegen.typeset.page": {"jinja2", "markupsafe"},
    "mechc_codegen.typeset.formula": {"latex2mathml"},
}


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
    """mechc_codegen.ir.passes.pair -> ir."""
    return [*module.split("."), "__init__"][1]


@pytest.mark.parametrize("module", COMPILER)
def test_a_folder_imports_what_comes_before_it(module: str) -> None:
    mine = part(module)
    if mine in DOORS:
        return
    for other in imported(COMPILER[module]):
        if not other.startswith("mechc_codegen") or part(other) == mine:
            continue
        assert part(other) in COMPILER_LAW[mine], f"{module} imports {other}"
        if only := DATA.get((mine, part(other))):
            assert other.removeprefix("mechc_codegen.") in only, f"{module} imports {other}"


def test_the_compiler_knows_sympy_and_the_standard_library_only() -> None:
    for name, path in COMPILER.items():
        roots = {m.split(".")[0] for m in imported(path)} - LIBRARIES.get(name, set())
        assert roots <= {"sympy", "mechc_codegen", *sys.stdlib_module_names}, path


def test_no_module_is_imported_by_what_it_imports() -> None:
    within = {
        name: {m for m in imported(path) if m in COMPILER} - {"mechc_codegen"}
        for name, path in COMPILER.items()
    }
    order = list(TopologicalSorter(within).static_order())
    assert order.index("mechc_codegen.errors") < order.index("mechc_codegen.compiler")


@pytest.mark.parametrize("path", RUNTIME, ids=lambda p: str(p.relative_to(ROOT / "src")))
def test_a_folder_of_the_runtime_imports_what_lies_below_it(path: Path) -> None:
    """Imports within functions and for types count too."""
    mine = path.relative_to(ROOT / "src" / "mechc").with_suffix("").parts[0]
    if mine in {"__init__", "__main__"}:
        return
    others = {runtime_part(m) for m in imported(path) if m.split(".")[0] == "mechc"}
    if "from mechc import __version__" in path.read_text("utf-8"):
        others.discard("__init__")
    assert others <= RUNTIME_LAW.get(mine, set()) | {mine, *EVERYWHERE}, path


def runtime_part(module: str) -> str:
    """mechc.simulation.run -> simulation."""
    return [*module.split("."), "__init__"][1]


@pytest.mark.slow
def test_only_one_folder_knows_the_compiler_and_only_inside_functions() -> None:
    for path in RUNTIME:
        assert not any(m.startswith("mechc_codegen") for m in imported(path, top_level=True)), path
        if "compilation" not in path.parts:
            assert not any(m.startswith("mechc_codegen") for m in imported(path)), path


@pytest.mark.parametrize("lines", [
    "import mechc",
    "import mechc; mechc.mechanisms()",
    "from mechc.cli.commands import main; main(['list'])",
    "import mechc; mechc.load('four_bar').rhs(0.0, [1.0] * 6)",
])  # fmt: skip
def test_the_runtime_loads_light(lines: str) -> None:
    heavy = [
        *("sympy", "scipy.integrate", "matplotlib", "xarray", "mechc_codegen", "Cython"),
        *("jinja2", "markupsafe", "latex2mathml", "filelock"),
    ]
    script = f"import sys; {lines}; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr


def test_the_law_covers_every_folder() -> None:
    """Renaming a folder must not quietly take it out of this test."""
    assert {part(name) for name in COMPILER} == {*COMPILER_LAW, *DOORS}


# What reads a motion, by the names of its methods: one class reads the steps of one run, one reads
# the pieces of a motion; the others pass these on.
READERS = {
    "interpolate": {"native/_steps.pyx: Steps", "simulation/record.py: Record",
                    "simulation/record.py: Steps"},  # the last: its protocol
    "smooth_parts": {"simulation/record.py: Record"},
    "params_along": {"simulation/record.py: Record"},
    "advance": {"native/_motion.pyx: Motion", "simulation/checkpoints.py: CheckpointedRun"},
}  # fmt: skip


@pytest.mark.parametrize("method", READERS)
def test_a_motion_is_one_record_that_one_class_reads(method: str) -> None:
    runtime = ROOT / "src" / "mechc"
    found = set()
    for path in [*RUNTIME, *(runtime / "native").glob("*.pyx")]:
        owner = ""
        for line in path.read_text("utf-8").splitlines():
            if match := re.match(r"(?:cdef )?class (\w+)", line):
                owner = match[1]
            elif re.match(rf"    def {method}\(", line):
                found.add(f"{path.relative_to(runtime).as_posix()}: {owner}")
    assert found == READERS[method]


# What is written once: a pattern of the sources, and the only files that may hold it.
ONCE = {
    "a reader of an index in a text": (
        r"re\.\w+\(.*\\\[.*\\d",
        {"system/quantities.py", "sensitivities/columns.py", "inputs/samples.py"},  # y0[2], F[3]
    ),
    "a class of unknown numbers": (
        r"class \w*(Unknown|Free)s?\b(?!\w*Error)",
        {"questions/unknowns.py", "optimal/problem.py"},  # the last: the blocks of its vector
    ),
    "an inverse of constraints": (
        r"np\.linalg\.(pinv|lstsq|matrix_rank)\(",
        {"assembly/closed.py", "assembly/positions.py", "assembly/tangent_branches.py",
         "analysis/constraint_rank.py", "analysis/equilibria.py", "analysis/inverse_dynamics.py",
         "analysis/linearize.py", "compilation/newton_euler.py", "periodic/newton.py",
         "simulation/limits.py", "simulation/events/resets.py", "simulation/events/stops.py"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", ONCE)
def test_what_is_written_once_is_not_written_again(what: str) -> None:
    pattern, holders = ONCE[what]
    runtime = ROOT / "src" / "mechc"
    found = {path.relative_to(runtime).as_posix() for path in RUNTIME
             if re.search(pattern, path.read_text("utf-8"))}  # fmt: skip
    assert found <= holders
