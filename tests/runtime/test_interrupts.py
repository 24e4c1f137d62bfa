"""Ctrl-C while NumPy is imported comes after its import: a process can load it once."""

import subprocess
import sys

import pytest

PROGRAM = """
import signal, sys

class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            sys.meta_path.remove(self)
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Interrupt())
try:
    import mechc
except KeyboardInterrupt:
    print("interrupted")
import mechc
print(mechc.load("four_bar").rhs(0.0, [1.0] * 6)[0])
"""


@pytest.mark.parametrize(
    "module", ["numpy._core", "numpy.linalg", "numpy.matrixlib", "mechc.native._motion"]
)
def test_an_interrupted_import_can_be_repeated(module):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(module=module)], capture_output=True, text=True
    )
    assert done.stdout.split() == ["interrupted", "1.0"], done.stderr
