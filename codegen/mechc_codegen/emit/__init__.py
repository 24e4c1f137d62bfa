"""From a program to C, or to Python over NumPy arrays."""
