"""Events of motions, for the other extensions."""

from mechc.native._hybrid cimport (
    mechc_contact_laws, mechc_event_functions, mechc_event_policy, mechc_event_tapes, mechc_tape_code
)


cdef struct called_event:
    mechc_event_tapes tapes  # first: those who run them are given this address
    void *events
    int number


cdef class EventTapes:
    cdef mechc_tape_code code
    cdef int width, parameters, contacts
    cdef const int[:, ::1] numbers
    cdef tuple kept


cdef class Events:
    cdef int count, width, parameters, coordinates
    cdef mechc_event_functions *functions
    cdef mechc_event_policy *policy
    cdef mechc_contact_laws laws
    cdef mechc_event_tapes of_contacts
    cdef called_event *called
    cdef object references, callbacks, table
    cdef readonly bint calls_python
    cdef public object failure

    cdef void run_tapes(self, int k, EventTapes tapes) noexcept
