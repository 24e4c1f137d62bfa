"""The command ``mechc``."""
