"""Exudyn, a multibody engine; its models are imported where a problem is built."""

from .engine import TOOLS, build

__all__ = ["TOOLS", "build"]
