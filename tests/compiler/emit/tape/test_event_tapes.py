"""Tapes of events, and the C of exports: both give what the expressions give."""

import ctypes
import subprocess

import numpy as np
import pytest
from mechc_codegen.emit.tape.assembler import NoTapeError
from mechc_codegen.emit.tape.event_tapes import event_tapes
from mechc_codegen.emit.units.event_functions import EventExpressions, event_functions
from mechc_codegen.errors import MechanismError
from mechc_codegen.extension.flags import RUNTIME, STRICT
from sympy import Abs, Add, Max, Symbol, besselj, diff, sin, sqrt

from mechc.compilation import toolchain

T, Y0, Y1, P0 = (Symbol(name, real=True) for name in ("t", "y0", "y1", "p0"))
VALUE = sin(Y0 * T) * sqrt(Y1) + Abs(Y0) ** 3 / P0 + Max(Y0, Y1)
RESET = {1: -P0 * Y1 + Y0**2, 2: 2 * P0}  # 2: the parameter
EVENTS = [EventExpressions(None), EventExpressions(VALUE, RESET)]
CONTACTS = [Y1, P0 / 2]
NUMBERS = {T: 0.7, Y0: -0.4, Y1: 1.3, P0: 0.9}
BOTH = """
#include "hybrid/events/by_tape.h"
#include "simd/bind_scalar.h"
%s
double tape(void *const *code, int number, double t, const double *y, const double *p, double *out)
{
    const mechc_tape_code of = {code[0], code[1], code[2], code[3], code[4]};
    const mechc_event_tapes event = {&of, 0, 0, 0, 0};
    return mechc_run_event_tape(&event, number, t, y, p, out);
}
double compiled(int kind, double t, const double *y, const double *p, double *out)
{
    const mechc_event_functions *event = mechc_functions + 1;
    if (kind == 0) return event->value(0, t, y, p);
    if (kind == 1) event->slopes(0, t, y, p, out);
    else if (kind == 2) event->reset(0, t, y, p, out);
    else mechc_contact_quantities(0, t, y, p, out);
    return 0.0;
}
"""


def test_values_slopes_resets_and_contacts(tmp_path):
    found = event_tapes(EVENTS, CONTACTS, 2)
    assert found.numbers[0] == [-1, -1, -1]
    (tmp_path / "events.c").write_text(BOTH % event_functions(EVENTS, CONTACTS, 2))
    command = [*toolchain.compiler(), "-std=gnu11", "-O1", *STRICT, "-shared", "-fPIC"]
    command += [f"-I{RUNTIME}", "events.c", "-lm", "-o", "events.so"]
    subprocess.run(command, cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "events.so"))
    library.tape.restype = library.compiled.restype = ctypes.c_double
    code = (ctypes.c_char_p * 5)(*found.code)
    exact = [
        [], [diff(VALUE, x) for x in (T, Y0, Y1)], [Y0, RESET[1], RESET[2]], CONTACTS,
    ]  # fmt: skip
    for kind, number in enumerate([*found.numbers[1], found.contacts]):
        results = []
        for call, first in ((library.tape, (code, number)), (library.compiled, (kind,))):
            out = np.array([-0.4, 1.3, 0.9])
            state, p = np.array([-0.4, 1.3]), np.array([0.9])
            pointers = [each.ctypes.data_as(ctypes.c_void_p) for each in (state, p, out)]
            results.append([call(*first, ctypes.c_double(0.7), *pointers), *out])
        assert results[0] == results[1]  # to the last bit
        wanted = [float(each.subs(NUMBERS)) for each in exact[kind]]
        assert results[0][1 : 1 + len(wanted)] == pytest.approx(wanted, rel=1e-14)
        if kind == 0:
            assert results[0][0] == pytest.approx(float(VALUE.subs(NUMBERS)), rel=1e-15)


def test_a_function_without_a_form_in_c_is_refused():
    with pytest.raises(MechanismError, match="besselj"):
        event_tapes([EventExpressions(besselj(0, Y0))], [], 2)


def test_a_sum_of_many_terms_has_a_tape():
    """As nested products and sums no reader of C, nor of Python, takes more than some hundred."""
    event = EventExpressions(Add(*(sin(k * Y0) * Y1 for k in range(1, 261))))
    found = event_tapes([event], [], 2)
    assert -1 not in found.numbers[0][:2]
    assert event_functions([event], [], 2).count("const real s") >= 5


def test_a_function_that_is_too_long_is_refused(monkeypatch):
    monkeypatch.setattr("mechc_codegen.emit.tape.code.MOST_REGISTERS", 100)
    states = [Symbol(f"y{k}", real=True) for k in range(110)]
    longest = sin(Add(*states)) + sin(Add(*(2 * y for y in states)))
    with pytest.raises(NoTapeError):
        event_tapes([], [longest], 110)
