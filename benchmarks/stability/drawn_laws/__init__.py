"""Random laws: drawn, followed from zero to zero by SciPy, and compared with mechc's motions."""
