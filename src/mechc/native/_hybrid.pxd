"""The driver of motions in C, for the other extensions."""

from mechc.native._abi cimport (
    mechc_options, mechc_run, mechc_stats, mechc_trajectory, mechc_unit
)
from mechc.native._inputs cimport mechc_driven, mechc_inputs, mechc_signal


cdef extern from "hybrid/reach.h":
    ctypedef struct mechc_event_functions:
        double (*value)(void *, double, const double *, const double *) noexcept nogil
        void (*slopes)(void *, double, const double *, const double *, double *) noexcept nogil
        int (*reset)(void *, double, const double *, const double *, double *) noexcept nogil
        void *context

    ctypedef int (*mechc_contact_table)(
        void *, double, const double *, const double *, double *
    ) noexcept nogil

    ctypedef struct mechc_event_policy:
        double direction
        long terminal
        int contact

    ctypedef struct mechc_contact_laws:
        int count, poisson
        const unsigned char *has_gap
        const unsigned char *has_friction
        const unsigned char *is_linear
        const int *event
        mechc_contact_table table
        void *context

    ctypedef struct mechc_sizes:
        const unsigned char *dimensionless
        const int *lengths
        int length_count
        const double *lowest
        const double *highest

    ctypedef struct mechc_motion:
        const mechc_unit *unit
        int coordinates, speeds, width, rows, parameters
        mechc_sizes sizes
        double *p
        const mechc_inputs *inputs

    ctypedef struct mechc_given_inputs:
        const mechc_driven *driven
        const mechc_signal *signals
        const ptrdiff_t *knots
        const double *kinks
        int signal_count, source_count
        ptrdiff_t kink_count
        void (*due)(void *, double, const double *) noexcept nogil
        void *context

    ctypedef struct mechc_motion_inputs:
        ptrdiff_t segment

    ctypedef struct mechc_event:
        double grazing, too_fast

    ctypedef struct mechc_event_zero:
        int event
        double t

    ctypedef struct mechc_watch:
        int own, keeps_states, stopped_by, causes
        mechc_event_functions *functions
        mechc_event_policy *policy
        mechc_event *event
        mechc_event_zero *zero
        double *zero_state
        ptrdiff_t zeros
        int *cause
        const double *reset

    int MECHC_NO_LAW, MECHC_NO_MASS, MECHC_NO_RESTITUTION, MECHC_PUSHES

    ctypedef struct mechc_contact_place:
        int failed

    ctypedef struct mechc_contacts:
        mechc_contact_laws laws
        mechc_contact_place place
        int overlaps, why
        double overlap, lowered_at, lowered_to
        long lowered

    ctypedef struct mechc_piece:
        const mechc_trajectory *steps
        mechc_trajectory own
        double cut
        int jumps, causes, contacts
        int *cause
        double *p
        unsigned char *contact

    ctypedef struct mechc_hybrid:
        mechc_motion motion
        const mechc_given_inputs *given
        mechc_motion_inputs inputs
        mechc_watch watch
        mechc_contacts contacts
        int keeps, live, pieces, status
        double max_bytes, stop
        mechc_run *run
        mechc_piece **piece

    ctypedef struct mechc_reacher:
        mechc_hybrid hybrid
        mechc_options options
        int ahead
        double t
        double *y

    mechc_piece *mechc_piece_make(const double *, int, int, int) nogil
    mechc_piece *mechc_piece_share(mechc_piece *) nogil
    void mechc_piece_leave(mechc_piece *) nogil
    void mechc_keep_last(mechc_trajectory *) nogil

    int mechc_hybrid_make(mechc_hybrid *, int) nogil
    void mechc_hybrid_free(mechc_hybrid *) nogil
    int mechc_hybrid_begin(mechc_hybrid *, const mechc_options *) nogil
    int mechc_hybrid_advance(mechc_hybrid *, long) nogil
    void mechc_hybrid_back(mechc_hybrid *, ptrdiff_t) nogil
    double mechc_hybrid_end(mechc_hybrid *, double *) nogil
    mechc_stats mechc_hybrid_stats(const mechc_hybrid *) nogil

    void mechc_reach_from(mechc_reacher *, double, const double *) nogil
    int mechc_reach_time(mechc_reacher *, double, int) nogil
    size_t mechc_reach_saved_size(mechc_reacher *, int) nogil
    void mechc_reach_save(mechc_reacher *, void *, int) nogil
    int mechc_reach_restore(mechc_reacher *, double, const double *, const void *) nogil

cdef extern from "hybrid/events/by_tape.h":
    ctypedef struct mechc_operation:
        pass

    ctypedef struct mechc_tape:
        pass

    ctypedef struct mechc_tape_table:
        pass

    ctypedef struct mechc_tape_code:
        const mechc_operation *operations
        const mechc_tape *tapes
        const mechc_tape_table *tables
        const double *numbers
        const double *of_tables

    ctypedef struct mechc_event_tapes:
        const mechc_tape_code *code
        int value, slopes, reset, contacts

    double mechc_value_by_tape(void *, double, const double *, const double *) noexcept nogil
    void mechc_slopes_by_tape(void *, double, const double *, const double *, double *) noexcept nogil
    int mechc_reset_by_tape(void *, double, const double *, const double *, double *) noexcept nogil
    int mechc_contacts_by_tape(void *, double, const double *, const double *, double *) noexcept nogil

cdef extern from "hybrid/contact/read.h":
    int mechc_piece_in_contact(const mechc_piece *) nogil
    int mechc_read_contact(
        const mechc_motion *, const mechc_contact_laws *, const mechc_piece *, ptrdiff_t,
        const double *, double *
    ) nogil
    int mechc_read_contact_forces(
        const mechc_motion *, const mechc_contact_laws *, const mechc_piece *, ptrdiff_t,
        const double *, const double *, double *
    ) nogil
    int mechc_impulses(
        const double *, const double *, const double *, int, int, double *, double *, int *
    ) nogil
