# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The compiled loop over many members: threads call ``work`` in parallel, without the GIL."""

import numpy as np

from libc.stdlib cimport calloc, free

from mechc.native._abi cimport (
    MECHC_COUNTS, MECHC_LEASTS, MECHC_PART_COLLOCATION, MECHC_PART_DRIVER, MECHC_PART_EXPLICIT,
    MECHC_PART_IMPLICIT,
    MECHC_PART_OUTPUTS, mechc_options, mechc_part_of_method, mechc_stack_of, mechc_unit,
    mechc_with_stack
)
from mechc.native._driver cimport Scene
from mechc.native._events cimport EventFunctions, mechc_event_unit
from mechc.native._inputs cimport Inputs, mechc_driven, mechc_signal


cdef extern from "batch/members.h":
    ctypedef struct mechc_quantity:
        int reduction, form, output, second, component, direction, terminal
        double level

    ctypedef struct mechc_batch_inputs:
        int segments
        const double *ends
        const mechc_driven *const *driven
        const mechc_signal *const *signals
        int signal_count, source_count, own
        const int *place
        const double *numbers

    ctypedef struct mechc_batch_events:
        const mechc_event_unit *unit
        const double *directions
        const long *terminal
        int coordinates, speeds, rows
        long *counts
        double *latest

    ctypedef struct mechc_batch:
        const mechc_unit *unit
        mechc_options options
        int coordinates, width, parameters, lockstep
        ptrdiff_t count
        const double *y0
        const double *p
        const double *length
        const double *allowed
        const unsigned char *pure
        const unsigned char *assembled
        ptrdiff_t times
        const double *t_eval
        int quantities, stopping
        const mechc_quantity *quantity
        mechc_batch_inputs inputs
        mechc_batch_events events
        double *y
        double *t
        double *at_times
        double *reduced
        double *least
        int *status
        long *counts
        ptrdiff_t next, done
        int stop

    int mechc_batch_work(mechc_batch *) noexcept nogil


ctypedef struct sharing:
    mechc_batch *batch
    int made

cdef void work_on_batch(void *given) noexcept nogil:
    cdef sharing *job = <sharing *>given
    job.made = mechc_batch_work(job.batch)


cdef int parts_of_batch(Scene scene, const mechc_options *options, bint lockstep, bint quantities):
    """The parts of a unit that such runs may come to: none waits for one under way."""
    cdef int parts = MECHC_PART_DRIVER | mechc_part_of_method(options.method)
    if scene.holonomic or lockstep:
        parts |= MECHC_PART_EXPLICIT
    if lockstep: # members that continue alone
        parts |= MECHC_PART_COLLOCATION
    if options.may_stiffen:
        parts |= MECHC_PART_IMPLICIT
    return parts | (MECHC_PART_OUTPUTS if quantities else 0)


cdef class Runs:
    """Simulations of ``y0`` (n, width) with parameters ``p`` (n, np).

    ``driven``: None, or the ends of the segments between kinks of inputs (s,), the inputs of each
    and of the whole span, numbers that differ between members (n, k) and which signals they are.
    ``events``: None, or compiled functions of k events, their directions (k,), and how many zeros of
    each end a run (k,), 0 for none.

    After the work: ``y`` (n, width) final states, ``t`` (n,), ``status`` (n,), ``at_times``
    (n, nt, width), ``reduced`` (n, nr); ``counts`` (n, 5) and ``least`` (n, 2), whose columns are those of
    :data:`mechc.native._codes.COUNTERS` and ``LEAST``; with events ``event_counts`` (n, k) and
    ``event_latest`` (n, k), the times of the last ones.
    """

    cdef object kept  # arrays that C points into
    cdef mechc_batch batch
    cdef mechc_quantity *quantity
    cdef const mechc_driven **segments
    cdef const mechc_signal **signals
    cdef readonly object y, t, status, at_times, reduced, counts, least
    cdef readonly object event_counts, event_latest

    def __cinit__(self):
        self.quantity, self.segments, self.signals = NULL, NULL, NULL

    def __init__(self, Scene scene, options, const double[:, ::1] y0, const double[:, ::1] p,
                 const double[::1] length, const unsigned char[::1] pure, assembled,
                 const double[::1] t_eval, quantities, const double[::1] allowed, driven=None,
                 events=None):
        cdef mechc_batch *batch = &self.batch
        cdef ptrdiff_t count = y0.shape[0]
        cdef const double[::1] atol
        cdef const unsigned char[::1] closed
        if y0.shape[1] != scene.width:
            raise ValueError("wrong number of state components")
        if p.shape[0] != count or p.shape[1] != scene.parameters or length.shape[0] != count:
            raise ValueError("a row of parameters and a length are needed for every member")
        if allowed.shape[0] != count:
            raise ValueError("a gap that is allowed is needed for every member")
        if pure.shape[0] != y0.shape[1]:
            raise ValueError("wrong number of scales")
        self.kept = [scene, y0, p, length, pure, assembled, t_eval, allowed]
        self._allocate(count, y0.shape[1], t_eval.shape[0], len(quantities))
        batch.unit = scene.unit
        batch.coordinates, batch.width = scene.coordinates, y0.shape[1]
        batch.parameters = scene.parameters
        batch.count = count
        batch.lockstep = options["lockstep"]
        batch.times, batch.quantities = t_eval.shape[0], len(quantities)
        if count:
            batch.y0, batch.length = &y0[0, 0], &length[0]
            batch.allowed = &allowed[0]
            batch.p = &p[0, 0] if scene.parameters else NULL
        batch.pure = &pure[0]
        if t_eval.shape[0]:
            batch.t_eval = &t_eval[0]
        if assembled is not None and count:
            closed = assembled
            if closed.shape[0] != count:
                raise ValueError("a flag is needed for every member")
            batch.assembled = &closed[0]
        self._choose(options)
        scene.need(parts_of_batch(scene, &batch.options, options["lockstep"], len(quantities)))
        batch.options.methods = scene.unit.methods
        if options["atol"] is not None:
            atol = options["atol"]
            self.kept.append(atol)
            batch.options.atol = &atol[0]
        self._ask(quantities)
        if driven is not None:
            ends, inputs, numbers, place = driven
            self._drive(ends, inputs, numbers, place)
        if events is not None:
            functions, directions, terminal = events
            self._watch(scene, functions, directions, terminal)

    cdef _allocate(self, ptrdiff_t count, ptrdiff_t width, ptrdiff_t times, ptrdiff_t quantities):
        cdef double[:, ::1] y, reduced, least
        cdef double[:, :, ::1] at_times
        cdef double[::1] t
        cdef int[::1] status
        cdef long[:, ::1] counts
        self.y = np.full((count, width), np.nan)
        self.t = np.full(count, np.nan)
        self.at_times = np.full((count, times, width), np.nan)
        self.reduced = np.full((count, quantities), np.nan)
        self.least = np.full((count, MECHC_LEASTS), np.nan)
        self.status = np.zeros(count, np.intc)
        self.counts = np.zeros((count, MECHC_COUNTS), np.int_)
        if not count:
            return
        y, t, status, counts, least = self.y, self.t, self.status, self.counts, self.least
        self.batch.y, self.batch.t, self.batch.status = &y[0, 0], &t[0], &status[0]
        self.batch.counts, self.batch.least = &counts[0, 0], &least[0, 0]
        if times:
            at_times = self.at_times
            self.batch.at_times = &at_times[0, 0, 0]
        if quantities:
            reduced = self.reduced
            self.batch.reduced = &reduced[0, 0]

    cdef _choose(self, options):
        cdef mechc_options *chosen = &self.batch.options
        chosen.t0, chosen.t1 = options["t0"], options["t1"]
        chosen.rtol = options["rtol"]
        chosen.first_step, chosen.max_step = options["first_step"], options["max_step"]
        chosen.max_steps, chosen.method = options["max_steps"], options["method"]
        chosen.dense, chosen.may_stiffen = options["dense"], options["may_stiffen"]
        chosen.last_only = not chosen.dense
        chosen.on_change_point = options["on_change_point"]
        chosen.stop = &self.batch.stop

    cdef _ask(self, quantities):
        cdef ptrdiff_t i
        self.quantity = <mechc_quantity *>calloc(max(len(quantities), 1), sizeof(mechc_quantity))
        if self.quantity == NULL:
            raise MemoryError()
        for i, asked in enumerate(quantities):
            self.quantity[i].reduction, self.quantity[i].form = asked[0], asked[1]
            self.quantity[i].output, self.quantity[i].second = asked[2], asked[3]
            self.quantity[i].component, self.quantity[i].direction = asked[4], asked[5]
            self.quantity[i].level, self.quantity[i].terminal = asked[6], asked[7]
            self.batch.stopping |= self.quantity[i].terminal
        self.batch.quantity = self.quantity

    cdef _watch(self, Scene scene, EventFunctions functions, const double[::1] directions,
                const long[::1] terminal):
        cdef mechc_batch_events *events = &self.batch.events
        cdef int width = functions.unit.count
        cdef long[:, ::1] counts
        cdef double[:, ::1] latest
        if functions.unit.width != scene.width or functions.unit.parameters != scene.parameters:
            raise ValueError("these events are of another model")
        if directions.shape[0] != width or terminal.shape[0] != width:
            raise ValueError("a direction is needed for every event")
        self.kept += [functions, directions, terminal]
        self.event_counts = np.zeros((self.batch.count, width), np.int_)
        self.event_latest = np.full((self.batch.count, width), np.nan)
        if not self.batch.count or not width:
            return
        scene.need(MECHC_PART_OUTPUTS)
        counts, latest = self.event_counts, self.event_latest
        events.unit, events.counts, events.latest = functions.unit, &counts[0, 0], &latest[0, 0]
        events.directions, events.terminal = &directions[0], &terminal[0]
        events.coordinates, events.speeds = scene.coordinates, scene.speeds
        events.rows = scene.rows
        self.batch.stopping = 1

    cdef _drive(self, const double[::1] ends, inputs, const double[:, ::1] numbers,
                const int[::1] place):
        cdef mechc_batch_inputs *out = &self.batch.inputs
        cdef Inputs each
        cdef ptrdiff_t i
        if not ends.shape[0] or len(inputs) != ends.shape[0] + 1:
            raise ValueError("inputs are needed for every segment, and for the whole span")
        if numbers.shape[0] != self.batch.count or numbers.shape[1] != place.shape[0]:
            raise ValueError("a row of numbers is needed for every member")
        self.kept += [ends, inputs, numbers, place]
        self.segments = <const mechc_driven **>calloc(len(inputs), sizeof(mechc_driven *))
        self.signals = <const mechc_signal **>calloc(len(inputs), sizeof(mechc_signal *))
        if self.segments == NULL or self.signals == NULL:
            raise MemoryError()
        for i, each in enumerate(inputs):
            self.segments[i], self.signals[i] = &each.driven, each.signals
            out.signal_count, out.source_count = each.signal_count, each.source_count
        if place.shape[0]:
            if min(place) < 0 or max(place) >= out.signal_count:
                raise ValueError("no such input")
            out.place = &place[0]
            if self.batch.count:
                out.numbers = &numbers[0, 0]
        out.own, out.ends, out.segments = place.shape[0], &ends[0], ends.shape[0]
        out.driven, out.signals = self.segments, self.signals

    def __dealloc__(self):
        free(self.quantity)
        free(self.segments)
        free(self.signals)

    @property
    def done(self):
        """Members finished so far."""
        return self.batch.done

    def work(self):
        """Take members until none is left; any number of threads may at once."""
        cdef sharing job
        cdef int given
        job.batch, job.made = &self.batch, 0
        with nogil:
            given = mechc_with_stack(mechc_stack_of(self.batch.width), work_on_batch, &job)
        if not given or not job.made:
            raise MemoryError()

    def stop(self):
        """Ask every thread to return after its current steps."""
        self.batch.stop = 1
