"""The benchmarks are scripts in a folder: imported by name here, and writing elsewhere."""

import importlib
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def module(monkeypatch, tmp_path):
    """A module of the benchmarks by name, writing into a folder of the test's own."""
    monkeypatch.syspath_prepend(str(FOLDER))
    for name in _namesakes():
        monkeypatch.delitem(sys.modules, name)

    def imported(name):
        found = importlib.import_module(name)
        for other in _of_the_benchmarks(set(sys.modules)):
            if hasattr(sys.modules[other], "OUT"):
                monkeypatch.setattr(sys.modules[other], "OUT", tmp_path)
        return found

    before = set(sys.modules)
    yield imported
    for name in _of_the_benchmarks(set(sys.modules) - before):
        del sys.modules[name]


def _of_the_benchmarks(names):
    """Those of the named modules that lie in the folder."""
    files = {name: getattr(sys.modules[name], "__file__", None) for name in names}
    return [name for name, file in files.items() if file and FOLDER in Path(file).parents]


def _namesakes():
    """Other tests' modules that are called like one of the folder's."""
    ours = {path.stem for path in FOLDER.iterdir() if path.suffix == ".py" or path.is_dir()}
    return sorted((ours & set(sys.modules)) - set(_of_the_benchmarks(set(sys.modules))))
