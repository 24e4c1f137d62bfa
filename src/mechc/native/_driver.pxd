"""Compiled scenes, for the other extensions."""

from mechc.native._abi cimport mechc_joined, mechc_model, mechc_unit


cdef class Scene:
    cdef const mechc_model *model
    cdef const mechc_unit *unit
    cdef mechc_joined *joined  # of parts; NULL: the unit is whole
    cdef object source  # of its parts
    cdef object first, whole  # capsules of its first unit, of all of it
    cdef object members  # see of_members
    cdef Scene general  # the same by the general unit, or None
    cdef long worked  # evaluations of runs by it
    cdef bint by_general
    cdef ptrdiff_t evaluated  # states, one after the other
    cdef dict indices
    cdef readonly dict outputs  # name -> width
    cdef readonly int width, coordinates, speeds, rows, holonomic, parameters, inputs
    cdef readonly bint switches # has it switching functions?
    cdef int widest  # output
    cdef size_t stack, stack_of_general  # bytes of stack that runs need beyond those of any thread

    cdef size_t stack_of(self, int width)
    cdef size_t stack_here(self)
    cdef size_t stack_of_thread(self)
    cdef size_t stack_of_derivatives(self)
    cdef size_t stack_beyond(self, int width)
    cpdef need(self, int parts)
    cpdef Scene at_once(self, int parts, int by_general=*)
    cdef take(self, capsule)
    cdef prefer_lanes(self, ptrdiff_t count)
