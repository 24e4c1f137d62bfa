# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""Events of motions, and the laws of contacts: tapes, and functions of Python."""

import numpy as np

from libc.math cimport NAN, isnan
from libc.stdlib cimport calloc, free
from libc.string cimport memcpy
from mechc.native._driver cimport Scene
from mechc.native._hybrid cimport (
    mechc_contacts_by_tape, mechc_event_functions, mechc_event_policy, mechc_event_tapes, mechc_impulses,
    mechc_operation, mechc_reset_by_tape, mechc_slopes_by_tape, mechc_tape, mechc_tape_code, mechc_tape_table,
    mechc_value_by_tape
)
from mechc.native._inputs cimport array_of


def impulses(const double[:, ::1] a, const double[::1] w, const double[::1] e, bint poisson=False):
    """The impulses (n,) at n contacts that touch, without friction: ``hybrid/contact/impulses.h``.

    a : (n, n)
        How the rates of the gaps change with them.
    w, e : (n,)
        The rates before, and the restitution of each.
    poisson
        By Poisson's law, not Newton's.

    Raises ArithmeticError where there are none.
    """
    cdef int n = w.shape[0]
    out, space, sets = np.zeros(n), np.zeros(n * (n + 7) + 1), np.zeros(2 * n + 1, np.intc)
    cdef double[::1] p = out, room = space
    cdef int[::1] of_contacts = sets
    if a.shape[0] != n or a.shape[1] != n or e.shape[0] != n:
        raise ValueError("a rate and a restitution are needed for every contact")
    if n and not mechc_impulses(
        &a[0, 0], &w[0], &e[0], n, poisson, &p[0], &room[0], &of_contacts[0]
    ):
        raise ArithmeticError("no impulses keep these gaps from closing")
    return out


cdef class EventTapes:
    """Functions of events and of contacts as tapes, made by this process: they are not checked.

    Parameters
    ----------
    width, parameters
        Of the state and the parameters that they are given.
    numbers : (k, 3)
        Of each event the tapes of its value, its slopes and its reset, -1 without.
    contacts
        The tape of the quantities of all contacts, or -1.
    code
        Operations, tapes, tables, constants, and the numbers of tables, as ``runtime/tape/tape.h`` has them.
    """

    def __init__(self, int width, int parameters, const int[:, ::1] numbers, int contacts, tuple code):
        cdef const unsigned char[::1] operations, tapes, tables, constants, of_tables
        self.width, self.parameters, self.contacts, self.numbers = width, parameters, contacts, numbers
        self.kept = tuple(np.frombuffer(part + bytes(8), np.uint8) for part in code)
        operations, tapes, tables, constants, of_tables = self.kept
        self.code = mechc_tape_code(
            <const mechc_operation *>&operations[0], <const mechc_tape *>&tapes[0],
            <const mechc_tape_table *>&tables[0], <const double *>&constants[0],
            <const double *>&of_tables[0],
        )

    def __len__(self):
        return self.numbers.shape[0]


cdef double call_value(void *given, double t, const double *y, const double *p) noexcept with gil:
    cdef called_event *called = <called_event *>given
    cdef Events events = <Events>called.events
    cdef double value = NAN
    if events.failure is not None:
        return NAN
    try:
        value = events.callbacks[called.number][0](
            t, array_of(y, events.width), array_of(p, events.parameters)
        )
        if isnan(value):
            events.failure = called.number, "value", t, None
    except BaseException as error:
        events.failure = called.number, "value", t, error
        value = NAN
    return value


cdef int call_reset(
    void *given, double t, const double *y, const double *p, double *after
) noexcept with gil:
    cdef called_event *called = <called_event *>given
    cdef Events events = <Events>called.events
    cdef const double[::1] state, values
    try:
        state, values = events.callbacks[called.number][1](
            t, array_of(y, events.width), array_of(p, events.parameters)
        )
        memcpy(after, &state[0], events.width * sizeof(double))
        if events.parameters:
            memcpy(after + events.width, &values[0], events.parameters * sizeof(double))
        return 1
    except BaseException as error:
        events.failure = called.number, "reset", t, error
        return 0


cdef int call_table(
    void *given, double t, const double *state, const double *p, double *table
) noexcept with gil:
    cdef Events events = <Events>given
    cdef const double[:, ::1] values
    try:
        values = events.table(
            t, array_of(state, events.width + events.coordinates), array_of(p, events.parameters)
        )
        memcpy(table, &values[0, 0], values.shape[0] * values.shape[1] * sizeof(double))
        return 1
    except BaseException as error:
        events.failure = -1, "contact", t, error
        return 0


cdef class Events:
    """The events of motions of a scene.

    Parameters
    ----------
    directions : (k,)
        Positive: only where the function grows; negative: only where it falls; 0: both.
    terminal : (k,)
        How many zeros of each end a motion, 0 for none.
    tapes
        :class:`EventTapes`, or None.
    callbacks
        Of each event None, or two functions of Python in place of its tapes: its value by t, y
        and p, and the state and the parameters after its reset by the same; each may be None.
    contacts : (k,)
        Of each event the number of the contact that it is, or -1.
    has_gap, has_friction, is_linear : (n,)
        Of each contact.
    poisson
        Whether impacts follow Poisson's law of restitution.
    table
        Where the laws of contacts have no tape, their quantities (n, 8 + nq + nu) by t, (q, u, q')
        and p.

    Attributes
    ----------
    failure
        The event (-1: a contact), what of it failed, when, and its exception, or None where it gave no
        number; None: nothing failed.
    calls_python
        Whether any function is one of Python.
    """

    def __cinit__(self):
        self.functions, self.policy, self.called = NULL, NULL, NULL

    def __init__(self, Scene scene, const double[::1] directions, const long[::1] terminal,
                 EventTapes tapes, list callbacks, const int[::1] contacts,
                 const unsigned char[::1] has_gap, const unsigned char[::1] has_friction,
                 const unsigned char[::1] is_linear, bint poisson=False, table=None):
        cdef int k, n = has_gap.shape[0]
        self.count = directions.shape[0]
        self.width, self.parameters = scene.width, scene.parameters
        self.coordinates = scene.coordinates
        if terminal.shape[0] != self.count or contacts.shape[0] != self.count \
                or len(callbacks) != self.count or has_friction.shape[0] != n \
                or is_linear.shape[0] != n:
            raise ValueError("a direction is needed for every event")
        if tapes is not None and (tapes.width != scene.width or tapes.numbers.shape[0] != self.count
                                  or tapes.parameters != scene.parameters):
            raise ValueError("these events are of another model")
        of_contacts = np.zeros(n, np.intc)
        cdef int[::1] numbers = of_contacts
        self.references = scene, tapes, has_gap, has_friction, is_linear, of_contacts
        self.callbacks, self.table, self.failure = callbacks, table, None
        self.functions = <mechc_event_functions *>calloc(self.count, sizeof(mechc_event_functions))
        self.policy = <mechc_event_policy *>calloc(self.count, sizeof(mechc_event_policy))
        self.called = <called_event *>calloc(self.count, sizeof(called_event))
        if self.functions == NULL or self.policy == NULL or self.called == NULL:
            raise MemoryError()
        self.calls_python = table is not None
        for k in range(self.count):
            self.policy[k].direction, self.policy[k].terminal = directions[k], terminal[k]
            self.policy[k].contact = contacts[k]
            if contacts[k] >= 0:
                numbers[contacts[k]] = k
            self.functions[k].context = &self.called[k]
            if tapes is not None:
                self.run_tapes(k, tapes)
            if callbacks[k] is None:
                continue
            self.calls_python = True
            self.called[k].events, self.called[k].number = <void *>self, k
            if callbacks[k][0] is not None:
                self.functions[k].value, self.functions[k].slopes = call_value, NULL
            if callbacks[k][1] is not None:
                self.functions[k].reset = call_reset
        self.laws.count = n
        if not n:
            return
        self.laws.has_gap, self.laws.has_friction = &has_gap[0], &has_friction[0]
        self.laws.is_linear = &is_linear[0]
        self.laws.event, self.laws.poisson = &numbers[0], poisson
        if table is None:
            self.of_contacts = mechc_event_tapes(&tapes.code, -1, -1, -1, tapes.contacts)
            self.laws.table, self.laws.context = mechc_contacts_by_tape, &self.of_contacts
        else:
            self.laws.table, self.laws.context = call_table, <void *>self

    cdef void run_tapes(self, int k, EventTapes tapes) noexcept:
        """Let an event have the functions that are tapes."""
        cdef int value = tapes.numbers[k, 0], slopes = tapes.numbers[k, 1], reset = tapes.numbers[k, 2]
        self.called[k].tapes = mechc_event_tapes(&tapes.code, value, slopes, reset, -1)
        if value >= 0:
            self.functions[k].value, self.functions[k].slopes = mechc_value_by_tape, mechc_slopes_by_tape
        if reset >= 0:
            self.functions[k].reset = mechc_reset_by_tape

    def __dealloc__(self):
        free(self.functions)
        free(self.policy)
        free(self.called)

    def __len__(self):
        return self.count
