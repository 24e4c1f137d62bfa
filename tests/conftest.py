"""Options of the whole suite, and the cache of compiled scenes that all of it shares."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest
from hypothesis import settings

from mechc.compilation import parts
from tests.support.compilers.compilation import (
    MadeOnRequest,
    compile_as_for_users,
    compile_less_optimised,
)
from tests.support.compilers.costs import Costs
from tests.support.compilers.law import CompilerIsOff

# --hypothesis-profile=thorough: ten times the random mechanisms, others at every run
settings.register_profile("usual", deadline=None, derandomize=True, print_blob=True)
settings.register_profile("thorough", deadline=None, derandomize=False, max_examples=1000)
settings.load_profile("usual")


CASES = 1  # of a slow test


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write the golden files anew from what the compiler emits now",
    )
    parser.addoption(
        "--thorough",
        action="store_true",
        help="fuzzers and fault injection: all of their cases, and others at every run",
    )
    parser.addoption("--seed", type=int, help="of the fuzzers' cases, to see one again")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Costs())
    config.pluginmanager.register(CompilerIsOff(), "compiler is off")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Of a slow test's cases the first runs at every landing: the others are thorough.

    ``pytest.mark.slow(cases=N)`` says how many, spread evenly, where each has something of its
    own.
    """
    tests = {}
    for item in items:
        if item.get_closest_marker("slow"):
            tests.setdefault((item.path, item.function), []).append(item)
    for cases in tests.values():
        most = cases[0].get_closest_marker("slow").kwargs.get("cases", CASES)
        kept = {round(k * (len(cases) - 1) / max(most - 1, 1)) for k in range(most)}
        for number, item in enumerate(cases):
            if len(cases) > most and number not in kept:
                item.add_marker(pytest.mark.thorough)


@pytest.fixture
def seed(request):
    """Of what is drawn at random; the fuzzers print it."""
    given = request.config.getoption("--seed")
    if given is not None:
        return given
    return time.time_ns() % 10**6 if request.config.getoption("--thorough") else 14


@pytest.fixture
def thorough(request):
    """Whether all cases are wanted, not as many as fit into a minute."""
    return request.config.getoption("--thorough")


@pytest.fixture(scope="module")
def flags_of_users():
    """The scenes of these tests are compiled as those of users are."""
    with pytest.MonkeyPatch.context() as patch:
        compile_as_for_users(patch)
        yield


@pytest.fixture(scope="session", autouse=True)
def interruptible():
    """A shell that starts the tests in the background makes them ignore Ctrl-C; some send it."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def compiled_once(request, tmp_path_factory):
    """What any test compiles is found by all others, in every worker, and by nobody else.

    Integrators are compiled when a test asks for them, and all with less optimisation but where
    a test wants the flags of users, or with ``--thorough``.  $MECHC_TESTS_COMPILED names a folder
    that keeps it for the next run.
    """
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "compiled"
    law = request.config.pluginmanager.get_plugin("compiler is off")
    with pytest.MonkeyPatch.context() as patch:
        law.begin(patch, Path(os.environ.get("MECHC_TESTS_COMPILED", str(folder))))
        patch.setattr(parts, "Pending", MadeOnRequest)
        if not request.config.getoption("--thorough"):
            compile_less_optimised(patch, own)
        yield
