# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The Python class of a compiled scene: evaluates outputs, runs integrations, releases the GIL."""

from os import fsencode

import numpy as np

from cpython.exc cimport PyErr_CheckSignals
from cpython.mem cimport PyMem_Free, PyMem_Malloc
from cpython.pycapsule cimport (
    PyCapsule_GetContext, PyCapsule_GetPointer, PyCapsule_New, PyCapsule_SetContext
)
from libc.math cimport INFINITY, NAN, isfinite
from libc.stdlib cimport free
from libc.string cimport memcpy, memset
from posix.dlfcn cimport RTLD_LOCAL, RTLD_NOW, dlclose, dlerror, dlopen, dlsym
from posix.time cimport CLOCK_MONOTONIC, clock_gettime, timespec

from mechc.native._inputs cimport Inputs, mechc_inputs


cdef extern from "abi/model.h":
    int MECHC_ABI
    const char *MECHC_CAPSULE
    int MECHC_RUNNING, MECHC_FINISHED

    ctypedef struct mechc_rows:
        const double *data
        ptrdiff_t stride

    ctypedef void (*mechc_evaluate_pointer)(
        ptrdiff_t count, mechc_rows t, mechc_rows y, mechc_rows p, const mechc_inputs *inputs,
        double *out
    ) noexcept nogil

    ctypedef struct mechc_output:
        const char *name
        int width
        mechc_evaluate_pointer evaluate

    ctypedef struct mechc_options:
        double t0, t1
        const double *y0
        const double *p
        const mechc_inputs *inputs
        double rtol
        const double *atol
        const double *scale
        double first_step, max_step
        long max_steps
        int method, dense, on_change_point, may_stiffen

    ctypedef struct mechc_stats:
        long steps, rejected, rhs_evaluations, closure_iterations
        double least_singular, least_singular_time
        int coordinate
        long examined
        double critical_gap, critical_time, rounding

    ctypedef struct mechc_trajectory:
        ptrdiff_t count, capacity
        int width, dense_rows
        double *t
        double *y
        double *dense
        unsigned char *methods
        ptrdiff_t crossing_count
        double *crossings

    ctypedef struct mechc_run:
        int status
        double t
        mechc_stats stats
        mechc_trajectory trajectory

    ctypedef struct mechc_given:
        pass

    ctypedef struct mechc_unit:
        const char *instruction_set
        int lanes
        int output_count
        const mechc_output *outputs
        size_t given_size
        void (*give)(const double *, const mechc_inputs *, mechc_given *) noexcept nogil
        void (*rates)(double, const double *, const mechc_given *, double *) noexcept nogil
        int (*project)(
            double, double *, const double *, const mechc_inputs *, double *
        ) noexcept nogil
        size_t run_size
        void (*start)(mechc_run *, const mechc_options *) noexcept nogil
        int (*advance)(mechc_run *, long) noexcept nogil
        void (*release)(mechc_run *) noexcept nogil
        void (*interpolate)(
            int, const mechc_trajectory *, const double *, const mechc_inputs *, ptrdiff_t,
            const double *, double *
        ) noexcept nogil
        void (*extend)(mechc_run *, double, const mechc_inputs *) noexcept nogil

    ctypedef struct mechc_model:
        int abi
        const char *metadata
        int coordinates, speeds, holonomic, rows, parameters
        void (*complete)(const unsigned char *, double *) noexcept nogil
        const mechc_unit *(*select)(const char *) noexcept nogil
        int inputs

cdef extern from "abi/large_stack.h":
    size_t mechc_stack_of(int) noexcept nogil
    int mechc_with_stack(size_t, void (*)(void *) noexcept nogil, void *) noexcept nogil

cdef extern from "abi/call.h":
    ctypedef struct mechc_bound:
        int states, width

    ctypedef struct mechc_along:
        pass

    mechc_bound *mechc_bind(
        const mechc_model *, const mechc_unit *, int, const double *, const mechc_inputs *
    ) nogil
    void mechc_call(double, const double *, double *, void *) noexcept nogil
    mechc_along *mechc_follow(mechc_bound *, int, int, const int *, const double *, double) nogil
    double mechc_call_along(int, double *, void *) noexcept nogil
    void mechc_let_go(mechc_along *) noexcept nogil

cdef double LOOK = 0.02  # s between checks of signals, and between turns of other threads
cdef double PIECE = 0.001  # s between checks of the clock: the next piece may take far longer
cdef ptrdiff_t LANES = 8  # states are evaluated in lanes, at most so many
cdef ptrdiff_t LARGEST_PIECE = 1 << 20


cdef double seconds_now() noexcept nogil:
    cdef timespec now
    clock_gettime(CLOCK_MONOTONIC, &now)
    return now.tv_sec + 1e-9 * now.tv_nsec


cdef ptrdiff_t next_piece(ptrdiff_t piece, double seconds) noexcept nogil:
    """Twice as much work if it took less than a piece of time; proportionally less if longer."""
    if seconds > PIECE:
        return max(<ptrdiff_t>(piece * (PIECE / seconds)), 1)
    return min(2 * piece, LARGEST_PIECE) if seconds < 0.5 * PIECE else piece


cdef const mechc_inputs *address_of(Inputs inputs) noexcept:
    return NULL if inputs is None else &inputs.driven.head


cdef const char *CALL = "void (double, double *, double *, void *)"
cdef const char *CALL_ALONG = "double (int, double *, void *)"

cdef void release_bound(object capsule) noexcept:
    free(PyCapsule_GetContext(capsule))

cdef void release_along(object capsule) noexcept:
    mechc_let_go(<mechc_along *>PyCapsule_GetContext(capsule))


ctypedef struct evaluation:
    mechc_output output
    ptrdiff_t left, piece
    mechc_rows t, y, p
    const mechc_inputs *inputs
    double *out

ctypedef struct advancing:
    const mechc_unit *unit
    mechc_run *run
    long left
    ptrdiff_t piece
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

ctypedef struct beginning:
    const mechc_unit *unit
    mechc_run *run
    const mechc_options *options

ctypedef struct projection:
    const mechc_unit *unit
    double t
    double *state
    const double *p
    const mechc_inputs *inputs
    double *moved
    int status


cdef void evaluate_a_while(void *given) noexcept nogil:
    cdef evaluation *job = <evaluation *>given
    cdef double started = seconds_now(), now = started, before
    cdef ptrdiff_t some
    while job.left and now - started < LOOK:
        some, before = min(job.piece, job.left), now
        job.output.evaluate(some, job.t, job.y, job.p, job.inputs, job.out)
        job.t.data += some * job.t.stride
        job.y.data += some * job.y.stride
        if job.p.stride:
            job.p.data += some * job.p.stride
        job.out += some * job.output.width
        job.left -= some
        now = seconds_now()
        job.piece = -(-next_piece(job.piece, now - before) // LANES) * LANES


cdef void advance_a_while(void *given) noexcept nogil:
    cdef advancing *job = <advancing *>given
    cdef double started = seconds_now(), now = started, before
    cdef long some
    while job.status == MECHC_RUNNING and job.left > 0 and now - started < LOOK:
        some, before = min(job.piece, job.left), now
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


cdef void begin(void *given) noexcept nogil:
    cdef beginning *job = <beginning *>given
    job.unit.start(job.run, job.options)


cdef void project_state(void *given) noexcept nogil:
    cdef projection *job = <projection *>given
    job.status = job.unit.project(job.t, job.state, job.p, job.inputs, job.moved)


cdef int with_stack(size_t bytes, void (*work)(void *) noexcept nogil, void *data) except -1:
    """Work without the GIL, on a stack that is large enough."""
    cdef int done
    with nogil:
        done = mechc_with_stack(bytes, work, data)
    if not done:
        raise MemoryError("no stack for a scene of this size")
    return 0


def capsule_of(path):
    """The model in a shared object, as a capsule; it stays loaded with the process.

    Raises ImportError if it cannot be loaded, holds no model, or one of another ABI.
    """
    cdef bytes name = fsencode(path)
    cdef void *library = dlopen(name, RTLD_NOW | RTLD_LOCAL)
    cdef const mechc_model *model = NULL
    if library != NULL:
        model = <const mechc_model *>dlsym(library, b"mechc_scene")
    if model == NULL:
        why = dlerror().decode(errors="replace")
    elif model.abi != MECHC_ABI:
        why = f"it was compiled for ABI {model.abi}, this mechc needs ABI {MECHC_ABI}"
    else:
        return PyCapsule_New(<void *>model, MECHC_CAPSULE, NULL)
    if library != NULL:
        dlclose(library)  # else the name would refer to this file even after it is replaced
    raise ImportError(f"{path} cannot be loaded: {why}")


def largest_of(const double[::1] values, const Py_ssize_t[::1] which):
    """The largest magnitude among the values at these places, 0 where there are none."""
    cdef double largest = 0.0
    cdef Py_ssize_t i
    for i in range(which.shape[0]):
        largest = max(largest, abs(values[which[i]]))
    return largest


def strictly_within(const double[:, ::1] rows, const double[::1] lower, const double[::1] upper):
    """Whether every number is strictly between the bounds of its column; NaN is not."""
    cdef ptrdiff_t i, k
    if lower.shape[0] != rows.shape[1] or upper.shape[0] != rows.shape[1]:
        raise ValueError("a bound for every column is needed")
    for i in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            if not lower[k] < rows[i, k] < upper[k]:
                return False
    return True


cdef class Scene:
    """One compiled scene, in the widest instruction set of this processor or in a named one.

    Raises ValueError if the capsule was built for another ABI or the processor lacks the
    instruction set requested.
    """

    cdef const mechc_model *model
    cdef const mechc_unit *unit
    cdef dict indices
    cdef readonly object capsule
    cdef readonly int width, coordinates, speeds, rows, holonomic, parameters, inputs
    cdef size_t stack  # bytes of stack that it needs beyond those of any thread

    def __init__(self, capsule, instruction_set=None):
        self.capsule = capsule
        self.model = <const mechc_model *>PyCapsule_GetPointer(capsule, MECHC_CAPSULE)
        if self.model.abi != MECHC_ABI:
            raise ValueError(
                f"this model was compiled for ABI {self.model.abi}, this mechc needs {MECHC_ABI}: "
                "compile it again"
            )
        cdef bytes wanted
        cdef const char *name = NULL
        if instruction_set is not None:
            wanted = instruction_set.encode()
            name = wanted
        self.unit = self.model.select(name)
        if self.unit == NULL:
            raise ValueError(f"this processor or this build has no {instruction_set!r}")
        self.coordinates = self.model.coordinates
        self.speeds = self.model.speeds
        self.width = self.coordinates + self.speeds
        self.stack = mechc_stack_of(self.width)
        self.rows = self.model.rows
        self.holonomic = self.model.holonomic
        self.parameters = self.model.parameters
        self.inputs = self.model.inputs
        self.indices = {
            self.unit.outputs[i].name.decode(errors="surrogatepass"): i for i in range(self.unit.output_count)
        }

    @property
    def metadata(self):
        """JSON text: names, units, drawing, operation counts."""
        return self.model.metadata.decode()

    @property
    def instruction_set(self):
        return self.unit.instruction_set.decode()

    @property
    def integrates(self):
        """Whether integrators are compiled in; a first unit has rates and outputs only."""
        return self.unit.start != NULL

    @property
    def lanes(self):
        return self.unit.lanes

    @property
    def outputs(self):
        """Output name -> width."""
        return {name: self.unit.outputs[i].width for name, i in self.indices.items()}

    def complete(self, const unsigned char[::1] given, double[::1] values):
        """Fill the parameters that are not given with their defaults, in place."""
        if given.shape[0] != self.parameters or values.shape[0] != self.parameters:
            raise ValueError(f"{self.parameters} parameters are needed")
        if self.parameters:
            self.model.complete(&given[0], &values[0])

    def complete_rows(self, const unsigned char[::1] given, double[:, ::1] rows):
        """The same for every row; the flags are the same for all."""
        cdef ptrdiff_t i
        if given.shape[0] != self.parameters or rows.shape[1] != self.parameters:
            raise ValueError(f"{self.parameters} parameters are needed")
        if self.parameters:
            for i in range(rows.shape[0]):
                self.model.complete(&given[0], &rows[i, 0])

    def evaluate(self, str name, const double[::1] t, const double[:, ::1] y,
                 const double[:, ::1] p, Inputs inputs=None):
        """Output `name` of y.shape[0] states; t and p have as many rows or one.

        Returns a fresh array (states, width).  Outputs that hold inputs need ``inputs``.
        """
        out = np.empty((y.shape[0], self.unit.outputs[self.indices[name]].width))
        self.evaluate_into(name, t, y, p, out, inputs)
        return out

    def evaluate_into(self, str name, const double[::1] t, const double[:, ::1] y,
                      const double[:, ::1] p, double[:, ::1] out, Inputs inputs=None):
        """The same, into an array (states, width)."""
        cdef mechc_output output = self.unit.outputs[self.indices[name]]
        cdef ptrdiff_t count = y.shape[0]
        if y.shape[1] != self.width or p.shape[1] != self.parameters:
            raise ValueError("wrong number of state components or parameters")
        if t.shape[0] not in (1, count) or p.shape[0] not in (1, count):
            raise ValueError("times and parameters must be given once or once a state")
        if out.shape[0] != count or out.shape[1] != output.width:
            raise ValueError("wrong shape of the array for the results")
        cdef mechc_rows times, states, parameters
        if count == 0:
            return
        times.data, times.stride = &t[0], t.shape[0] > 1
        states.data, states.stride = &y[0, 0], self.width
        parameters.data = &p[0, 0] if self.parameters else NULL
        parameters.stride = self.parameters if p.shape[0] > 1 else 0
        cdef evaluation job
        job.output, job.left, job.piece = output, count, LANES
        job.t, job.y, job.p, job.out = times, states, parameters, &out[0, 0]
        job.inputs = address_of(inputs)
        while job.left:
            with_stack(self.stack, evaluate_a_while, &job)
            PyErr_CheckSignals()

    cdef mechc_bound *_bind(self, str name, const double[::1] p) except NULL:
        cdef int index = -1 if name == "rates" else self.indices[name]
        cdef mechc_bound *bound
        if p.shape[0] != self.parameters:
            raise ValueError(f"{self.parameters} parameters are needed")
        bound = mechc_bind(self.model, self.unit, index, &p[0] if self.parameters else NULL, NULL)
        if bound == NULL:
            raise MemoryError()
        return bound

    def bound(self, str name, const double[::1] p):
        """Output `name` at the parameters p, for C: (capsule, address, data, width).

        The capsule is called by its C signature, has the data for its context and owns them;
        the address is that of its function.
        """
        cdef mechc_bound *bound = self._bind(name, p)
        capsule = PyCapsule_New(<void *>mechc_call, CALL, release_bound)
        PyCapsule_SetContext(capsule, bound)
        return capsule, <size_t>&mechc_call, <size_t>bound, bound.width

    def bound_along(
        self, str name, const double[::1] p, int component, const int[::1] places,
        const double[::1] y, double t,
    ):
        """One component of it as a function of y at these indices (-1: t), as a capsule."""
        cdef mechc_bound *bound = self._bind(name, p)
        cdef mechc_along *along
        if y.shape[0] != self.width or not 0 <= component < bound.width:
            free(bound)
            raise ValueError("no such component or no such state")
        along = mechc_follow(bound, component, places.shape[0], &places[0], &y[0], t)
        if along == NULL:
            free(bound)
            raise MemoryError()
        capsule = PyCapsule_New(<void *>mechc_call_along, CALL_ALONG, release_along)
        PyCapsule_SetContext(capsule, along)
        return capsule

    def rates_seconds(self, double t, const double[::1] y, const double[::1] p, long repeats):
        """Seconds that `repeats` scalar evaluations of the state rates take, each fed with the last result.

        For benchmarks: no Python in between.
        """
        cdef double[::1] state = np.array(y), rates = np.empty(self.width)
        cdef double[::1] prepared = np.empty(1 + self.unit.given_size // sizeof(double))
        cdef mechc_given *given = <mechc_given *>&prepared[0]
        cdef long i
        from time import perf_counter
        self.unit.give(&p[0], NULL, given)
        start = perf_counter()
        with nogil:
            for i in range(repeats):
                self.unit.rates(t, &state[0], given, &rates[0])
                state[0] += 1e-18 * rates[self.width - 1]
        return perf_counter() - start

    def project(self, double t, const double[::1] y, const double[::1] p, Inputs inputs=None):
        """The nearest state on the constraints.

        Returns (status code, new state, largest closure gap before, largest velocity residual);
        the gap is NaN where a component of y is not finite.
        """
        out = np.empty(self.width)
        cdef double[::1] state = out
        cdef double[2] moved
        cdef int i
        if y.shape[0] != self.width or p.shape[0] != self.parameters:
            raise ValueError("wrong number of state components or parameters")
        memcpy(&state[0], &y[0], self.width * sizeof(double))
        cdef projection job
        job.unit, job.t, job.state, job.moved = self.unit, t, &state[0], moved
        job.p, job.inputs = &p[0] if self.parameters else NULL, address_of(inputs)
        with_stack(self.stack, project_state, &job)
        for i in range(self.width):
            if not isfinite(y[i]):
                moved[0] = NAN
        return job.status, out, moved[0], moved[1]

    def start(self, double t0, double t1, const double[::1] y0, const double[::1] p, double rtol, atol,
              const double[::1] scale, double first_step, double max_step, long max_steps, int method,
              bint dense, int on_change_point=0, bint may_stiffen=False, Inputs inputs=None):
        """Begin a run; see Run.  on_change_point: a number of CHANGE_POINT_POLICIES."""
        cdef Run run = Run.__new__(Run)
        cdef const double[::1] tolerances
        cdef mechc_options options
        run.scene = self
        run.unit = self.unit
        run.method = method
        run.piece = 1
        if p.shape[0] != self.parameters:
            raise ValueError("wrong number of parameters")
        run.p, run.inputs = np.array(p), inputs
        run.run = <mechc_run *>PyMem_Malloc(self.unit.run_size)
        if run.run == NULL:
            raise MemoryError()
        memset(run.run, 0, self.unit.run_size)
        options.t0, options.t1 = t0, t1
        options.y0, options.p = &y0[0], &p[0] if self.parameters else NULL
        options.inputs = address_of(inputs)
        options.rtol = rtol
        options.atol = NULL
        if atol is not None:
            tolerances = atol
            options.atol = &tolerances[0]
        options.scale = &scale[0]
        options.first_step, options.max_step = first_step, max_step
        options.max_steps = max_steps
        options.method, options.dense = method, dense
        options.on_change_point = on_change_point
        options.may_stiffen = may_stiffen
        cdef beginning job
        job.unit, job.run, job.options = self.unit, run.run, &options
        with_stack(self.stack, begin, &job)
        return run


cdef class Run:
    """An integration under way or finished; owns the trajectory."""

    cdef Scene scene
    cdef const mechc_unit *unit  # besides `scene`, which the cycle collector may have cleared first
    cdef mechc_run *run
    cdef int method
    cdef object p
    cdef Inputs inputs, whole  # of the end of the run; of all of it
    cdef ptrdiff_t piece  # attempted steps until the next check of the clock

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
        job.status = MECHC_RUNNING
        with_stack(self.scene.stack, advance_a_while, &job)
        self.piece = job.piece
        PyErr_CheckSignals()
        return job.status

    def extend(self, double t1, Inputs inputs not None):
        """Go on to t1, from the end of the run or before it, with other inputs."""
        cdef const mechc_inputs *driven = address_of(inputs)
        if self.unit.extend == NULL:
            raise ValueError("this scene has no inputs")
        self.inputs = inputs
        with nogil:
            self.unit.extend(self.run, t1, driven)

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
        t, y = np.empty(record.count), np.empty((record.count, self.scene.width))
        cdef double[::1] times = t
        cdef double[:, ::1] states = y
        if record.count:
            memcpy(&times[0], record.t, record.count * sizeof(double))
            memcpy(&states[0, 0], record.y, record.count * self.scene.width * sizeof(double))
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

    def largest(self, const Py_ssize_t[::1] which):
        """The largest magnitude of these components in the first and the last accepted state."""
        cdef mechc_trajectory *record = &self.run.trajectory
        cdef double *last = record.y + (record.count - 1) * self.scene.width
        cdef double largest = 0.0
        cdef Py_ssize_t i
        for i in range(which.shape[0] if record.count else 0):
            if not 0 <= which[i] < self.scene.width:
                raise IndexError(f"states have {self.scene.width} components")
            largest = max(largest, abs(record.y[which[i]]), abs(last[which[i]]))
        return largest

    @property
    def crossings(self):
        """Number of change points crossed."""
        return self.run.trajectory.crossing_count

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
        cdef ptrdiff_t width = self.scene.coordinates + 2, i, j
        rows = np.empty((record.crossing_count, width))
        cdef double[:, ::1] view = rows
        for i in range(record.crossing_count):
            for j in range(width):
                view[i, j] = record.crossings[i * width + j]
        return rows[:, 0].copy(), rows[:, 2:].copy(), rows[:, 1].copy()

    def interpolate(self, const double[::1] t):
        """Dense output at the times t, projected onto the constraints: (len(t), width)."""
        out = np.empty((t.shape[0], self.scene.width))
        cdef double[:, ::1] view = out
        cdef double[::1] p = self.p
        cdef const double *parameters = &p[0] if self.scene.parameters else NULL
        cdef interpolation job
        job.unit, job.method, job.trajectory = self.unit, self.method, &self.run.trajectory
        job.p, job.left, job.piece = parameters, t.shape[0], 1
        job.inputs = address_of(self.inputs if self.whole is None else self.whole)
        if job.left:
            job.t, job.out = &t[0], &view[0, 0]
        job.width = self.scene.width
        while job.left:
            with_stack(self.scene.stack, interpolate_a_while, &job)
            PyErr_CheckSignals()
        return out
