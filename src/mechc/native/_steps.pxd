"""Steps of motions, for the other extensions."""

from mechc.native._abi cimport mechc_unit
from mechc.native._driver cimport Scene
from mechc.native._events cimport Events
from mechc.native._hybrid cimport mechc_piece, mechc_sizes
from mechc.native._inputs cimport Inputs


cdef class Sizes:
    cdef mechc_sizes sizes
    cdef object references


cdef class Steps:
    cdef object scene  # which holds the compiled code
    cdef object asked  # the same, or that by whose general unit the run is
    cdef const mechc_unit *unit
    cdef mechc_piece *piece
    cdef int coordinates, width
    cdef size_t stack
    cdef object p
    cdef Inputs inputs
    cdef Events events
    cdef Sizes sizes

    cdef read(self, Scene scene, p, Inputs inputs, Events events, Sizes sizes)
    cdef read_contact(self, const double[::1] t, const double *y, double *out)
    cdef Scene differentiated_by(self, ptrdiff_t work)
    cdef differentiate(self, Scene by, void (*work)(void *) noexcept nogil, void *asked)
    cdef ptrdiff_t at_once(self, int columns)


cdef Steps steps_of(Scene scene, mechc_piece *piece, p, Inputs inputs, Events events, Sizes sizes)
