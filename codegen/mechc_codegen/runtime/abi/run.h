/* A run of one scene as its caller sees it: options, statistics and trajectory. */
#pragma once

#include <float.h>
#include <stddef.h>
#include "codes.h"
#include "inputs.h"

/* Of the time: a shorter step makes no difference to it. */
#define MECHC_SMALLEST_STEP (16.0 * DBL_EPSILON)

typedef struct mechc_method mechc_method; /* see run/method.h */

/* Longest steps over parts of a run's span: longest[i] between times[i] and times[i + 1], which
 * increase; beyond them any step. */
typedef struct {
    ptrdiff_t count;
    const double *times, *longest;
} mechc_step_limits;

/* Rates that replace those of the scene, as in contact: the state is first moved onto the
 * constraints.  Only explicit methods support them. */
typedef struct {
    int (*rates)(void *owner, double t, double *y, double *rates);
    void *owner;
    const double *sizes; /* of the components: scales of speeds are no smaller */
} mechc_outer;

typedef struct {
    double t0, t1;
    const double *y0;
    const double *p;
    const mechc_inputs *inputs; /* NULL where the scene has none */
    double rtol;
    const double *atol;  /* per component, or NULL: rtol times each component's scale */
    const double *scale; /* per component, used where atol is NULL */
    double first_step;   /* 0: chosen */
    double max_step;     /* infinity: unlimited */
    long max_steps;
    int method;          /* mechc_method_number */
    int dense; /* keep the coefficients of the dense output */
    int on_change_point; /* mechc_change_point_policy */
    int when_stiff; /* number of the method that takes over where stability limits steps; 0: none */
    const mechc_method *const *methods; /* by their numbers, or NULL: those of the unit */
    const int *stop; /* set by another thread: give up the step under way; NULL: never */
    const mechc_step_limits *limits; /* kept by the caller as long as the run; NULL: none */
    const mechc_outer *outer; /* likewise */
    double allowed; /* 0, or y0 is moved onto the constraints first: by a gap, or by a residual of the
                       speeds over the fastest, that is larger it is refused */
    int last_only;  /* of the accepted states only the last is kept; not with dense output */
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
    int left_series; /* a run that began by its series was left to collocation before the first step */
} mechc_stats;

/* Accepted states; dense holds count-1 blocks of dense_rows * width doubles, and methods the number
 * of the method of each of these steps (both NULL where no dense output is kept).  Crossings of change
 * points are rows of 2 + coordinates doubles: time, closure gap there, configuration. */
typedef struct {
    ptrdiff_t count, capacity;
    int width, dense_rows;
    double *t, *y, *dense;
    unsigned char *methods;
    ptrdiff_t crossing_count, crossing_capacity;
    double *crossings;
    double dropped[2]; /* times of states that are no longer kept, the last one first */
    int dropped_count;
    int last_only; /* see mechc_options */
} mechc_trajectory;

/* The head of a run; private state follows it. */
typedef struct {
    int status; /* mechc_status */
    int wanted; /* the run goes on once the code of this method is among `methods`; -1: none */
    double t;
    mechc_stats stats;
    mechc_trajectory trajectory;
} mechc_run;
