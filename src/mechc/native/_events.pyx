# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""Events that are compiled: their functions, and their zeros and resets along a run."""

from os import fsencode

import numpy as np

from libc.string cimport memcpy
from mechc.native._abi cimport (
    MECHC_PART_DRIVER, MECHC_PART_OUTPUTS, MECHC_RUNNING, mechc_options, mechc_trajectory,
    mechc_unit
)
from mechc.native._driver cimport Scene
from mechc.native._inputs cimport Inputs, address_of
from mechc.native._pieces cimport with_stack
from mechc.native._run cimport Run
from mechc.native._shared_object cimport (
    mechc_close_shared, mechc_find_shared, mechc_open_shared, shared_error
)


cdef extern from "abi/codes.h":
    int MECHC_STOPPED_BY_EVENT, MECHC_NO_MEMORY

cdef extern from "events/resets.h":
    ctypedef struct mechc_event:
        double direction, grazing, too_fast
        long terminal, count

    ctypedef struct mechc_event_zero:
        int event
        double t

    ctypedef struct mechc_watch:
        int count, width, stopped_by
        mechc_event *event
        mechc_event_zero *zero
        ptrdiff_t zeros
        int *cause
        double *caused_at
        int causes
        const mechc_trajectory *steps

    int mechc_watch_make(
        mechc_watch *, const mechc_unit *, const mechc_event_unit *, int, int, int
    ) nogil
    void mechc_watch_free(mechc_watch *) nogil
    void mechc_watch_begin(mechc_watch *, const mechc_options *) nogil
    void mechc_watch_enter(mechc_watch *, double, const double *) nogil
    int mechc_watch_look(
        mechc_watch *, const mechc_trajectory *, ptrdiff_t *, double *
    ) nogil
    int mechc_watch_reset(mechc_watch *, double, double *) nogil
    int mechc_impulses(
        const double *, const double *, const double *, int, int, double *, double *, int *
    ) nogil


ctypedef struct looking:
    mechc_watch *watch
    const mechc_trajectory *steps
    ptrdiff_t *looked
    double t
    double *y
    int status

cdef void look_at_steps(void *given) noexcept nogil:
    cdef looking *job = <looking *>given
    job.status = mechc_watch_look(job.watch, job.steps, job.looked, &job.t)

cdef void enter_motion(void *given) noexcept nogil:
    cdef looking *job = <looking *>given
    mechc_watch_enter(job.watch, job.t, job.y)

cdef void reset_state(void *given) noexcept nogil:
    cdef looking *job = <looking *>given
    job.status = mechc_watch_reset(job.watch, job.t, job.y)


def impulses(const double[:, ::1] a, const double[::1] w, const double[::1] e, bint poisson=False):
    """The impulses (n,) at n contacts that touch: ``events/impact.h``.

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


cdef class EventFunctions:
    """The functions in a shared object, which stays loaded with the process.

    Raises ImportError if it cannot be loaded or was compiled for another ABI.

    Attributes
    ----------
    source
        The C that it was compiled from.
    """

    def __init__(self, path, str source):
        self.source = source
        cdef bytes name = fsencode(path)
        cdef void *library = mechc_open_shared(name)
        self.unit = NULL
        if library != NULL:
            self.unit = <const mechc_event_unit *>mechc_find_shared(library, b"mechc_events")
        if self.unit != NULL and self.unit.abi == MECHC_EVENTS_ABI:
            return
        why = "it has another ABI" if self.unit != NULL else shared_error()
        self.unit = NULL
        if library != NULL:
            mechc_close_shared(library)
        raise ImportError(f"{path} cannot be loaded: {why}")

    def __len__(self):
        return self.unit.count


cdef class Watch:
    """Looks for events along runs of a scene with parameters p (np,), and resets its state.

    run
        One of these runs.

    directions, terminal : (events,)
        As in :class:`mechc.Event`; how many zeros end the run, 0 for none.
    scale : (width,)
        The size of each component.
    inputs
        Of the whole span, where the scene has inputs.
    """

    cdef mechc_watch watch
    cdef object kept
    cdef size_t stack
    cdef Run run
    cdef ptrdiff_t looked

    def __init__(self, Run run, EventFunctions functions, const double[::1] directions,
                 const long[::1] terminal, const double[::1] p, const double[::1] scale,
                 double rtol, double t0, double t1, int method, Inputs inputs=None):
        cdef mechc_options options
        cdef Scene scene = run.scene
        cdef int k
        if functions.unit.width != scene.width or functions.unit.parameters != scene.parameters:
            raise ValueError("these events are of another model")
        if p.shape[0] != scene.parameters or scale.shape[0] != scene.width:
            raise ValueError("wrong number of parameters or scales")
        if directions.shape[0] != functions.unit.count or terminal.shape[0] != functions.unit.count:
            raise ValueError("a direction is needed for every event")
        self.kept = scene, functions, p, scale, inputs
        self.stack = scene.stack
        scene.need(MECHC_PART_DRIVER | MECHC_PART_OUTPUTS)
        if not mechc_watch_make(
            &self.watch, scene.unit, functions.unit, scene.coordinates, scene.speeds, scene.rows
        ):
            raise MemoryError()
        options.t0, options.t1, options.rtol, options.method = t0, t1, rtol, method
        options.p = &p[0] if p.shape[0] else NULL
        options.scale, options.inputs = &scale[0], address_of(inputs)
        for k in range(self.watch.count):
            self.watch.event[k].direction = directions[k]
            self.watch.event[k].terminal = terminal[k]
        mechc_watch_begin(&self.watch, &options)

    def __dealloc__(self):
        mechc_watch_free(&self.watch)

    def enter(self, Run run, double t, y):
        """Go on with the steps of a run, whose motion begins at the state y at time t."""
        cdef double[::1] state = np.array(y)
        cdef looking job
        self.run, self.looked = run, 0
        job.watch, job.t, job.y = &self.watch, t, &state[0]
        with_stack(self.stack, enter_motion, &job)

    def look(self):
        """Search the steps added since: the time of an event that ends or resets the motion, or
        None.  Raises ArithmeticError if a value is no number."""
        cdef looking job
        job.watch, job.steps, job.looked = &self.watch, &self.run.run.trajectory, &self.looked
        with_stack(self.stack, look_at_steps, &job)
        if job.status == MECHC_RUNNING:
            return None
        if job.status == MECHC_STOPPED_BY_EVENT:
            return job.t
        if job.status == MECHC_NO_MEMORY:
            raise MemoryError()
        raise ArithmeticError(f"it gave NaN from t = {self.run.run.trajectory.t[self.looked]:.9g} s on")

    def reset(self, double t, y):
        """The state after the event that stopped the search, from y (width,) before it.

        Returns (status code, state, the events whose resets made it, the state before each).
        """
        after = np.array(y)
        cdef double[::1] state = after
        cdef looking job
        cdef int i
        job.watch, job.t, job.y = &self.watch, t, &state[0]
        with_stack(self.stack, reset_state, &job)
        if job.status == MECHC_NO_MEMORY:
            raise MemoryError()
        causes = tuple(self.watch.cause[i] for i in range(self.watch.causes))
        before = np.empty((len(causes), self.watch.width))
        cdef double[:, ::1] rows = before
        if len(causes):
            memcpy(&rows[0, 0], self.watch.caused_at,
                   len(causes) * self.watch.width * sizeof(double))
        return job.status, after, causes, before

    def zeros(self):
        """The events found since the last call, and their times; they are forgotten."""
        found = [(self.watch.zero[i].event, self.watch.zero[i].t) for i in range(self.watch.zeros)]
        self.watch.zeros = 0
        return found

    @property
    def stopped_by(self):
        """The number of the event at which the search stopped, -1: none."""
        return self.watch.stopped_by

    def notes(self):
        """Of each event the first times at which it may only touch zero, and from which it changes
        too fast to follow, or NaN."""
        return [(self.watch.event[k].grazing, self.watch.event[k].too_fast)
                for k in range(self.watch.count)]
