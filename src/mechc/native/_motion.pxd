"""Motions of scenes, for the other extensions."""

from mechc.native._abi cimport mechc_options, mechc_step_limits
from mechc.native._driver cimport Scene
from mechc.native._events cimport Events
from mechc.native._hybrid cimport mechc_given_inputs, mechc_hybrid
from mechc.native._inputs cimport Inputs
from mechc.native._steps cimport Sizes


cdef class Request:
    cdef mechc_options options
    cdef mechc_given_inputs given
    cdef mechc_step_limits limits
    cdef Scene scene, asked  # at once; see Scene.at_once
    cdef int parts
    cdef Sizes sizes
    cdef Inputs inputs
    cdef Events events
    cdef object due, references
    cdef readonly object p

    cdef take_inputs(self, Inputs inputs, const double[::1] kinks)
    cdef describe(self, mechc_hybrid *hybrid)
    cdef give_events(self, mechc_hybrid *hybrid)
