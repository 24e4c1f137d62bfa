"""Compiled events, for the other extensions."""

cdef extern from "events/functions.h":
    int MECHC_EVENTS_ABI

    ctypedef struct mechc_event_unit:
        int abi, width, parameters, count


cdef class EventFunctions:
    cdef const mechc_event_unit *unit
    cdef readonly str source
