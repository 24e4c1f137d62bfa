# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The variational equations over many steps of one method, and the tableaus of explicit pairs."""

import numpy as np

from libc.stdlib cimport free, malloc


cdef extern from "methods/dormand_prince_tableaus.h":
    int MECHC_MOST_RATES

    ctypedef struct mechc_tableau:
        int stages, rates, dense_rows
        const double *nodes
        const double *matrix
        const double *dense

    const mechc_tableau mechc_dopri5_tableau, mechc_dop853_tableau

cdef extern from "variational/collocation.h":
    ctypedef struct mechc_collocation:
        int stages, states, columns, coordinates
        const double *nodes
        const double *first
        const double *second

    size_t mechc_collocation_work(const mechc_collocation *) nogil
    int mechc_collocate(
        const mechc_collocation *, double, const double *, const double *, const double *,
        double *, double *, double *
    ) nogil

cdef extern from "variational/explicit.h":
    ctypedef struct mechc_explicit:
        int rates, end, states, columns
        const double *matrix

    void mechc_onto(const double *, const double *, int, int, double *, double *) nogil
    void mechc_explicit_columns(
        const mechc_explicit *, double, const double *, const double *, const double *,
        const double *, const double *, double *, double *, double *
    ) nogil


cdef tuple _told(const mechc_tableau *tableau):
    cdef int i, j, rates = tableau.rates, extra = tableau.dense_rows - 3
    nodes = np.array([tableau.nodes[i] for i in range(rates)])
    matrix = np.zeros((rates, rates))
    for i in range(rates):
        for j in range(i):
            matrix[i, j] = tableau.matrix[i * MECHC_MOST_RATES + j]
    dense = [[tableau.dense[i * MECHC_MOST_RATES + j] for j in range(rates)] for i in range(extra)]
    return tableau.stages, nodes, matrix, np.array(dense)


# Method: the rate at the step's end, nodes, matrix (rates, rates), rows of the dense output.
PAIRS = {"dopri5": _told(&mechc_dopri5_tableau), "dop853": _told(&mechc_dop853_tableau)}


cdef double *_room(size_t doubles) except NULL:
    cdef double *found = <double *>malloc((doubles + 1) * sizeof(double))
    if found == NULL:
        raise MemoryError()
    return found


def _check(jacobians, forced, tangents, offsets, start, steps, rates, marks):
    """Shapes as documented, so that no step reads beyond an array."""
    states, columns = start.shape
    wanted = [(jacobians, (steps, rates, states, states)), (forced, (steps, rates, states, columns))]
    if tangents is not None:
        wanted += [(tangents, (*marks, states, states)), (offsets, (*marks, states, columns))]
    for array, shape in wanted:
        if array.shape != shape:
            raise ValueError(f"an array has the shape {array.shape}, not {shape}")


def collocation_steps(
    const double[::1] nodes, const double[:, ::1] first, const double[:, ::1] second, bint identity,
    const double[::1] h, jacobians, forced, tangents, offsets, start,
):
    """Columns at the ends of the steps (n, nx, k), and their rates at the stages (n, s, nx, k).

    first, second : (s + 1, s)
        Integrals of the rates to each node and to the end.
    identity
        Whether q' = u, with as many coordinates as speeds.
    h : (n,)
        The steps; jacobians (n, s, nx, nx) and forced (n, s, nx, k) are A and B of S' = A S + B
        at their stages.
    tangents, offsets
        P (n, nx, nx) and Q (n, nx, k): the end's columns become P S + Q; or None.
    start : (nx, k)
    """
    cdef Py_ssize_t n, steps = h.shape[0]
    cdef int s = nodes.shape[0], nx = start.shape[0], k = start.shape[1], fine = 1
    _check(jacobians, forced, tangents, offsets, start, steps, s, (steps,))
    if first.shape[0] != s + 1 or first.shape[1] != s or second.shape[0] != s + 1 \
            or second.shape[1] != s:
        raise ValueError("the integrals do not belong to the nodes")
    ends, rates = np.empty((steps, nx, k)), np.empty((steps, s, nx, k))
    if not steps or not k:
        return ends, rates
    cdef const double[:, :, :, ::1] a = jacobians, b = forced
    cdef const double[:, :, ::1] p, q
    cdef const double[:, ::1] before = start
    cdef double[:, :, ::1] end = ends
    cdef double[:, :, :, ::1] rate = rates
    cdef mechc_collocation rule
    rule.stages, rule.states, rule.columns = s, nx, k
    rule.coordinates = nx // 2 if identity else 0
    rule.nodes, rule.first, rule.second = &nodes[0], &first[0, 0], &second[0, 0]
    cdef bint projected = tangents is not None
    if projected:
        p, q = tangents, offsets
    cdef double *work = _room(mechc_collocation_work(&rule))
    cdef double *moved = NULL
    cdef const double *from_ = &before[0, 0]
    try:
        moved = _room(nx * k)
        with nogil:
            for n in range(steps):
                if n:
                    from_ = &end[n - 1, 0, 0]
                fine = mechc_collocate(
                    &rule, h[n], &a[n, 0, 0, 0], &b[n, 0, 0, 0], from_, work, &rate[n, 0, 0, 0],
                    &end[n, 0, 0]
                )
                if not fine:
                    break
                if projected:
                    mechc_onto(&p[n, 0, 0], &q[n, 0, 0], nx, k, &end[n, 0, 0], moved)
    finally:
        free(work)
        free(moved)
    if not fine:
        raise ArithmeticError("a step's variational equations are singular")
    return ends, rates


def pair_steps(
    const double[:, ::1] matrix, int last, const double[::1] h, jacobians, forced, tangents,
    offsets, start,
):
    """The same for an explicit pair: A, B, P and Q at every rate, the end's being rate `last`."""
    cdef Py_ssize_t n, steps = h.shape[0]
    cdef int r = matrix.shape[0], nx = start.shape[0], k = start.shape[1]
    _check(jacobians, forced, tangents, offsets, start, steps, r, (steps, r))
    if matrix.shape[1] != r or not 0 <= last < r:
        raise ValueError("no such rate")
    ends, rates = np.empty((steps, nx, k)), np.empty((steps, r, nx, k))
    if not steps or not k:
        return ends, rates
    cdef const double[:, :, :, ::1] a = jacobians, b = forced, p, q
    cdef const double[:, ::1] before = start
    cdef double[:, :, ::1] end = ends
    cdef double[:, :, :, ::1] rate = rates
    cdef mechc_explicit pair
    pair.rates, pair.end, pair.states, pair.columns = r, last, nx, k
    pair.matrix = &matrix[0, 0]
    cdef bint projected = tangents is not None
    if projected:
        p, q = tangents, offsets
    cdef double *work = _room(2 * nx * k)
    cdef const double *from_ = &before[0, 0]
    with nogil:
        for n in range(steps):
            if n:
                from_ = &end[n - 1, 0, 0]
            mechc_explicit_columns(
                &pair, h[n], &a[n, 0, 0, 0], &b[n, 0, 0, 0],
                &p[n, 0, 0, 0] if projected else NULL, &q[n, 0, 0, 0] if projected else NULL,
                from_, work, &rate[n, 0, 0, 0], &end[n, 0, 0]
            )
    free(work)
    return ends, rates
