"""The cache stays within its size, and what nobody uses goes with its lock."""

import fcntl
import os
import time

import pytest

from mechc.compilation import cache
from mechc.compilation.cache import size
from mechc.errors import CacheError

KEYS = [f"{i:x}" * 64 for i in range(10)]


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("MECHC_CACHE_SIZE", "3")
    return tmp_path / "cache"


def make(folder):
    (folder / cache.SHARED_OBJECT).write_bytes(bytes(2**20 - 100))


def used(root, key, seconds_ago):
    when = time.time() - seconds_ago
    os.utime(root / key / cache.SEAL, (when, when))


def names(root):
    return {path.name for path in root.iterdir()}


def test_what_was_not_used_for_longest_goes_first(root):
    for age, key in enumerate(KEYS[:3]):
        cache.entry(key, make)
        used(root, key, 10_000 + 1000 * age)
    assert cache.find(KEYS[2])  # a use of the oldest
    cache.entry(KEYS[3], make)
    assert {*cache.scenes()} == {KEYS[0], KEYS[2], KEYS[3]}
    assert f"{KEYS[1]}.lock" not in names(root)


def test_what_was_just_made_stays_however_large(root, monkeypatch):
    cache.entry(KEYS[0], make)
    monkeypatch.setenv("MECHC_CACHE_SIZE", "0")
    cache.entry(KEYS[1], make)
    assert [*cache.scenes()] == [KEYS[1]]


def test_what_another_process_is_at_stays(root, monkeypatch):
    cache.entry(KEYS[0], make)
    monkeypatch.setenv("MECHC_CACHE_SIZE", "1")
    with (root / f"{KEYS[0]}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        cache.entry(KEYS[1], make)
        assert {*cache.scenes()} == {KEYS[0], KEYS[1]}
    cache.entry(KEYS[2], make)
    assert [*cache.scenes()] == [KEYS[2]]


def test_locks_and_rests_without_an_entry_go_and_other_files_stay(root):
    cache.entry(KEYS[0], make)
    (root / f"{KEYS[4]}.lock").touch()
    (root / "notes").touch()
    old, new = (root / f".new-{KEYS[5]}-{name}" for name in ("old", "new"))
    for folder in (old, new):
        folder.mkdir()
    os.utime(old, (0, 0))
    cache.entry(KEYS[1], make)
    kept = {KEYS[0], KEYS[1], f"{KEYS[0]}.lock", f"{KEYS[1]}.lock", "notes", new.name}
    assert names(root) == kept


def test_an_entry_made_while_locks_without_one_are_looked_for_stays(root, monkeypatch):
    """Its lock was there before it, and is free again when it is tried."""
    cache.entry(KEYS[0], make)
    (root / f"{KEYS[5]}.lock").touch()
    most = size.most_bytes

    def and_another_is_made():
        (root / KEYS[5]).mkdir()
        return most()

    monkeypatch.setattr(size, "most_bytes", and_another_is_made)  # called when all are listed
    cache.entry(KEYS[1], make)
    assert (root / KEYS[5]).exists()


def test_an_entry_that_replaced_one_is_not_discarded_for_it(root):
    path = cache.entry(KEYS[0], make)
    known = cache.identity(path)
    cache.discard(KEYS[0], known)
    assert not path.exists()
    assert cache.identity(path) is None
    cache.entry(KEYS[0], make)
    for gone in (known, None):
        cache.discard(KEYS[0], gone)
        assert path.exists()


def test_a_size_that_is_no_number_is_told(monkeypatch):
    monkeypatch.setenv("MECHC_CACHE_SIZE", "1 GB")
    with pytest.raises(CacheError, match="1 GB"):
        cache.entry(KEYS[0], make)
