# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""Checks of arrays; for long ones, signals (Ctrl-C) are handled between blocks."""

import numpy as np

from cpython.exc cimport PyErr_CheckSignals

cdef ptrdiff_t BLOCK = 1 << 20  # numbers, some ms

INSIDE, OUTSIDE, NOT_IN_ORDER = range(3)


def largest_of(const double[::1] values, const Py_ssize_t[::1] which):
    """The largest magnitude among the values at these places, 0 where there are none."""
    cdef double largest = 0.0
    cdef Py_ssize_t i
    for i in range(which.shape[0]):
        largest = max(largest, abs(values[which[i]]))
    return largest


def strictly_within(const double[:, ::1] rows, const double[::1] lower, const double[::1] upper):
    """Whether every number is strictly between the bounds of its column; NaN is not."""
    cdef ptrdiff_t i, k, some = 1 + BLOCK // (1 + rows.shape[1])
    if lower.shape[0] != rows.shape[1] or upper.shape[0] != rows.shape[1]:
        raise ValueError("a bound for every column is needed")
    for i in range(rows.shape[0]):
        if i % some == 0:
            PyErr_CheckSignals()
        for k in range(rows.shape[1]):
            if not lower[k] < rows[i, k] < upper[k]:
                return False
    return True


def all_within(const double[::1] values, double lower, double upper):
    """Whether every number is between the bounds or at one of them; NaN is not."""
    cdef ptrdiff_t i, first
    cdef int within = 1
    for first in range(0, values.shape[0], BLOCK):
        with nogil:
            for i in range(first, min(first + BLOCK, values.shape[0])):
                within &= lower <= values[i] <= upper
        PyErr_CheckSignals()
        if not within:
            return False
    return True


cdef int take_times(
    const double *given, double *times, ptrdiff_t count, double *before, double direction,
    double low, double high, double slack
) noexcept nogil:
    """Copy a block; 0, or which promise a time does not keep.  before: the last one until then."""
    cdef ptrdiff_t i
    cdef double t
    for i in range(count):
        t = given[i]
        if abs(t - low) <= slack:
            t = low
        if abs(t - high) <= slack:
            t = high
        if not low <= t <= high:
            return 1
        if not (t - before[0]) * direction > 0:
            return 2
        before[0] = times[i] = t
    return 0


def times_along(const double[::1] given, double t0, double t1, double slack):
    """Times from t0 to t1, copied; those within ``slack`` of an end become that end.

    Returns (INSIDE, times), or (OUTSIDE or NOT_IN_ORDER, None): each has to be within the span
    and, strictly, beyond the one before it in the direction of the span.
    """
    cdef double direction = 1.0 if t1 >= t0 else -1.0
    cdef double low = min(t0, t1), high = max(t0, t1), before = -direction * float("inf")
    cdef ptrdiff_t first, some, count = given.shape[0]
    cdef int wrong = 0
    found = np.empty(count)
    cdef double[::1] times = found
    for first in range(0, count, BLOCK):
        some = min(BLOCK, count - first)
        with nogil:
            wrong = take_times(
                &given[first], &times[first], some, &before, direction, low, high, slack
            )
        PyErr_CheckSignals()
        if wrong:
            return wrong, None
    return INSIDE, found
