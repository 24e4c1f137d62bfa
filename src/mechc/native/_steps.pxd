"""Steps of runs, for the other extensions."""

from mechc.native._abi cimport mechc_trajectory, mechc_unit
from mechc.native._driver cimport Scene
from mechc.native._inputs cimport Inputs


cdef class Steps:
    cdef object scene  # which holds the compiled code
    cdef object owner  # of the trajectory
    cdef const mechc_unit *unit
    cdef const mechc_trajectory *record
    cdef mechc_trajectory own  # of steps that were given as arrays
    cdef int method, coordinates, width
    cdef size_t stack
    cdef object p
    cdef Inputs inputs

    cdef read(self, Scene scene, owner, const mechc_trajectory *record, int method, p, Inputs inputs)
    cdef ptrdiff_t at_once(self, int columns)
