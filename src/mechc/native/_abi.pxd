"""The binary interface of compiled scenes, for the extensions that call them.

Structs list the fields that extensions use; their layout is that of the headers.
"""

from mechc.native._inputs cimport mechc_inputs, mechc_shapes


cdef extern from "abi/model.h":
    int MECHC_ABI, MECHC_COUNTS, MECHC_LEASTS
    const char *MECHC_CAPSULE
    int MECHC_PART_DRIVER, MECHC_PART_COLLOCATION, MECHC_PART_EXPLICIT, MECHC_PART_IMPLICIT
    int MECHC_PART_OUTPUTS, MECHC_PART_TAYLOR, MECHC_PART_TAYLOR_LANES, MECHC_PART_SWEEPS, MECHC_PART_DERIVATIVES
    int MECHC_ALL_PARTS
    int MECHC_DOP853
    int MECHC_RUNNING, MECHC_INTERRUPTED, MECHC_MEMORY_LIMIT

    ctypedef struct mechc_rows:
        const double *data
        ptrdiff_t stride

    ctypedef void (*mechc_evaluate_pointer)(
        ptrdiff_t count, mechc_rows t, mechc_rows y, mechc_rows p, const mechc_inputs *inputs,
        mechc_rows forces, double *out
    ) noexcept nogil

    ctypedef struct mechc_output:
        const char *name
        int width
        mechc_evaluate_pointer evaluate

    ctypedef struct mechc_method:
        pass

    ctypedef struct mechc_step_limits:
        ptrdiff_t count
        const double *times
        const double *longest

    ctypedef struct mechc_options:
        double t0, t1, rtol, first_step, max_step
        const double *y0
        const double *p
        const double *atol
        long max_steps
        int method, dense, on_change_point, when_stiff, last_only
        const mechc_method *const *methods
        const int *stop
        const mechc_step_limits *limits

    ctypedef struct mechc_stats:
        long steps, rejected, rhs_evaluations, closure_iterations
        double least_singular, least_singular_time
        int coordinate
        long examined
        double critical_gap, critical_time, rounding
        int left_series

    ctypedef struct mechc_trajectory:
        ptrdiff_t count, crossing_count
        int width, dense_rows, dropped_count
        double *t
        double *y
        double *dense
        unsigned char *methods
        double *crossings
        double dropped[2]

    ctypedef struct mechc_run:
        int status, wanted
        mechc_trajectory trajectory

    ctypedef struct mechc_given:
        pass

    ctypedef struct mechc_variation:
        const mechc_trajectory *trajectory
        const double *p
        const mechc_inputs *inputs
        ptrdiff_t first, last
        int columns, restart, project
        const double *directions
        const mechc_shapes *shapes
        double *ends
        double *rates

    ctypedef struct mechc_projected_columns:
        const mechc_trajectory *trajectory
        const double *p
        const mechc_inputs *inputs
        ptrdiff_t states
        const double *t
        const double *y
        int count
        const double *directions
        const mechc_shapes *shapes
        double *columns

    ctypedef struct mechc_covariation:
        const mechc_trajectory *trajectory
        const double *p
        const mechc_inputs *inputs
        ptrdiff_t first, last
        int columns
        const double *sources
        double *covector
        const mechc_shapes *shapes
        double *gradient

    ctypedef struct mechc_unit:
        const char *instruction_set
        int lanes, output_count
        const mechc_output *outputs
        size_t given_size
        void (*give)(const double *, const mechc_inputs *, mechc_given *) noexcept nogil
        void (*rates)(double, const double *, const mechc_given *, double *) noexcept nogil
        int (*project)(
            double, double *, const double *, const mechc_inputs *, double *
        ) noexcept nogil
        const mechc_method *const *methods
        void (*interpolate)(
            int, const mechc_trajectory *, const double *, const mechc_inputs *, ptrdiff_t,
            const double *, double *
        ) noexcept nogil
        size_t (*saved_size)(const mechc_run *) noexcept nogil
        void (*save)(const mechc_run *, void *) noexcept nogil
        void (*restore)(mechc_run *, const void *) noexcept nogil
        int (*vary)(const mechc_variation *) noexcept nogil
        int (*covary)(const mechc_covariation *) noexcept nogil
        int (*project_columns)(const mechc_projected_columns *) noexcept nogil

    ctypedef struct mechc_model:
        int abi, coordinates, speeds, holonomic, rows, parameters, inputs, bound
        const char *metadata
        void (*complete)(const unsigned char *, double *) noexcept nogil
        const mechc_unit *(*select)(const char *) noexcept nogil
        const char *texts
        const mechc_part *general
        const mechc_part *series
        const mechc_part *derivatives

    ctypedef struct mechc_part:
        int parts
        const mechc_unit *unit

cdef extern from "abi/join_parts.h":
    ctypedef struct mechc_joined:
        mechc_unit unit
        const mechc_method *methods[5]
        int parts

    void mechc_join(mechc_joined *, const mechc_unit *, int) noexcept nogil
    int mechc_part_of_method(int) noexcept nogil
    int mechc_part_of_members(int) noexcept nogil

cdef extern from "abi/large_stack.h":
    ctypedef struct mechc_on_stack:
        pass

    size_t mechc_stack_of(int) noexcept nogil
    size_t mechc_stack_of_output(int, int, int, int) noexcept nogil
    size_t mechc_stack_left() noexcept nogil
    int mechc_begin_on_stack(
        mechc_on_stack *, size_t, void (*)(void *) noexcept nogil, void *
    ) noexcept nogil
    int mechc_wait_on_stack(mechc_on_stack *, double) noexcept nogil
    void mechc_end_on_stack(mechc_on_stack *) noexcept nogil
    int mechc_with_stack(size_t, void (*)(void *) noexcept nogil, void *) noexcept nogil
