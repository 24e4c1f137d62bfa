/* Taylor series of the motion (series/coefficients.h), of an order that follows from the tolerance.
 *
 * The step is known before it is taken: the last terms of the series are what is tolerated at its
 * end, and the series is its dense output.  The rates of a step's end are those of the next series.
 */
#pragma once

#include "dynamics/sizes.h"
#if MECHC_TAYLOR_SERIES

#if MECHC_HAS(TAYLOR_LANES)
#include "methods/taylor_lanes.h"
#endif
#include "methods/traits.h"
#include "run/integration.h"
#include "run/method.h"
#include "run/rates.h"
#include "dynamics/scalar_stage.h"
#include "simd/bind_scalar.h"
#include "dynamics/alone.h"
#include "series/step.h"
#include "simd/unbind.h"
#include "series/first_zero.h"
#include "stepping/control.h"
#include "stepping/stiffness.h"

typedef struct {
    double rows[(MECHC_TAYLOR_MOST + 1) * MECHC_SERIES_MAX];
    double t, scale, sizes[MECHC_TAYLOR_JUDGED]; /* of the rows */
    double weights[MECHC_NX_MAX], defect; /* 1 over what is tolerated; at the step's end */
    double unstable;
    int order, made, bound; /* whether the series, and not the step before, limits the step */
    double to_zero;   /* of the step that ends just past a root's zero, else infinite */
    double past_zero; /* the time there, else NaN */
    double over_zero; /* step of the pair from there */
} mechc_taylor_work;

MECHC_STATIC mechc_taylor_work *mechc_taylor_of(const mechc_integration *run)
{
    return run->work[MECHC_TAYLOR];
}

MECHC_STATIC void mechc_taylor_enter(mechc_integration *run)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    w->made = 0;
    w->to_zero = HUGE_VAL;
    w->past_zero = NAN;
}

MECHC_STATIC void mechc_taylor_make(mechc_integration *run)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    w->order = mechc_taylor_rows(run);
    w->unstable = mechc_taylor_unstable(w->order);
    mechc_taylor_enter(run);
}

/* Expand the series in units of a step, with the size of its last terms; 0 if these overflow. */
MECHC_STATIC int mechc_taylor_expand_by(mechc_integration *run, mechc_taylor_work *w, double step)
{
    double floor[MECHC_NX_MAX];
    const double asked = run->method->share * run->rtol;
    const int given = run->has_tolerances;
    int finite = 1;
    w->scale = run->direction * step;
    mechc_scalar_series(run->head.t, run->y, &run->given, w->scale, w->order, MECHC_ROWS(w));
    for (int i = 0; i < MECHC_NX; i++)
        floor[i] = given ? run->method->share * run->tolerance[i] : 0.0;
    mechc_scalar_taylor_weights(run->y, run->scale, floor, given ? 0.0 : asked,
                                given ? asked : 0.0,
                                mechc_part_of_share(run->head.stats.steps), w->weights);
    mechc_scalar_taylor_sizes(MECHC_ROWS(w), w->order, w->weights, w->sizes);
    for (int k = 0; k < MECHC_TAYLOR_JUDGED; k++) finite &= w->sizes[k] < HUGE_VAL;
    run->head.stats.rhs_evaluations += w->order;
    return finite;
}

/* Expand the series at the state, if it is not known yet; 0: it has none, for instance at the zero of
 * a root.  Far beyond its radius of convergence terms overflow, and say nothing about the step. */
MECHC_STATIC int mechc_taylor_expand(mechc_integration *run, mechc_taylor_work *w)
{
    const double t = run->head.t, least = mechc_smallest_step(run);
    double step = run->step;
    int finite;
    if (w->made && w->t == t && !memcmp(w->rows, run->y, MECHC_NX * sizeof *run->y)) return 1;
    while (!(finite = mechc_taylor_expand_by(run, w, step)) && step > least) step *= MECHC_TAYLOR_OVERFLOWS;
    if (!finite) return 0;
    for (int i = 0; i < MECHC_NX; i++) MECHC_RATE(run, 0)[i] = MECHC_ROWS(w)[1][i] / w->scale;
    w->t = t;
    w->made = 1;
    return 1;
}

/* End the step just past the first zero of a root, if there is one in it: see series/step.h. */
MECHC_STATIC void mechc_taylor_keep_branches(mechc_integration *run, mechc_taylor_work *w)
{
#if MECHC_SERIES_ROOTS_MAX
    const double size = fabs(w->scale), part = run->step / size, left = fabs(run->t1 - w->t);
    w->to_zero = HUGE_VAL;
    if (mechc_scalar_branches_kept(MECHC_ROWS(w), w->order, part) > 0.0) return;
    const double past = mechc_just_past(w->t, w->scale, part);
    int zero;
    const double end = mechc_branches_end(w->rows, 1, w->order, part, past, &zero);
    if (!(end < part)) return;
    w->over_zero = run->step;
    run->step = end * size;
    if (zero) w->to_zero = run->step;
    if (left > run->step && left <= MECHC_TO_END * run->step) run->step *= 0.5; /* not lengthened to the end */
#else
    (void)run, (void)w;
#endif
}

/* From a zero or just past it, where the recurrences divide by next to nothing, the explicit pair takes
 * a step: its rates are those of the new branch. */
MECHC_STATIC void mechc_taylor_leave_zero(mechc_integration *run, mechc_taylor_work *w)
{
    mechc_rates_at(run, run->head.t, run->y, MECHC_RATE(run, 0));
    run->current = run->methods[MECHC_DOP853];
    run->step = run->monitor.wanted = w->over_zero;
    w->over_zero *= MECHC_SHRINKS; /* if that is too long */
}

/* Whether the step has ended just past a zero. */
MECHC_STATIC void mechc_taylor_accept(mechc_integration *run, double h)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    w->past_zero = NAN;
    if (fabs(h) < w->to_zero) return;
    w->past_zero = run->head.t + (h + run->time_compensation);
    run->alone = 1;
}

MECHC_STATIC int mechc_taylor_stays_alone(const mechc_integration *run)
{
    return mechc_taylor_of(run)->past_zero == run->head.t;
}

/* Leave a run by itself that will be long to collocation, if the method may change: that is symmetric, and its
 * errors do not add up to a drift. */
MECHC_STATIC int mechc_taylor_leaves_long(mechc_integration *run, double reach)
{
    const int alone = run->when_stiff == MECHC_RADAU5 && run->method->number == MECHC_TAYLOR;
    const double left = fabs(run->t1 - run->head.t);
    if (!alone || run->head.stats.steps || !(left > MECHC_TAYLOR_LONG * reach)) return 0;
    run->head.stats.left_series = mechc_use_method(run, run->methods[MECHC_GAUSS8]);
    if (!run->head.stats.left_series) mechc_use_method(run, run->methods[MECHC_TAYLOR]); /* no memory */
    return run->head.stats.left_series;
}

/* Lengthen or shorten the step to what the series allows. */
MECHC_STATIC void mechc_taylor_plan(mechc_integration *run)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    const int grows = !run->refused && run->head.stats.steps > 0;
    const double most = grows ? run->current->growth * run->step : run->step;
    if (w->past_zero != run->head.t && !mechc_taylor_expand(run, w))
        w->past_zero = run->head.t, w->over_zero = most;
    if (w->past_zero == run->head.t) {
        mechc_taylor_leave_zero(run, w);
        return;
    }
    const double reach = fabs(w->scale) * mechc_scalar_taylor_reach(w->sizes, w->order);
    if (mechc_taylor_leaves_long(run, reach)) return;
    w->bound = reach < most;
    run->step = w->bound ? reach : most;
    mechc_taylor_keep_branches(run, w);
    if (run->step >= mechc_smallest_step(run)) return;
    w->past_zero = run->head.t, w->over_zero = most; /* at the zero of a root, but for rounding */
    mechc_taylor_leave_zero(run, w);
}

MECHC_STATIC int mechc_taylor_step(mechc_integration *run, double h, double *end)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    const double part = h / w->scale;
    mechc_scalar_taylor_end(MECHC_ROWS(w), w->order, part, run->compensation, run->next_compensation, end);
    for (int i = 0; i < MECHC_NX; i++)
        if (!(fabs(end[i]) < HUGE_VAL)) {
            double y[MECHC_NX_MAX];
            memcpy(y, run->y, MECHC_NX * sizeof *y);
            const int status = mechc_rates_at(run, run->head.t, y, MECHC_RATE(run, 1));
            return status == MECHC_RUNNING ? MECHC_NOT_FINITE : status;
        }
    w->defect = 0.0;
    if (!MECHC_SERIES_HIDES) { /* only another method, which may follow, needs the rates of the end */
        if (run->when_stiff && run->stiff >= MECHC_STIFF - 1)
            mechc_scalar_rates(run->head.t + (h + run->time_compensation), end, &run->given, MECHC_RATE(run, 1));
        else memcpy(MECHC_RATE(run, 1), MECHC_RATE(run, 0), MECHC_NX * sizeof *run->y);
        return MECHC_RUNNING;
    }
    const int status = mechc_rates_at(run, run->head.t + h, end, MECHC_RATE(run, 1));
    w->defect = mechc_scalar_taylor_defect(MECHC_ROWS(w), w->order, part, w->scale, MECHC_RATE(run, 1),
                                           w->weights);
    return status;
}

/* The error for which the step was planned, or a larger one that the rates at its end show; past a
 * root's zero these are of another branch. */
MECHC_STATIC double mechc_taylor_error(mechc_integration *run, double h, const double *end)
{
    const mechc_taylor_work *w = mechc_taylor_of(run);
    (void)end;
    return fabs(h) < w->to_zero ? mechc_max(0.5, sqrt(w->defect)) : 0.5;
}

/* Whether stability limits the step. */
MECHC_STATIC int mechc_taylor_limited(const mechc_integration *run, double h, const double *end,
                                      double error)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    double moved[MECHC_NX_MAX] = {0.0}, rates[MECHC_NX_MAX];
    (void)end, (void)error;
    if (!w->bound || (!run->stiff && run->head.stats.steps % MECHC_TAYLOR_LOOK)) return 0;
    mechc_scalar_taylor_moved(run->y, MECHC_ROWS(w), w->order, w->sizes, moved);
    mechc_scalar_rates(run->head.t, moved, &run->given, rates);
    return mechc_scalar_taylor_stiffness(rates, MECHC_ROWS(w), w->scale, w->weights, h) > w->unstable;
}

/* The factor of the next step: 1, since the next series decides about it, unless this one is refused. */
MECHC_STATIC double mechc_taylor_factor(mechc_integration *run, double error)
{
    return error > 1.0 ? MECHC_SAFETY * pow(error, -1.0 / mechc_taylor_of(run)->order) : 1.0;
}

#if MECHC_SWITCHES_MAX
/* Switching functions at nodes of the step. */
MECHC_RARE void mechc_taylor_switching(mechc_integration *run, double h, double *values)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    const int nodes = MECHC_STAGES + 2;
    for (int node = 0; node < nodes; node++) {
        double y[MECHC_NX_MAX], unused[MECHC_NX_MAX], found[MECHC_SWITCHES_MAX];
        const double s = mechc_gauss8_nodes[node] * h;
        mechc_scalar_taylor_end(MECHC_ROWS(w), w->order, s / w->scale, run->compensation, unused, y);
        mechc_scalar_output_switching(run->head.t + s, y, y + MECHC_NQ, &run->given, found);
        for (int k = 0; k < MECHC_SWITCHES; k++) values[k * nodes + node] = found[k];
    }
}
#endif

MECHC_STATIC void mechc_taylor_dense(mechc_integration *run, double h, const double *end, int count,
                                     double *rows)
{
    mechc_taylor_work *w = mechc_taylor_of(run);
    mechc_scalar_taylor_dense(MECHC_ROWS(w), w->order, h / w->scale, end, count, rows);
}

static const mechc_method mechc_taylor = {
    MECHC_TAYLOR_TRAITS,
    .work_size = sizeof(mechc_taylor_work),
    .make = mechc_taylor_make,
    .enter = mechc_taylor_enter,
#if MECHC_HAS(TAYLOR_LANES)
    .together = mechc_taylor_together,
#endif
    .plan = mechc_taylor_plan,
    .accept = mechc_taylor_accept,
    .stays_alone = mechc_taylor_stays_alone,
    .step = mechc_taylor_step,
    .error = mechc_taylor_error,
    .factor = mechc_taylor_factor,
#if MECHC_SWITCHES_MAX
    .switching = mechc_taylor_switching,
#endif
    .shows_end = mechc_error_is_small,
    .limited = mechc_taylor_limited,
    .dense = mechc_taylor_dense,
};
#endif
