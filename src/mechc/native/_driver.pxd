"""Compiled scenes, for the other extensions."""

from mechc.native._abi cimport mechc_model, mechc_unit


cdef class Scene:
    cdef const mechc_model *model
    cdef const mechc_unit *unit
    cdef dict indices
    cdef readonly dict outputs  # name -> width
    cdef readonly object capsule
    cdef readonly int width, coordinates, speeds, rows, holonomic, parameters, inputs
    cdef size_t stack  # bytes of stack that it needs beyond those of any thread
