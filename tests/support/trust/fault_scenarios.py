"""What goes on while the n-th call fails: ``python -m ...trust.fault_scenarios NAME FOLDER``.

Runs below ``LD_PRELOAD`` of the library that ``faults.c`` makes.  Every n is a process forked from
one that has imported all; it prints a JSON line for each: n, the call that failed, how it ended.
"""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import zarr  # noqa: F401  its threads must not begin before a fork

import mechc
from mechc.batch.stored import store  # noqa: F401
from mechc.compilation import build, cache
from mechc.results import files  # noqa: F401
from tests.support.pendulums import pendulum

FILES, MEMORY, KILL = 1, 2, 4
MODEL = mechc.load("four_bar")
START = MODEL.assemble({"theta_0": 1.4})
SOL = MODEL.simulate(0.3, START)
BATCH = {"t_eval": [0.0, 0.1], "reduce": "max(theta_2)", "chunk": 2, "threads": 1}
ASSEMBLY = mechc.Assembly({"theta_0": np.linspace(0.9, 1.5, 5)})
HELD = MODEL.simulate_batch(0.1, ASSEMBLY, **BATCH)


def same(batch: Any) -> None:
    assert batch.complete
    for name in HELD.arrays:
        assert np.array_equal(batch[name], HELD[name], equal_nan=True), name


# -- each: what is done before, what is done meanwhile, what has to hold afterwards ---------------


def streaming(folder: Path) -> Any:
    return MODEL.simulate_batch(0.1, ASSEMBLY, **BATCH, out=folder / "batch")


def nothing_before(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)


def streamed_again(folder: Path, _: Any) -> None:
    """Whatever is there opens as a part of the right results or is refused; the call mends it."""
    if (folder / "batch" / "mechc" / "request.json").exists():
        try:
            found = mechc.open(folder / "batch")
        except mechc.MechcError:
            pass
        else:
            ran = found["status"] != 0
            complete = np.array([(folder / "batch" / "mechc" / f"chunk-{i:012d}.json").exists()
                                 for i in (0, 2, 4)]).repeat(2)[:5]  # fmt: skip
            assert ran[complete].all()
            for name in HELD.arrays:
                assert np.array_equal(found[name][complete], HELD[name][complete], equal_nan=True)
    if (folder / "batch").exists() and not (folder / "batch" / "mechc").exists():
        shutil.rmtree(folder / "batch")
    same(streaming(folder))
    same(mechc.open(folder / "batch"))


def saved_before(folder: Path) -> None:
    nothing_before(folder)
    MODEL.simulate(0.05, START).save(folder / "run.nc")
    MODEL.simulate(0.05, START).save(folder / "run.csv")


def saving(folder: Path) -> Any:
    SOL.save(folder / "run.nc")
    SOL.save(folder / "run.csv")


def old_or_new(folder: Path, value: Any) -> None:
    found = mechc.open(folder / "run.nc")
    rows = len((folder / "run.csv").read_text().splitlines()) - 1
    old = MODEL.simulate(0.05, START)
    assert len(found.t) in (len(old.t), len(SOL.t))
    assert rows in (len(old.t), len(SOL.t))
    if value is not None:
        assert (len(found.t), rows) == (len(SOL.t), len(SOL.t))


def stored_before(folder: Path) -> None:
    nothing_before(folder)
    SOL.save(folder / "run.nc")
    streaming(folder)


def opening(folder: Path) -> Any:
    return mechc.open(folder / "run.nc"), mechc.open(folder / "batch")


def opened_right(folder: Path, value: Any) -> None:
    found = value or opening(folder)
    assert np.array_equal(found[0].t, SOL.t)
    same(found[1])


def make_entry(folder: Path) -> None:
    (folder / cache.SHARED_OBJECT).write_bytes(b"code" * 5000)


def cache_before(folder: Path) -> None:
    nothing_before(folder)
    os.environ["MECHC_CACHE_DIR"] = str(folder / "cache")


def caching(folder: Path) -> Any:
    cache_before(folder)
    for key in ("a" * 64, "b" * 64):
        cache.entry(key, make_entry)
    return cache.find("a" * 64)


def cached_right(folder: Path, value: Any) -> None:
    found = caching(folder)
    assert found.read_bytes() == b"code" * 5000


def compiling(folder: Path) -> Any:
    cache_before(folder)
    return float(mechc.compile(pendulum(3.25)).rhs(0.0, [0.3, 0.1])[1])


def compiled_right(folder: Path, value: Any) -> None:
    build._compiled.clear()
    for found in (value, compiling(folder)):
        assert found is None or abs(found + 3.25 * np.cos(0.3)) < 1e-13


def calculating(folder: Path) -> Any:
    """Runs, dense output, a batch and C functions: what asks for memory in C."""
    sol = MODEL.simulate(0.3, START)
    if sol.status.code == "no memory":
        raise MemoryError
    radau = MODEL.simulate(0.05, START, method="radau5", rtol=1e-6)
    if radau.status.code == "no memory":
        raise MemoryError
    batch = MODEL.simulate_batch(0.1, ASSEMBLY, **BATCH)
    if "no memory" in batch.counts:
        raise MemoryError
    bound = MODEL.c_function("rates")
    rates, state = np.zeros(6), np.array(START)
    bound.ctypes(0.0, state.ctypes.data, rates.ctypes.data, bound.data)
    return sol.y, batch, rates


def calculated_right(folder: Path, value: Any) -> None:
    for y, batch, rates in filter(None, (value, calculating(folder))):
        assert np.array_equal(y, SOL.y)
        same(batch)
        assert np.allclose(rates, MODEL.rhs(0.0, START), rtol=1e-13)


Scenario = tuple[Callable[[Path], None], Callable[[Path], Any], Callable[[Path, Any], None], int]
SCENARIOS: dict[str, Scenario] = {
    "streaming": (nothing_before, streaming, streamed_again, FILES),
    "streaming, killed": (nothing_before, streaming, streamed_again, FILES | KILL),
    "saving": (saved_before, saving, old_or_new, FILES),
    "saving, killed": (saved_before, saving, old_or_new, FILES | KILL),
    "opening": (stored_before, opening, opened_right, FILES),
    "caching": (nothing_before, caching, cached_right, FILES),
    "caching, killed": (nothing_before, caching, cached_right, FILES | KILL),
    "compiling": (nothing_before, compiling, compiled_right, FILES),
    "calculating": (nothing_before, calculating, calculated_right, MEMORY),
}


# -- one process for every n ----------------------------------------------------------------------


def in_child(work: Callable[[], dict[str, Any]]) -> dict[str, Any] | None:
    """What a forked process found; None if it was killed."""
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        os.close(reader)
        try:
            found = work()
        except BaseException:
            found = {"ended": "wrong", "why": traceback.format_exc()}
        os.write(writer, json.dumps(found).encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        told = pipe.read()
    os.waitpid(child, 0)
    return json.loads(told) if told else None


def attempt(name: str, folder: Path, number: int) -> dict[str, Any]:
    """The n-th call fails; then everything is well again, and is looked at."""
    before, meanwhile, afterwards, kinds = SCENARIOS[name]
    shim = ctypes.CDLL(None)
    shim.fault_kind.restype = ctypes.c_char_p
    shutil.rmtree(folder, ignore_errors=True)
    word = folder.with_name(f"{folder.name}.fired")
    word.unlink(missing_ok=True)
    assert in_child(lambda: before(folder) or {"before": "done"}) == {"before": "done"}

    def armed() -> dict[str, Any]:
        value, ended = None, "a value"
        if name == "compiling":
            os.environ |= {"FAULT_NUMBER": str(number), "FAULT_FOLDER": str(folder)}
            os.environ["LD_PRELOAD"] = PRELOAD
        shim.fault_arm(ctypes.c_long(number), kinds, str(folder).encode())
        try:
            value = meanwhile(folder)
        except (mechc.MechcError, MemoryError) as error:
            ended = f"{type(error).__name__}: {error}"
        shim.fault_disarm()
        fired = int(word.exists())
        for variable in ("FAULT_NUMBER", "FAULT_FOLDER"):
            os.environ.pop(variable, None)
        afterwards(folder, value)
        return {"fired": fired, "call": shim.fault_kind().decode(), "ended": ended}

    found = in_child(armed)
    if found is None:
        found = {"fired": 1, "call": "any", "ended": "killed"}
        again = in_child(lambda: afterwards(folder, None) or {"afterwards": "right"})
        found |= again or {"ended": "wrong", "why": "killed again"}
    return {"n": number} | found


PRELOAD = os.environ.pop("LD_PRELOAD", "")  # programs that are started are not to be disturbed


def warm_up() -> None:
    """What a first call imports is imported before the forks; Zarr's threads must not begin."""
    with tempfile.TemporaryDirectory() as folder:
        saving(Path(folder))
        mechc.open(Path(folder) / "run.nc")


def main(name: str, folder: str, numbers: str) -> None:
    warnings.simplefilter("ignore")
    warm_up()
    quiet = 0
    first, last, stride = map(int, numbers.split(":"))
    for number in range(first, last, stride):
        found = attempt(name, Path(folder), number)
        print(json.dumps(found), flush=True)
        quiet = 0 if found.get("fired", 1) else quiet + 1
        if quiet > 2:  # threads do not count alike in every process
            break


if __name__ == "__main__":
    main(*sys.argv[1:])
