"""Progress: a bar on a terminal, lines in words elsewhere."""

import io
import re
import sys

import pytest

import mechc
from mechc import progress
from mechc.progress import Notice


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def shown(monkeypatch, clock, stream):
    """What a count of 100 members, one a second, writes to a stream."""
    monkeypatch.setattr(sys, "stderr", stream)
    with progress.CountBar("simulating", 100) as bar:
        for done in range(31):
            bar.update_count(done)
            clock[0] += 1.0
    return stream.getvalue()


def test_a_pipe_gets_a_line_every_ten_seconds(monkeypatch, clock):
    lines = shown(monkeypatch, clock, io.StringIO()).splitlines()
    assert lines == [
        "simulating: 10% 1/s, 1 min 30 s left",
        "simulating: 20% 1/s, 1 min 20 s left",
        "simulating: 30% 1/s, 1 min 10 s left",
    ]


def test_a_terminal_gets_a_bar_that_is_removed(monkeypatch, clock):
    text = shown(monkeypatch, clock, Terminal())
    assert "simulating [####" in text
    assert "\n" not in text
    assert text.endswith(" \r")


def test_short_work_says_nothing(monkeypatch, clock):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    with progress.ProgressBar("drawing") as bar:
        clock[0] += 9.0
        bar.update(0.5)
    assert stream.getvalue() == ""


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_work_in_stages_says_which_one_it_has_come_to(monkeypatch, stream):
    screen = stream()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setattr(progress, "PATIENCE", 0.05)
    monkeypatch.setattr(progress, "SILENCE", 0.05)
    with progress.Notice("reading", "done") as whole:
        with progress.Notice("deriving"):
            assert screen.getvalue() == "", "it is short so far"
            whole._timer.join()
        with progress.Notice("compiling"):
            pass
    said = screen.getvalue().replace("\r", "\n").split("\n")
    lines = [line.strip() for line in said if line.strip()]
    assert lines[:2] == ["deriving", "compiling"]
    assert lines[2].startswith("done in ")


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (lambda sol, folder: sol.save(folder / "a.nc"), "writing .*a.nc"),
        (lambda sol, _: sol.to_xarray(), "collecting the motion"),
        (lambda sol, _: sol.plot(), "drawing"),
        (lambda sol, _: sol.plot("theta_0"), "drawing"),
        (lambda sol, _: sol.animate(), "drawing the motion"),
        (lambda sol, _: sol.check(), "checking the motion"),
        (lambda _, folder: mechc.export_c("pendulum", folder / "c"), "deriving .* of pendulum"),
        pytest.param(
            lambda _, folder: mechc.export_fmu("pendulum", folder / "p.fmu"),
            "compiling the unit",
            marks=pytest.mark.compiles,
        ),
    ],
)
def test_what_takes_long_says_what_it_does(monkeypatch, tmp_path, work, words):
    """A notice is begun around it; whether it is shown is a question of time."""
    told, begin = [], Notice.__enter__
    monkeypatch.setattr(Notice, "__enter__", lambda self: told.append(self.text) or begin(self))
    model = mechc.load("four_bar")
    work(model.simulate(0.1, model.assemble({"theta_0": 1.4})), tmp_path)
    assert any(re.match(words, text) for text in told)
