/* A step that is examined, and the results. */
#pragma once

#include "singularities/critical.h"
#include "singularities/placement.h"

/* Configurations of a step in the order of time: its start, nodes between, its end. */
#define MECHC_MOST_NODES 10

typedef struct {
    int count;
    double fraction[MECHC_MOST_NODES];
    double q[MECHC_MOST_NODES][MECHC_NQ_MAX];
    int open[MECHC_MOST_NODES]; /* its loops could not be closed there */
} mechc_path;

/* A step as proposed: states and rates at both ends. */
typedef struct {
    double t, h;
    const double *start, *start_rates, *end, *end_rates;
    const mechc_scalar_given *given;
    double low, best, high; /* fractions of a step between which a crossing is best placed */
    double horizon;         /* steps ahead that crossings are looked for */
    int bridge;             /* the step is fit to hold a crossing */
    int first, last;        /* of the run */
    double left;            /* time to the run's end */
    int looks_ahead;        /* crossings are placed beforehand (look_ahead.h) ... */
    mechc_nodes nodes;      /* ... between these */
    const mechc_path *path; /* NULL: not known yet */
} mechc_span;

enum { MECHC_STANDS, MECHC_CROSSES, MECHC_RETRY, MECHC_CANNOT_TELL };

typedef struct {
    int action;
    int why;         /* MECHC_CANNOT_TELL: the status */
    double factor;   /* MECHC_RETRY: of the step */
    int bridge;      /* MECHC_RETRY: with the method that crosses change points */
    int to_pair;     /* MECHC_RETRY: the explicit pair takes the steps that follow */
    int to_collocation; /* MECHC_RETRY: collocation does, to the run's end */
    double fraction; /* MECHC_CROSSES: of the step, about where the crossing lies */
    double q[MECHC_NQ_MAX], gap;
} mechc_decision;

/* Of a step that led to another branch: the next. */
#define MECHC_ASTRAY 0.3

#if MECHC_NH_MAX > 0
MECHC_STATIC void mechc_retry(mechc_decision *out, double factor, int bridge)
{
    out->action = MECHC_RETRY;
    out->factor = factor;
    out->bridge = bridge;
    out->to_pair = out->to_collocation = 0;
}

MECHC_STATIC void mechc_give_up(mechc_decision *out, int why, double gap)
{
    out->action = MECHC_CANNOT_TELL;
    out->why = why;
    out->gap = gap;
}

#endif
