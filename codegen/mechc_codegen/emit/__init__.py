"""Emission of a program as C, or as Python over NumPy arrays."""
