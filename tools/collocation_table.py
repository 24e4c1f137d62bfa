"""Print codegen/mechc_codegen/runtime/methods/gauss/tableau.h: Gauss-Legendre collocation with 8 stages.

Everything is computed in 60 digits and rounded once.  Needs mpmath.
"""

from mpmath import eig, inverse, legendre, lu_solve, matrix, mp, mpf, polyroots, taylor

mp.dps = 60
S = 8


def times(a, b):
    out = [mpf(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def integral(a):
    return [mpf(0)] + [x / (i + 1) for i, x in enumerate(a)]


def value(a, x):
    return sum(c * x**i for i, c in enumerate(a))


def lagrange(nodes, j):
    out = [mpf(1)]
    for m, node in enumerate(nodes):
        if m != j:
            out = times(out, [-node / (nodes[j] - node), 1 / (nodes[j] - node)])
    return out


def dense(polynomial, rows):
    """Coefficients in s, s(1-s), s^2(1-s), s^2(1-s)^2, ... of a polynomial that vanishes at 0."""
    basis, columns = [mpf(1)], []
    for row in range(rows):
        basis = times(basis, [mpf(0), mpf(1)] if row % 2 == 0 else [mpf(1), mpf(-1)])
        columns.append(basis + [mpf(0)] * (rows + 1 - len(basis)))
    system = matrix(rows, rows)
    right = matrix(rows, 1)
    for i in range(rows):
        right[i] = polynomial[i + 1] if i + 1 < len(polynomial) else mpf(0)
        for j in range(rows):
            system[i, j] = columns[j][i + 1]
    return list(lu_solve(system, right))


def lines(values):
    text, line = [], "   "
    for v in values:
        word = f" {float(v)!r},"
        if len(line) + len(word) > 98:
            text.append(line)
            line = "   "
        line += word
    return "\n".join([*text, line])


def table(comment, name, values, size):
    print(f"/* {comment} */")
    print(f"MECHC_GAUSS_TABLE mechc_gauss_{name}[{size}] = {{\n{lines(values)}\n}};\n")


shifted = [mpf(0)]
for power, coefficient in enumerate(taylor(lambda x: legendre(S, x), 0, S)):
    factor = [mpf(1)]
    for _ in range(power):
        factor = times(factor, [mpf(-1), mpf(2)])
    shifted = [
        a + b
        for a, b in zip(
            shifted + [mpf(0)] * (len(factor) - len(shifted)), [coefficient * f for f in factor]
        )
    ]
c = sorted(r.real for r in polyroots(shifted[::-1], maxsteps=500, extraprec=400))
basis = [lagrange(c, j) for j in range(S)]
first = [integral(p) for p in basis]
second = [integral(p) for p in first]
b = [value(p, mpf(1)) for p in first]
ends = [*c, mpf(1)]
barycentric = []
for j, node in enumerate(ends):
    product = mpf(1)
    for m, other in enumerate(ends):
        if m != j:
            product *= node - other
    barycentric.append(1 / product)

print("""/* Gauss-Legendre collocation with 8 stages, order 16, as data; printed by
 * tools/collocation_table.py.  Matrices are stored by columns: entry [j * 8 + i] is what the rate
 * of stage j gives to stage i. */
#pragma once

#define MECHC_STAGES 8
#define MECHC_GAUSS_TABLE static const __attribute__((aligned(64), unused)) double
""")
table("Nodes, then the step's end.", "nodes", ends, "MECHC_STAGES + 1")
table("Integral to the step's end.", "weights", b, "MECHC_STAGES")
table(
    "Second integral to the step's end.",
    "second_weights",
    [value(p, mpf(1)) for p in second],
    "MECHC_STAGES",
)
table(
    "Integrals to each stage.",
    "first",
    [value(first[j], x) for j in range(S) for x in c],
    "MECHC_STAGES * MECHC_STAGES",
)
table(
    "Second integrals to each stage.",
    "second",
    [value(second[j], x) for j in range(S) for x in c],
    "MECHC_STAGES * MECHC_STAGES",
)
table(
    "The polynomial through the rates of the stages at the step's end; at its start from the last one.",
    "continued",
    [value(p, mpf(1)) for p in basis],
    "MECHC_STAGES",
)
table(
    "Coefficient of the Legendre polynomial of degree 7 on the step.",
    "top",
    [(2 * S - 1) * b[j] * legendre(S - 1, 2 * c[j] - 1) for j in range(S)],
    "MECHC_STAGES",
)
table(
    "Coefficient of the Legendre polynomial of degree 6 on the step.",
    "next",
    [(2 * S - 3) * b[j] * legendre(S - 2, 2 * c[j] - 1) for j in range(S)],
    "MECHC_STAGES",
)
table(
    "Barycentric weights of the nodes and the end.", "barycentric", barycentric, "MECHC_STAGES + 1"
)
table(
    "What a difference at stage i, entry [i * 8 + j], continues to at stage j after it where it\n"
    " * vanishes at the stages before.",
    "onward",
    [
        mp.fprod((c[j] - c[m]) / (c[i] - c[m]) for m in range(i)) if j > i else mpf(0)
        for i in range(S)
        for j in range(S)
    ],
    "MECHC_STAGES * MECHC_STAGES",
)
values, right = eig(matrix([[value(first[j], x) for j in range(S)] for x in c]))
for k in range(S):  # the largest entry is 1
    largest = max((right[i, k] for i in range(S)), key=abs)
    for i in range(S):
        right[i, k] /= largest
left = inverse(right)
modes = sorted((k for k in range(S) if values[k].imag > 0), key=lambda k: values[k].imag)
print(
    "/* The first integrals' matrix is diagonal in its eigenvectors, of which every other one is the"
)
print(" * conjugate of the one before: four complex numbers each, real parts first. */")
print("#define MECHC_GAUSS_MODES (MECHC_STAGES / 2)\n")
table(
    "Eigenvalues.",
    "roots",
    [part(values[k]) for part in (mp.re, mp.im) for k in modes],
    "MECHC_STAGES",
)
table(
    "What each stage gives to the modes.",
    "to_modes",
    [part(left[k, j]) for j in range(S) for part in (mp.re, mp.im) for k in modes],
    "MECHC_STAGES * MECHC_STAGES",
)
table(
    "What the modes, real parts and then imaginary ones, with their conjugates give to each stage.",
    "from_modes",
    [2 * v for k in modes for v in (mp.re(right[i, k]) for i in range(S))]
    + [-2 * v for k in modes for v in (mp.im(right[i, k]) for i in range(S))],
    "MECHC_STAGES * MECHC_STAGES",
)
print("/* Rows of the dense output (tableaus.h), by row. */\n#define MECHC_GAUSS_DENSE 9\n")
table(
    "Of the first integral.",
    "first_dense",
    [dense(first[j], 9)[row] if row < 8 else mpf(0) for row in range(9) for j in range(S)],
    "MECHC_GAUSS_DENSE * MECHC_STAGES",
)
table(
    "Of the second integral.",
    "second_dense",
    [dense(second[j], 9)[row] for row in range(9) for j in range(S)],
    "MECHC_GAUSS_DENSE * MECHC_STAGES",
)
print("/* Where rates are taken: the start, the stages, the end. */")
print(f"MECHC_GAUSS_TABLE mechc_gauss8_nodes[MECHC_STAGES + 2] = {{\n{lines([mpf(0), *ends])}\n}};")
