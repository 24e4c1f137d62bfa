"""Batches streamed, killed and resumed, and spread over processes of which one is killed."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

import mechc
from mechc.batch.simulate import CHUNK

STREAM_METHOD = "dop853"


def request(members: int) -> tuple[tuple[Any, ...], dict[str, Any]]:
    draw = np.random.default_rng(0)
    params = {"l_3": draw.uniform(3.4, 3.6, members)}
    start = mechc.Assembly({"theta_0": np.radians(draw.uniform(75, 115, members))})
    return (20.0, start, params), {"rtol": 1e-9, "method": STREAM_METHOD, "progress": False}


def stream_child(members: int, folder: str) -> None:
    arguments, options = request(members)
    started = time.perf_counter()
    mechc.load("four_bar").simulate_batch(*arguments, **options, out=f"{folder}/batch")
    seconds = time.perf_counter() - started
    print(seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def child(members: int, folder: str) -> subprocess.Popen[str]:
    script = str(Path(__file__).with_name("batch.py"))
    command = [sys.executable, script, "--stream-child", str(members), folder]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def streamed(members: int) -> tuple[float, float]:
    """Seconds, and the most memory of the process in MiB."""
    folder = tempfile.mkdtemp()
    try:
        said, _ = child(members, folder).communicate()
    finally:
        shutil.rmtree(folder)
    seconds, memory = map(float, said.split()[-2:])
    return seconds, memory


def stopped_and_resumed(members: int) -> tuple[int, bool]:
    """Kill a stream that has written some chunks, make the call again: members that were written,
    and whether the arrays are those of an uninterrupted run."""
    arguments, options = request(members)
    model = mechc.load("four_bar")
    folder = tempfile.mkdtemp()
    try:
        running = child(members, folder)
        while len(manifests(folder)) < 2 and running.poll() is None:
            time.sleep(0.01)
        running.send_signal(signal.SIGKILL)
        running.wait()
        kept = CHUNK * len(manifests(folder))
        resumed = model.simulate_batch(*arguments, **options, out=f"{folder}/batch")
        whole = model.simulate_batch(*arguments, **options)
        return kept, same(resumed, whole)
    finally:
        shutil.rmtree(folder)


def manifests(folder: str) -> list[Path]:
    """Of the chunks that are finished."""
    return list(Path(folder).glob("batch/mechc/chunk-*.json"))


def same(a: Any, b: Any) -> bool:
    return set(a.arrays) == set(b.arrays) and all(
        np.array_equal(a[name], b[name], equal_nan=True) for name in a.arrays
    )


def cluster(members: int) -> tuple[bool, int]:
    """Whether real worker processes, one of them killed, give the arrays of a local run."""
    from distributed import Client, LocalCluster

    arguments, options = request(members)
    model = mechc.load("four_bar")
    killed: list[int] = []
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True,
                     dashboard_address=None) as here,
        Client(here) as client,
    ):  # fmt: skip
        first = next(iter(client.run(os.getpid).values()))
        timer = threading.Timer(1.0, lambda: (os.kill(first, signal.SIGKILL), killed.append(first)))
        timer.start()
        spread = model.simulate_batch(*arguments, **options, client=client, chunk=500)
        timer.cancel()
    return same(spread, model.simulate_batch(*arguments, **options)), len(killed)
