"""Runs of compiled scenes, for the other extensions."""

from mechc.native._abi cimport mechc_options, mechc_run, mechc_step_limits, mechc_unit
from mechc.native._inputs cimport Inputs


cdef class Run:
    cdef object scene  # which holds the compiled code
    cdef const mechc_unit *unit
    cdef mechc_run *run
    cdef int method, coordinates, width
    cdef int stop  # set to give up a step of a wide scene
    cdef size_t stack
    cdef object p
    cdef const double[::1] limit_times, longest  # those of the limits
    cdef mechc_step_limits limits
    cdef Inputs inputs  # of the end of the run
    cdef ptrdiff_t piece  # attempted steps until the next check of the clock
    cdef ptrdiff_t most  # accepted states that are kept

    cdef begin(self, const mechc_options *options, double max_bytes)
    cpdef void forget(self)
    cdef void _keep_last_state(self)
    cpdef int step(self, double t1, Inputs inputs=*) except -1
