"""Statements in C as operations of a tape, whose values are those of the statements."""

import math

import pytest
from mechc_codegen.emit.expressions import Line
from mechc_codegen.emit.tape.assembler import FUNCTIONS, OPERATIONS, Assembler, NoTapeError

NAMES = list(OPERATIONS)


def run(text, arrays=("p", "out"), given=(2.0, -3.0, 0.5), size=4):
    """The last array of a function, by the operations of its tape."""
    tape = Assembler({}, arrays, {"MECHC_LIMIT": 0.25})
    registers, rows = tape.take([Line(tuple(text.splitlines()))]).rows()
    numbers = [float.fromhex(key) for key in tape.numbers]
    values, found = [math.nan] * registers, [list(given), [math.nan] * size]
    for code, to, a, b, c in rows:
        match NAMES[code]:
            case "NUMBER":
                values[to] = numbers[a]
            case "LOAD":
                values[to] = found[a][b]
            case "STORE":
                found[a][b] = values[c]
            case "CLEAR":
                found[a][:b] = [0.0] * b
            case "SINE_COSINE":
                values[to], values[b] = math.sin(values[a]), math.cos(values[a])
            case "END":
                break
            case name:
                values[to] = computed(name, values, a, b, c)
    return found[-1]


def computed(name, v, a, b, c):
    return {
        "ADD": lambda: v[a] + v[b],
        "SUBTRACT": lambda: v[a] - v[b],
        "MULTIPLY": lambda: v[a] * v[b],
        "DIVIDE": lambda: v[a] / v[b],
        "NEGATE": lambda: -v[a],
        "FMA": lambda: v[a] * v[b] + v[c],
        "FNMA": lambda: v[c] - v[a] * v[b],
        "SQRT": lambda: math.sqrt(v[a]),
        "LESS": lambda: float(v[a] < v[b]),
        "AND": lambda: float(bool(v[a]) and bool(v[b])),
        "SELECT": lambda: v[b] if v[a] else v[c],
    }[name]()


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("out[0] = p[0] - p[1] - p[2]; /* left first; x[1] = 2 */", 4.5),
        ("const real a = p[0]; out[0] = (1.0/(a*a));", 0.25),
        ("out[0] = -p[1]*p[0];", 6.0),
        ("out[0] = R_FMA(p[0], p[1], R_FNMA(R(0.25), p[0], p[2]));", -6.0),
        ("out[0] = R_SQRT(p[0] + p[0]);", 2.0),
        ("real s, c; FN(sincos)(p[1], &s, &c); out[0] = s/c;", math.tan(-3.0)),
        ("out[0] = R_SELECT(R_MASK(p[1] > 0.0), R(1.0), R(0.0));", 0.0),
        ("real most = R(0.0); most = R_SELECT(R_MASK(p[0] > most), p[0], most);\n"
         "out[0] = most;", 2.0),
        ("rmask all = R_MASK(R(0.0) < p[0]); all &= R_MASK(p[2] > MECHC_LIMIT);\n"
         "out[0] = R_SELECT(all, R(1.0), R(0.0));", 1.0),
        ("out[0] = (1.0/3.0)*p[0];", 1.0 / 3.0 * 2.0),
        ("for (int i = 0; i < 3; i++) {\n    out[i] = R(0.0);\n}\nout[1] = p[0];", 0.0),
    ],
)  # fmt: skip
def test_statements_keep_their_values(text, wanted):
    assert run(text)[0] == wanted


def test_registers_are_used_again():
    chain = "".join(f"const real z{i + 1} = z{i} + p[{i % 3}];" for i in range(200))
    tape = Assembler({}, ("p", "out")).take(
        [Line((f"const real z0 = p[0]; {chain} out[0] = z200;",))]
    )
    registers, rows = tape.rows()
    assert registers < 4
    assert len(rows) == 403


@pytest.mark.parametrize(
    "text",
    [
        "out[0] = R_CALL(system, p[0]);",
        "out[0] = lookup_3(p[0]);",
        "while (1) {}",
        "out[0] = p[0] ? 1.0 : 2.0;",
        "p[0]++;",
    ],
)
def test_what_is_no_operation_is_refused(text):
    with pytest.raises(NoTapeError):
        Assembler({}, ("p", "out")).take([Line((text,))])


def test_lists_of_the_header_are_read_whole():
    assert {"NUMBER", "FMA", "SELECT", "RETURN", "END"} <= OPERATIONS.keys()
    assert FUNCTIONS["hoist"] == ["p", "k"]
    assert FUNCTIONS["series_next"] == ["p", "k", "kept", "sums", "row", "rates"]
    assert list(FUNCTIONS)[-4:] == ["plain", "solved", "adjoint", "default"]
