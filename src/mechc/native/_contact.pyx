# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The equations of motion with what contacts do, at states that are put onto these contacts."""

import numpy as np

from libc.string cimport memcpy

from mechc.native._abi cimport (
    MECHC_PART_DRIVER, MECHC_PART_OUTPUTS, MECHC_RUNNING, mechc_given, mechc_unit
)
from mechc.native._driver cimport Scene
from mechc.native._events cimport EventFunctions
from mechc.native._inputs cimport Inputs, address_of, array_of, mechc_inputs
from mechc.native._pieces cimport with_stack


cdef extern from "events/functions.h":
    ctypedef struct mechc_event_functions:
        void (*reset)(double, const double *, const double *, double *) noexcept nogil

    ctypedef struct mechc_event_unit:
        const mechc_event_functions *functions

cdef extern from "events/contact.h":
    int MECHC_LAWS, MECHC_NO_LAW, MECHC_NO_MASS

    ctypedef struct mechc_contact_mode:
        const unsigned char *closed
        const unsigned char *stuck
        const double *way

    ctypedef struct mechc_contact:
        const mechc_unit *unit
        const double *p
        const double *scale
        const mechc_inputs *inputs
        const unsigned char *has_gap
        int (*laws)(void *, double, const double *, const double *, double *) noexcept nogil
        void *context
        int contacts, coordinates, speeds, rows, columns, plain, mass, jacobian, failed
        double t
        double *y
        double *v
        double *table
        double *root
        double *normal
        double *tangent
        double *kinematic
        double *loops
        double *free
        double *opening
        double *slipping
        double *rates
        void *prepared

    int mechc_contact_make(mechc_contact *) nogil
    void mechc_contact_free(mechc_contact *) nogil
    int mechc_contact_place(mechc_contact *) nogil
    void mechc_contact_set_free(mechc_contact *) nogil
    int mechc_contact_settle(mechc_contact *, const mechc_contact_mode *) nogil


NO_LAW, NO_MASS = MECHC_NO_LAW, MECHC_NO_MASS


ctypedef struct placing:
    mechc_contact *contact
    int status

ctypedef struct settling:
    mechc_contact *contact
    mechc_contact_mode mode
    ptrdiff_t count
    const double *t
    double *y
    double *rates
    double *loops
    double *masses
    int *status


cdef void find_place(void *given) noexcept nogil:
    cdef placing *job = <placing *>given
    job.status = mechc_contact_place(job.contact)
    if job.status == MECHC_RUNNING:
        mechc_contact_set_free(job.contact)


cdef void settle_states(void *given) noexcept nogil:
    cdef settling *job = <settling *>given
    cdef mechc_contact *c = job.contact
    cdef ptrdiff_t width = c.coordinates + c.speeds, of_loops = c.rows * c.speeds, k
    cdef int i, j
    for k in range(job.count):
        c.t = job.t[k]
        memcpy(c.y, job.y + k * width, width * sizeof(double))
        job.status[k] = mechc_contact_settle(c, &job.mode)
        if job.status[k] == MECHC_NO_LAW:
            return
        memcpy(job.y + k * width, c.y, width * sizeof(double))
        memcpy(job.rates + k * width, c.rates, width * sizeof(double))
        memcpy(job.loops + k * of_loops, c.loops, of_loops * sizeof(double))
        for i in range(c.speeds):
            job.masses[k * c.speeds + i] = 0.0
            for j in range(i + 1):
                job.masses[k * c.speeds + i] += c.root[i * c.speeds + j] * c.root[i * c.speeds + j]


cdef int compiled_laws(
    void *functions, double t, const double *state, const double *p, double *table
) noexcept nogil:
    (<const mechc_event_functions *>functions).reset(t, state, p, table)
    return 1


cdef int laws_of_python(
    void *given, double t, const double *state, const double *p, double *table
) noexcept with gil:
    cdef ContactEquations equations = <ContactEquations>given
    cdef mechc_contact *c = &equations.contact
    cdef const double[:, ::1] values
    try:
        values = np.ascontiguousarray(
            equations.laws(t, array_of(state, 2 * c.coordinates + c.speeds))
        )
        memcpy(table, &values[0, 0], c.contacts * c.columns * sizeof(double))
        return 1
    except BaseException as error:
        equations.failure = error
        return 0


cdef object lower(const double *root, ptrdiff_t n):
    """A lower triangle, whose other half is anything."""
    out = np.zeros((n, n))
    cdef double[:, ::1] numbers = out
    cdef ptrdiff_t i
    for i in range(n):
        memcpy(&numbers[i, 0], root + i * n, (i + 1) * sizeof(double))
    return out


cdef class ContactEquations:
    """M u' + J^T lambda = F + W^T f of a scene with parameters p (np,) and its contacts.

    laws
        The quantities of n contacts (``events/contact.h``): a compiled function, what the reset of
        its one event assigns, or one of Python of t and (q, u, q').
    has_gap : (n,)
        Which are not always in contact.
    scale : (nq + nu,)
        The size of each component.
    plain
        Whether q' = u.
    inputs
        Where the scene has inputs.

    Attributes
    ----------
    failed
        The contact whose quantities were not finite at last, -1: none.
    failure
        The exception of the function of Python, or None.
    """

    cdef mechc_contact contact
    cdef object kept, laws
    cdef size_t stack
    cdef public object failure

    def __init__(self, Scene scene, laws, const unsigned char[::1] has_gap, const double[::1] p,
                 const double[::1] scale, bint plain, Inputs inputs=None):
        cdef mechc_contact *c = &self.contact
        if p.shape[0] != scene.parameters or scale.shape[0] != scene.width:
            raise ValueError("wrong number of parameters or scales")
        self.kept, self.laws, self.stack = (scene, p, scale, has_gap, inputs), laws, scene.stack
        scene.need(MECHC_PART_DRIVER | MECHC_PART_OUTPUTS)
        c.unit, c.inputs, c.plain = scene.unit, address_of(inputs), plain
        c.p = &p[0] if p.shape[0] else NULL
        c.scale, c.has_gap, c.contacts = &scale[0], &has_gap[0], has_gap.shape[0]
        c.coordinates, c.speeds, c.rows = scene.coordinates, scene.speeds, scene.rows
        c.columns, c.failed = MECHC_LAWS + scene.coordinates + scene.speeds, -1
        c.mass = scene.indices["mass_matrix"]
        c.jacobian = scene.indices["constraint_jacobian"] if scene.rows else -1
        if isinstance(laws, EventFunctions):
            c.laws = compiled_laws
            c.context = <void *>(<const mechc_event_unit *>(<EventFunctions>laws).unit).functions
        else:
            c.laws, c.context = laws_of_python, <void *>self
        if not mechc_contact_make(c):
            raise MemoryError()
        c.unit.give(c.p, c.inputs, <mechc_given *>c.prepared)

    def __dealloc__(self):
        mechc_contact_free(&self.contact)

    @property
    def failed(self):
        return self.contact.failed

    def place(self, double t, const double[::1] y):
        """At one state: (status, quantities (n, 8 + nq + nu), q' (nq,), L (nu, nu), rows R of gaps and
        slips (n, nu) each, N (nq, nu), J (nc, nu), rates without contacts (nq + nu,), accelerations
        without forces of gaps and slips (n,) each)."""
        cdef mechc_contact *c = &self.contact
        cdef placing job
        cdef ptrdiff_t n = c.contacts, nq = c.coordinates, nu = c.speeds
        c.t = t
        memcpy(c.y, &y[0], (nq + nu) * sizeof(double))
        job.contact = c
        with_stack(self.stack, find_place, &job)
        return (
            job.status, array_of(c.table, n * c.columns).reshape(n, c.columns),
            array_of(c.v, nq), lower(c.root, nu), array_of(c.normal, n * nu).reshape(n, nu),
            array_of(c.tangent, n * nu).reshape(n, nu),
            array_of(c.kinematic, nq * nu).reshape(nq, nu),
            array_of(c.loops, c.rows * nu).reshape(c.rows, nu), array_of(c.free, nq + nu),
            array_of(c.opening, n), array_of(c.slipping, n),
        )

    def settle(self, const double[::1] t, y, const unsigned char[::1] closed,
               const unsigned char[::1] stuck, const double[::1] way):
        """States (m, nq + nu) at times (m,) moved onto the constraints of a mode, of each contact
        whether its gap is kept, whether it sticks, and 1 or -1 where it slides.

        Returns (status (m,), states, rates (m, nq + nu), J (m, nc, nu), the diagonals of M (m, nu)).
        """
        cdef mechc_contact *c = &self.contact
        cdef ptrdiff_t m = t.shape[0], width = c.coordinates + c.speeds
        moved, rates = np.array(y), np.zeros((m, width))
        loops, masses = np.zeros((m, c.rows, c.speeds)), np.zeros((m, c.speeds))
        status = np.zeros(m, np.intc)
        cdef double[:, ::1] states = moved, of_rates = rates, of_masses = masses
        cdef double[:, :, ::1] of_loops = loops
        cdef int[::1] codes = status
        cdef settling job
        if not m:
            return status, moved, rates, loops, masses
        job.contact, job.count, job.t, job.y, job.rates = c, m, &t[0], &states[0, 0], &of_rates[0, 0]
        job.loops = &of_loops[0, 0, 0] if c.rows else NULL
        job.masses, job.status = &of_masses[0, 0], &codes[0]
        job.mode.closed, job.mode.stuck, job.mode.way = &closed[0], &stuck[0], &way[0]
        with_stack(self.stack, settle_states, &job)
        return status, moved, rates, loops, masses
