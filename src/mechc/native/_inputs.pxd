"""Inputs of runs, for the other extensions."""

cdef extern from "abi/signals.h":
    ctypedef struct mechc_inputs:
        void (*evaluate)(
            const mechc_inputs *, int, int, double, const double *, const double *, double *
        ) noexcept nogil
        int needs_state

    ctypedef struct mechc_signal:
        ptrdiff_t last
        int degree
        const double *knots
        const double *coefficients

    ctypedef struct mechc_source:
        const mechc_signal *signal
        int order

    ctypedef struct mechc_driven:
        mechc_inputs head
        const mechc_source *sources
        void *caller
        double (*call)(void *, int, double, const double *, const double *) noexcept nogil

    void mechc_driven_evaluate(
        const mechc_inputs *, int, int, double, const double *, const double *, double *
    ) noexcept nogil


cdef extern from "abi/variation.h":
    ctypedef struct mechc_shapes:
        int count
        const int *places
        const int *columns
        const mechc_inputs *factors


cdef object array_of(const double *numbers, ptrdiff_t count)


cdef class Caller:
    cdef list functions
    cdef int coordinates, speeds
    cdef public object failure
    cdef readonly long calls
    cdef readonly double seconds
    cdef readonly bint takes_state
    cdef set repeated  # functions that were called twice with the same arguments

    cdef double call(self, int which, double t, const double *q, const double *u) except? -1
    cdef double checked(self, int which, double t, const double *q, const double *u) except? -1
    cdef double value(self, int which, double t, const double *q, const double *u)


cdef class Inputs:
    cdef mechc_driven driven
    cdef mechc_signal *signals
    cdef mechc_source *sources
    cdef ptrdiff_t *knots  # how many each signal has
    cdef object arrays
    cdef int signal_count, source_count
    cdef readonly Caller caller


cdef class Shapes:
    cdef mechc_shapes shapes
    cdef object references
    cdef readonly int columns


cdef inline const mechc_shapes *shapes_of(Shapes shapes) noexcept:
    return NULL if shapes is None else &shapes.shapes


cdef inline const mechc_inputs *address_of(Inputs inputs) noexcept:
    return NULL if inputs is None else &inputs.driven.head
