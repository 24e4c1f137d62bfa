"""Scenes whose outputs are functions of Python, through the interface of compiled ones."""

import ctypes
import re
from ctypes import CFUNCTYPE, POINTER, Structure, c_char_p, c_double, c_int, c_ssize_t, c_void_p
from functools import cached_property
from pathlib import Path

import numpy as np
from mechc.native._driver import Scene

import mechc


class _Rows(Structure):
    _fields_ = (("data", POINTER(c_double)), ("stride", c_ssize_t))


_Evaluate = CFUNCTYPE(None, c_ssize_t, _Rows, _Rows, _Rows, c_void_p, _Rows, POINTER(c_double))


class _Output(Structure):
    _fields_ = (("name", c_char_p), ("width", c_int), ("evaluate", _Evaluate))


class _Unit(Structure):
    """The first members of ``mechc_unit``, which evaluate outputs."""

    _fields_ = (
        ("instruction_set", c_char_p), ("lanes", c_int), ("identity_kinematics", c_int),
        ("output_count", c_int), ("outputs", POINTER(_Output)),
    )  # fmt: skip


_Select = CFUNCTYPE(c_void_p, c_char_p)


class _Model(Structure):
    _fields_ = (
        ("abi", c_int), ("metadata", c_char_p), ("coordinates", c_int), ("speeds", c_int),
        ("holonomic", c_int), ("rows", c_int), ("parameters", c_int), ("complete", c_void_p),
        ("select", _Select), ("inputs", c_int), ("texts", c_char_p),
        ("general", c_void_p), ("series", c_void_p), ("derivatives", c_void_p), ("bound", c_int),
    )  # fmt: skip


class PythonScene:
    """Holonomic constraints, by ``evaluate(name, q, u)`` of a subclass."""

    def __init__(self, coordinates, rows):
        self.coordinates, self.rows, self.width = coordinates, rows, 2 * coordinates

    def _output(self, name, size):
        def evaluate(count, t, y, p, inputs, forces, out):
            states = np.ctypeslib.as_array(y.data, (count, self.width))
            q, u = np.split(states, 2, axis=1)
            np.ctypeslib.as_array(out, (count, size))[...] = self.evaluate(name, q, u).reshape(
                count, size
            )

        return _Output(name.encode(), size, _Evaluate(evaluate))

    @cached_property
    def scene(self):
        """The scene, as long as this object lives."""
        header = (Path(mechc.get_include()) / "model.h").read_text()
        (abi,) = re.findall(r"#define MECHC_ABI (\d+)", header)
        (name,) = re.findall(r'#define MECHC_CAPSULE "(.*)"', header)
        n, rows = self.coordinates, self.rows
        outputs = (_Output * 3)(
            self._output("constraints", rows), self._output("velocity_constraints", rows),
            self._output("constraint_jacobian", rows * n),
        )  # fmt: skip
        unit = _Unit(b"python", 1, 1, len(outputs), outputs)
        model = _Model(
            int(abi), b"{}", n, n, rows, rows, 1, None,
            _Select(lambda wanted: ctypes.addressof(unit)), 0, None,
        )  # fmt: skip
        self._alive = name.encode(), outputs, unit, model
        capsule = ctypes.pythonapi.PyCapsule_New
        capsule.restype, capsule.argtypes = ctypes.py_object, [c_void_p, c_char_p, c_void_p]
        return Scene(capsule(ctypes.addressof(model), self._alive[0], None))
