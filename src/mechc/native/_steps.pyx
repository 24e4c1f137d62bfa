# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The steps of a run: accepted states, dense output between them, and derivatives over them."""

import numpy as np

from cpython.exc cimport PyErr_CheckSignals
from libc.stdlib cimport malloc
from libc.string cimport memcpy, memset

from mechc.native._abi cimport (
    MECHC_DOP853, MECHC_MEMORY_LIMIT, MECHC_PART_DERIVATIVES, MECHC_PART_DRIVER, MECHC_RUNNING, mechc_covariation,
    mechc_projected_columns, mechc_trajectory, mechc_unit, mechc_variation
)
from mechc.native._driver cimport Scene
from mechc.native._events cimport Events
from mechc.native._hybrid cimport (
    mechc_contact_laws, mechc_motion, mechc_piece, mechc_piece_in_contact, mechc_piece_leave, mechc_piece_make,
    mechc_piece_share, mechc_read_contact, mechc_read_contact_forces
)
from mechc.native._inputs cimport Inputs, Shapes, address_of, array_of, mechc_inputs, shapes_of
from mechc.native._pieces cimport LONG_STACK, LOOK, next_piece, seconds_now, with_stack


ctypedef struct interpolation:
    const mechc_unit *unit
    int width
    const mechc_trajectory *trajectory
    const double *p
    const mechc_inputs *inputs
    ptrdiff_t left, piece
    const double *t
    double *out

ctypedef struct contact_reading:
    mechc_motion motion
    const mechc_contact_laws *laws
    const mechc_piece *piece
    ptrdiff_t count
    const double *t
    const double *y  # states whose forces are read; NULL: the states are read
    double *out
    int made

ctypedef struct differentiating:
    const mechc_unit *unit
    void *asked  # as the unit's function takes it
    int status


cdef void interpolate_a_while(void *given) noexcept nogil:
    cdef interpolation *job = <interpolation *>given
    cdef double started = seconds_now(), now = started, before
    cdef ptrdiff_t some
    while job.left and now - started < LOOK:
        some, before = min(job.piece, job.left), now
        job.unit.interpolate(
            1, job.trajectory, job.p, job.inputs, some, job.t, job.out
        )
        job.t += some
        job.out += some * job.width
        job.left -= some
        now = seconds_now()
        job.piece = next_piece(job.piece, now - before)


cdef void read_in_contact(void *given) noexcept nogil:
    cdef contact_reading *job = <contact_reading *>given
    if job.y == NULL:
        job.made = mechc_read_contact(&job.motion, job.laws, job.piece, job.count, job.t, job.out)
    else:
        job.made = mechc_read_contact_forces(
            &job.motion, job.laws, job.piece, job.count, job.t, job.y, job.out
        )


cdef int STAGES = 8  # a step that is differentiated counts as so many evaluations


cdef void vary_steps(void *given) noexcept nogil:
    cdef differentiating *job = <differentiating *>given
    job.status = job.unit.vary(<mechc_variation *>job.asked)


cdef void covary_steps(void *given) noexcept nogil:
    cdef differentiating *job = <differentiating *>given
    job.status = job.unit.covary(<mechc_covariation *>job.asked)


cdef void project_at_states(void *given) noexcept nogil:
    cdef differentiating *job = <differentiating *>given
    job.status = job.unit.project_columns(<mechc_projected_columns *>job.asked)


cdef object table_of(const double *numbers, ptrdiff_t count, ptrdiff_t width):
    """A copy of rows of numbers (count, width)."""
    return array_of(numbers, count * width).reshape(count, width)


cdef int copy_numbers(double **to, const double *numbers, ptrdiff_t count) except -1:
    to[0] = <double *>malloc((count + 1) * sizeof(double))
    if to[0] == NULL:
        raise MemoryError()
    memcpy(to[0], numbers, count * sizeof(double))


cdef class Sizes:
    """The rules for the sizes of the components of a scene's states.

    dimensionless : (nq + nu,)
        Which contain no length.
    lengths : (n,)
        The parameters that are lengths.
    lowest, highest : (np,)
        Bounds of the parameters.
    """

    def __init__(self, const unsigned char[::1] dimensionless, const int[::1] lengths,
                 const double[::1] lowest, const double[::1] highest):
        self.references = dimensionless, lengths, lowest, highest
        self.sizes.dimensionless = &dimensionless[0]
        self.sizes.length_count = lengths.shape[0]
        if lengths.shape[0]:
            self.sizes.lengths = &lengths[0]
        if lowest.shape[0]:
            self.sizes.lowest, self.sizes.highest = &lowest[0], &highest[0]


cdef class Steps:
    """The steps of a piece of a motion, which may be under way and make more of them.

    Steps by the explicit pair of order 8 are made from arrays, too: those of a scene with parameters
    p (np,) and ``inputs``, at increasing times t (nt,), with states y (nt, width) and the rows of
    their dense output (nt - 1, rows, width).
    """

    def __cinit__(self):
        self.piece = NULL

    def __init__(self, Scene scene, const double[::1] p, Inputs inputs, const double[::1] t,
                 const double[:, ::1] y, const double[:, :, ::1] rows):
        cdef mechc_trajectory *record
        cdef ptrdiff_t count = t.shape[0], block = rows.shape[1] * scene.width
        if count < 1 or y.shape[0] != count or y.shape[1] != scene.width \
                or rows.shape[0] != count - 1 or rows.shape[2] != scene.width:
            raise ValueError("steps need a state at every time, and rows between them")
        self.asked, scene = scene, scene.at_once(MECHC_PART_DRIVER)
        self.piece = mechc_piece_make(&p[0] if p.shape[0] else NULL, p.shape[0], 0, 0)
        if self.piece == NULL:
            raise MemoryError()
        record = &self.piece.own
        record.count, record.width, record.dense_rows = count, scene.width, rows.shape[1]
        copy_numbers(&record.t, &t[0], count)
        copy_numbers(&record.y, &y[0, 0], count * scene.width)
        copy_numbers(&record.dense, &rows[0, 0, 0] if count > 1 else NULL, (count - 1) * block)
        record.methods = <unsigned char *>malloc(count)
        if record.methods == NULL:
            raise MemoryError()
        memset(record.methods, MECHC_DOP853, count)
        self.piece.steps = record
        self.read(scene, np.asarray(p), inputs, None, None)

    def __dealloc__(self):
        mechc_piece_leave(self.piece)

    cdef read(self, Scene scene, p, Inputs inputs, Events events, Sizes sizes):
        """Read steps of a scene with parameters p (np,); ``events``, ``sizes``: of those in contact."""
        self.scene, self.unit, self.stack = scene, scene.unit, scene.stack
        if self.asked is None:
            self.asked = scene
        self.coordinates, self.width = scene.coordinates, scene.width
        self.p, self.inputs, self.events, self.sizes = p, inputs, events, sizes

    def read_by(self, Scene scene, Inputs inputs):
        """These steps, read by the functions of another scene of the same mechanism."""
        cdef Steps found = steps_of(
            scene.at_once(MECHC_PART_DRIVER), self.piece, self.p, inputs, self.events, self.sizes
        )
        found.asked = scene
        return found

    def states(self):
        """Accepted times (nt,) and states (nt, width), copied."""
        cdef const mechc_trajectory *record = self.piece.steps
        return array_of(record.t, record.count), table_of(record.y, record.count, self.width)

    def methods(self):
        """The number of the method of each accepted step, where dense output was kept."""
        cdef const mechc_trajectory *record = self.piece.steps
        cdef ptrdiff_t steps = max(record.count - 1, 0), i
        found = np.empty(steps, np.uint8)
        cdef unsigned char[::1] view = found
        if record.methods == NULL and steps:
            raise ValueError("this run kept no dense output")
        for i in range(steps):
            view[i] = record.methods[i]
        return found

    def rows(self):
        """Rows of the dense output of each accepted step (steps, rows, width), copied."""
        cdef const mechc_trajectory *record = self.piece.steps
        cdef ptrdiff_t steps = max(record.count - 1, 0)
        shape = (steps, record.dense_rows, self.width)
        return array_of(record.dense, steps * record.dense_rows * self.width).reshape(shape)

    def tail(self, ptrdiff_t count):
        """The last accepted times and states, at most so many, copied."""
        cdef const mechc_trajectory *record = self.piece.steps
        cdef ptrdiff_t some = min(count, record.count), first = record.count - some
        return array_of(record.t + first, some), table_of(record.y + first * self.width, some, self.width)

    @property
    def span(self):
        """The first and the last accepted time, s."""
        cdef const mechc_trajectory *record = self.piece.steps
        if record.count == 0:
            return np.nan, np.nan
        return record.t[0], record.t[record.count - 1]

    def ends(self):
        """The first and the last accepted time (2,) and state (2, width), copied."""
        cdef const mechc_trajectory *record = self.piece.steps
        cdef ptrdiff_t last = record.count - 1, i
        if last < 0:  # without memory not even the start was kept
            return np.full(2, np.nan), np.full((2, self.width), np.nan)
        t, y = np.array([record.t[0], record.t[last]]), np.empty((2, self.width))
        cdef double[:, ::1] states = y
        memcpy(&states[0, 0], record.y, self.width * sizeof(double))
        memcpy(&states[1, 0], record.y + last * self.width, self.width * sizeof(double))
        return t, y

    def largest(self, tuple which):
        """The largest magnitude of these components in the first and the last accepted state."""
        cdef const mechc_trajectory *record = self.piece.steps
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
        return self.piece.steps.crossing_count

    @property
    def count(self):
        """Number of accepted states, the start included."""
        return self.piece.steps.count

    def times(self, ptrdiff_t first):
        """Accepted times from the index `first` on, copied."""
        cdef const mechc_trajectory *record = self.piece.steps
        return array_of(record.t + first, max(record.count - first, 0))

    def change_points(self):
        """Change points crossed: times (n,), configurations (n, coordinates), closure gaps (n,).

        A gap that is not 0 was within rounding of it.
        """
        cdef const mechc_trajectory *record = self.piece.steps
        rows = table_of(record.crossings, record.crossing_count, self.coordinates + 2)
        return rows[:, 0].copy(), rows[:, 2:].copy(), rows[:, 1].copy()

    def interpolate(self, const double[::1] t):
        """Dense output at the times t, projected onto the constraints: (len(t), width)."""
        out = np.empty((t.shape[0], self.width))
        cdef double[:, ::1] view = out
        cdef double[::1] p = self.p
        cdef const double *parameters = &p[0] if p.shape[0] else NULL
        cdef interpolation job
        if not t.shape[0]:
            return out
        if self.piece.contacts and mechc_piece_in_contact(self.piece):
            self.read_contact(t, NULL, &view[0, 0])
            return out
        job.unit, job.trajectory = self.unit, self.piece.steps
        job.p, job.left, job.piece = parameters, t.shape[0], 1
        job.inputs = address_of(self.inputs)
        job.t, job.out, job.width = &t[0], &view[0, 0], self.width
        while job.left:
            with_stack((<Scene>self.scene).stack_here(), interpolate_a_while, &job)
            PyErr_CheckSignals()
        return out

    def forces(self, const double[::1] t, const double[:, ::1] y):
        """The generalized forces (nt, nu) of the contacts that last, at states (nt, width) of the piece.

        NaN where laws of contacts are not known, as of steps from a file.
        """
        cdef Scene scene = self.scene
        found = np.full((t.shape[0], scene.speeds), np.nan)
        cdef double[:, ::1] view = found
        if y.shape[0] != t.shape[0] or y.shape[1] != self.width:
            raise ValueError("a state is needed at every time")
        if t.shape[0] and mechc_piece_in_contact(self.piece):
            self.read_contact(t, &y[0, 0], &view[0, 0])
        elif self.piece.contacts:
            found[:] = 0.0
        return found

    cdef read_contact(self, const double[::1] t, const double *y, double *out):
        """Read states on the constraints of the contacts, or the forces at states ``y``."""
        cdef contact_reading job
        cdef Scene scene = self.scene
        memset(&job.motion, 0, sizeof(job.motion))
        job.motion.unit, job.motion.inputs = self.unit, address_of(self.inputs)
        job.motion.coordinates, job.motion.speeds = scene.coordinates, scene.speeds
        job.motion.rows, job.motion.parameters = scene.rows, scene.parameters
        job.motion.sizes = self.sizes.sizes
        job.laws, job.piece = &self.events.laws, self.piece
        job.count, job.t, job.y, job.out = t.shape[0], &t[0], y, out
        with_stack((<Scene>self.scene).stack_here(), read_in_contact, &job)
        if not job.made:
            raise MemoryError()

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
        cdef const mechc_trajectory *record = self.piece.steps
        cdef int k = start.shape[1]
        cdef ptrdiff_t steps = last - first, done = 0
        cdef Scene by = self.differentiated_by(steps * k)
        if by.unit.vary == NULL or record.methods == NULL:
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
        variation.trajectory = record
        variation.p = &p[0] if p.shape[0] else NULL
        variation.inputs = address_of(self.inputs)
        variation.columns, variation.restart = k, restart
        variation.directions = &directions[0, 0] if directions.shape[0] else NULL
        variation.shapes = shapes_of(shapes)
        while done < steps or project:
            variation.project, project = project, False
            variation.first = first + done
            variation.last = min(last, variation.first + self.at_once(k))
            variation.ends = &columns[done, 0, 0]
            variation.rates = &slopes[done, 0, 0, 0] if rates else NULL
            if restart:
                ends[done] = start
            self.differentiate(by, vary_steps, &variation)
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
        cdef Scene by = self.differentiated_by(count)
        if by.unit.project_columns == NULL:
            raise ValueError("this run or its scene has no derivatives")
        if y.shape[0] != count or y.shape[1] != self.width or columns.shape[0] != count \
                or columns.shape[1] != self.width or directions.shape[1] != k \
                or directions.shape[0] != self.p.shape[0] + self.scene.inputs:
            raise ValueError("arrays of another shape")
        if not count or not k:
            return
        cdef double[::1] p = self.p
        cdef mechc_projected_columns given
        given.trajectory, given.p = self.piece.steps, &p[0] if p.shape[0] else NULL
        given.inputs = address_of(self.inputs)
        given.count = k
        given.directions = &directions[0, 0] if directions.shape[0] else NULL
        given.shapes = shapes_of(shapes)
        while done < count:
            given.states = min(count - done, self.at_once(k))
            given.t, given.y = &t[done], &y[done, 0]
            given.columns = &columns[done, 0, 0]
            self.differentiate(by, project_at_states, &given)
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
        cdef const mechc_trajectory *record = self.piece.steps
        cdef ptrdiff_t left = last
        cdef Scene by = self.differentiated_by(last - first)
        if by.unit.covary == NULL or record.methods == NULL:
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
        covariation.trajectory, covariation.p = record, &p[0] if p.shape[0] else NULL
        covariation.inputs = address_of(self.inputs)
        covariation.covector, covariation.gradient = &moving[0], &total[0]
        covariation.sources, covariation.columns = NULL, columns
        covariation.shapes = shapes_of(shapes)
        if sources is not None:
            added = sources
        while left > first:
            covariation.last = left
            left = max(first, (left - 1) // self.at_once(columns) * self.at_once(columns))
            covariation.first = left
            if sources is not None:
                covariation.sources = &added[left - first, 0]
            self.differentiate(by, covary_steps, &covariation)
        return at, gradient[:columns]

    cdef Scene differentiated_by(self, ptrdiff_t work):
        """The scene by whose functions so many derivatives of steps are taken now."""
        cdef Scene by = (<Scene>self.asked).at_once(MECHC_PART_DERIVATIVES)
        if by.by_general:
            by.worked += STAGES * work
        return by

    cdef differentiate(self, Scene by, void (*work)(void *) noexcept nogil, void *asked):
        """Ask a unit for derivatives of some steps."""
        cdef differentiating job
        job.unit, job.asked = by.unit, asked
        cdef size_t stack = max(self.stack, LONG_STACK) if self.stack else 0
        with_stack(by.stack_of_derivatives() if by.by_general else stack, work, &job)
        PyErr_CheckSignals()
        if job.status == MECHC_MEMORY_LIMIT:
            raise MemoryError()
        if job.status != MECHC_RUNNING:
            raise ArithmeticError("a step's variational equations are singular")

    cdef ptrdiff_t at_once(self, int columns):
        """Steps between checks of signals."""
        return max(8, (1 << 22) // (self.width * self.width * (self.width + columns)) // 8 * 8)


cdef Steps steps_of(Scene scene, mechc_piece *piece, p, Inputs inputs, Events events, Sizes sizes):
    """The steps of a piece of a motion."""
    cdef Steps steps = Steps.__new__(Steps)
    steps.piece = mechc_piece_share(piece)
    steps.read(scene, p, inputs, events, sizes)
    return steps
