"""``python -m mechc`` is the command ``mechc``."""

from mechc.cli.commands import main

raise SystemExit(main())
