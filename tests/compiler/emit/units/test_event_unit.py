"""The C of events: compiled with warnings as errors, it gives what the expressions give."""

import ctypes
import subprocess

import pytest
from mechc_codegen.emit.units.event_unit import EventExpressions, event_unit
from mechc_codegen.errors import MechanismError
from mechc_codegen.extension.flags import RUNTIME, STRICT
from sympy import Abs, Max, Symbol, besselj, diff, sin, sqrt

from mechc.compilation import toolchain

T, Y0, Y1, P0 = (Symbol(name, real=True) for name in ("t", "y0", "y1", "p0"))


class Functions(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("value", "slopes", "reset", "context")]


class Unit(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_int) for name in ("abi", "width", "parameters", "count")),
        ("functions", ctypes.POINTER(Functions)),
        ("contacts", ctypes.c_void_p),
    ]


POINTERS = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]


def test_values_slopes_resets_and_contacts(tmp_path):
    value = sin(Y0 * T) * sqrt(Y1) + Abs(Y0) ** 3 / P0 + Max(Y0, Y1)
    reset = {1: -P0 * Y1 + Y0**2, 2: 2 * P0}  # 2: the parameter
    text = event_unit([EventExpressions(None), EventExpressions(value, reset)], [Y1, P0 / 2], 2, 1)
    (tmp_path / "events.c").write_text(text)
    command = [*toolchain.compiler(), "-std=gnu11", "-O1", *STRICT, "-shared", "-fPIC"]
    command += [f"-I{RUNTIME}", "events.c", "-lm", "-o", "events.so"]
    subprocess.run(command, cwd=tmp_path, check=True)
    unit = Unit.in_dll(ctypes.CDLL(str(tmp_path / "events.so")), "mechc_events")
    assert (unit.width, unit.parameters, unit.count) == (2, 1, 2)
    none, event = unit.functions[0], unit.functions[1]
    assert (none.value, none.slopes, none.reset) == (None, None, None)
    numbers = {T: 0.7, Y0: -0.4, Y1: 1.3, P0: 0.9}
    state, p = (ctypes.c_double * 2)(-0.4, 1.3), (ctypes.c_double * 1)(0.9)
    call = ctypes.CFUNCTYPE(ctypes.c_double, *POINTERS)(event.value)
    assert call(None, 0.7, state, p) == pytest.approx(float(value.subs(numbers)), rel=1e-15)
    slopes, after = (ctypes.c_double * 3)(), (ctypes.c_double * 3)(-0.4, 1.3, 0.9)
    into = ctypes.CFUNCTYPE(ctypes.c_int, *POINTERS, ctypes.c_void_p)
    into(event.slopes)(None, 0.7, state, p, slopes)
    exact = [float(diff(value, x).subs(numbers)) for x in (T, Y0, Y1)]
    assert list(slopes) == pytest.approx(exact, rel=1e-14)
    assert into(event.reset)(None, 0.7, state, p, after) == 1
    assert list(after) == pytest.approx([-0.4, -0.9 * 1.3 + 0.16, 1.8], rel=1e-15)
    table = (ctypes.c_double * 2)()
    assert into(unit.contacts)(None, 0.7, state, p, table) == 1
    assert list(table) == [1.3, 0.45]


def test_a_function_without_a_form_in_c_is_refused():
    with pytest.raises(MechanismError, match="besselj"):
        event_unit([EventExpressions(besselj(0, Y0))], [], 2, 0)
