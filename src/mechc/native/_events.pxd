"""Events of motions, for the other extensions."""

from mechc.native._hybrid cimport mechc_contact_laws, mechc_event_functions, mechc_event_policy, \
    mechc_event_unit


cdef struct called_event:
    void *events
    int number


cdef class EventFunctions:
    cdef const mechc_event_unit *unit
    cdef readonly str source


cdef class Events:
    cdef int count, width, parameters, coordinates
    cdef mechc_event_functions *functions
    cdef mechc_event_policy *policy
    cdef mechc_contact_laws laws
    cdef called_event *called
    cdef object references, callbacks, table
    cdef readonly bint calls_python
    cdef public object failure
