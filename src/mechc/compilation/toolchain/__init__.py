"""The C compiler of this machine: found, identified, run."""

from __future__ import annotations

import atexit
import hashlib
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache, partial
from pathlib import Path
from typing import IO, Any

from mechc.compilation.toolchain import zig_cache
from mechc.compilation.toolchain.found import installed_compiler
from mechc.compilation.toolchain.found import packaged_compiler as packaged_compiler
from mechc.errors import CompilerError, install_command
from mechc.files import ON_WINDOWS, in_forked_child
from mechc.interrupts import interrupts_deferred

_OWN_PROGRAM = re.compile(r"(.+-)?(gcc|clang)(-[\d.]+)?|zig")  # not ccache, not a script
_STEERING = ("COMPILER_PATH", "GCC_EXEC_PREFIX", "CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH")
_HEADERS = ("CPATH", "C_INCLUDE_PATH")  # those that name folders of headers
_MOST_HEADERS = 5000  # of which the content is hashed; of more, size and time
LONGEST = 1800.0  # s that a compiler may take for one file; a large scene takes minutes
_LONGEST_VERSION = 60.0
_LONGEST_WAIT = 0.2  # s until Ctrl-C is looked for again
_MOST_OUTPUT = 2**16  # bytes of its output, at the beginning and again at the end
_ANYWHERE = () if ON_WINDOWS else ("-fPIC",)  # code of Windows may lie at any address
# How linkers end that map their output into memory, as zig's does, where the disk is full; zig
# itself ends so when its linker has.
_UNMAPPED = () if sys.platform == "win32" else (-signal.SIGBUS, -signal.SIGABRT)


def find_compiler() -> list[str] | None:
    """The command of the C compiler: ``$CC``, else gcc, clang, cc or Python's own, else that of the
    package ``ziglang``; None if absent.

    Raises :class:`CompilerError` if ``$CC`` names a command that does not exist: no other is used
    in its place.
    """
    if chosen := os.environ.get("CC", "").strip():
        return _command_words(chosen)
    return installed_compiler() or packaged_compiler()


def _command_words(command: str) -> list[str]:
    try:
        words = shlex.split(command.replace(os.sep, "/"))
    except ValueError as error:
        raise CompilerError(f"CC = {command!r} cannot be read: {error}") from None
    if shutil.which(words[0]) is None:
        raise CompilerError(
            f"CC = {command!r}: there is no command {words[0]!r}; set CC to a C compiler, or unset "
            "it to use the one that is found"
        )
    return words


def compiler() -> list[str]:
    """The compiler of :func:`find_compiler`; raises :class:`CompilerError` if there is none."""
    command = find_compiler()
    if command is None:
        raise CompilerError(
            f"no C compiler was found: {install_command('compiler')} brings one; or install gcc or "
            "clang (Debian and Ubuntu: apt install gcc; Fedora: dnf install gcc; conda: conda "
            "install c-compiler), or set CC. Motions of most mechanisms need none"
        )
    return command


def identity(command: Sequence[str]) -> str:
    """The identity of a compiler, with its flags and the environment variables that affect it.

    A program of gcc or clang is identified by its file, without a process: its path, size and time,
    and its head, which contains the build number.  Anything else, such as a script or ccache, calls
    a compiler, and is identified by its ``--version``.
    """
    program = Path(shutil.which(command[0]) or command[0]).resolve()
    steering = [f"{name}={os.environ[name]}" for name in _STEERING if name in os.environ]
    told = [*command, _program(program) or version(tuple(command)), *steering]
    return " ".join([*told, *map(_headers, filter(os.environ.get, _HEADERS))])


def _headers(variable: str) -> str:
    """A hash of the headers that an environment variable puts before the system's."""
    digest = hashlib.sha256()
    for folder in os.environ[variable].split(os.pathsep):
        files = sorted(path for path in Path(folder or ".").rglob("*.h") if path.is_file())
        for number, file in enumerate(files):
            status = file.stat()
            told: object = (status.st_size, status.st_mtime_ns)
            if number < _MOST_HEADERS:
                told = hashlib.sha256(file.read_bytes()).hexdigest()
            digest.update(f"{file.relative_to(folder or '.')}\n{told}\n".encode("utf-8", "replace"))
    return f"{variable}:{digest.hexdigest()}"


def _program(path: Path) -> str | None:
    """Identity of a compiler's file; None if it is not one itself."""
    if not _OWN_PROGRAM.fullmatch(path.name):
        return None
    try:
        with path.open("rb") as file:
            head, status = file.read(4096), os.fstat(file.fileno())
    except OSError:
        return None
    if not head.startswith(b"\x7fELF"):
        return None
    digest = hashlib.sha256(head).hexdigest()
    return f"{path} {status.st_size} {status.st_mtime_ns} {digest}"


@lru_cache
def version(command: tuple[str, ...]) -> str:
    """First line of ``--version``."""
    return _output([*command, "--version"], _LONGEST_VERSION).stdout.partition("\n")[0]


def compile_all(
    folder: Path,
    sources: Sequence[tuple[str, Sequence[str]]],
    includes: Sequence[str],
    *,
    side_by_side: bool = True,
) -> list[Path]:
    """Compile sources (name, flags) of a folder; the object files.

    Raises :class:`CompilerError` with the command and the compiler's output.
    """
    command = compiler()
    paths = [f"-I{path}" for path in includes]

    def one(source: tuple[str, Sequence[str]]) -> Path:
        name, flags = source
        target = folder / f"{name}.o"
        told = [*command, *flags, *_ANYWHERE, *paths, "-c", str(folder / name), "-o", str(target)]
        _run(told, folder, target)
        return target

    if not side_by_side:
        return [one(source) for source in sources]
    return all_at_once([partial(one, source) for source in sources])


def all_at_once(jobs: Sequence[Callable[[], Any]]) -> list[Any]:
    """The results of functions that run a compiler each; if one fails, all end; so by Ctrl-C."""
    from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait  # slow

    threads = set[int]()
    with ThreadPoolExecutor(
        os.cpu_count(), initializer=lambda: threads.add(threading.get_ident())
    ) as pool:
        try:
            with interrupts_deferred():  # a thread that is half begun is not waited for
                begun = [pool.submit(job) for job in jobs]
            left: Collection[Any] = begun
            while left:  # for a while each time: Ctrl-C just before a wait does not end it
                _, left = wait(begun, _LONGEST_WAIT, FIRST_EXCEPTION)
                for each in filter(Future.done, begun):
                    each.result()
            return [each.result() for each in begun]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            _given_up.update(threads)  # those that only now start a compiler end it
            for process, thread in list(_running.items()):
                if thread in threads:
                    _end(process)
            pool.shutdown()
            _given_up.difference_update(threads)
            raise


def compile_shared(
    folder: Path, source: str, flags: Sequence[str], includes: Sequence[str], target: Path
) -> None:
    """Compile and link one source into a shared object, in one run of the compiler."""
    paths = [f"-I{path}" for path in includes]
    command = [*compiler(), *flags, *_ANYWHERE, "-shared", *paths, str(folder / source)]
    _run([*command, "-lm", "-o", str(target)], folder, target)


def compile_with(command: Sequence[str], source: Path, target: Path) -> None:
    """Compile and link one source by a command with its flags, for any machine."""
    _run([*command, str(source), "-lm", "-o", str(target)], source.parent, target)


def link(objects: Sequence[Path], target: Path) -> None:
    """Link object files into a shared object."""
    command = [*compiler(), "-shared", *map(str, objects), "-lm", "-o", str(target)]
    _run(command, target.parent, target)


_running: dict[subprocess.Popen[bytes], int] = {}  # with the thread that waits for it
_given_up = set[int]()  # threads whose compilers are not waited for


@atexit.register
def _stop_running() -> None:
    """End compilers in the background with this process."""
    for process in list(_running):
        _end(process)


in_forked_child(_running.clear)  # they belong to the parent


def _output(command: list[str], longest: float, **where: Any) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, in a separate process group, which ends with it."""
    with _running_process(command, **where) as process:
        out, told = _communicate(process, command, longest)
    return subprocess.CompletedProcess(command, process.returncode, out, told)


@contextmanager
def _running_process(command: list[str], **where: Any) -> Iterator[subprocess.Popen[bytes]]:
    """A process that is ended if the block is left by an exception."""
    process = None
    try:
        with interrupts_deferred():
            process = _start(command, **where)
        yield process
    except BaseException:
        if process is not None:
            _end(process)
        raise
    finally:
        if process is not None:
            with process:  # its pipes are closed, and it is waited for
                _running.pop(process, None)


def _start(command: list[str], **where: Any) -> subprocess.Popen[bytes]:
    pipe = subprocess.PIPE
    try:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe, bufsize=0,
            process_group=0, **where,
        )  # fmt: skip
    except OSError as error:
        raise CompilerError(f"cannot run {shlex.join(command)}: {error.strerror}") from None
    _running[process] = threading.get_ident()
    if _running[process] in _given_up:
        _end(process)
    return process


def _communicate(
    process: subprocess.Popen[bytes], command: list[str], longest: float
) -> tuple[str, str]:
    out, err = map(_PipeReader, (process.stdout, process.stderr))
    end = time.monotonic() + longest
    with suppress(subprocess.TimeoutExpired):
        process.wait(longest)
    for each in (out, err):
        each.join(max(0.0, end - time.monotonic()))
    if process.poll() is None or out.is_alive() or err.is_alive():
        _end(process)
        err.join(1.0)  # a child that still runs may keep the pipe open
        raise CompilerError(
            f"the C compiler did not end within {longest:g} s and was stopped.\n"
            f"{shlex.join(command)}\n{err.text().strip()}"
        )
    return out.text(), err.text()


class _PipeReader(threading.Thread):
    """Reads a pipe to its end, and keeps the beginning and the end of what it gives."""

    def __init__(self, pipe: IO[bytes] | None) -> None:
        super().__init__(daemon=True)
        assert pipe is not None
        self.pipe, self.first, self.last, self.left_out = pipe, b"", b"", 0
        self.start()

    def run(self) -> None:
        with suppress(OSError, ValueError):  # closed, while a child of the compiler holds it open
            while block := self.pipe.read(_MOST_OUTPUT):
                room = _MOST_OUTPUT - len(self.first)
                self.first += block[:room]
                last = self.last + block[room:]
                self.last = last[-_MOST_OUTPUT:]
                self.left_out += len(last) - len(self.last)

    def text(self) -> str:
        between = f"\n... {self.left_out} bytes ...\n" if self.left_out else ""
        content = self.first + between.encode() + self.last
        return content.decode(errors="replace").replace("\r\n", "\n")


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process and its children."""
    if sys.platform != "win32":  # which has no groups of processes
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()


def _run(command: list[str], folder: Path, target: Path) -> None:
    """Run a compiler; raise :class:`CompilerError` unless the target is written."""
    done = _alone(command, folder)
    if done.returncode in _UNMAPPED:
        done = _made_elsewhere(command, target)
    if done.returncode == 0 and target.is_file() and target.stat().st_size:
        return
    how = _ending(done.returncode) if done.returncode else f"succeeded but wrote no {target.name}"
    raise CompilerError(f"the C compiler {how}.\n{shlex.join(command)}\n{done.stderr.strip()}")


def _alone(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run in an environment where temporary files are in ``folder``, and removed with it."""
    own = {"TMPDIR": str(folder), "LC_ALL": "C", **zig_cache.environment(folder)}
    return _output(command, LONGEST, env={**os.environ, **own})


def _made_elsewhere(command: list[str], target: Path) -> subprocess.CompletedProcess[str]:
    """Make the target in a temporary folder; its copy fails with a reason if the disk is full."""
    try:
        with tempfile.TemporaryDirectory(prefix="mechc-") as folder:
            aside = Path(folder) / target.name
            there = [str(aside) if word == str(target) else word for word in command]
            done = _alone(there, aside.parent)
            if aside.is_file():
                shutil.copyfile(aside, target)
    except OSError as error:
        raise CompilerError(f"{target} cannot be written: {error.strerror or error}") from None
    return done


def _ending(code: int) -> str:
    if code >= 0:
        return f"failed (exit {code})"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    return f"was ended by {name}" + (", perhaps for lack of memory" if name == "SIGKILL" else "")
