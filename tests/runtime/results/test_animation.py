"""Promises of sol.animate(): one page, true to the motion, closed to the network and to markup."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import dataclass, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from mechc.errors import ValueOutOfBoundsError
from mechc.results.animation import animate
from mechc.results.player.motion import MOST_FRAMES
from mechc.results.sampling import pretty_name
from mechc.results.view.page import view_data
from tests.support import fake_linkage
from tests.support.fake_linkage import FakeChangePoint, FakeSolution, Faster
from tests.support.page_data import floats

EVIL = "</script><img src=x onerror=alert(1)>\u2028'\"&${x}$x"


class Page(HTMLParser):
    """The tags and scripts of a page, as a browser's parser would find them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.scripts: list[str] = []
        self.inside = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        if tag == "script":
            self.scripts.append("")
            self.inside = True

    def handle_endtag(self, tag: str) -> None:
        self.inside = self.inside and tag != "script"

    def handle_data(self, data: str) -> None:
        if self.inside:
            self.scripts[-1] += data


def motion(sol: FakeSolution, **policy: Any) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(Page(animate(sol, **policy).html).scripts[0])
    return data


def tracks(data: dict[str, Any]) -> Any:
    """Positions of the points, (frames, points, 2) m from the origin."""
    return floats(data["tracks"]).reshape(data["frames"], len(data["points"]), 2)


def evil_run() -> FakeSolution:
    points = (EVIL, "p_1", "p_2", "\ud800", "a", "b", "c")
    return fake_linkage.run(
        name=EVIL,
        title=EVIL,
        coordinates=(EVIL, "$\\frac", "\u202eabc"),
        point_names=points,
        skeleton=((EVIL, points[:2]),),
        ground=(EVIL,),
        traced=("\ud800",),
        units={EVIL: EVIL},
    )


def test_frames_are_sixty_a_second_of_simulated_time_and_240_of_short_runs() -> None:
    data = motion(fake_linkage.run(5.0))
    assert data["frames"] == 301
    assert data["step"] == pytest.approx(1 / 60, rel=1e-12)
    assert data["notes"] == []
    assert motion(fake_linkage.run(0.03))["frames"] == 240


def test_what_turns_more_has_more_frames_and_the_page_fills_in_the_rest() -> None:
    """At 60 frames a second nine in ten of this motion's were missing: circles were triangles."""
    made = fake_linkage.run(2.0)
    sol = Faster(made.system, np.array([0.0, 1.0, 2.0]))
    data = motion(sol)
    assert data["frames"] > 4 * 121
    names = ["O", "p_1", "p_2", "p_3"]
    t = np.random.default_rng(1).uniform(0.0, 2.0, 4000)
    true = sol.system.points(sol(t))[:, [sol.system.point_names.index(n) for n in names], :2]
    frames = tracks(data)[:, [data["points"].index(pretty_name(n)) for n in names]] + data["origin"]
    drawn = CubicHermiteSpline(np.arange(len(frames)), frames, np.gradient(frames, axis=0))
    assert np.abs(drawn(t / data["step"]) - true).max() < 0.004 * 3.5


@pytest.mark.parametrize("of", ["animate", "view"])
def test_paths_are_the_dense_output_and_not_the_frames(of: str) -> None:
    """In pages of both kinds cubics through their points are the motion, however fast."""
    made = fake_linkage.run(2.0)
    sol = Faster(made.system, np.array([0.0, 1.0, 2.0]))
    data = motion(sol) if of == "animate" else view_data(sol)
    times, traced = floats(data["paths"]["times"]), len(data["traced"])
    points = floats(data["paths"]["points"]).reshape(len(times), traced, -1) + data["origin"]
    assert (np.diff(times) > 0).all()
    assert len(times) < 2400  # of which frames between them would need more
    names = sol.system.point_names
    numbers = [[pretty_name(n) for n in names].index(data["points"][k]) for k in data["traced"]]
    t = np.random.default_rng(1).uniform(0.0, 2.0, 4000)
    true = sol.system.points(sol(t))[:, numbers, : points.shape[-1]]
    drawn = CubicHermiteSpline(times, points, np.gradient(points, times.astype(float), axis=0))
    assert np.abs(drawn(t) - true).max() < 0.0005 * np.ptp(true, axis=0).max()


@pytest.mark.slow
def test_curves_are_the_dense_output_and_not_the_frames() -> None:
    made = fake_linkage.run(2.0)
    sol = Faster(made.system, np.array([0.0, 1.0, 2.0]))
    data = motion(sol)
    grid = np.linspace(0.0, 2.0, 40001)
    times = floats(data["times"])
    assert (np.diff(times) > 0).all()
    energy = {line["name"]: floats(line["values"]) for line in data["panels"][-1]["lines"]}
    true = sol.system.kinetic_energy(sol(grid))
    seen = np.interp(grid, times, energy["kinetic"])
    assert np.abs(seen - true).max() < 0.004 * true.max()
    angle = floats(data["panels"][0]["lines"][1]["values"])
    true = np.rad2deg(sol(grid)[:, 1])
    assert np.abs(np.interp(grid, times, angle) - true).max() < 0.004 * 360


def test_a_constant_energy_is_not_followed_into_its_rounding() -> None:
    assert len(floats(motion(fake_linkage.run(4.0))["times"])) < 1500


def test_long_runs_are_capped_and_say_the_frame_step() -> None:
    data = motion(fake_linkage.run(120.0))
    assert data["frames"] == MOST_FRAMES
    assert data["notes"] == ["one frame every 40 ms"]


def test_frames_hold_the_motion_to_single_precision() -> None:
    data = motion(fake_linkage.run(1.0))
    times = data["start"] + data["step"] * np.arange(data["frames"])
    true = fake_linkage.joints(fake_linkage.exact_state(times)[:, :3])[:, 2, :2]
    seen = tracks(data)[:, data["points"].index("p₂")] + data["origin"]
    assert np.abs(seen - true).max() <= 2e-7 * np.abs(true).max()


def test_coordinates_are_plotted_in_degrees() -> None:
    panel = motion(fake_linkage.run(1.0))["panels"][0]
    assert (panel["unit"], panel["lines"][0]["name"]) == ("°", "θ₀")
    assert floats(panel["lines"][0]["values"])[0] == pytest.approx(85.0)


def test_links_pivots_and_traces_point_at_the_right_tracks() -> None:
    data = motion(fake_linkage.run(1.0))
    names = data["points"]
    assert [[names[i] for i in link["points"]] for link in data["links"]] == [
        ["O", "p₁"], ["p₁", "p₂"], ["p₂", "p₃"],
    ]  # fmt: skip
    assert [names[i] for i in data["ground"]] == ["O", "p₃"]
    assert [names[i] for i in data["traced"]] == ["p₁", "p₂", "g₁"]
    assert "g₀" not in names


def test_change_points_reach_the_page() -> None:
    sol = replace(fake_linkage.run(), change_points=(FakeChangePoint(1.25), FakeChangePoint(3.0)))
    assert [mark["t"] for mark in motion(sol)["marks"]] == [1.25, 3.0]
    assert motion(fake_linkage.run())["marks"] == []


def test_speeds_offered() -> None:
    usual = motion(fake_linkage.run(20.0))
    assert (usual["speeds"], usual["speed"]) == ([0.1, 0.25, 0.5, 1.0, 2.0], 1.0)
    brief = motion(fake_linkage.run(0.03))
    assert brief["speed"] == 0.01
    assert brief["speeds"][0] == 0.01


def test_names_cannot_break_out_of_the_page() -> None:
    text = animate(evil_run()).html
    page = Page(text)
    assert text.isascii()
    assert page.tags.count("script") == 2
    assert "img" not in page.tags
    assert not {"<", ">", "&"} & set(page.scripts[0])
    assert json.loads(page.scripts[0])["title"].startswith("</script><img src=x")


def test_user_text_is_never_read_as_markup_by_the_script() -> None:
    script = Page(animate(fake_linkage.run()).html).scripts[1]
    for gate in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("):
        assert gate not in script


def test_the_page_asks_nothing_of_the_network_and_runs_only_its_own_script() -> None:
    text = animate(fake_linkage.run()).html
    page = Page(text)
    assert not {name for name, _ in page.attributes} & {"src", "href", "srcset"}
    assert "url(" not in text
    assert "@import" not in text
    policy = next(value or "" for name, value in page.attributes if "default-src" in (value or ""))
    digest = base64.b64encode(hashlib.sha256(page.scripts[1].encode()).digest()).decode()
    assert "default-src 'none'" in policy
    assert f"script-src 'sha256-{digest}';" in policy
    assert "unsafe" not in policy


def test_every_placeholder_is_filled() -> None:
    text = animate(fake_linkage.run()).html
    assert not re.search(r"\$(title|style|motion|library|script|\w+_hash|script_sources)\b", text)


def test_a_notebook_shows_the_same_page_in_a_sandbox(tmp_path: Path) -> None:
    animation = animate(fake_linkage.run(1.0))
    frame = dict(Page(animation._repr_html_()).attributes)
    assert frame["srcdoc"] == animation.html
    assert frame["sandbox"] == "allow-scripts"
    path = animation.save(tmp_path / "new" / "motion.html")
    assert path.read_bytes().decode("ascii") == animation.html
    with pytest.raises(ValueOutOfBoundsError, match=r"save it as \.html.*sol\.view\(\)\.save"):
        animation.save(tmp_path / "motion.gif")


def test_repr_is_one_short_line_however_long_the_page() -> None:
    animation = animate(fake_linkage.run(1.0))
    assert len(animation.html) > 10_000
    assert re.fullmatch(r"<mechc animation, \d+ KiB of HTML[^<>\n]*>", repr(animation))
    assert len(repr(animation)) < 100


@pytest.mark.parametrize("fps", [0.0, -1.0, float("nan"), float("inf")])
def test_a_senseless_frame_rate_is_refused(fps: float) -> None:
    with pytest.raises(ValueOutOfBoundsError, match="fps must be a positive number"):
        animate(fake_linkage.run(), fps=fps)


@pytest.mark.parametrize(
    ("sol", "frames"),
    [
        pytest.param(replace(fake_linkage.run(), t=np.array([0.7])), 1, id="single sample"),
        pytest.param(replace(fake_linkage.run(), t=np.array([0.0, 1e-12])), 240, id="short run"),
        pytest.param(replace(fake_linkage.run(), t=np.array([2.0, 1.0])), 240, id="backward"),
        pytest.param(
            fake_linkage.run(1.0, point_names=(), skeleton=(), ground=(), traced=()),
            240,
            id="no points",
        ),
        pytest.param(
            fake_linkage.run(1.0, skeleton=(), ground=(), traced=()), 240, id="no skeleton"
        ),
    ],
)
def test_odd_runs_still_make_a_page(sol: FakeSolution, frames: int) -> None:
    data = motion(sol)
    assert data["frames"] == frames
    assert len(tracks(data)) == frames


def test_a_spatial_mechanism_says_how_it_is_seen() -> None:
    tilt = ((1.0, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.9, 1.0))
    assert motion(fake_linkage.run(1.0, tilt=tilt))["notes"] == [
        "spatial motion, projected on x and z"
    ]


def test_a_motion_in_an_upright_plane_is_not_seen_as_a_line() -> None:
    """In the plane of x = y the two axes of largest extent are x and y."""
    upright = ((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    data = motion(fake_linkage.run(1.0, tilt=upright))
    seen = tracks(data).reshape(-1, 2)
    small, large = np.linalg.eigvalsh(np.cov(seen.T))
    assert small > 0.1 * large
    assert "and z" in data["notes"][0]


@dataclass(frozen=True)
class Overflowing(FakeSolution):
    """A run whose last half is not numbers."""

    def __call__(self, t: Any, /) -> Any:
        return np.where(np.asarray(t)[:, None] > 0.5, np.nan, super().__call__(t))


@dataclass(frozen=True)
class Failed:
    ok: bool = False

    def __str__(self) -> str:
        return "The run stopped: overflow."


def test_a_run_that_failed_is_played_up_to_there_and_says_so() -> None:
    sol = fake_linkage.run(1.0)
    data = motion(Overflowing(sol.system, sol.t, status=Failed()))
    assert data["frames"] == 120
    assert data["notes"] == ["The run stopped: overflow."]
