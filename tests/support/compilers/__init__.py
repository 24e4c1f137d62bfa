"""Compilers as tests use them: less optimised, asked for other systems, made on request."""
