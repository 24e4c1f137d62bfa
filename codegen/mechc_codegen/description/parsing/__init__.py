"""Typed expressions, read within bounds."""
