"""``mechc bench``, or ``python -m benchmarks`` in a clone: see suite/run.py."""

import signal
import sys

from .suite.run import main

if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends the scripts with the suite
    sys.exit(main())
