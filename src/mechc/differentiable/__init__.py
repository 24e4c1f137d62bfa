"""Motions as differentiable functions: of NumPy arrays, under JAX, under PyTorch."""
