/* The binary interface between a compiled scene and whoever drives it. */
#ifndef MECHC_MODEL_H
#define MECHC_MODEL_H

#include <stddef.h>

#define MECHC_ABI 4
#define MECHC_CAPSULE "mechc.model.4"

#ifndef MECHC_NI
#define MECHC_NI 0 /* values of inputs that a run is given; the sizes of a scene that has any say so */
#endif

/* Constants made of parameters, and last the number of rows that count: see generic_rank.h. */
#define MECHC_CONSTANTS (MECHC_NK + 1)

#ifndef MECHC_STATES
#define MECHC_STATES 0 /* of the coordinates: those, the last, that no displacement moves */
#endif

/* Arrays of states are walked with a stride in doubles; stride 0 repeats one row. */
typedef struct {
    const double *data;
    ptrdiff_t stride;
} mechc_rows;

/* out[k*width ...] = output at (t[k], y[k], p[k]), k < count; out is contiguous. */
typedef void mechc_evaluate(ptrdiff_t count, mechc_rows t, mechc_rows y, mechc_rows p, double *out);

typedef struct {
    const char *name;
    int width;
    mechc_evaluate *evaluate;
} mechc_output;

/* How a run, or the projection of one state, ended. */
enum {
    MECHC_RUNNING = 0,
    MECHC_FINISHED = 1,
    MECHC_NOT_CLOSED = 2,      /* the loops cannot be closed near this state */
    MECHC_STEP_TOO_SMALL = 3,  /* the step shrank to the spacing of doubles */
    MECHC_NOT_FINITE = 4,      /* NaN or infinity */
    MECHC_SINGULAR_MASS = 5,   /* mass matrix not positive definite; stats.coordinate */
    MECHC_TOO_MANY_STEPS = 6,
    MECHC_NO_MEMORY = 7,
    MECHC_UNDECIDED = 8,       /* a gap so small that doubles cannot tell which way it bends */
    MECHC_AT_CHANGE_POINT = 9, /* the start is a change point: two ways lead on from it */
    MECHC_STOPPED_AT_CHANGE_POINT = 10 /* as asked for; the passage is recorded, not the step */
};

/* What to do at a change point. */
enum { MECHC_CONTINUE_STRAIGHT = 0, MECHC_STOP_BEFORE = 1 };

typedef struct {
    double t0, t1;
    const double *y0;
    const double *p;
    double rtol;
    const double *atol;  /* per component, or NULL: rtol times each component's scale */
    const double *scale; /* per component, used where atol is NULL */
    double first_step;   /* 0: chosen */
    double max_step;     /* infinity: unlimited */
    long max_steps;
    int method;
    int dense; /* keep the coefficients of the dense output */
    int on_change_point;
    int may_stiffen; /* an explicit method may hand over to the implicit one */
} mechc_options;

typedef struct {
    long steps, rejected, rhs_evaluations, closure_iterations;
    double least_singular; /* least ratio of smallest to largest constraint pivot at a step's end */
    double least_singular_time;
    int coordinate; /* the speed whose mass pivot vanished, or -1 */
    long examined;  /* steps near a critical configuration that were examined */
    double critical_gap; /* least closure gap at a critical configuration near the motion */
    double critical_time;
    double rounding; /* largest relative error of a step that rounding near a crossing left */
} mechc_stats;

/* Accepted states; dense holds count-1 blocks of dense_rows * width doubles.  Passages of change
 * points are rows of 2 + coordinates doubles: time, closure gap there, configuration. */
typedef struct {
    ptrdiff_t count, capacity;
    int width, dense_rows;
    double *t, *y, *dense;
    ptrdiff_t passage_count, passage_capacity;
    double *passages;
} mechc_trajectory;

/* The head of a run; private state follows it. */
typedef struct {
    int status;
    double t;
    mechc_stats stats;
    mechc_trajectory trajectory;
} mechc_run;

/* One compilation of a scene for one instruction set. */
typedef struct {
    const char *instruction_set;
    int lanes;
    int output_count;
    const mechc_output *outputs;
    /* Unprojected state rates of one state, with constants from prepare(). */
    void (*rates)(double t, const double *y, const double *p, const double *constants, double *out);
    void (*prepare)(const double *p, double *constants);
    /* Nearest state on the constraints; moved[0], moved[1]: largest closure gap and largest
       velocity residual found before. */
    int (*project)(double t, double *y, const double *p, double *moved);
    size_t run_size;
    void (*start)(mechc_run *run, const mechc_options *options);
    /* At most `steps` attempted steps; returns run->status. */
    int (*advance)(mechc_run *run, long steps);
    /* The same for up to `lanes` runs side by side, where the method and the scene allow it: each
       is the run that it is by itself.  Returns early where one of them ends. */
    void (*advance_abreast)(mechc_run **runs, int count, long steps);
    void (*release)(mechc_run *run);
    /* Dense output, projected onto the constraints. */
    void (*interpolate)(int method, const mechc_trajectory *trajectory, const double *p,
                        ptrdiff_t count, const double *t, double *out);
    /* Go on to t1, beyond the end of the run or before it, with other inputs (see inputs.h); NULL
     * where the scene has none. */
    void (*extend)(mechc_run *run, double t1, double inputs);
} mechc_unit;

typedef struct {
    int abi;
    const char *metadata; /* JSON */
    int coordinates, speeds, holonomic, rows, parameters, constants;
    /* Parameters not given take their defaults, which may follow those given. */
    void (*complete)(const unsigned char *given, double *p);
    const mechc_unit *(*select)(const char *instruction_set); /* NULL: the widest that runs here */
    int inputs; /* values of inputs; where there are any, p has one number more: see inputs.h */
} mechc_model;

#endif
