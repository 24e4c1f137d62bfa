"""``mechc bench``, or ``python -m benchmarks`` in a clone: see suite.py.

The folder of the scripts is put first where modules are looked for, in a process of its own.
"""

import signal
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from suite import main

if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends the scripts with the suite
    sys.exit(main())
