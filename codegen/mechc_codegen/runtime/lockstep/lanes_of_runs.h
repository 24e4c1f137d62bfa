/* Several runs of one method in lockstep, one in each lane, far from critical configurations.
 *
 * Every lane has its own time, step, error and end; nothing passes from one lane to another, so the
 * numbers of a run do not depend on what runs beside it, and a run by itself is the case of one
 * lane in use.  Stages are taken as the equations stand and the step's end is projected: off the
 * constraints by d the equations are wrong by d over the conditioning, which counts with the
 * step's error.  A lane whose conditioning falls low takes its step back and continues alone
 * (stepping/attempt.h), with every stage on the constraints and crossings looked for.
 */
#pragma once

#include "run/method.h"
#include "run/trajectory.h"
#include "simd/bind_vector.h"
#include "dynamics/given.h"
#include "simd/unbind.h"

/* Of the step that a rough root of the error allows, which is right to three per cent. */
#define MECHC_LOCKSTEP_SAFETY 0.84

typedef struct {
    mechc_vector_given given;
    mechc_vector t, t1, time_compensation, step, max_step, h;
    mechc_vector y[MECHC_NX_MAX], compensation[MECHC_NX_MAX], scale[MECHC_NX_MAX];
    mechc_vector end[MECHC_NX_MAX], next_compensation[MECHC_NX_MAX];
    mechc_vector rates[MECHC_MOST_RATES][MECHC_NX_MAX]; /* the first are those of y */
    mechc_vector floor[MECHC_NX_MAX], of_scale, of_size; /* tolerated: a number, of the scale, of |y|, */
    mechc_vector part; /* of which a step after many may use less: see mechc_part_of_share */
    mechc_vector first, least, least_time; /* conditioning: at y; the least at a step's end, when */
    mechc_vector met; /* in this step: least distance of the rows from dependent ones, squared */
    mechc_vector conditioning; /* at its end */
    mechc_vector error, factor;            /* of this step: its error squared; of the step size */
    mechc_vector last_step, last_factor;   /* of the last accepted step; 0: none */
    mechc_vector before[2]; /* times of the two states before y */
    mechc_mask kept;        /* steps up to the state that a run which keeps one has kept */
    mechc_mask refused, last, closed;
    mechc_mask watched; /* a change point is known: steps so long that they may pass one leave */
    mechc_mask steps, rejected, evaluations, configurations, stiff, easy;
    int last_only; /* no run keeps states but the last */
} mechc_lockstep;

/* The functions of a method for lockstep; its own lanes begin with a mechc_lockstep. */
typedef struct {
    mechc_method_number number;
    int last_rate;  /* the rates of a step's end are kept there */
    int dense_rows; /* of its dense output */
    double growth;  /* most that one step may be longer than the one before */
    /* data of a run besides, into a lane and out of it; NULL: none */
    void (*load)(mechc_lockstep *a, int lane, const mechc_integration *run);
    void (*store)(const mechc_lockstep *a, int lane, mechc_integration *run);
    /* From y at t by h to the end, compensated, on the constraints: mechc_lockstep_project.  The
     * least conditioning on the way is `met`; evaluations are counted. */
    void (*step)(mechc_lockstep *a);
    mechc_vector (*error)(mechc_lockstep *a); /* squared, over what is tolerated */
    int plans; /* it sets the length of a step itself before it takes it */
    mechc_mask (*limited)(const mechc_lockstep *a); /* by stability; NULL: no step is */
    void (*accept)(mechc_lockstep *a, mechc_mask accepted); /* NULL: nothing to keep */
    void (*dense)(mechc_lockstep *a, mechc_vector *rows); /* of this step: see dense_output.h */
} mechc_lockstep_method;

/* Numbers that a lane takes from its run and gives back to it. */
#define MECHC_LANE_NUMBERS(X)                                                                     \
    X(t, head.t) X(time_compensation, time_compensation) X(step, step)                            \
    X(first, monitor.first) X(last_step, last_step) X(last_factor, last_factor)                   \
    X(least, head.stats.least_singular) X(least_time, head.stats.least_singular_time)             \
    X(stiff, stiff) X(easy, easy)
#define MECHC_LANE_TAKE(own, of_run) a->own[lane] = run->of_run;
#define MECHC_LANE_GIVE(own, of_run) run->of_run = (__typeof__(run->of_run))a->own[lane];

/* Put a run into a lane. */
MECHC_STATIC void mechc_lockstep_load(mechc_lockstep *a, int lane, const mechc_integration *run)
{
    const double asked = run->method->share * run->rtol;
    for (int i = 0; i < MECHC_NP; i++) a->given.p[i][lane] = run->given.p[i];
    for (int i = 0; i < MECHC_CONSTANTS; i++) a->given.k[i][lane] = run->given.k[i];
    a->given.inputs[lane] = run->given.inputs[0];
    for (int i = 0; i < MECHC_NX; i++) {
        a->y[i][lane] = run->y[i];
        a->compensation[i][lane] = run->compensation[i];
        a->scale[i][lane] = run->scale[i];
        a->rates[0][i][lane] = run->rates[i];
        a->floor[i][lane] = run->has_tolerances ? run->method->share * run->tolerance[i] : 0.0;
    }
    a->part[lane] = 1.0;
    a->of_scale[lane] = run->has_tolerances ? 0.0 : asked;
    a->of_size[lane] = run->has_tolerances ? asked : 0.0;
    MECHC_LANE_NUMBERS(MECHC_LANE_TAKE)
    a->t1[lane] = run->t1;
    a->max_step[lane] = run->max_step;
    a->refused[lane] = -(int64_t)(run->refused != 0);
    a->watched[lane] = -(int64_t)mechc_knows_crossing(&run->monitor);
    a->steps[lane] = a->kept[lane] = run->head.stats.steps;
    a->rejected[lane] = a->evaluations[lane] = a->configurations[lane] = 0;
    a->before[0][lane] = run->head.trajectory.dropped[0];
    a->before[1][lane] = run->head.trajectory.dropped[1];
}

/* Record the last state of a run that records no other; 0 without memory. */
MECHC_STATIC int mechc_lockstep_keep_last(mechc_lockstep *a, int lane, mechc_integration *run)
{
    mechc_trajectory *trajectory = &run->head.trajectory;
    const int64_t steps = a->steps[lane] - a->kept[lane];
    double y[MECHC_NX_MAX];
    if (!steps) return 1;
    for (int i = 0; i < MECHC_NX; i++) y[i] = a->y[i][lane];
    if (steps > 1) mechc_drop(trajectory, a->before[1][lane]);
    mechc_drop(trajectory, a->before[0][lane]);
    a->kept[lane] = a->steps[lane];
    return mechc_append_turned(trajectory, a->t[lane], y, run->turns);
}

/* Store a run from its lane. */
MECHC_STATIC void mechc_lockstep_store(mechc_lockstep *a, int lane, mechc_integration *run)
{
    mechc_stats *stats = &run->head.stats;
    for (int i = 0; i < MECHC_NX; i++) {
        run->y[i] = a->y[i][lane];
        run->compensation[i] = a->compensation[i][lane];
        run->scale[i] = a->scale[i][lane];
        run->rates[i] = a->rates[0][i][lane];
    }
    MECHC_LANE_NUMBERS(MECHC_LANE_GIVE)
    run->conditioning = run->monitor.first;
    run->refused = a->refused[lane] != 0;
    stats->steps = a->steps[lane];
    stats->rejected += a->rejected[lane];
    stats->closure_iterations += a->configurations[lane];
    stats->rhs_evaluations += a->evaluations[lane];
    run->regular = 1;
    if (run->head.trajectory.last_only) mechc_lockstep_keep_last(a, lane, run);
}
