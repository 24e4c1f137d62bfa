"""The same models by other formulations, in NumPy and SciPy: the converged values."""
