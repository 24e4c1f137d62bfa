# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The closer of loops: configurations and speeds that keep the constraints of a scene.

Its C code asks compiled outputs directly.
"""

import numpy as np

from cpython.exc cimport PyErr_CheckSignals
from libc.math cimport NAN
from libc.string cimport memset

from mechc.native._abi cimport mechc_inputs, mechc_unit
from mechc.native._driver cimport Scene
from mechc.native._inputs cimport Inputs, address_of
from mechc.native._pieces cimport LOOK, stack_for, with_stack, working


cdef extern from "closing/closure.h":
    const double MECHC_ALIGNED

    ctypedef struct mechc_closure:
        const mechc_unit *unit
        const mechc_inputs *inputs
        int rows, columns, coordinates, width, parameters
        const unsigned char *kind
        const int *alike
        int *output
        int *breadth
        double t

    void mechc_close_with_lengths(mechc_closure *, int, const int *) noexcept


cdef extern from "closing/search.h":
    ctypedef struct mechc_closing:
        mechc_closure closure
        int unknowns, only_near, all, tells_miss, most, enough, stop
        ptrdiff_t starts, near, count, block, done
        const int *unknown
        const unsigned char *guessed
        const double *start
        const double *fixed
        const double *p
        const double *length
        double *found
        int *many
        double *miss
        double *open

    ctypedef struct mechc_closer:
        pass

    mechc_closer *mechc_closer_make(const mechc_closing *) noexcept nogil
    void mechc_closer_free(mechc_closer *) noexcept nogil
    int mechc_close_go_on(mechc_closing *, mechc_closer *, double) noexcept nogil


cdef extern from "closing/measure.h":
    ctypedef struct mechc_measure:
        const mechc_closure *closure
        double length, size
        double *weight

    int mechc_measure_make(
        mechc_measure *, const mechc_closure *, int, const int *
    ) noexcept nogil
    void mechc_measure_free(mechc_measure *) noexcept nogil
    void mechc_measure_member(
        mechc_measure *, const double *, const double *, double
    ) noexcept nogil


cdef extern from "closing/speeds.h":
    ctypedef struct mechc_speeds_job:
        mechc_closure closure
        int rows, speeds, unknowns, stop
        const int *unknown
        double dead
        ptrdiff_t count, p_stride
        const double *p
        const double *weight
        const double *step
        double *y
        double *left
        int *row
        double *residual
        double *conditioning

    int mechc_speeds_work(mechc_speeds_job *) noexcept nogil


cdef extern from "closing/follow.h":
    ctypedef struct mechc_following:
        mechc_closure closure
        int driven, unknowns, most, stop
        const int *unknown
        ptrdiff_t count, values
        const double *value
        const double *p
        const double *length
        double *q
        double *ratio
        double *change_point
        int *passed
        double *end

    int mechc_follow_work(mechc_following *) noexcept nogil


ALIGNED = MECHC_ALIGNED  # the least product of axes that point the same way


ctypedef struct searching:
    mechc_closing *job
    mechc_closer *closer
    int more

ctypedef struct measuring:
    mechc_measure *measure
    ptrdiff_t count, p_stride
    const double *q
    const double *p
    const double *hint
    double *length
    double *rows


cdef void measure_members(void *given) noexcept nogil:
    cdef measuring *work = <measuring *>given
    cdef mechc_measure *one = work.measure
    cdef ptrdiff_t k, i
    cdef int rows = one.closure.rows
    for k in range(work.count):
        mechc_measure_member(one, work.q, work.p + k * work.p_stride, work.hint[k])
        work.length[k] = one.length
        for i in range(rows):
            work.rows[k * rows + i] = one.size / one.weight[i]


cdef void follow(void *given) noexcept nogil:
    cdef working *work = <working *>given
    work.made = mechc_follow_work(<mechc_following *>work.job)


cdef void search_a_while(void *given) noexcept nogil:
    cdef searching *search = <searching *>given
    search.more = mechc_close_go_on(search.job, search.closer, LOOK)


cdef void find_speeds(void *given) noexcept nogil:
    cdef working *work = <working *>given
    work.made = mechc_speeds_work(<mechc_speeds_job *>work.job)


cdef class Closure:
    """The constraints of a scene.

    ``kind`` (nq,): 0 for a translation, 1 for an angle, 2 for a number (None: translations);
    ``alike`` (nh,): the first row that is known to have the same unit (None: no two are);
    ``quaternions`` (n, 4): places of their components, whose length is one.
    """

    cdef mechc_closure closure
    cdef Scene scene
    cdef Inputs inputs
    cdef readonly int holonomic, rows, speeds
    cdef const unsigned char[::1] kind
    cdef const int[::1] alike
    cdef object quaternions

    cdef size_t stack(self):
        """Bytes of a separate stack for the calling thread; 0: its own suffices."""
        return max(self.scene.stack, self.scene.stack_beyond(1))

    def __init__(self, Scene scene, Inputs inputs=None, kind=None, alike=None, quaternions=()):
        cdef mechc_closure *closure = &self.closure
        self.scene, self.inputs = scene, inputs
        self.holonomic, self.rows, self.speeds = scene.holonomic, scene.rows, scene.speeds
        closure.coordinates, closure.width = scene.coordinates, scene.width
        closure.parameters = scene.parameters
        closure.unit, closure.inputs = scene.unit, address_of(inputs)
        self.kind = np.zeros(scene.coordinates, np.uint8) if kind is None else kind
        self.alike = np.arange(self.holonomic, dtype=np.intc) if alike is None else alike
        self.quaternions = np.array(quaternions, np.intc).reshape(-1, 4)
        self.check_rows()
        whole = "constraint_gradient" in scene.indices
        closure.rows, closure.columns = self.holonomic, closure.coordinates if whole else self.speeds
        closure.kind, closure.alike = &self.kind[0], &self.alike[0]
        names = (
            "constraints", "constraint_gradient" if whole else "constraint_jacobian",
            "velocity_constraints", "constraint_jacobian", "preference", "cut_directions",
        )
        for what, name in enumerate(names):
            closure.output[what] = scene.indices.get(name, -1)
            closure.breadth[what] = scene.outputs.get(name, 0)

    cdef object let_lengths_count(self, mechc_closure *closure, const int[::1] unknown):
        """Add rows for quaternions that may move; what C points into has to be kept."""
        movable = np.isin(self.quaternions, unknown).all(axis=1)
        cdef int[:, ::1] component = np.ascontiguousarray(self.quaternions[movable])
        cdef int[::1] alike
        if not component.shape[0]:
            return None
        alike = np.append(self.alike, np.arange(self.holonomic, self.holonomic + len(component))
                          ).astype(np.intc)
        closure.alike = &alike[0]
        mechc_close_with_lengths(closure, component.shape[0], &component[0, 0])
        return alike, component

    cdef int check_rows(self) except -1:
        cdef ptrdiff_t row
        if self.quaternions.size and not 0 <= self.quaternions.min() <= self.quaternions.max() \
                < self.closure.coordinates:
            raise ValueError("a quaternion has four coordinates")
        if self.kind.shape[0] != self.closure.coordinates or self.alike.shape[0] != self.holonomic:
            raise ValueError("wrong number of coordinates or rows")
        for row in range(self.holonomic):
            if not 0 <= self.alike[row] <= row or self.alike[self.alike[row]] != self.alike[row]:
                raise ValueError("a row is alike to the first one of its unit")
        return 0

    def keep_speeds(self, double t, const double[:, ::1] y, const double[:, ::1] p,
                    const int[::1] unknown, double dead, const double[:, ::1] weight=None,
                    const double[:, ::1] step=None):
        """States (n, width) with the nearest speeds that keep the constraints, p (n or 1, np).

        The speeds at the places ``unknown`` may change; ``dead``: below it, relative singular
        values count as zero; ``weight`` (as p, rows): by which rows are multiplied, and ``step``
        (as p, nu): units of the speeds (None: 1).  Returns states, what is left of the residuals relative to the size of
        J and of the speeds (n,), the row that has it (n,), its size per second (n,), and the least
        singular value of J relative to the largest (n,).
        """
        cdef mechc_speeds_job job
        cdef working work
        cdef ptrdiff_t count = y.shape[0]
        out, left, size = np.array(y), np.empty(count), np.empty(count)
        row, conditions = np.empty(count, np.intc), np.empty(count)
        cdef double[:, ::1] states = out
        cdef double[::1] remains = left, sizes = size, weakest = conditions
        cdef int[::1] rows = row
        if y.shape[1] != self.closure.width or p.shape[1] != self.closure.parameters:
            raise ValueError("wrong number of state components or parameters")
        if p.shape[0] not in (1, count):
            raise ValueError("parameters must be given once or once a state")
        if not count:
            return out, left, row, size, conditions
        job.closure, job.rows, job.speeds = self.closure, self.rows, self.speeds
        job.closure.t = t
        job.unknowns, job.dead, job.count = unknown.shape[0], dead, count
        job.unknown = &unknown[0] if unknown.shape[0] else NULL
        job.p = &p[0, 0] if p.shape[1] else NULL
        job.p_stride = p.shape[1] if p.shape[0] > 1 else 0
        job.weight = job.step = NULL
        if weight is not None and step is not None:
            if weight.shape[0] != p.shape[0] or step.shape[0] != p.shape[0]:
                raise ValueError("weights and units must be given as often as parameters")
            if weight.shape[1] != self.rows or step.shape[1] != self.speeds:
                raise ValueError("wrong number of weights or units")
            job.weight, job.step = &weight[0, 0], &step[0, 0]
        job.y, job.left, job.row, job.residual = &states[0, 0], &remains[0], &rows[0], &sizes[0]
        job.conditioning, job.stop = &weakest[0], 0
        work.job = &job
        with_stack(stack_for(self.stack(), count), find_speeds, &work, &job.stop)
        if not work.made:
            raise MemoryError()
        return out, left, row, size, conditions


cdef class Closings:
    """Closed configurations of members with coordinates ``fixed`` (n, nq), of the unknowns a guess.

    ``start`` (starts, unknowns) within -1 ... 1: where the search begins, of half a turn or of the
    mechanism's length; ``length`` (n,): where the search for it begins; ``guessed``: which unknowns are (None: none), ``near``: how many starts are at
    the guess, ``only_near``: whether there are no others.  ``most`` configurations are kept.  The
    search ends after ``enough`` of them (0: of any number), and where hardly more are to be
    expected unless ``all`` starts are wanted.

    After the work: ``found`` (n, most, nq), the nearest to the guess or the preferred one first,
    ``many`` (n,), ``miss`` (n,), the least gap met, of all rows as they are, and ``open`` (n, nq),
    where it was met, NaN where something was found.
    """

    cdef mechc_closing job
    cdef Closure closure
    cdef object references  # arrays that C points into
    cdef readonly object found, many, miss, open

    def __init__(self, Closure closure, double t, const int[::1] unknown,
                 const double[:, ::1] start, const double[:, ::1] fixed, const double[:, ::1] p, const double[::1] length, int most, *, const unsigned char[::1] guessed=None,
                 ptrdiff_t near=1, bint only_near=False, bint all=False, int enough=0, bint tells_miss=True,
                 ptrdiff_t block=1):
        cdef mechc_closing *job = &self.job
        cdef ptrdiff_t count = fixed.shape[0], unknowns = unknown.shape[0]
        cdef double[:, :, ::1] found
        cdef int[::1] many
        cdef double[::1] miss
        cdef double[:, ::1] opened
        job.closure = closure.closure
        job.closure.t = t
        if fixed.shape[1] != job.closure.coordinates or p.shape[1] != job.closure.parameters:
            raise ValueError("wrong number of coordinates or parameters")
        if p.shape[0] != count or length.shape[0] != count or not count:
            raise ValueError("a row of coordinates, parameters and a length for every member")
        if start.shape[1] != unknowns or not unknowns:
            raise ValueError("wrong number of unknowns")
        if not 0 < near <= start.shape[0] or most < 1 or not closure.holonomic:
            raise ValueError("nothing to search for or to keep")
        self.closure = closure
        self.references = [unknown, start, fixed, p, length, guessed,
                           closure.let_lengths_count(&job.closure, unknown)]
        found = self.found = np.empty((count, most, fixed.shape[1]))
        many = self.many = np.zeros(count, np.intc)
        miss = self.miss = np.empty(count)
        opened = self.open = np.empty((count, fixed.shape[1]))
        found[...], miss[...] = NAN, NAN
        job.unknowns, job.unknown = unknowns, &unknown[0]
        if guessed is not None:
            if guessed.shape[0] != unknowns:
                raise ValueError("wrong number of unknowns")
            job.guessed = &guessed[0]
        job.starts, job.near, job.only_near = start.shape[0], near, only_near
        job.start, job.count, job.block = &start[0, 0], count, max(block, 1)
        job.fixed, job.length = &fixed[0, 0], &length[0]
        job.p = &p[0, 0] if job.closure.parameters else NULL
        job.all, job.most, job.enough, job.tells_miss = all, most, enough, tells_miss
        job.found, job.many, job.miss = &found[0, 0, 0], &many[0], &miss[0]
        job.open = &opened[0, 0]

    @property
    def done(self):
        """Members finished so far."""
        return self.job.done

    def work(self):
        """Take members until none is left; any number of threads may at once.

        A pending signal (Ctrl-C) is raised as its handler says.
        """
        cdef searching search
        search.job, search.closer = &self.job, mechc_closer_make(&self.job)
        if search.closer == NULL:
            raise MemoryError()
        search.more = 1
        try:
            while search.more:
                with_stack(self.closure.stack(), search_a_while, &search)
                PyErr_CheckSignals()
        finally:
            mechc_closer_free(search.closer)

    def stop(self):
        """Ask every thread to return."""
        self.job.stop = 1


def measure(Closure closure, double t, const int[::1] unknown, const double[::1] q,
            const double[:, ::1] p, const double[::1] hint):
    """The sizes that coordinates and rows of members are compared with, see ``closing/measure.h``.

    ``unknown``: coordinates that may move, the others are those of q (nq,).  Returns the lengths
    (n,) of a step of a coordinate that is neither angle nor number, and (n, rows) what such steps
    of the unknowns change each row by; rows that are alike have the same size.
    """
    cdef mechc_measure one
    cdef mechc_closure asked = closure.closure
    cdef measuring work
    cdef double[::1] lengths = np.empty(hint.shape[0])
    cdef double[:, ::1] rows = np.empty((hint.shape[0], closure.holonomic))
    asked.t = t
    if (q.shape[0], p.shape[0], p.shape[1]) != (asked.coordinates, len(hint), asked.parameters):
        raise ValueError("wrong number of coordinates or parameters")
    if not unknown.shape[0] or not closure.holonomic or not hint.shape[0]:
        raise ValueError("nothing to measure")
    if not mechc_measure_make(&one, &asked, unknown.shape[0], &unknown[0]):
        raise MemoryError()
    work.measure, work.count, work.p_stride = &one, hint.shape[0], p.shape[1]
    work.q, work.p, work.hint = &q[0], &p[0, 0] if p.shape[1] else NULL, &hint[0]
    work.length, work.rows = &lengths[0], &rows[0, 0]
    with_stack(closure.stack(), measure_members, &work)
    mechc_measure_free(&one)
    return np.asarray(lengths), np.asarray(rows)


def trace_assemblies(Closure closure, double t, int driven, const int[::1] unknown,
                     const double[::1] value, double[:, :, ::1] q, const double[:, ::1] p,
                     const double[::1] length, int most):
    """One assembly of every member, followed through the values of a coordinate.

    ``q`` (n, values, nq): the
    first configuration of every member, closed; the others are written to it, NaN beyond the
    assembly's end.  Returns their derivatives by the driven coordinate (n, values, nq), the change
    points passed (n, most), how many (n,), and where the assembly ends (n,), NaN where it does not.
    """
    cdef mechc_following job
    cdef working work
    cdef ptrdiff_t count = q.shape[0], unknowns = unknown.shape[0]
    ratio, ends = np.full((count, q.shape[1], q.shape[2]), np.nan), np.full(count, np.nan)
    change_points, passed = np.full((count, most), np.nan), np.zeros(count, np.intc)
    cdef double[:, :, ::1] ratios = ratio
    cdef double[:, ::1] points = change_points
    cdef int[::1] passes = passed
    cdef double[::1] end = ends
    memset(&job, 0, sizeof(job))
    job.closure = closure.closure
    job.closure.t = t
    if q.shape[2] != job.closure.coordinates or p.shape[1] != job.closure.parameters:
        raise ValueError("wrong number of coordinates or parameters")
    if p.shape[0] != count or length.shape[0] != count or q.shape[1] != value.shape[0]:
        raise ValueError("a row of parameters, a length and a row of values for every member")
    cdef int[::1] places = np.append(unknown, np.intc(driven)).astype(np.intc)
    kept = closure.let_lengths_count(&job.closure, unknown)
    if not 0 < unknowns <= job.closure.rows or not count:
        raise ValueError("wrong number of unknowns")
    job.driven, job.unknowns, job.unknown = driven, unknowns, &places[0]
    job.count, job.values = count, value.shape[0]
    job.value, job.length, job.most = &value[0], &length[0], most
    job.p = &p[0, 0] if p.shape[1] else NULL
    job.q, job.ratio, job.end = &q[0, 0, 0], &ratios[0, 0, 0], &end[0]
    job.change_point, job.passed = &points[0, 0], &passes[0]
    work.job = &job
    with_stack(stack_for(closure.stack(), count * value.shape[0]), follow, &work, &job.stop)
    if not work.made:
        raise MemoryError()
    return ratio, change_points, passed, ends
