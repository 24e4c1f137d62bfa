"""Threads with small stacks: the work space of a wide scene is not on them."""

import subprocess
import sys

import pytest

# 256 KiB hold Python's own frames, and no matrix of 120 times 120 doubles beside others.
IN_A_THREAD = """
import threading
import numpy as np
import mechc

model = mechc.load("planar_chain", links=60)
start = model.assemble()
held = model.simulate(1e-3, start)
rates, at_once = model.rhs(0.0, start), model.ode()(0.0, start)
found = {}

def work():
    found["sol"] = model.simulate(1e-3, start)
    found["implicit"] = model.simulate(1e-4, start, method="radau5", rtol=1e-5)
    found["dense"] = found["sol"](5e-4)
    found["rates"] = model.rhs(0.0, start)
    found["ode"] = model.ode()(0.0, start)
    found["batch"] = model.simulate_batch(1e-4, np.stack([start, start]), threads=2)

threading.stack_size(256 * 1024)
thread = threading.Thread(target=work)
thread.start()
thread.join()
assert np.array_equal(found["sol"].y, held.y)
assert np.array_equal(found["rates"], rates)
assert np.allclose(found["ode"], at_once, rtol=1e-12, atol=1e-12 * abs(rates).max())
assert np.array_equal(found["dense"], held(5e-4))
assert found["implicit"].status.ok, found["implicit"].status
assert found["batch"].counts == {"finished": 2}, found["batch"].counts
"""


@pytest.mark.thorough
def test_a_chain_of_sixty_links_in_a_thread_with_a_small_stack():
    subprocess.run([sys.executable, "-c", IN_A_THREAD], check=True, timeout=1200)
