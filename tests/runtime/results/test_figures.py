"""Promises of mechc.plot: true curves, readable scales, and any name or run drawn."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from mechc.errors import MechcError, MissingPackageError
from mechc.results import figures as plot
from mechc.results import panels
from mechc.results import sampling as view
from mechc.results.mathtext import typeset
from mechc.results.player.page import template
from tests.support import ROOT, fake_linkage
from tests.support.fake_linkage import FakeChangePoint, FakeModel, FakeSolution

HOSTILE = (
    "</script><b>", "$\\frac", "_hidden", 'say "hi" & \'bye\'', "two\nlines", "\u202eeman", "名前",
    "\ud800", "a/b\\c", "x" * 500, "%s {0} ${y}", "",
)  # fmt: skip


def hostile_run(**changes: Any) -> FakeSolution:
    names, points = HOSTILE[:3], HOSTILE[:7]
    return fake_linkage.run(
        title=HOSTILE[0] + HOSTILE[1],
        coordinates=names,
        speeds=HOSTILE[3:6],
        units={names[0]: "$m", HOSTILE[3]: "a\nb<c>"},
        point_names=points,
        skeleton=(("$", points[:2]), ("_", points[1:4])),
        ground=(points[0],),
        traced=points[1:],
        **changes,
    )


LEAST = replace(fake_linkage.run(constrained=False), t=np.array([0.0]))


def texts(figure: Any) -> list[str]:
    """Everything the figure says; drawing it first also shows that it can be drawn."""
    from matplotlib.text import Text

    figure.canvas.draw()
    return [text.get_text() for text in figure.findobj(Text)]


@dataclass(frozen=True)
class ExactlyClosed(FakeSolution):
    """A run whose residuals are exact zeros at its steps."""

    @property
    def closure(self) -> Any:
        return np.zeros_like(self.t)

    @property
    def velocity_closure(self) -> Any:
        return np.zeros_like(self.t)


class NoEnergyModel(FakeModel):
    """A scene that was compiled without its energy."""

    def kinetic_energy(self, *_: Any) -> Any:
        raise MechcError("this scene was compiled without energy: ask for outputs=('energy',)")


def test_the_fake_linkage_moves_as_the_reference_does() -> None:
    reference = {
        0.5: [2.07411126810819182, 0.560754596757764875, -0.7030486336841345],
        3.0: [1.71994051742504046, 0.644506847235452485, -0.8185693473471385],
    }
    for time, state in reference.items():
        got = fake_linkage.exact_state(np.array(time))[:3]
        np.testing.assert_allclose(got, state, rtol=0, atol=2e-12)


@pytest.mark.parametrize(("draw", "first"), [("coordinates", 0), ("speeds", 3)])
def test_curves_are_the_dense_output_in_degrees(draw: str, first: int) -> None:
    figure = plot.picture(draw, fake_linkage.run(steps=5), samples=400)
    lines = figure.axes[0].get_lines()
    grid = np.linspace(0.0, 4.0, 400)
    expected = np.rad2deg(fake_linkage.exact_state(grid))[:, first : first + 3]
    assert len(lines) == 3
    for line, values in zip(lines, expected.T, strict=True):
        np.testing.assert_allclose(line.get_xdata(), grid)
        np.testing.assert_allclose(line.get_ydata(), values)


def test_axes_carry_units_and_names_are_pretty() -> None:
    said = texts(plot.picture("overview", fake_linkage.run()))
    wanted = {"time (s)", "angle (°)", "angular speed (°/s)", "x (m)", "y (m)", "energy (J)"}
    assert wanted | {r"$\theta_{0}$", r"$\theta_{2}$", r"$\omega_{0}$", "path of $p_{2}$"} <= set(
        said
    )


def test_coordinates_of_different_units_get_their_own_panels() -> None:
    units = {"theta_0": "rad", "theta_1": "m", "theta_2": "rad"}
    figure: Any = plot.picture("coordinates", fake_linkage.run(units=units))
    assert [axes.get_ylabel() for axes in figure.axes] == ["angle (°)", "position (m)"]
    np.testing.assert_allclose(
        figure.axes[1].get_lines()[0].get_ydata()[-1], fake_linkage.exact_state(np.array(4.0))[1]
    )


def test_paths_keep_their_shape() -> None:
    figure: Any = plot.picture("paths", fake_linkage.run())
    axes = figure.axes[0]
    figure.canvas.draw()
    assert axes.get_aspect() == 1.0
    crank = next(line for line in axes.get_lines() if len(line.get_xdata()) == plot.SAMPLES)
    np.testing.assert_allclose(np.hypot(crank.get_xdata(), crank.get_ydata()), 1.0)


def test_a_spatial_mechanism_is_drawn_on_its_two_widest_axes_and_says_so() -> None:
    tilt = ((1.0, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.9, 1.0))
    run = view.sample(fake_linkage.run(tilt=tilt), 50)
    assert view.plane_view(run).axes == ("x", "z")
    said = texts(plot.picture("paths", run.solution))
    assert {"x (m)", "z (m)", "spatial motion, projected on x and z"} <= set(said)
    assert "projected" not in " ".join(texts(plot.picture("paths", fake_linkage.run())))


def test_a_mechanism_may_say_from_where_it_is_seen() -> None:
    tilt = ((1.0, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.9, 1.0))
    widest = view.plane_view(view.sample(fake_linkage.run(tilt=tilt), 50))
    run = view.sample(fake_linkage.run(tilt=tilt, view=("x", "-z")), 50)
    seen = view.plane_view(run)
    assert seen.axes == ("x", "-z")
    np.testing.assert_array_equal(seen.positions, widest.positions * [1, -1])
    assert {"x (m)", "-z (m)"} <= set(texts(plot.picture("paths", run.solution)))


def test_energy_change_is_readable_at_rounding_level() -> None:
    figure = plot.picture("energy", fake_linkage.run())
    change = figure.axes[1]
    assert "10⁻¹" in change.get_ylabel()
    assert 0.5 < max(np.abs(change.get_lines()[0].get_ydata())) < 20.0


class Driven(fake_linkage.FakeSolution):
    """Energy that 3 t joules of work were done on, of which the motion knows nothing."""

    @property
    def work(self) -> Any:
        return self.work_until(self.t)

    def work_until(self, times: Any) -> Any:
        return 3.0 * np.asarray(times)


def test_where_work_is_done_what_it_does_not_explain_is_drawn() -> None:
    run = fake_linkage.run()
    plain, driven = (
        plot.picture("energy", sol).axes[1] for sol in (run, Driven(run.system, run.t))
    )
    assert "change of total energy" in plain.get_ylabel()
    assert "change of energy less work" in driven.get_ylabel()
    t, change = driven.lines[0].get_data()
    assert np.polyfit(t, change, 1)[0] < 0  # energy is kept, the work is missing
    assert np.abs(np.diff(change, 2)).max() < 1e-6 * np.ptp(change)


def test_energies_have_the_colours_of_the_pages() -> None:
    lines = plot.picture("energy", fake_linkage.run()).axes[0].get_lines()
    light = re.search(r"light: \[(.*?)\]", template("player", "theme.js"))
    assert light is not None
    expected = re.findall(r"#\w{6}", light[1])[:3]
    assert [str(line.get_color()).lower() for line in lines] == expected


def test_an_energy_that_never_changes_is_drawn_flat() -> None:
    resting = replace(fake_linkage.run(), t=np.array([0.0, 1e-9]))
    low, high = plot.picture("energy", resting).axes[1].get_ylim()
    assert low < 0.0 < high


def test_a_unit_of_one_is_not_spelt_out() -> None:
    assert plot.picture("coordinates", fake_linkage.run(units={})).axes[0].get_ylabel() == "value"


def test_energy_that_was_not_asked_for_is_a_sentence_not_an_error() -> None:
    sol = replace(fake_linkage.run(), system=NoEnergyModel())
    assert any("compiled without energy" in text for text in texts(plot.picture("energy", sol)))
    texts(plot.picture("overview", sol))


def test_closure_is_on_a_log_scale_and_shows_exact_zeros() -> None:
    usual = plot.picture("closure", fake_linkage.run())
    assert usual.axes[0].get_yscale() == "log"
    sol = fake_linkage.run()
    closed = plot.picture("closure", ExactlyClosed(sol.system, sol.t))
    assert "exactly zero" in texts(closed)
    marks = closed.axes[0].get_lines()[-1]
    np.testing.assert_array_equal(marks.get_xdata(), sol.t)


def test_a_scene_without_constraints_says_so() -> None:
    sol = fake_linkage.run(constrained=False)
    assert any("no constraints" in text for text in texts(plot.picture("closure", sol)))
    texts(plot.picture("overview", sol))


@pytest.mark.parametrize(
    ("times", "label"),
    [
        ((1.5,), "change point at (s)"),
        ((0.5, 2.5), "change points at (s)"),
        ((1.0, 1.001, 2.0), "3 change points"),
        (tuple(np.linspace(0.1, 3.9, 17)), "17 change points"),
    ],
)
def test_change_points_are_marked_and_labelled(times: tuple[float, ...], label: str) -> None:
    sol = replace(fake_linkage.run(), change_points=tuple(map(FakeChangePoint, times)))
    figure: Any = plot.picture("coordinates", sol)
    assert label in texts(figure)
    lines = figure.axes[0].get_lines()
    marked = [line.get_xdata()[0] for line in lines if len(line.get_xdata()) == 2]
    np.testing.assert_array_equal(marked, times)


def test_no_change_points_leave_no_label() -> None:
    assert not any(
        "change point" in text for text in texts(plot.picture("overview", fake_linkage.run()))
    )


def test_hostile_names_are_shown_as_they_are_and_saved(tmp_path: Path) -> None:
    sol = replace(hostile_run(), status="ended: $x_{ and </svg>\n" + HOSTILE[6])
    said = texts(plot.picture("coordinates", sol))
    assert {"</script><b>", r"\$\frac", "_hidden"} <= set(said)
    plot._save(plot.picture("overview", sol, samples=50), tmp_path / "overview.svg", 40)
    tree = ElementTree.parse(tmp_path / "overview.svg")
    tags = {element.tag.rsplit("}")[-1] for element in tree.iter()}
    assert "svg" in tags
    assert "script" not in tags


@pytest.mark.parametrize("name", HOSTILE)
def test_shown_names_are_one_short_printable_line(name: str) -> None:
    shown = view.pretty_name(name)
    assert shown.isprintable()
    assert len(shown) <= 32


@pytest.mark.parametrize(
    ("name", "shown"),
    [("theta_0", "θ₀"), ("omega_12", "ω₁₂"), ("q3", "q₃"), ("l_ab", "l_ab"), ("x_1_2", "x_1_2")],
)
def test_pretty_names(name: str, shown: str) -> None:
    assert view.pretty_name(name) == shown


def test_many_coordinates_keep_a_short_legend() -> None:
    names = tuple(f"q_{i}" for i in range(40))
    sol = fake_linkage.run(coordinates=names, units=dict.fromkeys(names, "rad"))
    run = view.Run(sol, np.linspace(0, 1, 9), np.random.default_rng(0).normal(size=(9, 43)))
    figure = plot._picture("coordinates", run)
    shown = [text for text in texts(figure) if text.startswith("$q")]
    assert len(shown) == panels.MOST_LEGEND_LINES
    assert shown[0] == "$q_{0}$"
    assert shown[-1] == "$q_{39}$"


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    "sol",
    [
        pytest.param(replace(fake_linkage.run(), t=np.array([0.7])), id="single sample"),
        pytest.param(replace(fake_linkage.run(), t=np.array([0.0, 1e-12])), id="short run"),
        pytest.param(replace(fake_linkage.run(), t=np.array([2.0, 0.5])), id="backward in time"),
        pytest.param(
            fake_linkage.run(point_names=(), skeleton=(), ground=(), traced=()), id="no points"
        ),
        pytest.param(fake_linkage.run(skeleton=(), ground=(), traced=()), id="no skeleton"),
        pytest.param(fake_linkage.run(speeds=()), id="no speeds"),
        pytest.param(LEAST, id="least"),
    ],
)
def test_odd_runs_are_drawn_without_a_warning(sol: FakeSolution) -> None:
    assert "Coordinates" in texts(plot.picture("overview", sol, samples=30))


def test_a_run_that_left_the_numbers_is_drawn_up_to_there() -> None:
    run = view.sample(fake_linkage.run(), 60)
    run.y[40:] = np.nan
    assert "Coordinates" in texts(plot._picture("overview", run))
    figure: Any = plot._picture("coordinates", run)
    expected = np.rad2deg(fake_linkage.exact_state(run.t)[:40, :3])
    for line, values in zip(figure.axes[0].get_lines(), expected.T, strict=True):
        np.testing.assert_allclose(line.get_ydata()[:40], values)
        assert np.isnan(line.get_ydata()[40:]).all()
    low, high = figure.axes[0].get_ylim()
    assert low < expected.min() < expected.max() < high < expected.max() + np.ptp(expected)


@pytest.mark.slow
def test_files_have_fixed_names_and_the_same_bytes_every_time(tmp_path: Path) -> None:
    sol = fake_linkage.run(steps=9)
    first = plot.save_all(sol, tmp_path / "new" / "a", samples=50, dpi=40)
    second = plot.save_all(sol, tmp_path / "b", samples=50, dpi=40)
    stems = ("overview", "coordinates", "speeds", "paths", "energy", "closure")
    assert [path.name for path in first] == [f"{s}.{e}" for s in stems for e in ("png", "svg")]
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_a_notebook_can_show_a_picture() -> None:
    picture: Any = plot.picture("overview", fake_linkage.run(), samples=50)
    assert picture._repr_png_().startswith(b"\x89PNG")


def test_no_global_setting_outlives_a_picture(tmp_path: Path) -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    plot._save(plot.picture("coordinates", fake_linkage.run(), samples=20), tmp_path / "a.svg", 30)
    assert dict(matplotlib.rcParams) == before


def test_matplotlib_is_imported_late_and_pyplot_never() -> None:
    program = (
        "import sys\n"
        "from mechc.results import figures as plot\n"
        "from tests.support import fake_linkage\n"
        "assert 'matplotlib' not in sys.modules\n"
        "plot.picture('overview', fake_linkage.run(), samples=20)\n"
        "assert 'matplotlib' in sys.modules and 'matplotlib.pyplot' not in sys.modules\n"
    )
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_missing_matplotlib_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingPackageError, match="pip install matplotlib"):
        plot.picture("overview", fake_linkage.run())


def shown_legend(axes: Any) -> list[str]:
    return [text.get_text() for text in axes.get_legend().get_texts()]


@pytest.mark.parametrize("count", [3, 12, 18, 40])
def test_a_legend_fits_beside_its_panel(count: int) -> None:
    names = tuple(f"q_{k}" for k in range(count))

    class Chain(FakeSolution):
        def __call__(self, t: Any, /) -> Any:
            return np.outer(np.ones_like(t), np.arange(2.0 * count))

        @property
        def y(self) -> Any:
            return self(self.t)

    units = dict.fromkeys(names, "rad")
    model = replace(FakeModel(), coordinates=names, speeds=names, units=units)
    figure: Any = plot.picture("coordinates", Chain(model, np.linspace(0.0, 1.0, 9)), samples=20)
    figure.canvas.draw()
    (axes,) = figure.axes
    box, panel = axes.get_legend().get_window_extent(), figure.bbox
    assert box.y0 >= panel.y0
    assert box.x1 <= panel.x1
    assert axes.get_window_extent().width > 0.4 * panel.width
    told = shown_legend(axes)
    assert (told[0], told[-1]) == ("$q_{0}$", typeset(names[-1]))
    heading = axes.get_legend().get_title().get_text()
    assert (len(told), heading) == ((12, "12 of 40") if count == 40 else (count, ""))


def test_curves_that_coincide_are_told_apart() -> None:
    t = np.linspace(0.0, 1.0, 500)
    values = np.column_stack([np.sin(t), np.cos(t), np.sin(t) + 1e-6, np.sin(t)])
    figure: Any = plot._figure_class()(figsize=(4, 3), dpi=100)
    axes = figure.add_subplot()
    colours = ["#ff0000", "#000000", "#00ff00", "#0000ff"]
    from mechc.results.curves import draw_curves

    first, alone, *_ = draw_curves(axes, t, values, colours)
    assert (first.is_dashed(), alone.is_dashed()) == (True, False)
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3].reshape(-1, 3).astype(int)
    for channel in range(3):
        pure = (pixels[:, channel] > 200) & (np.delete(pixels, channel, 1).max(axis=1) < 60)
        assert pure.sum() > 20  # each of the three that coincide is seen


def test_what_has_no_constraints_has_no_panel_of_closure(tmp_path: Path) -> None:
    free = fake_linkage.run(constrained=False)
    figure: Any = plot.picture("overview", free)
    assert not any(axes.get_title(loc="left") == "Closure" for axes in figure.axes)
    assert not any("no constraints" in said for said in texts(figure))
    plot.save_all(free, tmp_path, samples=20, formats=("svg",), dpi=20)
    assert {"energy.svg"} <= {path.name for path in tmp_path.iterdir()}
    assert not (tmp_path / "closure.svg").exists()
