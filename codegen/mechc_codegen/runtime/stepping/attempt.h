/* The driver's loop: a step is tried, refused or accepted, whatever the method. */
#pragma once

#include "stepping/lockstep_fit.h"
#include "stepping/passages.h"
#include "stepping/stiffness.h"
#include "stepping/switches.h"

/* Conditioning above which a crossing that the pair was left to is passed. */
#define MECHC_LEFT_BEHIND (MECHC_NC > 2 ? 0.2 : 0.1)

/* The step to try; returns 1 if it is the last. */
MECHC_STATIC int mechc_next_step(mechc_integration *run, double *h)
{
    if (run->current->plan) run->current->plan(run);
    const double left = fabs(run->t1 - run->head.t), free = mechc_min(run->step, run->max_step);
    const double step = run->limits ? mechc_within_limits(run, free) : free;
    if (MECHC_SWITCHES && run->switches.cut > 0.0) { /* to the zero of a switching function */
        *h = run->direction * mechc_min(run->switches.cut, left);
        return run->switches.cut >= left;
    }
    if (run->current->reach) {
        const double open = mechc_min(step, left), planned = mechc_step_ahead(run, open);
        *h = run->direction * planned;
        if (planned != open && planned < mechc_min(left, run->max_step)) return 0;
        if (planned == left && left <= run->max_step) return mechc_fit_to_end(run, left, h);
    }
    return mechc_fit_to_end(run, step, h);
}

/* Compute the rows of the dense output if they are recorded or needed for a crossing. */
MECHC_STATIC int mechc_finish_step(mechc_integration *run, double h, const double *end)
{
    mechc_trajectory *trajectory = &run->head.trajectory;
    const int passes = mechc_may_pass(run, h, end);
    double own[MECHC_MOST_DENSE * MECHC_NX_MAX], *rows = own;
    const int wanted = trajectory->dense_rows || passes;
    if (!wanted && MECHC_NH == 0) return MECHC_RUNNING;
    if (!mechc_make_room(trajectory)) return MECHC_NO_MEMORY;
    /* whether its stages close decides about the step, so they are taken in any case */
    const int status = run->current->dense_stages ? run->current->dense_stages(run, h)
                                                  : MECHC_RUNNING;
    if (status != MECHC_RUNNING || !wanted) return status;
    const int count = trajectory->dense_rows ? trajectory->dense_rows : run->most_dense;
    if (trajectory->dense_rows) {
        rows = trajectory->dense + (trajectory->count - 1) * trajectory->width * count;
        trajectory->methods[trajectory->count - 1] = (unsigned char)run->current->number;
    }
    run->current->dense(run, h, end, count, rows);
    return passes ? mechc_record_passages(run, h, end, rows) : MECHC_RUNNING;
}

/* Tell the monitor about an accepted step, whose end has this conditioning. */
MECHC_STATIC void mechc_monitor_accept(mechc_integration *run, double h, double conditioning)
{
    mechc_monitor *monitor = &run->monitor;
    monitor->leaving = conditioning > monitor->first;
    monitor->fall = (monitor->first - conditioning) / fabs(h);
    monitor->first = conditioning;
    monitor->tries = 0;
    monitor->ahead = NAN;
}

/* Accept a step: record it and continue from its end. */
MECHC_STATIC int mechc_accept(mechc_integration *run, double h, double t, const double *end,
                              double error)
{
    const double conditioning = run->conditioning;
    const int status = mechc_finish_step(run, h, end);
    int made = 1;
    if (status != MECHC_RUNNING) return status;
    mechc_watch_stiffness(run, h, end, error);
    if (run->current->accept) run->current->accept(run, h);
    memcpy(run->y, end, MECHC_NX * sizeof *end);
    memcpy(run->compensation, run->next_compensation, MECHC_NX * sizeof *run->compensation);
    memcpy(MECHC_RATE(run, 0), MECHC_RATE(run, run->current->last_rate), MECHC_NX * sizeof *end);
    run->time_compensation = h + run->time_compensation - (t - run->head.t);
    run->head.t = t;
    run->refused_step = 0.0;
    run->failure = 0;
    if (run->monitor.leaving && conditioning > MECHC_LEFT_BEHIND)
        made = mechc_come_back(run);
    if (!mechc_nears_critical(&run->monitor, run->horizon)) {
        run->allowed = 1.0;
        run->monitor.stayed = 0;
    }
    mechc_monitor_accept(run, h, conditioning);
    made &= mechc_change_method(run);
    for (int i = MECHC_NQ; i < MECHC_NX; i++) /* speeds are judged against the largest met so far */
        run->scale[i] = mechc_max(run->scale[i], fabs(run->y[i]));
    mechc_return_to_lockstep(run);
    run->head.stats.steps++;
    made &= mechc_append_turned(&run->head.trajectory, t, run->y, run->turns);
    if (!run->outer) mechc_take_turns(run->y, run->turns);
    return made ? MECHC_RUNNING : MECHC_NO_MEMORY;
}

/* Try again from the same state, with the step multiplied by `factor`. */
MECHC_STATIC int mechc_refuse(mechc_integration *run, double factor)
{
    run->head.stats.rejected++;
    run->step *= factor;
    run->refused = 1;
    mechc_leave_bridge(run);
    run->monitor.wanted = 0.0;
    return MECHC_RUNNING;
}

/* The status if no step succeeds: beside a critical configuration, doubles cannot decide it. */
MECHC_STATIC int mechc_too_small(const mechc_integration *run)
{
    const int examined = run->head.stats.critical_gap < HUGE_VAL;
    if (run->failure == MECHC_NOT_FINITE) return MECHC_NOT_FINITE;
    if (MECHC_NH > 0 && examined && run->monitor.least < MECHC_NARROW)
        return mechc_knows_crossing(&run->monitor) ? MECHC_NO_STEP_FITS : MECHC_BEND_TOO_SHARP;
    return run->failure ? run->failure : MECHC_STEP_TOO_SMALL;
}

/* Handle a stage that could not be computed. */
MECHC_STATIC int mechc_fail(mechc_integration *run, double h, int status)
{
    const int over = status == MECHC_NO_MEMORY || status == MECHC_INTERRUPTED;
    if (over || fabs(h) < mechc_smallest_step(run)) return status;
    run->step = fabs(h);
    run->failure = status;
    if (mechc_step_aside(run, h)) {
        mechc_refuse(run, 1.0);
        mechc_leave_to_pair(run, h);
        return MECHC_RUNNING;
    }
    return mechc_refuse(run, run->current->after_failure);
}

/* A node that came near a crossing spoils a step more than its length does: place the crossing
 * between the nodes rather than shrink the step. */
MECHC_STATIC int mechc_place_instead(mechc_integration *run, double h, const double *end,
                                     double error)
{
    if (!run->current->shows_end(run, error) || run->monitor.tries >= 4) return 0;
    return mechc_examine_step(run, h, end) == MECHC_RUNNING
        && run->decision.action == MECHC_RETRY;
}

/* Handle a step whose error is too large. */
MECHC_STATIC int mechc_shorten(mechc_integration *run, double h, const double *end, double error,
                               double factor)
{
    if (fabs(h) < mechc_smallest_step(run)) return mechc_too_small(run);
    if (mechc_place_instead(run, h, end, error)) return MECHC_RUNNING;
    mechc_learn_rounding(run, h, error);
    return mechc_refuse(run, error > 1.0 ? factor : MECHC_SHRINKS);
}

/* Choose the next step's length after an accepted step. */
MECHC_STATIC void mechc_lengthen(mechc_integration *run, double h, double error, double factor)
{
    mechc_stats *stats = &run->head.stats;
    if (error > 1.0) {
        const double part = run->current->root_error ? error * error : error;
        stats->rounding = mechc_max(stats->rounding, part * run->method->share * run->rtol);
    }
    run->step = mechc_max(run->step * mechc_max(factor, error > 1.0), run->monitor.wanted);
    if (run->current->farthest < HUGE_VAL)
        run->step = mechc_min(run->step, run->current->farthest * fabs(h));
    mechc_leave_bridge(run);
    run->monitor.wanted = 0.0;
    run->monitor.patience = HUGE_VAL;
    run->refused = 0;
}

/* The error of a step, or that beside its ends where this refuses it: steps that are accepted keep theirs. */
MECHC_STATIC double mechc_with_ends(const mechc_integration *run, double h, double error)
{
    const int start = !mechc_is_at_switch(run->switches.at_start);
    const int end = !mechc_is_at_switch(run->switches.at_end);
    if (!run->current->ends_error || !(error <= run->allowed)) return error;
    const double beside = run->current->ends_error(run, h, start, end);
    return beside > run->allowed ? beside : error;
}

/* The rounding in an error that would shorten steps, over what is tolerated; at least 1. */
MECHC_STATIC double mechc_known_rounding(mechc_integration *run, double h, const double *end, double error)
{
    const int shortens = run->alike ? error > MECHC_ALIKE_SHORTENS : !(error <= run->allowed);
    const double rounding = shortens && error < HUGE_VAL ? mechc_rounding_of_error(run, h, end) : 0.0;
    run->alike &= rounding > 1.0;
    return mechc_max(1.0, rounding);
}

/* Make one attempt; returns the run's status after it. */
MECHC_STATIC int mechc_attempt(mechc_integration *run)
{
    const double t = run->head.t;
    double end[MECHC_NX_MAX], h;
    if (mechc_scalar_stopped(&run->given)) return MECHC_INTERRUPTED;
    if (!mechc_is_loaded(run->current) && !mechc_use_loaded(run)) return run->head.status;
    const int last = mechc_next_step(run, &h);
    if (!mechc_is_loaded(run->current) && !mechc_use_loaded(run)) return run->head.status;
    if (run->monitor.bends && run->current->reach) {
        mechc_leave_to_pair(run, h);
        return MECHC_RUNNING;
    }
    if (!last && fabs(h) < mechc_smallest_step(run)) return mechc_too_small(run);
    run->monitor.least = run->monitor.most = run->monitor.first;
    memcpy(run->monitor.q, run->y, MECHC_NQ * sizeof *run->y);
    run->alike = 0;
    const int status = run->current->step(run, h, end);
    const double inner = status == MECHC_RUNNING ? run->current->error(run, h, end) : HUGE_VAL;
    if (mechc_cut_at_switch(run, h, end, status, inner)) return run->head.status;
    if (status != MECHC_RUNNING) return mechc_fail(run, h, status);
    const double error = mechc_with_ends(run, h, inner);
    run->step = fabs(h);
    const double part = error / mechc_known_rounding(run, h, end, error);
    const double factor = mechc_limited_factor(run, part);
    if (!(part <= run->allowed)) return mechc_shorten(run, h, end, error, factor);
    const int examined = mechc_examine_step(run, h, end);
    if (examined != MECHC_RUNNING || run->decision.action == MECHC_RETRY) return examined;
    const double t_end = last ? run->t1 : t + (h + run->time_compensation);
    const int accepted = mechc_accept(run, h, t_end, end, error);
    if (accepted == MECHC_NO_MEMORY || accepted == MECHC_STOPPED_AT_CHANGE_POINT) return accepted;
    if (accepted != MECHC_RUNNING) /* the dense output's own stages could not be closed */
        return mechc_refuse(run, 0.5);
    mechc_lengthen(run, h, error, factor);
    const int passed = mechc_pass_switches(run);
    return last ? MECHC_FINISHED : passed;
}

/* Make up to `steps` attempts, fewer if the run is fit for lockstep; returns their number. */
MECHC_STATIC long mechc_advance_alone(mechc_integration *run, long steps)
{
    mechc_run *head = &run->head;
    long made = 0;
    run->regular = 0;
    do {
        const int most = head->stats.steps + head->stats.rejected >= run->max_steps;
        head->status = most ? MECHC_TOO_MANY_STEPS : mechc_attempt(run);
        made++;
    } while (head->status == MECHC_RUNNING && head->wanted < 0 && made < steps
             && (run->current->by_itself || !mechc_fits_lockstep(run)));
    return made;
}

static const __attribute__((unused)) mechc_driver mechc_driver_of_run = {
    mechc_rates_at, mechc_conditioning_at,
};
