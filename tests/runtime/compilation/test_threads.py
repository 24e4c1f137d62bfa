"""Threads that import the compiler and compile at once get what one thread gets."""

import os
import subprocess
import sys
import threading
import time

import pytest

import mechc

# In a fresh process each: what is half imported is so only once.
AT_ONCE = """
import sys, threading, traceback
sys.setswitchinterval(1e-6)
import mechc

def kane():
    import sympy as sm
    from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols
    q, u = dynamicsymbols("q u")
    m, g = sm.symbols("m g")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    point = origin.locatenew("P", q * frame.x)
    point.set_vel(frame, u * frame.x)
    method = KanesMethod(frame, [q], [u], [q.diff() - u])
    method.kanes_equations([Particle("p", point, m)], [(point, m * g * frame.x)])
    mechc.compile(method)

ways = [
    lambda: mechc.State, kane, mechc.get_include,
    lambda: mechc.load("four_bar", fix={"l_0": 4.0}),
    lambda: mechc.load("pendulum", links=2),
]
failed, together = [], threading.Barrier(40)

def one(way):
    together.wait()
    try:
        way()
    except BaseException:
        failed.append(traceback.format_exc())

threads = [threading.Thread(target=one, args=(ways[i % len(ways)],)) for i in range(40)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
sys.exit(failed[0] if failed else 0)
"""


@pytest.mark.slow
def test_forty_threads_import_and_compile_at_once():
    for _ in range(3):
        subprocess.run([sys.executable, "-c", AT_ONCE], check=True, timeout=120)


def test_one_thread_at_a_time_derives(monkeypatch):
    import mechc_codegen.compiler as compiler

    inside, most = [], []

    def watched(*_):
        inside.append(None)
        most.append(len(inside))
        time.sleep(0.02)
        inside.pop()
        raise KeyError("nothing is compiled here")

    def load(mass):
        with pytest.raises(KeyError):
            mechc.load("pendulum", fix={"m_0": mass})

    monkeypatch.setattr(compiler, "build_scene", watched)
    threads = [threading.Thread(target=load, args=(1.0 + 1e-9 * k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1] * 8


def test_a_process_forked_while_a_thread_compiles_compiles_too():
    script = """
import os, threading, time
import mechc
import pytest
from mechc.compilation.one_at_a_time import one_at_a_time
ready, leave = threading.Event(), threading.Event()

@one_at_a_time
def hold():
    ready.set()
    leave.wait(60)

threading.Thread(target=hold, daemon=True).start()
ready.wait()
child = os.fork()
if not child:
    mechc.load("pendulum")
    os._exit(0)
assert os.waitpid(child, 0)[1] == 0
leave.set()
"""
    command = [sys.executable, "-W", "ignore", "-c", script]
    subprocess.run(command, check=True, timeout=60, env=os.environ)
