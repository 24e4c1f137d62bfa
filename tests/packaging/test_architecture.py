"""The map leads to places that exist, and tests lie where their modules do."""

import re

import pytest

from tests.support import ROOT

PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")
ROOTS = [ROOT, *(ROOT / p for p in ("codegen/mechc_codegen", "src/mechc"))]
FOLDERS = [*ROOTS, ROOT / "codegen/mechc_codegen/runtime"]
TESTS = {  # where the modules below a root are tested, and tests of more than one module
    "src/mechc": ("tests/runtime", {
        "assembly/quaternions", "auxiliary_reactions", "batch/compiled_on_demand", "batch/contact",
        "batch/controlled",
        "batch/damaged_store", "batch/stiff_members", "cli/bad_input",
        "compilation/bad_compilers", "compilation/failures", "compilation/first_requests",
        "compilation/functions_of_coordinates",
        "compilation/on_demand", "compilation/threads", "inputs/laws", "names",
        "native/other_systems", "options", "package",
        "results/pictures_of_models", "sensitivities/jumps_of_laws", "sensitivities/loops",
        "simulation/contact/drive", "simulation/contact/impacts", "simulation/contact/modes",
        "simulation/contact/outputs", "simulation/events/drawn_events", "simulation/interrupts",
        "simulation/quaternions", "simulation/small_stacks", "symbols",
    }),
    "codegen/mechc_codegen": ("tests/compiler", {
        "derive/random_mechanisms", "emit/headers", "emit/portable_c", "emit/sanitizers",
        "emit/values",
    }),
    "benchmarks": ("tests/benchmarks", {"peers/engines", "peers/ode_peers"}),
}  # fmt: skip


def _exists(path):
    return any((root / path).exists() for root in FOLDERS)


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`([\w/]+/(?:[\w.]*))`", PAGE))))
def test_a_path_on_the_map_exists(path):
    assert _exists(path)


def test_places_that_answer_a_question_define_what_they_are_said_to():
    rows = re.findall(r"^\|[^|]*\| `([\w/.]+)`: `(\w+)`(.*)\|$", PAGE, re.M)
    assert len(rows) >= 3
    for path, function, others in rows:
        text = next(root / path for root in FOLDERS if (root / path).exists()).read_text("utf-8")
        for name in (function, *re.findall(r"^(?:, `(\w+)`)", others)):
            assert re.search(rf"\b{name}\(", text), f"{path} has no {name}"


def test_every_folder_of_the_sources_is_on_the_map():
    for root in ROOTS[1:]:
        for folder in sorted(
            p for p in root.iterdir() if p.is_dir() and not p.name.startswith("_")
        ):
            assert f"`{folder.name}/`" in PAGE, folder


@pytest.mark.parametrize("sources", TESTS)
def test_a_test_has_the_path_of_its_module_or_folder(sources):
    root, (place, of_several) = ROOT / sources, TESTS[sources]
    modules = [p for p in root.rglob("*.py*") if p.suffix in (".py", ".pyx")]
    known = {(p.parent / p.stem.lstrip("_")).relative_to(root).as_posix() for p in modules}
    folders = {p.parent.relative_to(root) for p in modules}
    known |= {f.as_posix() for f in folders} | {(f / f.name).as_posix() for f in folders}
    tests = {
        (p.parent / p.stem.removeprefix("test_")).relative_to(ROOT / place).as_posix()
        for p in (ROOT / place).rglob("test_*.py")
    }
    assert tests - known == of_several
