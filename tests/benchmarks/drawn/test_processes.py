"""Cases in processes of their own: what ends one is told."""

import os
import time

import pytest

from benchmarks.drawn import processes
from benchmarks.drawn.case import Outcome
from benchmarks.drawn.tally import Tally


def outcomes(judge, count, folder, jobs=2):
    return {
        case: found for case, found, _ in processes.each(iter(range(count)), judge, jobs, folder)
    }


def test_outcomes_come_from_other_processes(tmp_path):
    found = outcomes(lambda case: (case, os.getpid()), 4, tmp_path)
    assert {case for case, _ in found.values()} == {0, 1, 2, 3}
    assert len({process for _, process in found.values()} - {os.getpid()}) == 4


def test_a_crash_and_an_exit_are_told(tmp_path):
    found = outcomes(lambda case: os.kill(os.getpid(), 11) if case else os._exit(7), 2, tmp_path)
    assert "SIGSEGV" in found[1]
    assert "7" in found[0]


def test_a_case_that_does_not_end_is_ended(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "LATEST", 0.3)
    found = outcomes(lambda case: time.sleep(60), 1, tmp_path)
    assert "took longer" in found[0]


def test_a_case_that_computes_without_end_is_ended(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "LONGEST", 1)

    def endless(case):
        while True:
            pass

    assert "processor seconds" in outcomes(endless, 1, tmp_path)[0]


def test_faults_are_told_with_the_command_that_repeats_them(capsys):
    tally = Tally(12)
    tally.add(
        3, Outcome(3, used=frozenset({"pin"}), faults=["auto (1 scenes): 1, allowed 0.1"]), 1.0
    )
    tally.add(4, "the process ended with SIGSEGV", 1.0)
    tally.print(2.0)
    out = capsys.readouterr().out
    assert "--seed 12 --only-case 3: auto" in out
    assert "--seed 12 --only-case 4: the process ended with SIGSEGV" in out
    assert tally.failed == 2
    assert pytest.approx(2) == tally.cases
