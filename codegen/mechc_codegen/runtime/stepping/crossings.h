/* The behaviour of a run at critical configurations: all functions of singularities/ that the
 * driver needs.
 *
 * monitor_start: at the start.   step_ahead: before a step is tried.   leave_to_pair, step_aside,
 * come_back: steps that a method leaves to the explicit pair of order 8.   examine_step: may a step
 * stand?   Where it went through change points is recorded by passages.h.
 */
#pragma once

#include "run/dense_output.h"
#include "singularities/look_ahead.h"
#include "stepping/work.h"

#if MECHC_NH_MAX > 0
/* The rank of the configuration rows around a configuration: the most that is found when each speed
 * in turn has moved it a little and the loops are closed again. */
MECHC_RARE int mechc_generic_rank(const mechc_integration *run)
{
    const mechc_scalar_given *given = &run->given;
    int rank = 0;
    for (int j = 0; j < MECHC_NU && !mechc_scalar_stopped(given); j++) {
        double by[MECHC_NU_MAX] = {0}, q[MECHC_NX_MAX];
        long unused = 0;
        mechc_scalar_place place;
        mechc_weakest weakest;
        by[j] = MECHC_NEARBY * mechc_given_unit(given, MECHC_NQ + j);
        mechc_displace(run->head.t, run->y, given, by, q);
        if (mechc_close_loops(run->head.t, q, given, &place, &unused) != MECHC_RUNNING) continue;
        mechc_weakest_of(&place, 0, &weakest);
        if (weakest.found > rank) rank = weakest.found;
    }
    return rank;
}

/* Whether the conditioning at the start, that of the rows that count, shows that no row is
 * redundant.  Of n rows the least singular value is at most n^(1/2) 2^(n-1) times as small as what
 * is left of the last row in an elimination. */
MECHC_STATIC int mechc_shows_all_rows(const mechc_integration *run)
{
    const int of_all = !MECHC_WALKED && MECHC_NC == MECHC_NH && MECHC_NH < 8
                    && run->given.k[MECHC_ROWS_THAT_COUNT] == MECHC_NC;
    return of_all && run->conditioning * run->conditioning > MECHC_NO_ROW;
}

/* Find the rows that are redundant everywhere; where more are, the start is a change point. */
MECHC_RARE void mechc_find_rank(mechc_integration *run)
{
    mechc_weakest weakest;
    mechc_weakest_at(run->head.t, run->y, &run->given, 0, &weakest);
    run->monitor.rank = weakest.rank;
    if (weakest.found < MECHC_NH) {
        const int generic = mechc_generic_rank(run);
        /* where every row vanishes they may do so at this configuration alone, and none is beside */
        run->monitor.at_critical = weakest.found == 0 || generic > weakest.found;
        if (generic > weakest.found) mechc_weakest_at(run->head.t, run->y, &run->given, generic, &weakest);
        run->monitor.rank = weakest.rank;
    }
    run->conditioning = weakest.ratio;
}
#endif

/* Begin monitoring, with the start's rates known. */
MECHC_RARE void mechc_monitor_start(mechc_integration *run)
{
#if MECHC_NH_MAX > 0
    if (MECHC_NH == 0 || mechc_shows_all_rows(run)) run->monitor.rank = MECHC_NH;
    else mechc_find_rank(run);
#endif
    run->monitor.first = run->conditioning;
    run->monitor.ahead = NAN;
}

/* The data of a step from the run's state; its end may not be known yet. */
MECHC_STATIC mechc_span mechc_span_of(const mechc_integration *run, double h, const double *end,
                                      const double *end_rates)
{
    const mechc_method *method = run->current;
    return (mechc_span){
        .t = run->head.t,
        .h = h,
        .start = run->y,
        .start_rates = MECHC_RATE(run, 0),
        .end = end,
        .end_rates = end_rates,
        .given = &run->given,
        .low = run->low,
        .best = run->best,
        .high = run->high,
        .horizon = run->horizon,
        .bridge = method->holds_crossing,
        .first = run->head.stats.steps == 0,
        .last = mechc_is_last(run, h),
        .left = fabs(run->t1 - run->head.t),
        .looks_ahead = method->reach != 0,
        .nodes = method->nodes,
    };
}

/* The step to try, normally no longer than `open`. */
MECHC_STATIC double mechc_step_ahead(mechc_integration *run, double open)
{
#if MECHC_NH_MAX > 0
    const mechc_span span =
        mechc_span_of(run, run->direction * open, run->y, MECHC_RATE(run, 0));
    return mechc_plan_ahead(&span, &run->monitor, run->refused, run->current->reach(run));
#else
    (void)run;
    return open;
#endif
}

/* Return to the method in use and its step, after one step by the pair across a crossing. */
MECHC_STATIC void mechc_leave_bridge(mechc_integration *run)
{
    if (run->current == run->method) return;
    run->current = run->method;
    run->step = run->monitor.wanted;
}

/* Let the explicit pair take the steps that follow. */
MECHC_STATIC void mechc_leave_to_pair(mechc_integration *run, double h)
{
    run->resumed = run->method;
    run->step = 0.25 * fabs(h);
    run->monitor.wanted = 0.0;
    run->monitor.bends = 0;
    mechc_use_method(run, run->methods[MECHC_DOP853]);
}

/* Whether the method can start beside a crossing: only collocation can. */
MECHC_STATIC int mechc_starts_beside(const mechc_integration *run)
{
    return run->head.stats.steps == 0 && run->monitor.first < MECHC_TOO_NEAR;
}

/* Step with the pair over a crossing so near that a step's error is only rounding, as magnified there. */
MECHC_STATIC void mechc_straddle_with_pair(mechc_integration *run)
{
    if (mechc_starts_beside(run)) return;
    if (run->method->reach) {
        run->resumed = run->method;
        mechc_use_method(run, run->methods[MECHC_DOP853]);
    }
    run->allowed =
        mechc_max(run->allowed, MECHC_ROUNDING_ALLOWED / (run->method->share * run->rtol));
}

/* Collocation takes the steps that start or end beside a crossing, whatever the method; 0 without
 * memory. */
MECHC_STATIC int mechc_leave_to_collocation(mechc_integration *run)
{
    run->resumed = run->method->alone ? run->methods[run->method->alone] : run->method;
    run->monitor.wanted = 0.0;
    return mechc_use_method(run, run->methods[MECHC_GAUSS8]);
}

/* Where several rows are weak together, and in the bend of a near miss, the iteration magnifies
 * rounding more than an explicit step does.  1 where the pair is to continue. */
MECHC_STATIC int mechc_step_aside(mechc_integration *run, double h)
{
    const mechc_monitor *monitor = &run->monitor;
    const int here = MECHC_NH > 0 && (monitor->ahead < fabs(h) || monitor->first < MECHC_CLEAR);
    return run->current->reach && here && !mechc_starts_beside(run) && ++run->missed >= 2;
}

/* Return, past the crossing, to the method that left it to the pair; 0 without memory. */
MECHC_STATIC int mechc_come_back(mechc_integration *run)
{
    const mechc_method *method = run->resumed;
    run->missed = 0;
    run->resumed = 0;
    return !method || mechc_use_method(run, method);
}

#if MECHC_NH_MAX > 0
/* A configuration on the cubic through both ends of a step, with its loops closed; 1 if that fails. */
MECHC_STATIC int mechc_close_on_cubic(const mechc_span *span, double s, double *q)
{
    const double r = 1.0 - s;
    double closed[MECHC_NQ_MAX];
    long unused = 0;
    mechc_scalar_place place;
    for (int i = 0; i < MECHC_NQ; i++)
        q[i] = span->start[i] * r * r * (1.0 + 2.0 * s) + span->end[i] * s * s * (3.0 - 2.0 * s)
             + span->h * s * r * (span->start_rates[i] * r - span->end_rates[i] * s);
    memcpy(closed, q, MECHC_NQ * sizeof *q);
    if (mechc_scalar_stopped(span->given)
        || mechc_close_loops(span->t + s * span->h, closed, span->given, &place, &unused)
               != MECHC_RUNNING)
        return 1;
    memcpy(q, closed, MECHC_NQ * sizeof *q);
    return 0;
}

/* The configurations of a step, those of the method if it stores them. */
MECHC_STATIC void mechc_path_of(const mechc_integration *run, const mechc_span *span,
                                mechc_path *path)
{
    const mechc_method *method = run->current;
    const int last = method->node ? method->nodes.count : MECHC_MOST_NODES - 1;
    path->count = last + 1;
    for (int i = 0; i <= last; i++) {
        const double s = method->node ? method->nodes.at[i] : (double)i / last;
        double *q = path->q[i];
        path->fraction[i] = s;
        path->open[i] = 0;
        if (i == 0 || i == last) memcpy(q, i ? span->end : span->start, MECHC_NQ * sizeof *q);
        else if (method->node) method->node(run, i, q);
        else path->open[i] = mechc_close_on_cubic(span, s, q);
    }
}

/* Of the conditioning: below it a motion in contact is not followed; of its change over a step: a value
 * so much smaller may have been zero between the stages. */
#define MECHC_POOR_IN_CONTACT 1e-3
#define MECHC_HIDES 0.5

/* Refuse a step over a change point by rates that are not those of the scene. */
MECHC_RARE int mechc_examine_outer(mechc_integration *run, double h)
{
    const mechc_monitor *monitor = &run->monitor;
    run->head.stats.examined++;
    if (monitor->least < MECHC_POOR_IN_CONTACT) return MECHC_NEARLY_DEPENDENT;
    if (monitor->least >= MECHC_HIDES * (monitor->most - monitor->least)) return MECHC_RUNNING;
    run->decision.action = MECHC_RETRY;
    run->head.stats.rejected++;
    run->step = 0.5 * fabs(h);
    run->refused = 1;
    return MECHC_RUNNING;
}
#endif

/* Judge a step that its error allows; decision.action is MECHC_RETRY if it is rejected. */
MECHC_STATIC int mechc_examine_step(mechc_integration *run, double h, const double *end)
{
    run->decision.action = MECHC_STANDS;
#if MECHC_NH_MAX > 0
    if (MECHC_NH == 0) return MECHC_RUNNING;
    if (!mechc_nears_critical(&run->monitor, run->horizon)) return MECHC_RUNNING;
    if (run->outer) return mechc_examine_outer(run, h);
    mechc_path path;
    mechc_span span = mechc_span_of(run, h, end, MECHC_RATE(run, run->current->last_rate));
    mechc_path_of(run, &span, &path);
    span.path = &path;
    mechc_stats *stats = &run->head.stats;
    run->decision.gap = HUGE_VAL;
    mechc_examine(&span, &run->monitor, &run->decision);
    if (mechc_scalar_stopped(&run->given)) return MECHC_INTERRUPTED;
    if (run->decision.action == MECHC_STANDS && run->monitor.least < MECHC_NARROW
        && !mechc_keeps_work(run, &span))
        mechc_retry(&run->decision, MECHC_ASTRAY, 0);
    stats->examined++;
    if (fabs(run->decision.gap) < stats->critical_gap) {
        stats->critical_gap = fabs(run->decision.gap);
        stats->critical_time = run->head.t;
    }
    if (run->decision.action == MECHC_CANNOT_TELL) {
        stats->critical_gap = fabs(run->decision.gap); /* the reason */
        stats->critical_time = run->head.t;
        return run->decision.why;
    }
    if (run->decision.action == MECHC_RETRY) {
        const int bridge = run->decision.bridge && !run->method->holds_crossing;
        run->monitor.tries++;
        stats->rejected++;
        run->step = fabs(h) * run->decision.factor;
        run->refused = run->monitor.wanted == 0.0;
        if (run->decision.to_pair) mechc_straddle_with_pair(run);
        if (run->decision.to_collocation && !mechc_leave_to_collocation(run))
            return MECHC_NO_MEMORY;
        run->current = bridge ? run->methods[MECHC_DOP853] : run->method;
    }
#else
    (void)h, (void)end;
#endif
    return MECHC_RUNNING;
}
