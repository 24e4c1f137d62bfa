"""Only what a scene needs: what falls away is neither written, nor compiled, nor counted."""

import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache

import pytest
from mechc_codegen.compiler import build_scene, operations_of_all
from mechc_codegen.derive.derive_equations import derive_equations
from mechc_codegen.description.request import DEFAULT_REQUEST, OutputRequest
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.library.catalogue import shipped_mechanism
from mechc_codegen.library.chains.rods import planar_chain, spatial_chain
from mechc_codegen.library.spatial.heavy_top import heavy_top
from sympy import Integer, Symbol

import mechc
from mechc.compilation import build
from mechc.compilation import cache as kept
from tests.support.compilers.compilation import compile_as_for_users

NOTHING = OutputRequest(frozenset())
ROWS = re.compile(r"gap\[|jacobian\[|bias\[|gamma\[")  # what constraints are assigned to
OF_ROWS = ("orthogonalise", "redundant", "multipliers", "least_step", "critical", "passage")


def texts(mechanism, request):
    return build_scene(mechanism, (BASELINE,), request).texts


def functions(mechanism, request):
    """Names of the functions of the program, and its text."""
    text = texts(mechanism, request)["scene_program.h"]
    return set(re.findall(r"void FN\((\w+)\)", text)), text


@pytest.fixture(scope="module", autouse=True)
def compiled_for_this_file():
    """What other files have compiled lies in caches of theirs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "_compiled", {})
        yield


@cache
def model(chain, count, outputs=()):
    return mechc.compile(chain(count), outputs=outputs)


@pytest.mark.slow
def test_outputs_that_were_not_asked_for_are_not_written():
    four_bar = shipped_mechanism("four_bar")
    everything, _ = functions(four_bar, DEFAULT_REQUEST)
    nothing, text = functions(four_bar, NOTHING)
    gone = {f"output_{name}" for name in (
        "kinetic_energy", "potential_energy", "linear_momenta", "angular_momenta", "points",
        "point_velocities",
    )}  # fmt: skip
    assert everything - nothing == gone
    assert "multipliers" not in texts(four_bar, NOTHING)["scene_sizes.h"]
    assert len(text) < 0.7 * len(functions(four_bar, DEFAULT_REQUEST)[1])


@pytest.mark.slow
def test_a_fixed_parameter_takes_its_operations_with_it():
    """Without gravity no weight is left; the parameter is gone from the arrays too."""
    four_bar = shipped_mechanism("four_bar")
    fixed = OutputRequest(DEFAULT_REQUEST.outputs, {Symbol("g"): Integer(0)})
    _, with_weight = functions(four_bar, DEFAULT_REQUEST)
    _, without = functions(four_bar, fixed)
    assert "#define MECHC_NP 11" in texts(four_bar, DEFAULT_REQUEST)["scene_sizes.h"]
    assert "#define MECHC_NP 10" in texts(four_bar, fixed)["scene_sizes.h"]
    (potential,) = re.findall(r"out\[0\] = (.*?); /\* V \*/", without)
    assert potential == "R(0.0)"
    assert len(without) < len(with_weight)
    whole = operations_of_all(four_bar, fixed)
    assert operations_of_all(four_bar, DEFAULT_REQUEST) is None, "it is that of all"
    left = operations_of_all(four_bar, OutputRequest(frozenset()))
    assert whole == left  # nothing is fixed there
    report = mechc.load("four_bar", fix={"g": 0}, outputs=()).report()
    assert "loads: 3, of which 3 vanish" in report
    assert "with nothing fixed" in report
    gone, free = map(int, re.search(r"; (\d+) of (\d+) operations of the outputs", report).groups())
    assert 0 < gone < free


@pytest.mark.slow
def test_without_constraints_nothing_of_them_is_written_or_compiled():
    made, text = functions(planar_chain(3), NOTHING)
    assert "output_constraints" not in made
    body = "\n".join(line for line in text.splitlines() if "(void)" not in line)
    assert not ROWS.search(body)
    assert "constraints: none" in mechc.compile(planar_chain(3), outputs=()).report()


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("nm") is None, reason="nm lists what is in a binary")
def test_without_constraints_the_binary_has_no_code_for_them(monkeypatch):
    compile_as_for_users(monkeypatch)  # without optimisation it has what nothing calls
    open_chain = mechc.compile(planar_chain(3), outputs=())
    loop = mechc.load("four_bar")
    names = {}
    for each in (open_chain, loop):
        assert each.capsule
        path = each.system.reference.library_file or kept.find(each.build["key"])
        listed = subprocess.run(["nm", str(path)], capture_output=True, text=True, check=True)
        names[each.name] = listed.stdout
    found = {of for of in OF_ROWS if of in names[loop.name]}
    assert len(found) >= 3, "the names that are looked for are those of the runtime"
    assert not [of for of in OF_ROWS if of in names[open_chain.name]]


@pytest.mark.skipif(shutil.which("nm") is None, reason="nm lists what is in a binary")
@pytest.mark.thorough
def test_without_multipliers_asked_for_the_binary_has_no_code_for_them():
    """Of constraints, redundant ones included, the motion is solved without them."""
    found = {}
    for outputs in ((), ("multipliers",)):
        made = mechc.load("four_bar", outputs=outputs)
        assert made.capsule
        command = ["nm", str(kept.find(made.build["key"]))]
        listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        found[outputs] = "multipliers" in listed
    assert found == {(): False, ("multipliers",): True}


def test_rates_that_are_the_speeds_are_not_written():
    made, _ = functions(planar_chain(3), NOTHING)
    assert "output_coordinate_rates" not in made
    made, _ = functions(heavy_top(), NOTHING)
    assert "output_coordinate_rates" in made


@pytest.mark.slow
def test_a_plane_has_no_third_dimension():
    """Links move by three numbers instead of six; what points out of the plane is zero."""
    flat, solid = (derive_equations(chain(8), NOTHING) for chain in (planar_chain, spatial_chain))
    sizes = [[len(e.outputs[n].elements) for n in ("tree_subspace", "tree_inertia", "tree_wrench")]
             for e in (flat, solid)]  # fmt: skip
    assert sizes == [[8 * 3, 8 * 4, 8 * 3], [8 * 6, 8 * 10, 8 * 6]]
    told = derive_equations(
        planar_chain(8), OutputRequest(frozenset({"momenta", "points"}))
    ).outputs
    for name in ("points", "point_velocities", "linear_momenta"):
        assert set(told[name].elements[2::3]) == {0}, name
    assert set(told["angular_momenta"].elements[0::3]) == {0}
    report = mechc.compile(planar_chain(8), outputs=("points",)).report()
    assert "three numbers a motion of a link; 22 of 54 components" in report


@pytest.mark.slow
def test_five_links_in_a_row_in_space_are_written_out_link_by_link():
    """Fewer, and chains in a plane, are by partial velocities; seven are a tree at run time."""
    written = [derive_equations(c(n), NOTHING) for c, n in ((spatial_chain, 5), (spatial_chain, 4),
               (planar_chain, 5), (spatial_chain, 7))]  # fmt: skip
    assert [bool(e.intermediates) for e in written] == [True, False, False, True]
    assert [e.tree is not None for e in written] == [False, False, False, True]
    assert {"mass_matrix", "forcing"} <= written[0].outputs.keys()


def test_work_of_parameters_alone_is_done_once_a_run():
    """A call reads constants, and computes with no parameter that stands in them alone."""
    _, text = functions(shipped_mechanism("four_bar"), NOTHING)
    once, *running = text.split("/* What depends on the configuration")
    assert once.count("const real k") >= 6
    configuration = running[0].split("/* What depends on the speeds")[0]
    masses = [f"p[{i}]" for i in range(4, 10)]  # they stand in constants alone
    assert not any(mass in configuration for mass in masses)


@pytest.mark.slow
def test_the_report_says_what_each_stage_took_and_shows_itself_in_a_notebook():
    made = model(planar_chain, 3)
    made.wait_compiled()
    report = made.report()
    stages = ("describe", "derive", "optimize", "emit", "first unit", "driver", "collocation")
    assert all(re.search(rf"^{stage}: \d+\.\d+ s", report, re.M) for stage in stages)
    page = report._repr_html_()
    assert page.count("<table>") == len(report.sections) >= 4
    assert "configuration" in page
    assert report == str(report)


def test_names_in_a_report_are_text():
    """The report of a scene with a hostile name has no tag but those of its tables."""
    hostile = replace(planar_chain(3), title="<script>alert(1)</script>")
    page = mechc.compile(hostile, outputs=()).report()._repr_html_()
    assert set(re.findall(r"</?(\w+)", page)) <= {"b", "table", "tr", "th", "td"}
