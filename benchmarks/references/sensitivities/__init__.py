"""Derivatives of motions in many digits, made in two ways, and the comparison with them."""
