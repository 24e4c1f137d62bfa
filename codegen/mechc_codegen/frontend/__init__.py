"""Reading of objects of ``sympy.physics.mechanics`` and of requests as descriptions."""
