# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The Python class of a compiled scene: evaluates outputs, begins runs, releases the GIL."""

from os import fsencode

import numpy as np
from numpy import empty, ndarray

from cpython.buffer cimport (
    PyBUF_FORMAT, PyBUF_SIMPLE, PyBUF_STRIDED_RO, PyBuffer_Release, PyObject_GetBuffer
)
from cpython.exc cimport PyErr_CheckSignals
from cpython.ref cimport PyObject, Py_INCREF, Py_XDECREF
from cpython.pycapsule cimport (
    PyCapsule_GetContext, PyCapsule_GetPointer, PyCapsule_New, PyCapsule_SetContext
)
from libc.math cimport NAN, isfinite
from libc.stdlib cimport calloc, free
from libc.string cimport memcpy
from mechc.native._abi cimport (
    MECHC_ABI, MECHC_ALL_PARTS, MECHC_CAPSULE, MECHC_PART_COLLOCATION, MECHC_PART_DERIVATIVES,
    MECHC_PART_DRIVER, MECHC_PART_OUTPUTS, MECHC_PART_SWEEPS, MECHC_PART_TAYLOR,
    MECHC_PART_TAYLOR_LANES, mechc_given, mechc_join, mechc_joined, mechc_model, mechc_output,
    mechc_part, mechc_rows, mechc_stack_left, mechc_stack_of, mechc_stack_of_output, mechc_unit
)
from mechc.native._inputs cimport Inputs, address_of, mechc_inputs
from mechc.native._pieces cimport LOOK, next_piece, seconds_now, with_stack
from mechc.native._shared_object cimport (
    mechc_close_shared, mechc_find_shared, mechc_open_shared, shared_error
)


cdef extern from "abi/model.h":
    ctypedef struct mechc_tape_opener:
        const char *key
        const mechc_model *(*open)(const unsigned char *, size_t, const char **)


cdef extern from "abi/call.h":
    ctypedef struct mechc_bound:
        int width
        void *owner

    ctypedef struct mechc_along:
        const mechc_bound *of

    mechc_bound *mechc_bind(
        const mechc_model *, const mechc_unit *, int, const double *, const mechc_inputs *
    ) nogil
    void mechc_call(double, const double *, double *, void *) noexcept nogil
    mechc_along *mechc_follow(mechc_bound *, int, int, const int *, const double *, double) nogil
    double mechc_call_along(int, double *, void *) noexcept nogil
    void mechc_let_go(mechc_along *) noexcept nogil

cdef ptrdiff_t LANES = 8  # states are evaluated in lanes, at most so many
cdef ptrdiff_t LITTLE_WORK = 1 << 17
cdef size_t STACK_OF_GENERAL = 1 << 21  # bytes at least: thrice what the unit's arrays take
cdef size_t STACK_OF_TAPE = 1 << 20
cdef long MUCH_WORK = 1 << 16  # evaluations by the general unit, from which on compiling pays
cdef ptrdiff_t MANY = 1 << 16  # states, from which on compiling their evaluation in lanes pays

cdef extern from *:
    """
    typedef struct { const char *name; int bit; } mechc_part_row;
    #define MECHC_PART_ROW(PART) {#PART, MECHC_PART_##PART},
    static const mechc_part_row mechc_part_rows[] = {MECHC_PART_TABLE(MECHC_PART_ROW)};
    enum { mechc_part_count = sizeof mechc_part_rows / sizeof *mechc_part_rows };
    """
    ctypedef struct mechc_part_row:
        const char *name
        int bit

    const mechc_part_row mechc_part_rows[]
    int mechc_part_count

# The parts of a unit by their names, and what batches may need of them.
PARTS = {
    mechc_part_rows[i].name.decode().lower(): mechc_part_rows[i].bit for i in range(mechc_part_count)
}
FOR_BATCHES = MECHC_ALL_PARTS & ~(
    MECHC_PART_DERIVATIVES | MECHC_PART_TAYLOR | MECHC_PART_TAYLOR_LANES | MECHC_PART_SWEEPS
)
# Those that know nothing of how a run is kept.
cdef int BESIDE_GENERAL = MECHC_PART_OUTPUTS | MECHC_PART_DERIVATIVES
FOR_RUNS = MECHC_PART_DRIVER | MECHC_PART_COLLOCATION  # as most are


cdef ptrdiff_t first_piece(ptrdiff_t width) noexcept nogil:
    """States to evaluate before the clock is read: the work of one grows as its size cubed at most.

    Each piece computes the constants of the parameters anew, so many small ones take longer.
    """
    return max(LANES, LITTLE_WORK // (width * width * width + 1) // LANES * LANES)


cdef const char *CALL = "void (double, double *, double *, void *)"
cdef const char *CALL_ALONG = "double (int, double *, void *)"

cdef void release_bound(object capsule) noexcept:
    cdef mechc_bound *bound = <mechc_bound *>PyCapsule_GetContext(capsule)
    Py_XDECREF(<PyObject *>bound.owner)
    free(bound)

cdef void release_along(object capsule) noexcept:
    cdef mechc_along *along = <mechc_along *>PyCapsule_GetContext(capsule)
    Py_XDECREF(<PyObject *>along.of.owner)
    mechc_let_go(along)


ctypedef struct evaluation:
    mechc_output output
    ptrdiff_t left, piece
    mechc_rows t, y, p, forces
    const mechc_inputs *inputs
    double *out

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
        job.output.evaluate(some, job.t, job.y, job.p, job.inputs, job.forces, job.out)
        job.t.data += some * job.t.stride
        job.y.data += some * job.y.stride
        if job.p.stride:
            job.p.data += some * job.p.stride
        if job.forces.data != NULL:
            job.forces.data += some * job.forces.stride
        job.out += some * job.output.width
        job.left -= some
        now = seconds_now()
        job.piece = -(-next_piece(job.piece, now - before) // LANES) * LANES


cdef void project_state(void *given) noexcept nogil:
    cdef projection *job = <projection *>given
    job.status = job.unit.project(job.t, job.state, job.p, job.inputs, job.moved)


cdef const char *PART = "mechc.part"


cdef const int *data_of(path, const char *symbol) except NULL:
    """The struct of this name in a shared object; it begins with its ABI version."""
    cdef bytes name = fsencode(path)
    cdef void *library = mechc_open_shared(name)
    cdef const int *abi = NULL
    if library != NULL:
        abi = <const int *>mechc_find_shared(library, symbol)
    if abi == NULL:
        why = shared_error()
    elif abi[0] != MECHC_ABI:
        why = f"it was compiled for ABI {abi[0]}, this mechc needs ABI {MECHC_ABI}"
    else:
        return abi
    if library != NULL:
        mechc_close_shared(library)  # else the name would refer to this file even after it is replaced
    raise ImportError(f"{path} cannot be loaded: {why}")


def capsule_of(path):
    """The model in a shared object, as a capsule; it stays loaded with the process.

    Raises ImportError if it cannot be loaded, holds no model, or one of another ABI.
    """
    return PyCapsule_New(<void *>data_of(path, b"mechc_scene"), MECHC_CAPSULE, NULL)


def model_of_tape(path, bytes tape, bytes signature):
    """The model that a tape describes, as a capsule, run by a unit in a shared object of its own.

    signature
        That of the unit, where it was compiled at installation.

    Raises ImportError if that cannot be loaded, or the tape is none for it.
    """
    cdef const mechc_tape_opener *opener = <const mechc_tape_opener *>data_of(path, b"mechc_opener")
    cdef const char *why = NULL
    if opener.key[0] and opener.key != signature:
        raise ImportError("the unit that runs this tape is of another version of mechc")
    cdef const mechc_model *model = opener.open(<const unsigned char *>tape, len(tape), &why)
    if model == NULL:
        raise ImportError(f"the tape of this scene cannot be run: {why.decode()}")
    return PyCapsule_New(<void *>model, MECHC_CAPSULE, NULL)


def part_of(path):
    """A capsule of the part of a unit in a shared object."""
    return PyCapsule_New(<void *>data_of(path, b"mechc_part_of_unit"), PART, NULL)


def texts_of(capsule):
    """The texts that the parts of a first unit are compiled from, as JSON."""
    cdef const mechc_model *model = (
        <const mechc_model *>PyCapsule_GetPointer(capsule, MECHC_CAPSULE)
    )
    return model.texts.decode()


cdef class Scene:
    """One compiled scene, in the widest instruction set of this processor or in a named one.

    source
        The maker of a first unit's parts: ``parts(bits)`` are the capsules of these parts,
        ``if_made(bit)`` that of one, or None until it is made, ``made(bits, begin)`` tells whether
        all of them are made, or begins them, and ``whole()`` is that of the model.
    by_general
        Whether runs are by the unit that is compiled once for all scenes of a kind.

    Raises ValueError if the capsule was built for another ABI or the processor lacks the
    instruction set requested.
    """

    def __init__(self, capsule, instruction_set=None, source=None, bint by_general=False):
        self.source, self.evaluated, self.joined, self.first = source, 0, NULL, capsule
        self.members = self.general = None
        self.worked, self.by_general = 0, by_general
        self.whole = capsule if source is None else None
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
        if source is not None:
            self.joined = <mechc_joined *>calloc(1, sizeof(mechc_joined))  # as long as the process
            if self.joined == NULL:
                raise MemoryError()
            self.joined.unit = self.unit[0]
            self.joined.unit.methods = self.joined.methods
            self.unit = &self.joined.unit
        self.coordinates = self.model.coordinates
        self.speeds = self.model.speeds
        self.width = self.coordinates + self.speeds
        self.stack = mechc_stack_of(self.width)
        self.stack_of_general = STACK_OF_GENERAL
        if self.model.general != NULL:
            self.stack_of_general = max(STACK_OF_GENERAL, mechc_stack_of(self.model.bound))
        self.rows = self.model.rows
        self.holonomic = self.model.holonomic
        self.switches = b'"switches": ' in <bytes>self.model.metadata
        self.parameters = self.model.parameters
        self.inputs = self.model.inputs
        self.indices = {
            self.unit.outputs[i].name.decode(errors="surrogatepass"): i for i in range(self.unit.output_count)
        }
        self.outputs = {key: self.unit.outputs[i].width for key, i in self.indices.items()}
        self.widest = max(self.width, max(self.outputs.values(), default=0))
        if by_general:
            mechc_join(self.joined, self.model.general.unit, self.model.general.parts)
            if self.model.series != NULL:
                mechc_join(self.joined, self.model.series.unit, self.model.series.parts)
            if self.model.derivatives != NULL:
                mechc_join(self.joined, self.model.derivatives.unit, self.model.derivatives.parts)
        elif source is not None and self.model.general != NULL:
            self.general = Scene(capsule, instruction_set, source, True)

    @property
    def metadata(self):
        """JSON text: names, units, drawing, operation counts."""
        return self.model.metadata.decode()

    @property
    def evaluator(self):
        """The native scene that evaluates the outputs, for wrappers of a scene to pass on."""
        return self

    @property
    def instruction_set(self):
        return self.unit.instruction_set.decode()

    cpdef need(self, int parts):
        """Wait until these parts of the unit are loaded; they are compiled if they are missing."""
        if self.joined != NULL and parts & ~self.joined.parts:
            if self.by_general and parts & ~self.joined.parts & ~BESIDE_GENERAL:
                raise AssertionError("parts of a scene's own do not fit the general unit's runs")
            for part in self.source.parts(parts & ~self.joined.parts):
                self.take(part)

    @property
    def serves_runs(self):
        """Whether runs begin before more is compiled."""
        return self.general is not None

    @property
    def goes_over(self):
        """Whether batches are by the general unit until parts of its own are compiled."""
        return self.general is not None and not self.joined.parts & MECHC_PART_DRIVER

    cpdef Scene at_once(self, int parts, int by_general=0):
        """The scene by whose functions runs with these parts begin now: this one where its parts are
        compiled, else that by the general unit, which gives the same bits, if it has the parts
        ``by_general``, by default the same; after some work by it they are compiled in the
        background, where there is a compiler."""
        cdef int missing = 0 if self.joined == NULL else parts & ~self.joined.parts
        if missing and self.general is not None and not (by_general or parts) & ~(
            self.general.joined.parts | MECHC_PART_OUTPUTS  # of which the first unit serves
        ):
            if not self.source.made(missing, self.general.worked >= MUCH_WORK):
                return self.general
        self.need(parts)
        return self

    cdef take(self, capsule):
        cdef const mechc_part *part = <const mechc_part *>PyCapsule_GetPointer(capsule, PART)
        mechc_join(self.joined, part.unit, part.parts)

    def wait(self, batches=True, series=False, int together=0):
        """Return when all that runs, or also batches, need is loaded, and in the cache for others.

        ``series``: runs by themselves begin by their Taylor series; ``together``: the parts for
        members side by side.
        """
        cdef int parts = FOR_BATCHES | together if batches else FOR_RUNS
        if not batches and self.general is not None:
            return
        if series:
            parts = parts | MECHC_PART_TAYLOR if batches else MECHC_PART_DRIVER | MECHC_PART_TAYLOR
        self.need(parts)

    @property
    def capsule(self):
        """The model, with all parts of its unit."""
        if self.whole is None:
            self.whole = self.source.whole()
        return self.whole

    @property
    def of_members(self):
        """A copy of the scene for loops over members, with all outputs evaluated in lanes.

        What is loaded for them changes no digit of the outputs of this one.
        """
        if self.joined == NULL:
            return self
        if self.members is None:
            self.members = Scene(self.first, None, self.source)
        return self.members

    cdef prefer_lanes(self, ptrdiff_t count):
        """Evaluate outputs of many states in lanes, once these are compiled."""
        self.evaluated += count
        if self.evaluated > MANY:
            part = self.source.if_made(MECHC_PART_OUTPUTS)
            if part is not None:
                self.take(part)

    @property
    def lanes(self):
        return self.unit.lanes

    def complete(self, const unsigned char[::1] given, double[::1] values):
        """Fill the parameters that are not given with their defaults, in place."""
        if given.shape[0] != self.parameters or values.shape[0] != self.parameters:
            raise ValueError(f"{self.parameters} parameters are needed")
        if self.parameters:
            self.model.complete(&given[0], &values[0])

    cdef size_t stack_of(self, int width):
        """Bytes of stack that an output of so many numbers takes at most."""
        cdef size_t needed = mechc_stack_of_output(self.speeds, self.rows, self.widest, width)
        if self.stack_of_general > STACK_OF_GENERAL:  # by tapes, in arrays as large as bounds
            needed = max(needed, self.stack_of_general // 8)
        return needed

    cdef size_t stack_here(self):
        """Bytes of a separate stack for a run from the calling thread; 0: its own suffices."""
        cdef bint little = self.by_general and mechc_stack_left() < self.stack_of_general
        return self.stack_of_general if little else self.stack

    cdef size_t stack_of_thread(self):
        """Bytes of a separate stack for runs from a thread of which nothing is known; 0: none."""
        return self.stack_of_general if self.by_general else self.stack

    cdef size_t stack_of_derivatives(self):
        """The same for derivatives of runs by the general unit, whose arrays are larger."""
        cdef size_t needed = 3 * self.stack_of_general
        return needed if mechc_stack_left() < needed else 0

    cdef size_t stack_beyond(self, int width):
        """0 where the calling thread has so much left."""
        cdef size_t needed = self.stack_of(width) if self.stack or self.model.general != NULL else 0
        if self.model.general != NULL:
            needed = max(needed, STACK_OF_TAPE)
        return needed if needed > mechc_stack_left() else 0

    def complete_rows(self, const unsigned char[::1] given, double[:, ::1] rows):
        """Complete the parameters of every row (members, np); the flags are the same for all."""
        cdef ptrdiff_t i
        if given.shape[0] != self.parameters or rows.shape[1] != self.parameters:
            raise ValueError(f"{self.parameters} parameters are needed")
        if self.parameters:
            for i in range(rows.shape[0]):
                self.model.complete(&given[0], &rows[i, 0])

    def evaluate(self, str name, const double[::1] t, const double[:, ::1] y,
                 const double[:, ::1] p, Inputs inputs=None, const double[:, ::1] forces=None):
        """Output `name` of y.shape[0] states; t and p have as many rows or one.

        Returns a fresh array (states, width).  Outputs that hold inputs need ``inputs``; those that
        hold accelerations or multipliers take generalized ``forces`` (states, nu) besides the scene's.
        """
        out = np.empty((y.shape[0], self.unit.outputs[self.indices[name]].width))
        self.evaluate_into(name, t, y, p, out, inputs, forces)
        return out

    def evaluate_into(self, str name, const double[::1] t, const double[:, ::1] y,
                      const double[:, ::1] p, double[:, ::1] out, Inputs inputs=None,
                      const double[:, ::1] forces=None):
        """Evaluate an output into an array (states, width)."""
        cdef ptrdiff_t count = y.shape[0]
        if self.joined != NULL and not self.joined.parts & MECHC_PART_OUTPUTS:
            self.prefer_lanes(count)
        cdef mechc_output output = self.unit.outputs[self.indices[name]]
        if y.shape[1] != self.width or p.shape[1] != self.parameters:
            raise ValueError("wrong number of state components or parameters")
        if t.shape[0] not in (1, count) or p.shape[0] not in (1, count):
            raise ValueError("times and parameters must be given once or once a state")
        if out.shape[0] != count or out.shape[1] != output.width:
            raise ValueError("wrong shape of the array for the results")
        if forces is not None and (forces.shape[0] != count or forces.shape[1] != self.speeds):
            raise ValueError("a row of forces is needed for every state")
        cdef mechc_rows times, states, parameters
        if count == 0:
            return
        times.data, times.stride = &t[0], t.shape[0] > 1
        states.data, states.stride = &y[0, 0], self.width
        parameters.data = &p[0, 0] if self.parameters else NULL
        parameters.stride = self.parameters if p.shape[0] > 1 else 0
        cdef evaluation job
        job.output, job.left, job.piece = output, count, first_piece(self.width)
        job.t, job.y, job.p, job.out = times, states, parameters, &out[0, 0]
        job.inputs = address_of(inputs)
        job.forces.data, job.forces.stride = NULL, 0
        if forces is not None:
            job.forces.data, job.forces.stride = &forces[0, 0], self.speeds
        while job.left:
            with_stack(self.stack_beyond(output.width), evaluate_a_while, &job)
            PyErr_CheckSignals()

    def bound(self, str name, const double[::1] p, Inputs inputs=None):
        """Output `name` at the parameters p, for C: (capsule, address, data, width, stack).

        The capsule is called by its C signature, has the data for its context and owns them;
        the address is that of its function; a call takes at most so many bytes of stack.
        """
        cdef mechc_bound *bound = bound_output(self, name, p, inputs)
        capsule = PyCapsule_New(<void *>mechc_call, CALL, release_bound)
        PyCapsule_SetContext(capsule, bound)
        keep_for(bound, inputs)
        stack = self.stack_of(bound.width)
        return capsule, <size_t>&mechc_call, <size_t>bound, bound.width, stack

    def bound_along(
        self, str name, const double[::1] p, int component, const int[::1] places,
        const double[::1] y, double t, Inputs inputs=None,
    ):
        """One component of it as a function of y at these indices (-1: t), as a capsule."""
        cdef mechc_bound *bound = bound_output(self, name, p, inputs)
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
        keep_for(bound, inputs)
        return capsule

    def rates_seconds(self, double t, const double[::1] y, const double[::1] p, long repeats):
        """Seconds that `repeats` scalar evaluations of the state rates take, each fed with the last result.

        For benchmarks: no Python in between.
        """
        self.need(MECHC_PART_OUTPUTS)
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
        cdef Scene scene = self.at_once(MECHC_PART_DRIVER)
        out = np.empty(self.width)
        cdef double[::1] state = out
        cdef double[2] moved
        cdef int i
        if y.shape[0] != self.width or p.shape[0] != self.parameters:
            raise ValueError("wrong number of state components or parameters")
        memcpy(&state[0], &y[0], self.width * sizeof(double))
        cdef projection job
        job.unit, job.t, job.state, job.moved = scene.unit, t, &state[0], moved
        job.p, job.inputs = &p[0] if self.parameters else NULL, address_of(inputs)
        with_stack(scene.stack_here() or self.stack_beyond(0), project_state, &job)
        for i in range(self.width):
            if not isfinite(y[i]):
                moved[0] = NAN
        return job.status, out, moved[0], moved[1]


cdef mechc_bound *bound_output(
    Scene scene, str name, const double[::1] p, Inputs inputs=None
) except NULL:
    cdef int index = -1 if name == "rates" else scene.indices[name]
    cdef mechc_bound *bound
    if p.shape[0] != scene.parameters:
        raise ValueError(f"{scene.parameters} parameters are needed")
    scene.need(MECHC_PART_OUTPUTS)
    bound = mechc_bind(
        scene.model, scene.unit, index, &p[0] if scene.parameters else NULL, address_of(inputs)
    )
    if bound == NULL:
        raise MemoryError()
    return bound


cdef void keep_for(mechc_bound *bound, Inputs inputs):
    """Let inputs live as long as what is bound to them."""
    if inputs is not None:
        Py_INCREF(inputs)
        bound.owner = <void *>inputs


cdef class Ode:
    """``f(t, y)`` of a system at parameters p (np,): one state (nq + nu,), its rates as a new array.

    Compiled code is called at once where the scene is of compiled code alone, every input being a
    number, and the calling thread has enough stack for it; all else goes to ``general(t, y)``.
    """

    cdef object system, p, general, scene
    cdef Inputs inputs
    cdef mechc_bound *bound
    cdef size_t stack

    def __init__(self, system, const double[::1] p, general):
        self.system, self.p, self.general = system, p, general

    def __dealloc__(self):
        free(self.bound)

    cdef int _bind(self) except -1:
        """Choose the function anew when a compilation in the background has ended."""
        scene = self.scene = self.system.scene
        free(self.bound)
        self.bound, self.inputs = NULL, None
        if self.system.driven is not None:
            if not scene.has_only_numbers:
                return 0
            scene, self.inputs = scene.without_inputs, scene.native_inputs()
        if isinstance(scene, Scene):
            self.bound = bound_output(scene, "rates", self.p, self.inputs)
            small = not (<Scene>scene).stack and (<Scene>scene).stack_of_general == STACK_OF_GENERAL
            self.stack = 0 if small else (<Scene>scene).stack_of(self.bound.width)
        return 0

    def __call__(self, t, y):
        cdef Py_buffer state, rates  # views of Cython take longer than a small scene
        cdef double time = t
        if self.system.scene is not self.scene:
            self._bind()
        if self.bound == NULL or type(y) is not ndarray or self.stack > mechc_stack_left():
            return self.general(t, y)
        try:
            PyObject_GetBuffer(y, &state, PyBUF_STRIDED_RO | PyBUF_FORMAT)
        except ValueError:
            return self.general(t, y)
        try:
            if not holds_doubles(&state, self.bound.width):
                return self.general(t, y)
            out = empty(self.bound.width)
            PyObject_GetBuffer(out, &rates, PyBUF_SIMPLE)
            mechc_call(time, <double *>state.buf, <double *>rates.buf, self.bound)
            PyBuffer_Release(&rates)
            return out
        finally:
            PyBuffer_Release(&state)


cdef bint holds_doubles(const Py_buffer *view, ptrdiff_t count) noexcept:
    """Whether a view is of one row of so many doubles, side by side."""
    return (
        view.ndim == 1 and view.shape[0] == count and view.strides[0] == sizeof(double)
        and view.format[0] == b"d" and view.format[1] == 0
    )
