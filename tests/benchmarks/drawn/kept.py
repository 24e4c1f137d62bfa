"""Scenes that a judge of drawn scenes has found wrong once, written out."""

from benchmarks.drawn.scene import Scene

# The factor B - 1 of a series' first term was printed without parentheses.
SUM_OF_PARAMETERS = Scene(
    "equations by hand",
    """\
x, v = dynamicsymbols("x v")
A, B = sm.symbols("A B")
q, u = [x], [v]
M, F, rates = [[A + (B - 1) * sm.sin(x)]], [-(B - 1) * sm.cos(x) * v**2 / 2], u
described = mechc.from_equations(q, u, M, F)
""",
    "",
    {"A": (2.5, 4.0), "B": (1.5, 2.5)},
    {"x": (-1.0, 1.0), "v": (0.5, 1.5)},
)

KEPT = {"sum of parameters": (SUM_OF_PARAMETERS, ("auto", "taylor", "gauss8"))}
