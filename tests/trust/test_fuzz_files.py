"""Damaged and crafted files: the data that were written, or an error that names the file."""

import json
import shutil
import warnings

import numpy as np
import pytest

import mechc
from mechc.batch.stored.store import examine
from mechc.compilation import cache
from mechc.results import files as storage
from tests.support.trust.fuzzing import run_cases

pytestmark = pytest.mark.slow

JUNK = [
    None, True, 0, -1, 1e308, 2**70, "", "x", "\x1b[2J", [], {}, [[]], {"a": []}, [1, 2, 3], "NaN",
    float("nan"), ["theta_0"] * 6, "a" * 5000, [None] * 6, {"code": "finished"},
]  # fmt: skip


def damaged(draw, content):
    """A flipped bit, other bytes in a place, a cut, something put in, or nothing of it left."""
    kind, place = draw.randrange(5), draw.randrange(len(content) + 1)
    if kind == 0 and place < len(content):
        changed = bytes([content[place] ^ 1 << draw.randrange(8)])
        return content[:place] + changed + content[place + 1 :]
    some = draw.randbytes(draw.choice([1, 4, 8, 64]))
    if kind == 1:
        return (
            content[:place]
            + draw.choice([some, bytes(len(some)), b"\xff" * len(some)])
            + (content[place + len(some) :])
        )
    if kind == 2:
        return content[:place]
    return content[:place] + some + content[place:] if kind == 3 else some


def crafted(draw, told):
    """JSON data with something in it replaced, dropped or added."""
    keys = [key for key in told if draw.random() < 0.15] or [draw.choice(sorted(told))]
    changed = dict(told)
    for key in keys:
        inner = changed[key]
        if isinstance(inner, dict) and inner and draw.random() < 0.6:
            changed[key] = crafted(draw, inner)
        elif isinstance(inner, list) and inner and draw.random() < 0.5:
            place = draw.randrange(len(inner))
            changed[key] = [*inner[:place], draw.choice(JUNK), *inner[place + draw.randrange(2) :]]
        elif draw.random() < 0.2:
            del changed[key]
        else:
            changed[key] = draw.choice(JUNK)
    if draw.random() < 0.1:
        changed[draw.choice(["more", "__class__", "\x00"])] = draw.choice(JUNK)
    return changed


def refused_by_name(call, path):
    """Its value; an error has to name the file and to steer no terminal."""
    try:
        return call()
    except mechc.MechcError as error:
        told = str(error)
        if path.name in told and told.isprintable():
            raise
    raise AssertionError(f"{path.name} is not named, or the text steers a terminal: {told!r}")


def test_saved_solutions(seed, thorough, tmp_path):
    model = mechc.load("four_bar")
    sol = model.simulate(0.5, model.assemble({"theta_0": 1.4}))
    path = sol.save(tmp_path / "run.nc")
    content = path.read_bytes()
    told = json.loads(sol.to_xarray().attrs["mechc"])

    def case(draw):
        if draw.random() < 0.6:
            path.write_bytes(damaged(draw, content))
            honest = True
        else:
            data = sol.to_xarray()
            data.attrs["mechc"] = json.dumps(crafted(draw, told))
            data.attrs["sha256"] = storage.digest(data)
            data.to_netcdf(path, engine="scipy")
            honest = False

        def call():
            found = refused_by_name(lambda: mechc.open(path, max_bytes=2**24), path)
            assert str(found.status).isprintable()
            if honest:
                assert np.array_equal(found.t, sol.t)
                np.testing.assert_allclose(found.y, sol.y, rtol=0, atol=1e-6)

        return call

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # NumPy's, of numbers that overflow
        ended = run_cases(seed, thorough, 500, 2_000, case)
    assert ended["MechcError"] > 300


def test_batch_folders(seed, thorough, tmp_path):
    pytest.importorskip("zarr")
    model, whole, folder = mechc.load("four_bar"), tmp_path / "whole", tmp_path / "batch"
    start = mechc.Assembly({"theta_0": np.linspace(0.9, 1.5, 5)})
    held = model.simulate_batch(
        0.1, start, {"l_3": 3.5}, t_eval=[0.0, 0.1], outputs=["points"], reduce="max(theta_2)",
        out=whole, chunk=2,
    )  # fmt: skip
    shutil.copytree(whole, folder)
    arrays = {name: held[name] for name in held.arrays}
    files = sorted(path.relative_to(whole) for path in whole.rglob("*") if path.is_file())

    def case(draw):
        names = draw.sample(files, draw.choice([1, 1, 1, 2]))
        for name in names:
            content = (whole / name).read_bytes()
            if name.suffix == ".json" and draw.random() < 0.6:
                changed = json.dumps(crafted(draw, json.loads(content))).encode()
            else:
                changed = damaged(draw, content)
            (folder / name).write_bytes(changed)
            if draw.random() < 0.1:
                (folder / name).unlink()

        def call():
            try:
                found = refused_by_name(lambda: mechc.open(folder), folder)
                missing = examine(folder).missing
                assert found.complete == (missing == 0)
                for name, values in arrays.items() if found.complete else ():
                    assert np.array_equal(found[name], values, equal_nan=True), name
            finally:
                for name in names:
                    shutil.copy(whole / name, folder / name)

        return call

    ended = run_cases(seed, thorough, 300, 2_000, case)
    assert ended["MechcError"] > 200


def test_cache_entries(seed, thorough, tmp_path, monkeypatch):
    """What is in the cache is loaded as code: only what was put there is taken."""
    monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path / "cache"))
    key, code = "a" * 64, bytes(range(256)) * 40
    files = [cache.SHARED_OBJECT, cache.SEAL]

    def make(folder):
        (folder / cache.SHARED_OBJECT).write_bytes(code)

    def case(draw):
        entry = cache.entry(key, make).parent
        name = draw.choice(files)
        content = (entry / name).read_bytes()
        changed = damaged(draw, content)
        (entry / name).write_bytes(changed)

        def call():
            found = cache.find(key)
            assert (found is None) == (changed != content)
            assert cache.entry(key, make).read_bytes() == code
            if changed != content:
                raise ValueError("refused")

        return call

    ended = run_cases(seed, thorough, 1_000, 2_000, case)
    assert ended["ValueError"] > 0.9 * ended.total()
