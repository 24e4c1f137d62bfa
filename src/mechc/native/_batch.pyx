# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The compiled loop over many members: threads call ``work`` in parallel, without the GIL."""

import numpy as np

from libc.stdlib cimport calloc, free

from mechc.native._abi cimport (
    MECHC_COUNTS, MECHC_LEASTS, mechc_options, mechc_stack_of, mechc_unit, mechc_with_stack
)
from mechc.native._driver cimport Scene


cdef extern from "batch/members.h":
    ctypedef struct mechc_quantity:
        int reduction, form, output, second, component, direction, terminal
        double level

    ctypedef struct mechc_batch:
        const mechc_unit *unit
        mechc_options options
        int coordinates, width, parameters, lockstep
        double open_at_most
        ptrdiff_t count
        const double *y0
        const double *p
        const double *length
        const unsigned char *pure
        const unsigned char *assembled
        ptrdiff_t times
        const double *t_eval
        int quantities, stopping
        const mechc_quantity *quantity
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


cdef class Runs:
    """Simulations of ``y0`` (n, width) with parameters ``p`` (n, np).

    After the work: ``y`` (n, width) final states, ``t`` (n,), ``status`` (n,), ``at_times``
    (n, nt, width), ``reduced`` (n, nr); ``counts`` (n, 5) and ``least`` (n, 2), whose columns are those of
    :data:`mechc.native._codes.COUNTERS` and ``LEAST``.
    """

    cdef object kept  # arrays that C points into
    cdef mechc_batch batch
    cdef mechc_quantity *quantity
    cdef readonly object y, t, status, at_times, reduced, counts, least

    def __cinit__(self):
        self.quantity = NULL

    def __init__(self, Scene scene, options, const double[:, ::1] y0, const double[:, ::1] p,
                 const double[::1] length, const unsigned char[::1] pure, assembled,
                 const double[::1] t_eval, quantities, double open_at_most):
        cdef mechc_batch *batch = &self.batch
        cdef ptrdiff_t count = y0.shape[0]
        cdef const double[::1] atol
        cdef const unsigned char[::1] closed
        if y0.shape[1] != scene.width:
            raise ValueError("wrong number of state components")
        if p.shape[0] != count or p.shape[1] != scene.parameters or length.shape[0] != count:
            raise ValueError("a row of parameters and a length are needed for every member")
        if pure.shape[0] != y0.shape[1]:
            raise ValueError("wrong number of scales")
        self.kept = [scene, y0, p, length, pure, assembled, t_eval]
        self._allocate(count, y0.shape[1], t_eval.shape[0], len(quantities))
        batch.unit = scene.unit
        batch.coordinates, batch.width = scene.coordinates, y0.shape[1]
        batch.parameters = scene.parameters
        batch.open_at_most = open_at_most
        batch.count = count
        batch.lockstep = options["lockstep"]
        batch.times, batch.quantities = t_eval.shape[0], len(quantities)
        if count:
            batch.y0, batch.length = &y0[0, 0], &length[0]
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
        if options["atol"] is not None:
            atol = options["atol"]
            self.kept.append(atol)
            batch.options.atol = &atol[0]
        self._ask(quantities)

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

    def __dealloc__(self):
        free(self.quantity)

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
