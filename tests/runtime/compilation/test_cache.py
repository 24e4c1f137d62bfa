"""The cache: nobody else's code, nothing damaged, made once, and nothing else touched."""

import errno
import fcntl
import multiprocessing
import os
import shutil
import signal
import stat
import time
from pathlib import Path

import pytest

from mechc.compilation import cache
from mechc.errors import CacheError

KEY = "0123456789abcdef" * 4
# Python 3.12 warns where a process that forks has threads, as a worker of the tests may.
pytestmark = pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("MECHC_CACHE_DIR", str(folder))
    return folder


class Maker:
    """Makes an entry, and counts how often it was asked to."""

    def __init__(self, content=b"code"):
        self.content, self.made = content, 0

    def __call__(self, folder):
        self.made += 1
        (folder / cache.SHARED_OBJECT).write_bytes(self.content)


def test_an_entry_is_made_once_and_found_again(root):
    make = Maker()
    for _ in range(3):
        path = cache.entry(KEY, make)
        assert path == root / KEY / "scene.so"
        assert path.read_bytes() == b"code"
    assert make.made == 1
    assert cache.scenes() == {KEY: [root / KEY]}


def test_only_the_owner_can_enter(root):
    cache.entry(KEY, Maker())
    assert root.stat().st_mode & 0o777 == 0o700
    assert (root / KEY).stat().st_mode & 0o077 == 0


def test_a_key_of_its_own_for_everything(root):
    cache.entry(KEY, Maker(b"one"))
    other = KEY[::-1]
    assert cache.entry(other, Maker(b"two")).read_bytes() == b"two"
    assert cache.entry(KEY, Maker()).read_bytes() == b"one"


def damage_code(entry):
    (entry / "scene.so").write_bytes(b"cod")


def damage_bits(entry):
    (entry / "scene.so").write_bytes(b"codf")


def truncate_checksum(entry):
    checksum = entry / "scene.seal"
    checksum.write_text(checksum.read_text()[:-1])


def scramble_checksum(entry):
    (entry / "scene.seal").write_bytes(b"\xff\xfe")


def remove_code(entry):
    (entry / "scene.so").unlink()


def remove_checksum(entry):
    (entry / "scene.seal").unlink()


@pytest.mark.parametrize(
    "damage",
    [damage_code, damage_bits, truncate_checksum, scramble_checksum, remove_code, remove_checksum],
)
def test_a_damaged_entry_is_made_again(root, damage):
    make = Maker()
    cache.entry(KEY, make)
    damage(root / KEY)
    assert cache.entry(KEY, make).read_bytes() == b"code"
    assert make.made == 2
    cache.entry(KEY, make)
    assert make.made == 2


def test_a_failure_leaves_nothing_behind(root):
    def fail(folder):
        (folder / "half").touch()
        raise RuntimeError("no")

    with pytest.raises(RuntimeError):
        cache.entry(KEY, fail)
    assert cache.scenes() == {}
    assert {path.name for path in root.iterdir()} == {f"{KEY}.lock"}


def test_what_a_killed_process_left_is_swept_up(root):
    root.mkdir(mode=0o700)
    left = root / f".new-{KEY}-abc"
    other = root / f".new-{KEY[::-1]}-abc"
    for folder in (left, other):
        folder.mkdir()
        (folder / "half").touch()
    cache.entry(KEY, Maker())
    assert not left.exists()
    assert other.exists(), "another process may be writing that one"


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702, 0o720])
def test_a_folder_that_others_can_write_is_refused(root, mode):
    root.mkdir()
    root.chmod(mode)
    with pytest.raises(CacheError, match="can be written by others: chmod 700"):
        cache.entry(KEY, Maker())


def test_an_entry_that_others_can_write_is_refused(root):
    cache.entry(KEY, Maker())
    (root / KEY).chmod(0o777)
    with pytest.raises(CacheError, match=f"{KEY} can be written by others"):
        cache.entry(KEY, Maker())


def test_a_folder_of_another_user_is_refused(root, monkeypatch):
    cache.entry(KEY, Maker())
    owner = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)
    with pytest.raises(CacheError, match="belongs to another user"):
        cache.entry(KEY, Maker())
    with pytest.raises(CacheError, match="belongs to another user"):
        cache.clear()


def test_a_link_to_a_private_folder_is_followed(root, tmp_path):
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    root.symlink_to(tmp_path / "elsewhere")
    path = cache.entry(KEY, Maker())
    assert path == tmp_path / "elsewhere" / KEY / "scene.so"
    (tmp_path / "elsewhere").chmod(0o777)
    with pytest.raises(CacheError, match="can be written by others"):
        cache.entry(KEY, Maker())


def test_a_folder_below_one_that_others_write_is_refused(tmp_path, monkeypatch):
    shared = tmp_path / "shared"
    shared.mkdir()
    monkeypatch.setenv("MECHC_CACHE_DIR", str(shared / "mine"))
    shared.chmod(0o777)
    with pytest.raises(CacheError, match="above the cache folder"):
        cache.entry(KEY, Maker())
    with pytest.raises(CacheError, match="above the cache folder"):
        cache.check()
    shared.chmod(0o1777)  # sticky, as /tmp is: nobody can replace what is not theirs
    cache.entry(KEY, Maker())


def test_a_tilde_is_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("MECHC_CACHE_DIR", "~/here")
    assert cache.entry(KEY, Maker()) == tmp_path / "here" / KEY / "scene.so"


def test_an_entry_is_found_where_it_is_and_only_there(root):
    assert cache.find(KEY) is None
    cache.entry(KEY, Maker())
    assert cache.find(KEY) == root / KEY / "scene.so"
    damage_bits(root / KEY)
    assert cache.find(KEY) is None


def test_a_folder_that_cannot_be_made_is_told_with_what_to_do(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    for folder in ("file", "file/below"):
        monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path / folder))
        with pytest.raises(CacheError, match="set MECHC_CACHE_DIR"):
            cache.entry(KEY, Maker())


def test_where_it_lies(monkeypatch, tmp_path):
    assert cache.cache_folder() == tmp_path / "cache"
    monkeypatch.delenv("MECHC_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache.cache_folder() == tmp_path / "xdg" / "mechc"
    monkeypatch.setenv("XDG_CACHE_HOME", "")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache.cache_folder() == tmp_path / ".cache" / "mechc"


def test_clearing_removes_entries_and_nothing_else(root):
    cache.entry(KEY, Maker())
    (root / "notes").mkdir()
    (root / "poetry.lock").touch()
    assert cache.clear() == 1
    assert {path.name for path in root.iterdir()} == {"notes", "poetry.lock"}
    assert cache.clear() == 0
    assert cache.entry(KEY, Maker(b"again")).read_bytes() == b"again"


def test_clearing_takes_first_units_along(root):
    cache.entry(KEY, Maker())
    cache.entry(cache.part_key(KEY, "first"), Maker())
    assert cache.scenes() == {KEY: [root / KEY, root / f"{KEY}.first"]}
    assert cache.clear() == 1
    assert list(root.iterdir()) == []


def test_clearing_takes_along_what_killed_processes_and_failures_left(root):
    cache.entry(KEY, Maker())
    other = KEY[::-1]
    (root / f".new-{other}-abc").mkdir()
    (root / f".new-{cache.part_key(other, 'first')}-abc").mkdir()
    (root / f"{other}.lock").touch()
    cache.cached_hash("compiler", "one", lambda: KEY)
    (root / ".new-notes-abc").mkdir()
    assert cache.clear() == 1
    assert [path.name for path in root.iterdir()] == [".new-notes-abc"]


def test_clearing_a_cache_that_never_was_makes_none(root):
    assert cache.clear() == 0
    assert not root.exists()


def test_a_note_saves_work_until_its_stamp_changes(root):
    values = iter((KEY, KEY[::-1]))
    for _ in range(2):
        assert cache.cached_hash("what", "one", lambda: next(values)) == KEY
    assert cache.cached_hash("what", "two", lambda: next(values)) == KEY[::-1]
    assert (root / "what.note").stat().st_mode & 0o077 == 0
    assert cache.scenes() == {}


@pytest.mark.parametrize("damage", ["", "one", f"one {KEY[:-1]}", "one \xff", f"two {KEY}"])
def test_a_damaged_note_is_no_matter(root, damage):
    cache.cached_hash("what", "one", lambda: KEY)
    (root / "what.note").write_text(damage, "latin-1")
    assert cache.cached_hash("what", "one", lambda: KEY[::-1]) == KEY[::-1]


def make_slowly(folder):
    with (folder.parent / "log").open("a") as log:
        log.write("made\n")
    time.sleep(0.3)
    (folder / cache.SHARED_OBJECT).write_bytes(b"code")


def take(queue, together):
    together.wait()
    queue.put(cache.entry(KEY, make_slowly).read_bytes())


def test_fifty_processes_at_once_make_an_entry_once(root):
    """Each waits for the one that makes it, and then finds it whole."""
    context = multiprocessing.get_context("fork")
    queue, together = context.Queue(), context.Barrier(50)
    workers = [context.Process(target=take, args=(queue, together)) for _ in range(50)]
    for worker in workers:
        worker.start()
    assert [queue.get(timeout=60) for _ in workers] == [b"code"] * 50
    for worker in workers:
        worker.join()
    assert Path(root / "log").read_text() == "made\n"


def test_what_is_forked_meanwhile_does_not_keep_the_lock(root):
    """A child shares its parent's open files, and locks are held as long as one is open."""
    children = []

    def fork(folder):
        children.append(os.fork())
        if children[-1] == 0:
            time.sleep(60)
            os._exit(0)
        (folder / cache.SHARED_OBJECT).write_bytes(b"code")

    try:
        cache.entry(KEY, fork)
        with (root / f"{KEY}.lock").open() as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    finally:
        os.kill(children[0], signal.SIGKILL)
        os.waitpid(children[0], 0)


def test_a_killed_process_leaves_no_lock_although_its_child_lives(root):
    """What a child inherited it closes, so that the kernel frees the lock with the parent."""
    reading, writing = os.pipe()

    def fork_and_die(folder):
        child = os.fork()
        if child == 0:
            os.write(writing, b"%d\n" % os.getpid())
            time.sleep(60)
            os._exit(0)
        os.kill(os.getpid(), signal.SIGKILL)

    parent = os.fork()
    if parent == 0:
        cache.entry(KEY, fork_and_die)
    os.waitpid(parent, 0)
    orphan = int(os.read(reading, 20))
    try:
        with (root / f"{KEY}.lock").open() as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        assert cache.entry(KEY, Maker()).read_bytes() == b"code"
        assert not list(root.glob(".new-*"))
    finally:
        os.kill(orphan, signal.SIGKILL)
        os.close(reading)
        os.close(writing)


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_will_do(root, monkeypatch, number):
    """Then two may make the same at once; the one that is later keeps the other's."""

    def refuse(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", refuse)
    make = Maker()

    def make_while_another_does(folder):
        make(folder)
        if make.made == 1:
            cache.entry(KEY, make_while_another_does)

    assert cache.entry(KEY, make_while_another_does).read_bytes() == b"code"
    assert make.made == 2
    assert cache.find(KEY) is not None


def test_an_entry_of_another_name_is_not_taken(root):
    """Whole and sealed, but another scene's: copied or renamed by whoever tidied up."""
    cache.entry(KEY, Maker(b"one"))
    other = KEY[::-1]
    shutil.copytree(root / KEY, root / other)
    assert cache.find(other) is None
    assert cache.entry(other, Maker(b"two")).read_bytes() == b"two"
    assert cache.entry(KEY, Maker()).read_bytes() == b"one"


def link_code(entry, elsewhere):
    (entry / "scene.so").rename(elsewhere)
    (entry / "scene.so").symlink_to(elsewhere)


def share_code(entry, elsewhere):
    (entry / "scene.so").chmod(0o606)


def pipe_code(entry, elsewhere):
    (entry / "scene.so").unlink()
    os.mkfifo(entry / "scene.so")


@pytest.mark.parametrize("change", [link_code, share_code, pipe_code])
def test_code_that_is_not_a_file_of_the_users_alone_is_made_again(root, tmp_path, change):
    """What a link leads to, or what others write, could be another thing when it is loaded."""
    cache.entry(KEY, Maker())
    change(root / KEY, tmp_path / "elsewhere")
    assert cache.find(KEY) is None
    path = cache.entry(KEY, Maker())
    assert path.read_bytes() == b"code"
    assert stat.S_ISREG(path.lstat().st_mode)


def test_a_link_in_place_of_an_entry_is_told(root, tmp_path):
    cache.entry(KEY, Maker())
    (root / KEY).rename(tmp_path / "moved")
    (root / KEY).symlink_to(tmp_path / "moved")
    with pytest.raises(CacheError, match=f"{KEY} is not a folder; remove it"):
        cache.entry(KEY, Maker())


def test_a_link_in_place_of_a_lock_is_not_followed(root, tmp_path):
    root.mkdir(mode=0o700)
    (root / f"{KEY}.lock").symlink_to(tmp_path / "precious")
    with pytest.raises(CacheError, match="cannot be made or written"):
        cache.entry(KEY, Maker())
    assert not (tmp_path / "precious").exists()


@pytest.mark.parametrize("mask", [0o000, 0o022, 0o077])
def test_the_umask_is_no_matter(tmp_path, monkeypatch, mask):
    """Folders made on the way are the user's alone; code can be read again."""
    monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path / "a" / "b" / "cache"))
    make, before = Maker(), os.umask(mask)
    try:
        for _ in range(2):
            cache.entry(KEY, make)
    finally:
        os.umask(before)
    assert make.made == 1
    for folder in ("a", "a/b", "a/b/cache", f"a/b/cache/{KEY}"):
        assert (tmp_path / folder).stat().st_mode & 0o777 == 0o700


def clear_often(seconds):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        cache.clear()


def make_often(queue, seconds):
    deadline = time.monotonic() + seconds
    try:
        while time.monotonic() < deadline:
            cache.entry(KEY, Maker())
        queue.put("well")
    except BaseException as error:
        queue.put(repr(error))


def test_clearing_while_others_build_disturbs_nobody(root):
    """The lock that a builder holds stays the lock, although clearing removes its file."""
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    workers = [context.Process(target=make_often, args=(queue, 0.7)) for _ in range(2)]
    workers.append(context.Process(target=clear_often, args=(0.7,)))
    for worker in workers:
        worker.start()
    assert [queue.get(timeout=60) for _ in range(2)] == ["well", "well"]
    for worker in workers:
        worker.join()
