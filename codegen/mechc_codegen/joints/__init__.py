"""Joints that ``sympy.physics.mechanics`` lacks, and couplings between joints."""
