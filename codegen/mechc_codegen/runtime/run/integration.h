/* A run, whatever its method: state and clock, tolerances, and what watches for critical
 * configurations.
 */
#pragma once

#include "abi/run.h"
#include "run/tableau.h"
#include "singularities/crossing.h"

typedef struct mechc_driver mechc_driver;

/* Data of a run's switching functions: see stepping/switches.h. */
typedef struct {
    double cut;     /* the step to try, which is to end at a zero; 0: as step control says */
    double planned; /* the step before it was cut; 0: it was not */
    double next;    /* after a step that ends at a table's knot, about: to the next one */
    int refused;    /* attempts in a row */
    int unwatched;  /* until a step is accepted */
    int rest, rests; /* steps that are left to the pair, and were left to it the last time */
    int row;        /* steps in a row that ended at a zero, */
    double row_t, row_step; /* the first of them there; how long the next was to be */
    double side[MECHC_AT_LEAST_ONE(MECHC_SWITCHES_MAX)]; /* values at the end of the last step, watched; */
    int turns[MECHC_AT_LEAST_ONE(MECHC_SWITCHES_MAX)]; /* ends in a row that go back, no nearer to zero */
    double size[MECHC_AT_LEAST_ONE(MECHC_SWITCHES_MAX)]; /* of the largest values so far */
    int at_start[MECHC_AT_LEAST_ONE(MECHC_SWITCHES_MAX)]; /* of this step: is it zero there? */
    int at_end[MECHC_AT_LEAST_ONE(MECHC_SWITCHES_MAX)];
} mechc_switches;

typedef struct {
    mechc_run head;
    const mechc_driver *driver;
    const mechc_method *const *methods; /* by their numbers */
    const mechc_method *method;  /* in use */
    const mechc_method *current; /* of this step: that one, or the pair that bridges a crossing */
    const mechc_method *resumed; /* the one that left a crossing to the pair; NULL: none did */
    void *work[MECHC_METHODS];   /* work space of each method, made when it is first used */
    int number;                  /* of the method asked for */
    int missed;                  /* crossings in a row that the method could not step over */
    int has_tolerances;
    double t1, rtol, max_step, step, direction;
    const mechc_step_limits *limits; /* or NULL */
    const mechc_outer *outer;        /* or NULL */
    long max_steps;
    int refused; /* the last attempt failed: do not let the step grow */
    int failure; /* why a stage of it could not be taken; 0 */
    int on_change_point, most_dense;
    mechc_monitor monitor;
    mechc_decision decision;     /* of the last step that was examined */
    double conditioning;       /* of the configuration rows at the last stage taken */
    double low, best, high;    /* where in a step a crossing is placed best */
    double horizon;            /* steps ahead that crossings are looked for */
    double allowed; /* error of a step over its tolerance; above 1 where rounding is larger */
    int alike;      /* the estimates of this step's error, of different orders, are alike: rounding */
    double refused_t, refused_step, refused_error; /* the last step that its error refused */
    mechc_scalar_given given;
    double compensation[MECHC_NX_MAX], next_compensation[MECHC_NX_MAX]; /* of y: Kahan (1965) */
    double time_compensation;
    double y[MECHC_NX_MAX], tolerance[MECHC_NX_MAX], scale[MECHC_NX_MAX];
    double turns[MECHC_NQ_MAX]; /* whole turns taken out of y: see turns.h */
    double rates[MECHC_MOST_RATES * MECHC_NX_MAX]; /* of this step; the first are those of y */
    int when_stiff;            /* the method that takes over where stability limits the step; 0: none */
    int stiff, easy;           /* steps in a row that were limited so; that were not */
    int trial, trials;         /* steps left of the implicit method's trial; trials so far */
    int goes_back;             /* the trial is lost */
    const mechc_method *left;  /* the method before the trial, */
    double pace;               /* and how far a unit of work led by it */
    double pace_t;             /* since this time, */
    long pace_rhs;             /* and after so many evaluations */
    mechc_switches switches;
    int alone;                 /* too near a critical configuration for lockstep with others */
    int regular;               /* its rows are far enough for it: so it was left in lockstep */
    double last_step, last_factor; /* of the last step taken in lockstep: its length, and by which
                                      its error would have let it grow; 0: none */
} mechc_integration;

/* Functions of the driver that other parts of the unit call. */
struct mechc_driver {
    int (*rates_at)(mechc_integration *run, double t, double *y, double *rates);
    double (*conditioning)(const mechc_integration *run, double t, const double *q);
};

#define MECHC_RATE(run, i) ((run)->rates + (i) * MECHC_NX_MAX) /* rows as long as in lockstep */

/* Of a step: what is left of the run after its last one, by rounding. */
#define MECHC_LAST_STEP 1e-12

/* Whether no step of the run follows one of this length. */
MECHC_STATIC int mechc_is_last(const mechc_integration *run, double h)
{
    return fabs(run->t1 - run->head.t - h) <= MECHC_LAST_STEP * fabs(h);
}
