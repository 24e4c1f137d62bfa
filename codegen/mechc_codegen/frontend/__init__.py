"""From objects of ``sympy.physics.mechanics`` and what a user requests to descriptions."""
