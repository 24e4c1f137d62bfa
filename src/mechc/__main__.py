"""``python -m mechc`` is the command ``mechc``."""

from mechc.cli import main

raise SystemExit(main())
