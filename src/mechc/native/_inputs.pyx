# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""Inputs for compiled scenes: piecewise polynomials in C, and Python functions."""

import numpy as np

from cpython.mem cimport PyMem_Calloc, PyMem_Free
from libc.math cimport NAN, isfinite
from libc.string cimport memcpy

from mechc.native._pieces cimport seconds_now


cdef class Caller:
    """Python functions of t, or of t, q and u, that a run calls.

    ``functions``: for each value of the inputs (name, function, whether it takes the state) or
    None.  After one has failed none is called any more and every value is NaN; ``failure`` is then
    (name, time, the exception; None where the function returned no finite number).
    """

    def __init__(self, functions, int coordinates, int speeds):
        self.functions = list(functions)
        self.coordinates, self.speeds = coordinates, speeds
        self.takes_state = any(f is not None and f[2] for f in self.functions)
        self.repeated = set()

    def reset(self):
        """Reset counters and failure."""
        self.failure, self.calls, self.seconds = None, 0, 0.0
        self.repeated = set()

    cdef double call(self, int which, double t, const double *q, const double *u) except? -1:
        name, function, takes_state = self.functions[which]
        if not takes_state:
            return function(t)
        return function(t, array_of(q, self.coordinates), array_of(u, self.speeds))

    cdef double checked(self, int which, double t, const double *q, const double *u) except? -1:
        """The value; at the first call it must be the same again."""
        cdef double found = self.call(which, t, q, u), again
        if which not in self.repeated and isfinite(found):
            self.repeated.add(which)
            again = self.call(which, t, q, u)
            if again != found:
                raise ValueError(
                    f"it returned {found:.6g} and then {again:.6g} for the same arguments, which no "
                    "step can follow: give noise as a mechc.Signal of samples"
                )
        return found

    cdef double value(self, int which, double t, const double *q, const double *u):
        cdef double found = NAN
        if self.failure is not None:
            return NAN
        name = self.functions[which][0]
        cdef double started = seconds_now()
        try:
            found = self.checked(which, t, q, u)
            if not isfinite(found):
                self.failure = name, t, None
        except BaseException as error:
            self.failure = name, t, error
            found = NAN
        self.calls += 1
        self.seconds += seconds_now() - started
        return found


cdef object array_of(const double *numbers, ptrdiff_t count):
    """A copy of a state, which may be stored."""
    out = np.empty(count)
    cdef double[::1] view = out
    if count:
        memcpy(&view[0], numbers, count * sizeof(double))
    return out


cdef double call_back(void *caller, int which, double t, const double *q, const double *u) noexcept with gil:
    return (<Caller>caller).value(which, t, q, u)


cdef class Inputs:
    """The inputs of a run, as compiled scenes read them.

    Parameters
    ----------
    signals
        Piecewise polynomials: knots (n,), coefficients (n, degree + 1) in powers of the time since
        the knot.
    sources
        For each value (index of the signal or -1: called back, order of the derivative).
    """

    def __cinit__(self, signals, sources, Caller caller):
        cdef const double[::1] knots
        cdef const double[:, ::1] coefficients
        cdef ptrdiff_t i
        self.caller, self.arrays = caller, list(signals)
        self.signal_count, self.source_count = len(signals), len(sources)
        self.signals = <mechc_signal *>PyMem_Calloc(len(signals) + 1, sizeof(mechc_signal))
        self.sources = <mechc_source *>PyMem_Calloc(len(sources) + 1, sizeof(mechc_source))
        self.knots = <ptrdiff_t *>PyMem_Calloc(len(signals) + 1, sizeof(ptrdiff_t))
        if self.signals == NULL or self.sources == NULL or self.knots == NULL:
            raise MemoryError()
        for i, (knots, coefficients) in enumerate(self.arrays):
            if knots.shape[0] < 1 or coefficients.shape[0] != knots.shape[0]:
                raise ValueError("a signal needs a knot for every piece")
            self.signals[i].degree, self.knots[i] = coefficients.shape[1] - 1, knots.shape[0]
            self.signals[i].knots, self.signals[i].coefficients = &knots[0], &coefficients[0, 0]
            self.signals[i].last = knots.shape[0] - 1
        for i, (signal, order) in enumerate(sources):
            if not -1 <= signal < len(self.arrays):
                raise ValueError("no such signal")
            self.sources[i].signal = &self.signals[<int>signal] if signal >= 0 else NULL
            self.sources[i].order = order
        self.driven.head.evaluate = mechc_driven_evaluate
        self.driven.head.needs_state = caller.takes_state
        self.driven.sources = self.sources
        self.driven.caller, self.driven.call = <void *>caller, call_back

    def __dealloc__(self):
        PyMem_Free(self.signals)
        PyMem_Free(self.sources)
        PyMem_Free(self.knots)


cdef class Shapes:
    """Changes of inputs along columns of derivatives that are functions of time.

    Parameters
    ----------
    factors
        Of each change its factor at a time.
    places, columns : (n,)
        Of each the place of its input among parameters and then inputs, and its column.
    size
        How many columns there are behind those of parameters and inputs, where these have one each.
    """

    def __init__(self, Inputs factors, const int[::1] places, const int[::1] columns, int size):
        if places.shape[0] != factors.source_count or columns.shape[0] != factors.source_count:
            raise ValueError("each change needs a factor, a place and a column")
        self.references = factors, places, columns
        self.columns = size
        self.shapes.count = factors.source_count
        self.shapes.places, self.shapes.columns = &places[0], &columns[0]
        self.shapes.factors = &factors.driven.head
