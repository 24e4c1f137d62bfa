"""Joints besides those of ``sympy.physics.mechanics``, and couplings between joints."""
