# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""An integration of a compiled scene: it continues in pieces, without the GIL."""

import numpy as np

from cpython.exc cimport PyErr_CheckSignals
from cpython.mem cimport PyMem_Free, PyMem_Malloc
from libc.limits cimport LONG_MAX
from libc.string cimport memcpy, memset

from mechc.native._abi cimport (
    MECHC_INTERRUPTED, MECHC_MEMORY_LIMIT, MECHC_PART_DERIVATIVES, MECHC_RUNNING, mechc_options,
    mechc_part_of_method, mechc_run,
    mechc_covariation, mechc_projected_columns, mechc_trajectory, mechc_unit, mechc_variation
)
from mechc.native._inputs cimport Inputs, Shapes, address_of, mechc_inputs, shapes_of
from mechc.native._pieces cimport LONG_STACK, LOOK, next_piece, seconds_now, with_stack


ctypedef struct advancing:
    const mechc_unit *unit
    mechc_run *run
    long left
    ptrdiff_t piece, most
    int status

ctypedef struct interpolation:
    const mechc_unit *unit
    int method, width
    const mechc_trajectory *trajectory
    const double *p
    const mechc_inputs *inputs
    ptrdiff_t left, piece
    const double *t
    double *out

ctypedef struct varying:
    const mechc_unit *unit
    mechc_variation *variation
    int status

ctypedef struct covarying:
    const mechc_unit *unit
    mechc_covariation *covariation
    int status

ctypedef struct projecting:
    const mechc_unit *unit
    mechc_projected_columns *columns
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


cdef void interpolate_a_while(void *given) noexcept nogil:
    cdef interpolation *job = <interpolation *>given
    cdef double started = seconds_now(), now = started, before
    cdef ptrdiff_t some
    while job.left and now - started < LOOK:
        some, before = min(job.piece, job.left), now
        job.unit.interpolate(
            job.method, job.trajectory, job.p, job.inputs, some, job.t, job.out
        )
        job.t += some
        job.out += some * job.width
        job.left -= some
        now = seconds_now()
        job.piece = next_piece(job.piece, now - before)


cdef void vary_steps(void *given) noexcept nogil:
    cdef varying *job = <varying *>given
    job.status = job.unit.vary(job.variation)


cdef void covary_steps(void *given) noexcept nogil:
    cdef covarying *job = <covarying *>given
    job.status = job.unit.covary(job.covariation)


cdef void project_at_states(void *given) noexcept nogil:
    cdef projecting *job = <projecting *>given
    job.status = job.unit.project_columns(job.columns)


cdef void check_varied(int status) except *:
    if status == MECHC_MEMORY_LIMIT:
        raise MemoryError()
    if status != MECHC_RUNNING:
        raise ArithmeticError("a step's variational equations are singular")


cdef void extend_run(void *given) noexcept nogil:
    cdef extending *job = <extending *>given
    job.unit.extend(job.run, job.t1, job.inputs)


cdef void begin(void *given) noexcept nogil:
    cdef beginning *job = <beginning *>given
    job.unit.start(job.run, job.options)


cdef class Run:
    """An integration under way or finished; owns the trajectory.

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

    def state_at(self, double t):
        """The state at t within the last step (width,), from the dense output."""
        y = np.empty(self.width)
        cdef double[::1] p = self.p, state = y
        cdef interpolation job
        job.unit, job.method, job.trajectory = self.unit, self.method, &self.run.trajectory
        job.p, job.left, job.piece = &p[0] if p.shape[0] else NULL, 1, 1
        job.inputs = address_of(self.inputs)
        job.t, job.out, job.width = &t, &state[0], self.width
        with_stack(self.stack, interpolate_a_while, &job)
        return y

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

    def read_with(self, Inputs inputs not None):
        """The inputs that :meth:`interpolate` takes, of the whole run."""
        self.whole = inputs

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

    def states(self):
        """Accepted times (nt,) and states (nt, width), copied."""
        cdef mechc_trajectory *record = &self.run.trajectory
        t, y = np.empty(record.count), np.empty((record.count, self.width))
        cdef double[::1] times = t
        cdef double[:, ::1] states = y
        if record.count:
            memcpy(&times[0], record.t, record.count * sizeof(double))
            memcpy(&states[0, 0], record.y, record.count * self.width * sizeof(double))
        return t, y

    def methods(self):
        """The number of the method of each accepted step, where dense output was kept."""
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef ptrdiff_t steps = max(record.count - 1, 0), i
        found = np.empty(steps, np.uint8)
        cdef unsigned char[::1] view = found
        if record.methods == NULL and steps:
            raise ValueError("this run kept no dense output")
        for i in range(steps):
            view[i] = record.methods[i]
        return found

    def tail(self, ptrdiff_t count):
        """The last accepted times and states, at most so many, copied."""
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef ptrdiff_t some = min(count, record.count)
        t, y = np.empty(some), np.empty((some, self.width))
        cdef double[::1] times = t
        cdef double[:, ::1] states = y
        if some:
            memcpy(&times[0], record.t + record.count - some, some * sizeof(double))
            memcpy(&states[0, 0], record.y + (record.count - some) * self.width,
                   some * self.width * sizeof(double))
        return t, y

    def largest(self, tuple which):
        """The largest magnitude of these components in the first and the last accepted state."""
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef double *last = record.y + (record.count - 1) * self.width
        cdef double largest = 0.0
        cdef Py_ssize_t i
        for i in which if record.count else ():
            if not 0 <= i < self.width:
                raise IndexError(f"states have {self.width} components")
            largest = max(largest, abs(record.y[i]), abs(last[i]))
        return largest

    @property
    def crossings(self):
        """Number of change points crossed."""
        return self.run.trajectory.crossing_count

    @property
    def met_critical(self):
        """Whether a critical configuration was found near a state: at the start, or in a step."""
        return self.run.stats.critical_gap < 1e300

    @property
    def count(self):
        """Number of accepted states, the start included."""
        return self.run.trajectory.count

    def times(self, ptrdiff_t first):
        """Accepted times from the index `first` on, copied."""
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef ptrdiff_t left = max(record.count - first, 0)
        t = np.empty(left)
        cdef double[::1] times = t
        if left:
            memcpy(&times[0], record.t + first, left * sizeof(double))
        return t

    def change_points(self):
        """Change points crossed: times (n,), configurations (n, coordinates), closure gaps (n,).

        A gap that is not 0 was within rounding of it.
        """
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef ptrdiff_t width = self.coordinates + 2, i, j
        rows = np.empty((record.crossing_count, width))
        cdef double[:, ::1] view = rows
        for i in range(record.crossing_count):
            for j in range(width):
                view[i, j] = record.crossings[i * width + j]
        return rows[:, 0].copy(), rows[:, 2:].copy(), rows[:, 1].copy()

    def interpolate(self, const double[::1] t):
        """Dense output at the times t, projected onto the constraints: (len(t), width)."""
        out = np.empty((t.shape[0], self.width))
        cdef double[:, ::1] view = out
        cdef double[::1] p = self.p
        cdef const double *parameters = &p[0] if p.shape[0] else NULL
        cdef interpolation job
        job.unit, job.method, job.trajectory = self.unit, self.method, &self.run.trajectory
        job.p, job.left, job.piece = parameters, t.shape[0], 1
        job.inputs = address_of(self.inputs if self.whole is None else self.whole)
        if job.left:
            job.t, job.out = &t[0], &view[0, 0]
        job.width = self.width
        while job.left:
            with_stack(self.stack, interpolate_a_while, &job)
            PyErr_CheckSignals()
        return out

    def vary(self, ptrdiff_t first, ptrdiff_t last, const double[:, ::1] directions,
             const double[:, ::1] start, int rates=0, bint restart=False,
             bint project=False, Shapes shapes=None):
        """Columns of derivatives over the steps first ... last - 1: (last - first + 1, width, k).

        directions : (parameters + inputs, k)
            How these change along each column.
        start : (width, k)
            The columns at the first step's start.
        rates
            How many rates a step has, all by one method; then also S' there, (steps, rates, width,
            k).  0: the columns alone.
        restart
            Every step begins with these columns: the ends are then the steps' propagators.
        project
            The columns at the start are moved onto the constraints' tangent space first.
        shapes
            How inputs change along columns as functions of time, besides ``directions``.

        Raises ArithmeticError where the equations of a step are singular.
        """
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef int k = start.shape[1]
        cdef ptrdiff_t steps = last - first, done = 0
        self.scene.need(MECHC_PART_DERIVATIVES)
        if self.unit.vary == NULL or record.methods == NULL:
            raise ValueError("this run or its scene has no derivatives")
        if not 0 <= first <= last < record.count or start.shape[0] != self.width \
                or directions.shape[0] != self.p.shape[0] + self.scene.inputs \
                or directions.shape[1] != k:
            raise ValueError("no such steps, or arrays of another shape")
        ends, taken = np.empty((steps + 1, self.width, k)), np.empty((steps, rates, self.width, k))
        ends[0] = start
        if not k or not steps and not project:
            return ends, taken
        cdef double[:, :, ::1] columns = ends
        cdef double[:, :, :, ::1] slopes = taken
        cdef double[::1] p = self.p
        cdef mechc_variation variation
        cdef varying job
        variation.trajectory = record
        variation.p = &p[0] if p.shape[0] else NULL
        variation.inputs = address_of(self.inputs if self.whole is None else self.whole)
        variation.columns, variation.restart = k, restart
        variation.directions = &directions[0, 0] if directions.shape[0] else NULL
        variation.shapes = shapes_of(shapes)
        job.unit, job.variation = self.unit, &variation
        while done < steps or project:
            variation.project, project = project, False
            variation.first = first + done
            variation.last = min(last, variation.first + self.at_once(k))
            variation.ends = &columns[done, 0, 0]
            variation.rates = &slopes[done, 0, 0, 0] if rates else NULL
            if restart:
                ends[done] = start
            with_stack(max(self.stack, LONG_STACK) if self.stack else 0, vary_steps, &job)
            PyErr_CheckSignals()
            check_varied(job.status)
            done = variation.last - first
        return ends, taken

    def project_columns(self, const double[::1] t, const double[:, ::1] y,
                        const double[:, ::1] directions, double[:, :, ::1] columns,
                        Shapes shapes=None):
        """Move columns (n, width, k) at times t (n,) and states y (n, width) of the run onto the
        tangent space of the constraints, in place.

        directions, shapes
            As in :meth:`vary`.
        """
        cdef ptrdiff_t done = 0, count = t.shape[0]
        cdef int k = columns.shape[2]
        self.scene.need(MECHC_PART_DERIVATIVES)
        if self.unit.project_columns == NULL:
            raise ValueError("this run or its scene has no derivatives")
        if y.shape[0] != count or y.shape[1] != self.width or columns.shape[0] != count \
                or columns.shape[1] != self.width or directions.shape[1] != k \
                or directions.shape[0] != self.p.shape[0] + self.scene.inputs:
            raise ValueError("arrays of another shape")
        if not count or not k:
            return
        cdef double[::1] p = self.p
        cdef mechc_projected_columns given
        cdef projecting job
        given.trajectory, given.p = &self.run.trajectory, &p[0] if p.shape[0] else NULL
        given.inputs = address_of(self.inputs if self.whole is None else self.whole)
        given.count = k
        given.directions = &directions[0, 0] if directions.shape[0] else NULL
        given.shapes = shapes_of(shapes)
        job.unit, job.columns = self.unit, &given
        while done < count:
            given.states = min(count - done, self.at_once(k))
            given.t, given.y = &t[done], &y[done, 0]
            given.columns = &columns[done, 0, 0]
            with_stack(max(self.stack, LONG_STACK) if self.stack else 0, project_at_states, &job)
            PyErr_CheckSignals()
            check_varied(job.status)
            done += given.states

    def covary(self, ptrdiff_t first, ptrdiff_t last, const double[::1] covector, sources=None,
               Shapes shapes=None, gathered=None):
        """The transposed of :meth:`vary`: of a function's derivative by the state at the end of these
        steps, covector (width,), those by the state at their start and by (parameters + inputs +
        columns of the shapes).

        sources : (last - first, width)
            Added to the covector at the start of each step.
        gathered : (parameters + inputs + columns of the shapes)
            What later steps gave, to which these add.
        """
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef ptrdiff_t left = last
        self.scene.need(MECHC_PART_DERIVATIVES)
        if self.unit.covary == NULL or record.methods == NULL:
            raise ValueError("this run or its scene has no derivatives")
        if not 0 <= first <= last < record.count or covector.shape[0] != self.width \
                or (sources is not None and sources.shape != (last - first, self.width)):
            raise ValueError("no such steps, or arrays of another shape")
        cdef int columns = self.p.shape[0] + self.scene.inputs + (shapes.columns if shapes else 0)
        at, gradient = np.array(covector), np.zeros(columns + 1)
        if gathered is not None:
            gradient[:columns] = gathered
        cdef double[::1] p = self.p, moving = at, total = gradient
        cdef const double[:, ::1] added
        cdef mechc_covariation covariation
        cdef covarying job
        covariation.trajectory, covariation.p = record, &p[0] if p.shape[0] else NULL
        covariation.inputs = address_of(self.inputs if self.whole is None else self.whole)
        covariation.covector, covariation.gradient = &moving[0], &total[0]
        covariation.sources, covariation.columns = NULL, columns
        covariation.shapes = shapes_of(shapes)
        if sources is not None:
            added = sources
        job.unit, job.covariation = self.unit, &covariation
        while left > first:
            covariation.last = left
            left = max(first, (left - 1) // self.at_once(columns) * self.at_once(columns))
            covariation.first = left
            if sources is not None:
                covariation.sources = &added[left - first, 0]
            with_stack(max(self.stack, LONG_STACK) if self.stack else 0, covary_steps, &job)
            PyErr_CheckSignals()
            check_varied(job.status)
        return at, gradient[:columns]

    cdef ptrdiff_t at_once(self, int columns):
        """Steps between checks of signals."""
        return max(8, (1 << 22) // (self.width * self.width * (self.width + columns)) // 8 * 8)
