# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""An integration of a compiled scene: it continues in parts, without the GIL."""

import numpy as np

from cpython.exc cimport PyErr_CheckSignals
from cpython.mem cimport PyMem_Free, PyMem_Malloc
from libc.limits cimport LONG_MAX
from libc.string cimport memcpy, memset

from mechc.native._abi cimport (
    MECHC_INTERRUPTED, MECHC_MEMORY_LIMIT, MECHC_RUNNING, mechc_options, mechc_part_of_method,
    mechc_run, mechc_trajectory, mechc_unit
)
from mechc.native._inputs cimport Inputs, address_of, mechc_inputs
from mechc.native._pieces cimport LOOK, next_piece, seconds_now, with_stack
from mechc.native._steps cimport Steps


ctypedef struct advancing:
    const mechc_unit *unit
    mechc_run *run
    long left
    ptrdiff_t piece, most
    int status

ctypedef struct extending:
    const mechc_unit *unit
    mechc_run *run
    double t1
    const mechc_inputs *inputs

ctypedef struct beginning:
    const mechc_unit *unit
    mechc_run *run
    const mechc_options *options


cdef void advance_a_while(void *given) noexcept nogil:
    cdef advancing *job = <advancing *>given
    cdef double started = seconds_now(), now = started, before
    cdef long some
    while (job.status == MECHC_RUNNING and job.run.wanted < 0 and job.left > 0
           and now - started < LOOK):
        some, before = min(job.piece, job.left), now
        some = min(some, job.most - job.run.trajectory.count)
        if some <= 0:
            job.status = job.run.status = MECHC_MEMORY_LIMIT
            return
        job.status = job.unit.advance(job.run, some)
        job.left -= some
        now = seconds_now()
        job.piece = next_piece(job.piece, now - before)


cdef void extend_run(void *given) noexcept nogil:
    cdef extending *job = <extending *>given
    job.unit.extend(job.run, job.t1, job.inputs)


cdef void begin(void *given) noexcept nogil:
    cdef beginning *job = <beginning *>given
    job.unit.start(job.run, job.options)


cdef class Run:
    """An integration under way or finished; owns the trajectory, which ``steps`` reads.

    ``unit`` is held besides ``scene``, which the cycle collector may have cleared first.
    """

    cdef begin(self, const mechc_options *options, double max_bytes):
        cdef beginning job
        self.piece = 1
        self.run = <mechc_run *>PyMem_Malloc(self.unit.run_size)
        if self.run == NULL:
            raise MemoryError()
        job.unit, job.run, job.options = self.unit, self.run, options
        if self.stack:
            memset(self.run, 0, self.unit.run_size)  # it may not begin, without memory
            with_stack(self.stack, begin, &job, &self.stop)
        else:
            begin(&job)  # of a small scene it takes less time than giving up the GIL
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef double state = sizeof(double) * (1.0 + record.width * (1.0 + record.dense_rows))
        self.most = <ptrdiff_t>min(max(max_bytes / state, 2.0), 2.0**62)

    def __dealloc__(self):
        if self.run != NULL:
            self.unit.release(self.run)
            PyMem_Free(self.run)

    def advance(self, long steps):
        """At most `steps` further attempted steps, and no more than fit into a moment.

        Returns the status code.  A pending signal (Ctrl-C) is raised as its handler says; the run
        stays usable.
        """
        cdef advancing job
        job.unit, job.run, job.left, job.piece = self.unit, self.run, steps, self.piece
        job.status, job.most = MECHC_RUNNING, self.most
        try:
            with_stack(self.stack, advance_a_while, &job, &self.stop)
        finally:
            if self.stop and self.run.status == MECHC_INTERRUPTED:
                self.run.status = MECHC_RUNNING  # from the last state accepted
            self.stop = 0
        self.piece = job.piece
        if self.run.wanted >= 0:
            self.scene.need(mechc_part_of_method(self.run.wanted))
            self.run.wanted = -1
        PyErr_CheckSignals()
        return job.status

    def extend(self, double t1, Inputs inputs=None):
        """Go on to t1, from the end of the run or before it, with other inputs where given."""
        cdef extending job
        job.unit, job.run, job.t1, job.inputs = self.unit, self.run, t1, address_of(inputs)
        if inputs is not None:
            self.inputs = inputs
        with_stack(self.stack, extend_run, &job)

    cpdef void forget(self):
        """Keep of the record the last state only; count from zero."""
        self._keep_last_state()
        self.run.stats.steps = self.run.stats.rejected = 0

    cdef void _keep_last_state(self):
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef ptrdiff_t last = record.count - 1
        if last > 0:
            record.t[0] = record.t[last]
            memcpy(record.y, record.y + last * self.width, self.width * sizeof(double))
            record.count = 1
        record.crossing_count = 0

    def keep_last(self):
        """Keep of the record the last state only, such that the run goes on as if it kept all."""
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef ptrdiff_t last = record.count - 1
        if last > 0:
            record.dropped[1] = record.t[last - 2] if last > 1 else record.dropped[0]
            record.dropped[0] = record.t[last - 1]
            record.dropped_count = 2 if last > 1 or record.dropped_count else 1
        self._keep_last_state()

    def checkpoint(self):
        """What :meth:`back_to` goes on from."""
        cdef mechc_trajectory *record = &self.run.trajectory
        dropped = record.dropped[0], record.dropped[1], record.dropped_count
        return self.save(), dropped, self.inputs

    def back_to(self, checkpoint):
        """To a checkpoint of this run; of its record the state there is kept."""
        cdef mechc_trajectory *record = &self.run.trajectory
        saved, dropped, self.inputs = checkpoint
        self.restore(saved)
        self._keep_last_state()
        record.dropped[0], record.dropped[1], record.dropped_count = dropped

    @property
    def bytes_a_step(self):
        """Of the record."""
        cdef mechc_trajectory *record = &self.run.trajectory
        return sizeof(double) * (1 + record.width * (1 + record.dense_rows))

    cpdef int step(self, double t1, Inputs inputs=None) except -1:
        """On to t1, forgetting the way there; inputs as in :meth:`extend`.  The status code."""
        self.forget()
        self.extend(t1, inputs)
        while self.run.status == MECHC_RUNNING:
            self.advance(LONG_MAX)
        return self.run.status

    def step_by(self, double dt, Inputs inputs=None):
        """The same, on by dt."""
        return self.step(self.run.t + dt, inputs)

    def reach(self, double t1):
        """Steps of the run's own lengths until it has reached t1 or passed it.  The status code."""
        if self.run.t < t1:
            self.forget()
        while self.run.status == MECHC_RUNNING and self.run.t < t1:
            self.advance(1)
        return self.run.status

    def state(self):
        """The last accepted state (width,), a copy."""
        cdef mechc_trajectory *record = &self.run.trajectory
        y = np.empty(self.width)
        cdef double[::1] state = y
        memcpy(&state[0], record.y + (record.count - 1) * self.width, self.width * sizeof(double))
        return y

    def save(self):
        """The run as bytes, which contain addresses."""
        saved = np.empty(self.unit.saved_size(self.run), dtype=np.uint8)
        cdef unsigned char[::1] to = saved
        self.unit.save(self.run, &to[0])
        return saved

    def restore(self, const unsigned char[::1] saved):
        """Back to what :meth:`save` gave of this run, or of one with the same inputs."""
        self.unit.restore(self.run, &saved[0])

    @property
    def status(self):
        return self.run.status

    @property
    def t(self):
        """Time reached."""
        return self.run.t

    def stats(self):
        """Counters and the least conditioning met."""
        return self.run.stats  # the struct as a dict, by the names of its fields


    @property
    def met_critical(self):
        """Whether a critical configuration was found near a state: at the start, or in a step."""
        return self.run.stats.critical_gap < 1e300

    @property
    def count(self):
        """Number of accepted states, the start included."""
        return self.run.trajectory.count

    @property
    def steps(self):
        """What it has recorded, with the present inputs."""
        cdef Steps steps = Steps.__new__(Steps)
        steps.read(self.scene, self, &self.run.trajectory, self.method, self.p, self.inputs)
        return steps
