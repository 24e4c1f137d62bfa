# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The compiled loop over many members: threads call ``work`` in parallel, without the GIL."""

import numpy as np

from libc.stdlib cimport calloc, free

from mechc.native._abi cimport (
    MECHC_COUNTS, MECHC_LEASTS, MECHC_PART_COLLOCATION, MECHC_PART_DRIVER, MECHC_PART_EXPLICIT,
    MECHC_PART_IMPLICIT, MECHC_PART_OUTPUTS, MECHC_PART_TAYLOR, MECHC_PART_TAYLOR_LANES,
    mechc_options, mechc_part_of_members, mechc_part_of_method, mechc_unit, mechc_with_stack
)
from mechc.native._driver cimport Scene
from mechc.native._hybrid cimport (
    mechc_contact_laws, mechc_event_functions, mechc_event_policy, mechc_given_inputs, mechc_motion
)
from mechc.native._motion cimport Request
from mechc.native._pieces cimport working
from mechc.native._codes import COUNTERS


cdef extern from "batch/members.h":
    ctypedef struct mechc_quantity:
        int reduction, form, output, second, component, of_motion, direction
        double level, away

    ctypedef struct mechc_batch:
        const mechc_unit *unit
        mechc_options options
        mechc_motion scene
        int lockstep, quantities, own, events, stop
        ptrdiff_t count, times, done
        const double *y0
        const double *p
        const double *allowed
        const unsigned char *assembled
        const double *t_eval
        const mechc_quantity *quantity
        const mechc_quantity *until
        const mechc_given_inputs *given
        const int *place
        const double *numbers
        const mechc_event_functions *functions
        const mechc_event_policy *policy
        mechc_contact_laws laws
        double *y
        double *t
        double *at_times
        double *p_at_times
        double *forces_at_times
        double *reduced
        double *least
        double *event_latest
        int *status
        long *counts
        long *event_counts
        long *lowered

    int mechc_batch_work(mechc_batch *) noexcept nogil


cdef void work_on_batch(void *given) noexcept nogil:
    cdef working *work = <working *>given
    work.made = mechc_batch_work(<mechc_batch *>work.job)


cdef int parts_of_batch(Scene scene, const mechc_options *options, bint lockstep, bint quantities):
    """The parts of a unit that such runs may need, so that none waits for one under way."""
    cdef int parts = MECHC_PART_DRIVER
    parts |= (mechc_part_of_members if lockstep else mechc_part_of_method)(options.method)
    # over change points, and where steps do not settle what a switching function shows
    if scene.holonomic or scene.switches or parts & MECHC_PART_TAYLOR or lockstep:
        parts |= MECHC_PART_EXPLICIT
    if lockstep or options.when_stiff: # members that continue alone, and that a series leaves to it
        parts |= MECHC_PART_COLLOCATION
    if options.when_stiff:
        parts |= MECHC_PART_IMPLICIT
    return parts | (MECHC_PART_OUTPUTS if quantities else 0)


cdef class Runs:
    """Motions from ``y0`` (n, width) with parameters ``p`` (n, np) between two times.

    request
        What is asked of each.
    lockstep
        Whether members run side by side, a lane each.
    assembled : (n,)
        Which members have a start, or None for all.
    allowed : (n,)
        The gaps of starts that are rounding.
    quantities, until
        Reductions, and the crossing at which a member ends or None, as tuples of the fields of
        ``mechc_quantity``.
    numbers : (n, k), places : (k,)
        Inputs that differ between members, and which of the signals of the inputs they are.
    keeps_params
        Whether parameters are kept at t_eval, since resets change them.
    keeps_forces
        Whether the generalized forces of contacts that last are kept there.

    After the work: ``y`` (n, width) final states, ``t`` (n,), ``status`` (n,), ``at_times``
    (n, nt, width), ``p_at_times`` (n, nt, np), ``forces_at_times`` (n, nt, nu), ``reduced`` (n, nr); ``counts`` (n, 5) and ``least``
    (n, 2), whose columns are those of :data:`mechc.native._codes.COUNTERS` and ``LEAST``;
    ``event_counts`` (n, e), ``event_latest`` (n, e), the times of the last ones, ``lowered`` (n,).
    """

    cdef object references  # arrays that C points into
    cdef Scene scene
    cdef long counted  # evaluations
    cdef mechc_batch batch
    cdef mechc_quantity *quantity
    cdef readonly object y, t, status, at_times, p_at_times, forces_at_times, reduced, counts, least
    cdef readonly object event_counts, event_latest, lowered

    def __cinit__(self):
        self.quantity = NULL

    def __init__(self, Request request, bint lockstep, double t0, double t1, const double[:, ::1] y0,
                 const double[:, ::1] p, assembled, const double[::1] t_eval, quantities, until,
                 const double[::1] allowed, const double[:, ::1] numbers, const int[::1] places,
                 bint keeps_params=False, bint keeps_forces=False):
        cdef mechc_batch *batch = &self.batch
        cdef Scene scene = request.asked
        cdef ptrdiff_t count = y0.shape[0]
        cdef const unsigned char[::1] closed
        if y0.shape[1] != scene.width:
            raise ValueError("wrong number of state components")
        if p.shape[0] != count or p.shape[1] != scene.parameters or allowed.shape[0] != count:
            raise ValueError("a row of parameters and a gap are needed for every member")
        if numbers.shape[0] != count or numbers.shape[1] != places.shape[0]:
            raise ValueError("a row of numbers is needed for every member")
        self.references = [request, y0, p, assembled, t_eval, allowed, numbers, places]
        outputs = len(quantities) or until is not None
        parts = parts_of_batch(scene, &request.options, lockstep, outputs)
        # each has the results that it has alone
        self.scene = scene = scene.at_once(
            parts, parts & ~MECHC_PART_TAYLOR_LANES | MECHC_PART_TAYLOR
            if parts & MECHC_PART_TAYLOR_LANES else parts
        )
        if scene.by_general and parts & MECHC_PART_TAYLOR_LANES:
            lockstep = False
        batch.unit, batch.count, batch.lockstep = scene.unit, count, lockstep
        batch.scene.unit, batch.scene.sizes = scene.unit, request.sizes.sizes
        batch.scene.coordinates, batch.scene.speeds = scene.coordinates, scene.speeds
        batch.scene.rows, batch.scene.parameters = scene.rows, scene.parameters
        batch.scene.width = scene.width
        batch.options = request.options
        batch.options.t0, batch.options.t1, batch.options.stop = t0, t1, &batch.stop
        batch.options.last_only = not batch.options.dense
        if request.inputs is not None:
            batch.given = &request.given
        if request.events is not None:
            batch.events, batch.laws = request.events.count, request.events.laws
            batch.functions, batch.policy = request.events.functions, request.events.policy
        batch.times, batch.quantities = t_eval.shape[0], len(quantities)
        self._allocate(count, scene, keeps_params, keeps_forces)
        if count:
            batch.y0, batch.allowed = &y0[0, 0], &allowed[0]
            batch.p = &p[0, 0] if scene.parameters else NULL
        if t_eval.shape[0]:
            batch.t_eval = &t_eval[0]
        if assembled is not None and count:
            closed = assembled
            if closed.shape[0] != count:
                raise ValueError("a flag is needed for every member")
            batch.assembled = &closed[0]
        if places.shape[0] and count:
            batch.own, batch.place, batch.numbers = places.shape[0], &places[0], &numbers[0, 0]
        self._ask([*quantities, *([] if until is None else [until])])
        if until is not None:
            batch.until = self.quantity + batch.quantities
        batch.options.methods = scene.unit.methods

    cdef _allocate(self, ptrdiff_t count, Scene scene, bint keeps_params, bint keeps_forces):
        cdef mechc_batch *batch = &self.batch
        cdef double[:, ::1] y, reduced, least, latest
        cdef double[:, :, ::1] at_times, p_at_times, forces
        cdef double[::1] t
        cdef int[::1] status
        cdef long[:, ::1] counts, event_counts
        cdef long[::1] lowered
        cdef ptrdiff_t times = batch.times, events = batch.events
        self.y, self.t = np.full((count, scene.width), np.nan), np.full(count, np.nan)
        self.at_times = np.full((count, times, scene.width), np.nan)
        self.p_at_times = np.full((count, times if keeps_params else 0, scene.parameters), np.nan)
        self.forces_at_times = np.zeros((count, times if keeps_forces else 0, scene.speeds))
        self.reduced = np.full((count, batch.quantities), np.nan)
        self.least = np.full((count, MECHC_LEASTS), np.nan)
        self.status = np.zeros(count, np.intc)
        self.counts = np.zeros((count, MECHC_COUNTS), np.int_)
        self.event_counts = np.zeros((count, events), np.int_)
        self.event_latest = np.full((count, events), np.nan)
        self.lowered = np.zeros(count, np.int_)
        if not count:
            return
        y, t, status, counts, least = self.y, self.t, self.status, self.counts, self.least
        lowered = self.lowered
        batch.y, batch.t, batch.status, batch.lowered = &y[0, 0], &t[0], &status[0], &lowered[0]
        batch.counts, batch.least = &counts[0, 0], &least[0, 0]
        if times:
            at_times = self.at_times
            batch.at_times = &at_times[0, 0, 0]
        if times and keeps_params:
            p_at_times = self.p_at_times
            batch.p_at_times = &p_at_times[0, 0, 0]
        if times and keeps_forces:
            forces = self.forces_at_times
            batch.forces_at_times = &forces[0, 0, 0]
        if batch.quantities:
            reduced = self.reduced
            batch.reduced = &reduced[0, 0]
        if events:
            event_counts, latest = self.event_counts, self.event_latest
            batch.event_counts, batch.event_latest = &event_counts[0, 0], &latest[0, 0]

    cdef _ask(self, quantities):
        cdef ptrdiff_t i
        self.quantity = <mechc_quantity *>calloc(max(len(quantities), 1), sizeof(mechc_quantity))
        if self.quantity == NULL:
            raise MemoryError()
        for i, asked in enumerate(quantities):
            self.quantity[i].reduction, self.quantity[i].form = asked[0], asked[1]
            self.quantity[i].output, self.quantity[i].second = asked[2], asked[3]
            self.quantity[i].component, self.quantity[i].of_motion = asked[4], asked[5]
            self.quantity[i].direction, self.quantity[i].level = asked[6], asked[7]
            self.quantity[i].away = asked[8]
        self.batch.quantity = self.quantity

    def __dealloc__(self):
        free(self.quantity)

    @property
    def done(self):
        """Members finished so far."""
        return self.batch.done

    def work(self):
        """Take members until none is left; any number of threads may at once."""
        cdef working work
        cdef int given
        cdef size_t stack = self.scene.stack_of_thread()
        work.job, work.made = &self.batch, 0
        with nogil:
            given = mechc_with_stack(stack, work_on_batch, &work)
        self._count()
        if not given or not work.made:
            raise MemoryError()

    cdef _count(self):
        """Count the work, after which it pays to compile."""
        cdef long evaluations = self.counts[:, COUNTERS["rhs_evaluations"]].sum()
        self.scene.worked += evaluations - self.counted
        self.counted = evaluations

    def stop(self):
        """Ask every thread to return after its current steps."""
        self.batch.stop = 1
