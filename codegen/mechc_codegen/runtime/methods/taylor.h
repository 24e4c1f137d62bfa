/* Taylor series of the motion (series/coefficients.h), of an order that follows from the tolerance.
 *
 * The step is known before it is taken: the last terms of the series are what is tolerated at its
 * end, and the series is its dense output.  The rates of a step's end are those of the next series.
 */
#pragma once

#include "dynamics/sizes.h"
#if MECHC_TAYLOR_SERIES

#include "methods/taylor_lanes.h"
#include "methods/traits.h"
#include "run/integration.h"
#include "run/method.h"
#include "run/rates.h"
#include "simd/bind_scalar.h"
#include "series/step.h"
#include "simd/unbind.h"
#include "stepping/control.h"

typedef struct {
    double rows[MECHC_TAYLOR_MOST + 1][MECHC_SERIES];
    double t, scale, sizes[MECHC_TAYLOR_JUDGED]; /* of the rows */
    int order, made;
} mechc_taylor_work;

MECHC_STATIC mechc_taylor_work *mechc_taylor_of(const mechc_integration *run)
{
    return run->work[MECHC_TAYLOR];
}

MECHC_STATIC void mechc_taylor_make(mechc_integration *run)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    w->order = mechc_taylor_rows(run);
    w->made = 0;
}

MECHC_STATIC void mechc_taylor_enter(mechc_integration *run) { mechc_taylor_of(run)->made = 0; }

/* The series at the state; kept until the state is another. */
MECHC_STATIC void mechc_taylor_expand(mechc_integration *run, mechc_taylor_work *w)
{
    double weights[MECHC_NX], floor[MECHC_NX];
    const double t = run->head.t, asked = run->method->share * run->rtol;
    const int given = run->has_tolerances;
    if (w->made && w->t == t && !memcmp(w->rows[0], run->y, sizeof run->y)) return;
    w->scale = run->direction * run->step;
    mechc_scalar_series(t, run->y, &run->given, w->scale, w->order, w->rows);
    for (int i = 0; i < MECHC_NX; i++) {
        floor[i] = given ? run->method->share * run->tolerance[i] : 0.0;
        MECHC_RATE(run, 0)[i] = w->rows[1][i] / w->scale;
    }
    mechc_scalar_taylor_weights(run->y, run->scale, floor, given ? 0.0 : asked,
                                given ? asked : 0.0, weights);
    mechc_scalar_taylor_sizes(w->rows, w->order, weights, w->sizes);
    w->t = t;
    w->made = 1;
    run->head.stats.rhs_evaluations += w->order;
}

/* Lengthen or shorten the step to what the series allows. */
MECHC_STATIC void mechc_taylor_plan(mechc_integration *run)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    mechc_taylor_expand(run, w);
    const int grows = !run->refused && run->head.stats.steps > 0;
    const double most = grows ? run->current->growth * run->step : run->step;
    const double reach = fabs(w->scale) * mechc_scalar_taylor_reach(w->sizes, w->order);
    run->step = reach < most ? reach : most;
}

MECHC_STATIC int mechc_taylor_step(mechc_integration *run, double h, double *end)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    mechc_scalar_taylor_end(w->rows, w->order, h / w->scale, run->compensation,
                            run->next_compensation, end);
    for (int i = 0; i < MECHC_NX; i++)
        if (!(fabs(end[i]) < HUGE_VAL)) {
            double y[MECHC_NX];
            memcpy(y, run->y, sizeof y);
            const int status = mechc_rates_at(run, run->head.t, y, MECHC_RATE(run, 1));
            return status == MECHC_RUNNING ? MECHC_NOT_FINITE : status;
        }
    memcpy(MECHC_RATE(run, 1), MECHC_RATE(run, 0), sizeof run->y);
    return MECHC_RUNNING;
}

/* What the step was planned for. */
MECHC_STATIC double mechc_taylor_error(mechc_integration *run, double h, const double *end)
{
    (void)run, (void)h, (void)end;
    return 0.5;
}

/* The next series tells how much the step may grow. */
MECHC_STATIC double mechc_taylor_factor(mechc_integration *run, double error)
{
    (void)run, (void)error;
    return 1.0;
}

MECHC_STATIC void mechc_taylor_dense(mechc_integration *run, double h, const double *end, int count,
                                     double *rows)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    mechc_scalar_taylor_dense(w->rows, w->order, h / w->scale, end, count, rows);
}

static const mechc_method mechc_taylor = {
    MECHC_TAYLOR_TRAITS,
    .work_size = sizeof(mechc_taylor_work),
    .make = mechc_taylor_make,
    .enter = mechc_taylor_enter,
    .together = mechc_taylor_together,
    .plan = mechc_taylor_plan,
    .step = mechc_taylor_step,
    .error = mechc_taylor_error,
    .factor = mechc_taylor_factor,
    .shows_end = mechc_error_is_small,
    .dense = mechc_taylor_dense,
};
#endif
