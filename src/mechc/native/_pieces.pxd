"""Long work in pieces between which signals are handled, on a stack that is large enough."""

from cpython.exc cimport PyErr_CheckSignals

from mechc.native._abi cimport (
    mechc_begin_on_stack, mechc_end_on_stack, mechc_on_stack, mechc_wait_on_stack
)

cdef extern from "abi/clock.h":
    double seconds_now "mechc_seconds"() noexcept nogil


cdef extern from *:
    """
    #define MECHC_LOOK 0.02   /* s between checks of signals, and between turns of other threads */
    #define MECHC_PIECE 0.001 /* s between checks of the clock: the next piece may take far longer */
    #define MECHC_LARGEST_PIECE ((ptrdiff_t)1 << 20)
    #define MECHC_LONG 4096   /* items of some us each: more of them are worth a thread */
    #define MECHC_LONG_STACK ((size_t)4 << 20)
    """
    const double LOOK "MECHC_LOOK"
    const double PIECE "MECHC_PIECE"
    const ptrdiff_t LARGEST_PIECE "MECHC_LARGEST_PIECE"
    const ptrdiff_t LONG "MECHC_LONG"
    const size_t LONG_STACK "MECHC_LONG_STACK"


ctypedef struct working:  # work that fails without memory
    void *job
    int made


cdef inline ptrdiff_t next_piece(ptrdiff_t piece, double seconds) noexcept nogil:
    """Twice as much work if it took less than a piece of time; proportionally less if longer."""
    if seconds > PIECE:
        return max(<ptrdiff_t>(piece * (PIECE / seconds)), 1)
    return min(2 * piece, LARGEST_PIECE) if seconds < 0.5 * PIECE else piece


cdef inline int with_stack(
    size_t bytes, void (*work)(void *) noexcept nogil, void *data, int *stop=NULL
) except -1:
    """Work without the GIL, on a stack that is large enough.

    Signals are handled meanwhile where it runs on a stack of its own; one that raises sets `stop`.
    """
    cdef mechc_on_stack job
    cdef int done = 0
    if not bytes:
        with nogil:
            work(data)
        return 0
    if not mechc_begin_on_stack(&job, bytes, work, data):
        raise MemoryError("no stack for a scene of this size")
    try:
        while not done:
            with nogil:
                done = mechc_wait_on_stack(&job, LOOK)
            PyErr_CheckSignals()
    except BaseException:
        if stop != NULL:
            stop[0] = 1
        raise
    finally:
        with nogil:
            mechc_end_on_stack(&job)
    return 0


cdef inline size_t stack_for(size_t needed, ptrdiff_t items) noexcept nogil:
    """Bytes of stack for so many items of work: many have a stack of their own, so that a signal
    stops them."""
    return max(needed, LONG_STACK) if items > LONG else needed
