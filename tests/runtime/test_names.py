"""Names are any text, and a name is a name: in C, Python, HTML, pictures and files."""

import csv
import os
import warnings
from pathlib import Path

import numpy as np
import pytest
from sympy import Dummy, Function, Symbol, sin
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc
from benchmarks.problems.particle import on_a_line, particle
from mechc.errors import MechcError

t = dynamicsymbols._t
NAMES = (
    r"\theta_{0}", "$", "$x_{", "θ̈ 名前 \U0001f600 \u202e", "int", "z0", "mechc_scene",
    "say \"hi\" & 'bye'", "two\nlines\r\t", "*/ int x; /*", "<script>alert(1)</script>",
    "a/b\\c", '"); system("touch PWNED");', "-->", "]]>", "%s {0} ${y}", "=1+1", "../../up", "..",
    ".", "", " ", "time", "energy", "closure", "y", "y0", "t", "status", "member", "state",
    "zarr.json", "x" * 120, "__import__('os').system('touch PWNED')", "lambda", "gamma",
)  # fmt: skip


def particles(coordinates, speeds, masses, gravity, points):
    """Particles on a line, each drawn back by a sine, by Kane's method."""
    qs = [Function(name)(t) for name in coordinates]
    us = [Function(name)(t) for name in speeds]
    forces = [-Symbol(gravity) * sin(q) for q in qs]
    return on_a_line(qs, us, forces, [Symbol(mass) for mass in masses], points)


@pytest.fixture(
    scope="module",
    params=[pytest.param(0, marks=pytest.mark.slow), 1, pytest.param(2, marks=pytest.mark.slow)],
)
def scene(request):
    """(model, coordinates, speeds, masses, name of an output): a third of the names each."""
    names = NAMES[12 * request.param : 12 * request.param + 12]
    q, u, m = names[:4], names[4:8], names[8:]
    own = f"{names[-1]} of {names[0]}"
    model = mechc.compile(
        particles(q, u, m, "g'%$</", u),
        defaults={**dict.fromkeys(m, 1.0), "g'%$</": 2.0},
        units={q[0]: names[1], m[0]: names[2]},
        outputs=("energy", "points", "momenta", {own: Function(q[0])(t) ** 2}),
        name=names[3],
    )
    return model, q, u, m, own


@pytest.fixture(scope="module")
def sol(scene):
    model, q, *_ = scene
    return model.simulate(0.5, model.assemble({q[0]: 0.3}))


@pytest.fixture(autouse=True)
def nothing_is_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield
    assert not Path("PWNED").exists()


def test_the_model_knows_them_and_computes_with_them(scene):
    model, q, u, m, own = scene
    assert (model.coordinates, model.speeds) == (q, u)
    assert set(model.parameters) == {*m, "g'%$</"}
    y = np.linspace(0.1, 0.8, 8)
    rates = model.rhs(0.0, y, {m[1]: 4.0, "g'%$</": 3.0})
    np.testing.assert_allclose(rates[:4], y[4:])
    np.testing.assert_allclose(rates[4:], -3.0 * np.sin(y[:4]) / [1, 4, 1, 1], rtol=1e-14)
    assert model.output(own, y) == pytest.approx(0.01, rel=1e-14)
    assert model.point_names == model.body_names == u


def test_displays_hold_them_as_text(scene, sol):
    model = scene[0]
    for page in (model._repr_html_(), sol._repr_html_(), sol.animate().html):
        assert "<script>alert(1)" not in page
        assert "]]><" not in page
    report = model.report()
    assert all(line.isprintable() for line in report.split("\n"))
    assert "<script>alert(1)" not in report._repr_html_()
    assert repr(model)


@pytest.mark.filterwarnings("ignore:Glyph:UserWarning", "ignore:constrained_layout:UserWarning")
def test_pictures_are_drawn(scene, sol, tmp_path):
    """A stray $ is no formula."""
    figure = sol.plot()
    for name in ("run.svg", "run.png"):
        figure.savefig(tmp_path / name)
    assert "<script>alert(1)" not in (tmp_path / "run.svg").read_text("utf-8")


def test_files_keep_them(scene, sol, tmp_path):
    xarray = pytest.importorskip("xarray")
    _, q, u, *_ = scene
    for path in (sol.save(tmp_path / "run.nc"),):
        with xarray.open_dataset(path, engine="scipy", decode_times=False) as data:
            kept = {v.attrs["long_name"]: v.values for v in data.values() if "long_name" in v.attrs}
    for k, name in enumerate((*q, *u)):
        np.testing.assert_array_equal(kept[name], sol.y[:, k])
    with sol.save(tmp_path / "run.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert len(rows) == len(sol.t)
    assert all(any(name in cell for cell in header) for name in (*q, *u))
    assert not any(cell[:1] in "=+-@" for cell in header)
    assert sorted(os.listdir(tmp_path)) == ["run.csv", "run.nc"]


def test_batches_and_their_stores_keep_them(scene, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("zarr")
    model, q, _, m, own = scene
    start, varied = mechc.Assembly({q[0]: np.linspace(0, 1, 3)}), {m[0]: [1.0, 2.0, 3.0]}
    batch = model.simulate_batch(
        0.5, start, varied, out=tmp_path / "batch", outputs=(own,), t_eval=[0.1, 0.2]
    )
    np.testing.assert_allclose(batch[own][:, 0], batch.arrays["y_eval"][:, 0, 0] ** 2, rtol=1e-12)
    data = batch.to_xarray()
    given = {v.attrs.get("long_name"): v.values for v in data.coords.values()}
    np.testing.assert_array_equal(given[m[0]], varied[m[0]])
    assert list(data.state.values) == [*model.coordinates, *model.speeds]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zarr: texts of a fixed length have no standard yet
        data.to_zarr(tmp_path / "again.zarr", consolidated=False)
    again = xarray.open_zarr(tmp_path / "again.zarr", consolidated=False)
    assert list(again.state.values) == [*model.coordinates, *model.speeds]
    stored = {p.name for p in (tmp_path / "batch" / "data.zarr").iterdir()}
    assert stored == {*batch.arrays, "zarr.json"}
    assert sorted(os.listdir(tmp_path)) == ["again.zarr", "batch"]


def test_what_was_saved_is_opened_again(scene, sol, tmp_path):
    """The mechanism is found by its key in the user's own cache."""
    again = mechc.open(sol.save(tmp_path / "run.nc"))
    assert again.model.coordinates == scene[1]
    np.testing.assert_allclose(again.y, sol.y, rtol=1e-12)


# -- one printed name for two things ---------------------------------------------------------


def slider(q, u, mass, stiffness, *, twice=False):
    """A particle on a spring; twice: another one at twice the place, of the same name."""
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    place = O.locatenew("P", q * N.x)
    place.set_vel(N, u * N.x)
    bodies = [Particle("B", place, mass)]
    if twice:
        other = O.locatenew("P", 2 * q * N.x)
        other.set_vel(N, 2 * u * N.x)
        bodies.append(Particle("B", other, mass))
    kane = KanesMethod(N, [q], [u], kd_eqs=[q.diff(t) - u])
    kane.kanes_equations(bodies, [(place, -stiffness * q * N.x)])
    return kane


q, u = dynamicsymbols("q u")
m, c = Symbol("m"), Symbol("c")


@pytest.mark.parametrize(
    ("coordinate", "mass", "stiffness", "name"),
    [
        (q, m, Symbol("m", positive=True), "m"),
        (q, Dummy("m"), Dummy("m"), "_m"),
        (q, m, Symbol("q"), "q"),
        (q, Symbol("u"), c, "u"),
        (dynamicsymbols("c"), m, c, "c"),
    ],
)
def test_two_symbols_of_one_name_are_refused(coordinate, mass, stiffness, name):
    with pytest.raises(MechcError, match=f"more than one symbol is printed as '{name}'"):
        mechc.compile(slider(coordinate, u, mass, stiffness))


def test_two_coordinates_of_one_name_are_refused():
    q, other = dynamicsymbols("q"), dynamicsymbols("q", positive=True)
    u, v = dynamicsymbols("u v")
    kane = particle([q, other], [u, v], [-q, -2 * other])
    with pytest.raises(MechcError, match="printed as 'q'"):
        mechc.compile(kane)


def test_points_and_bodies_of_one_name_are_told_apart():
    model = mechc.compile(slider(q, u, m, c, twice=True), outputs=("points", "momenta"))
    assert model.point_names == ("P", "P (2)")
    assert model.body_names == ("B", "B (2)")
    values = {"m": 1.0, "c": 1.0}
    np.testing.assert_array_equal(model.points([0.5, 0.1], values)[:, 0], [0.5, 1.0])
    np.testing.assert_allclose(model.point_velocities([0.5, 0.1], values)[:, 0], [0.1, 0.2])
    np.testing.assert_allclose(model.momenta([0.5, 0.1], values).linear[:, 0], [0.1, 0.2])


def test_symbols_that_differ_in_assumptions_alone_are_two_scenes():
    """Of each there is one here, so each is called by its name; but one is not the other."""
    kinds = (Symbol("m"), Symbol("m", positive=True), Symbol("m", real=True))
    models = [mechc.compile(slider(q, u, kind, c)) for kind in kinds]
    assert len({model.build["key"] for model in models}) == 3
    positive = dynamicsymbols("q", positive=True)
    keys = {mechc.compile(slider(x, u, m, c)).build["key"] for x in (q, positive)}
    assert len(keys) == 2


def test_names_made_to_look_like_other_expressions_are_other_scenes():
    """What is written down for the key cannot be forged by a name."""

    def digest(*expressions):
        from mechc_codegen.convert.fingerprint import Fingerprint

        text = Fingerprint(ReferenceFrame("N"))
        for expression in expressions:
            text.expression(expression)
        return text.digest()

    x = Symbol("x")
    f, g = Function("sin"), Function("Symbol()'x'[]\nsin")
    assert len({digest(x), digest(sin(x)), digest(f(x)), digest(g(x))}) == 4


# -- texts where expressions belong -----------------------------------------------------------

EVIL = "__import__('os').system('touch PWNED')"


@pytest.mark.parametrize(
    "asked",
    [
        {"outputs": ({"x": EVIL},)},
        {"configuration_constraints": [EVIL]},
        {"outputs": ({"x": [q, EVIL]},)},
    ],
)
def test_a_text_is_never_evaluated(asked):
    with pytest.raises(MechcError, match=r"is not an expression; write one with SymPy's symbols"):
        mechc.compile(slider(q, u, m, c * dynamicsymbols("F")), **asked)


def test_a_text_of_an_input_is_read_by_the_grammar_alone():
    with pytest.raises(MechcError, match=r"cannot read .* at character 12: .* means nothing here"):
        mechc.compile(slider(q, u, m, c * dynamicsymbols("F")), inputs={"F": EVIL})


@pytest.mark.parametrize("asked", [{"defaults": {"c": EVIL}}, {"fix": {"c": EVIL}}])
def test_a_text_is_no_number(asked):
    with pytest.raises(MechcError, match="is not a number"):
        mechc.compile(slider(q, u, m, c), **asked)


@pytest.mark.parametrize("name", ["rates", "forcing", "mass_matrix", "energy", "kinetic_energy"])
def test_an_output_of_ones_own_does_not_take_the_place_of_another(name):
    with pytest.raises(MechcError, match=f"'{name}' is the name of another output"):
        mechc.compile(slider(q, u, m, c), outputs=({name: q},))


@pytest.mark.parametrize("name", ["", "a\0b", 3, None])
def test_what_is_no_name_is_refused(name):
    with pytest.raises(MechcError, match="is not a name"):
        mechc.compile(slider(q, u, m, c), outputs=({name: q},))


def test_every_output_of_mechcs_own_is_reserved():
    from mechc_codegen.emit.metadata import OUTPUTS
    from mechc_codegen.frontend.read_request import RESERVED

    model = mechc.load("four_bar")
    assert set(model.system.scene.outputs) <= RESERVED
    assert {*OUTPUTS, *(name for names in OUTPUTS.values() for name in names)} <= RESERVED
