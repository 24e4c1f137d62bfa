/* A motion to a sequence of increasing times, without a record of its steps.
 *
 * A mechanism without loops and events is integrated up to the time itself.  One with loops may come to a
 * change point, near which no step of the integrator should end: it is integrated in steps of their own
 * length, beyond the time, where the dense output is read; what happens after the time is applied when a
 * later one is asked for.  It begins again where inputs change.
 */
#pragma once

#include <limits.h>
#include "hybrid/driver.h"

#define MECHC_REACH_AHEAD 100.0        /* s that a run which may be ahead goes on before it begins again; or */
#define MECHC_STEPS_AHEAD 1000.0 /* times the interval to the time that is asked for */

typedef struct {
    mechc_hybrid hybrid;
    mechc_options options; /* as they are asked for */
    int ahead;             /* whether runs go beyond the times that are asked for */
    int anew;              /* a run begins again before the next time */
    double t, *y;          /* reached; the state there */
} mechc_reacher;

/* Begin the motion at a time and a state, with the parameters of the options. */
MECHC_STATIC void mechc_reach_from(mechc_reacher *reacher, double t, const double *y)
{
    mechc_hybrid *hybrid = &reacher->hybrid;
    mechc_hybrid_drop(hybrid);
    mechc_forget_counters(hybrid);
    reacher->t = t;
    reacher->anew = 0;
    memmove(reacher->y, y, (size_t)hybrid->motion.width * sizeof *y);
    memcpy(hybrid->motion.p, reacher->options.p, (size_t)hybrid->motion.parameters * sizeof *y);
    hybrid->inputs.segment = 0;
    if (mechc_has_events(hybrid)) mechc_watch_begin(&hybrid->watch);
    if (mechc_has_contacts(hybrid)) mechc_contacts_begin(&hybrid->contacts);
}

/* Drop all steps but the last state, and count steps from zero. */
MECHC_STATIC void mechc_forget_steps(mechc_hybrid *hybrid)
{
    mechc_keep_last(&hybrid->run->trajectory);
    hybrid->run->trajectory.crossing_count = 0;
    hybrid->run->stats.steps = hybrid->run->stats.rejected = 0;
    hybrid->ended.steps = hybrid->ended.rejected = 0;
    hybrid->searched = hybrid->watch.zeros = 0;
}

/* Forget the zeros that were found in steps beyond the time reached: they are found again. */
MECHC_STATIC void mechc_reach_forget_ahead(mechc_reacher *reacher)
{
    mechc_watch *watch = &reacher->hybrid.watch;
    for (ptrdiff_t i = 0; i < watch->zeros; i++)
        if (watch->zero[i].t > reacher->t) watch->event[watch->zero[i].event].count--;
    watch->zeros = 0;
}

/* Give up the run; what it has met counts. */
MECHC_STATIC void mechc_reach_drop(mechc_reacher *reacher)
{
    mechc_hybrid *hybrid = &reacher->hybrid;
    mechc_reach_forget_ahead(reacher);
    if (hybrid->live) mechc_add_stats(&hybrid->ended, &hybrid->run->stats);
    hybrid->ended.steps = hybrid->ended.rejected = 0;
    mechc_hybrid_drop(hybrid);
}

/* Begin a run from the current state, where there is none. */
MECHC_STATIC int mechc_reach_begin(mechc_reacher *reacher, double t1, int method)
{
    mechc_hybrid *hybrid = &reacher->hybrid;
    mechc_options options = reacher->options;
    options.t0 = reacher->t;
    options.t1 = t1;
    options.method = method;
    memcpy(hybrid->state, reacher->y, (size_t)hybrid->motion.width * sizeof(double));
    return mechc_hybrid_go_on(hybrid, &options);
}

/* Set the time and state that the run has reached. */
MECHC_STATIC void mechc_reach_end(mechc_reacher *reacher)
{
    reacher->t = mechc_hybrid_end(&reacher->hybrid, reacher->y);
}

/* Integrate exactly to a time; `changed`: inputs have new values. */
MECHC_STATIC int mechc_reach_exactly(mechc_reacher *reacher, double t1, int changed)
{
    mechc_hybrid *hybrid = &reacher->hybrid;
    mechc_motion *motion = &hybrid->motion;
    if (!hybrid->live) mechc_reach_begin(reacher, t1, reacher->options.method);
    else {
        mechc_forget_steps(hybrid);
        hybrid->options.t1 = motion->last = t1;
        mechc_enter_inputs(hybrid, reacher->t, reacher->y);
        const double end =
            hybrid->given ? mechc_segment_end(hybrid->given, &hybrid->inputs, t1, motion->sense) : t1;
        motion->unit->extend(hybrid->run, end, changed ? motion->inputs : 0);
        hybrid->status = hybrid->run->status;
    }
    return mechc_hybrid_advance(hybrid, LONG_MAX);
}

/* Whether a run ended beside a change point, where another method is more reliable. */
MECHC_STATIC int mechc_ended_beside(int status)
{
    return status == MECHC_UNDECIDED || status == MECHC_NO_STEP_FITS || status == MECHC_BRANCH_IN_DOUBT
        || status == MECHC_BEND_TOO_SHARP || status == MECHC_STEP_TOO_SMALL;
}

/* Take steps of free length until one has reached t1 or something happens before it; returns the
 * status. */
MECHC_STATIC int mechc_reach_steps(mechc_hybrid *hybrid, double t1)
{
    if (hybrid->run->t < t1 && isnan(hybrid->stop)) mechc_forget_steps(hybrid);
    while (hybrid->status == MECHC_RUNNING && hybrid->run->wanted < 0) {
        if (isnan(hybrid->stop) && hybrid->run->t >= t1) break;
        if (hybrid->stop > t1) break;
        if (isnan(hybrid->stop) && hybrid->run->status == MECHC_RUNNING) {
            hybrid->motion.unit->advance(hybrid->run, 1);
            const int status = mechc_hybrid_search(hybrid);
            if (status != MECHC_RUNNING) hybrid->status = status;
            else if (hybrid->run->status != MECHC_FINISHED) hybrid->status = hybrid->run->status;
        } else if (isnan(hybrid->stop)) hybrid->status = mechc_take_run_end(hybrid);
        else if (mechc_has_events(hybrid)) hybrid->status = mechc_take_event(hybrid);
    }
    return hybrid->status;
}

/* Integrate to or beyond a time, and read the dense output there. */
MECHC_STATIC int mechc_reach_beyond(mechc_reacher *reacher, double t1, int changed)
{
    mechc_hybrid *hybrid = &reacher->hybrid;
    int method = reacher->options.method;
    if (changed) mechc_reach_drop(reacher);
    for (;;) {
        const double ahead = fmax(MECHC_REACH_AHEAD, MECHC_STEPS_AHEAD * (t1 - reacher->t));
        if (!hybrid->live) mechc_reach_begin(reacher, reacher->t + ahead, method);
        const int status = mechc_reach_steps(hybrid, t1);
        if (hybrid->live && hybrid->run->wanted >= 0) return MECHC_RUNNING;
        if (status == MECHC_RUNNING || (hybrid->live && hybrid->run->t >= t1 && status == MECHC_FINISHED))
            return status;
        const int beside = mechc_ended_beside(status) && method != MECHC_DOP853;
        mechc_reach_end(reacher);
        if (status != MECHC_FINISHED && !beside) return status;
        method = beside ? MECHC_DOP853 : reacher->options.method;
        mechc_reach_drop(reacher);
    }
}

/* The ways to treat the memory of a motion. */
enum { MECHC_MEASURE, MECHC_SAVE, MECHC_RESTORE };

/* Measure, save or restore a part of it at a place; returns the place of the next. */
MECHC_STATIC size_t mechc_remember(int what, char *bytes, size_t at, void *part, size_t size)
{
    if (what == MECHC_SAVE) memcpy(bytes + at, part, size);
    if (what == MECHC_RESTORE) memcpy(part, bytes + at, size);
    return at + (size + sizeof(double) - 1) / sizeof(double) * sizeof(double);
}

/* The memory of a motion beside its run: parameters, which resets change, events and contacts.  Returns its
 * bytes. */
MECHC_STATIC size_t mechc_reach_memory(mechc_hybrid *hybrid, int what, char *bytes)
{
    mechc_motion *motion = &hybrid->motion;
    mechc_watch *watch = &hybrid->watch;
    mechc_contacts *contacts = &hybrid->contacts;
    const size_t n = (size_t)contacts->laws.count, number = sizeof(double);
    size_t at = mechc_remember(what, bytes, 0, motion->p, (size_t)motion->parameters * number);
    if (mechc_has_events(hybrid)) {
        at = mechc_remember(what, bytes, at, watch->event, (size_t)watch->own * sizeof *watch->event);
        at = mechc_remember(what, bytes, at, &watch->step, number);
    }
    if (!mechc_has_contacts(hybrid)) return at;
    at = mechc_remember(what, bytes, at, contacts->mode, 6 * n);
    at = mechc_remember(what, bytes, at, contacts->fastest_gap, n * number);
    at = mechc_remember(what, bytes, at, contacts->fastest_slip, n * number);
    at = mechc_remember(what, bytes, at, contacts->speeds_met, (size_t)motion->speeds * number);
    at = mechc_remember(what, bytes, at, &contacts->changed_at, number);
    return mechc_remember(what, bytes, at, &contacts->changes, sizeof contacts->changes);
}

/* What the driver knows of a moment; its memory and, where there is one, the run follow. */
typedef struct {
    double t1;
    ptrdiff_t segment, has_run;
} mechc_saved_driver;

/* Whether a run is saved: one with events is not, but begins again, whether or not it is restored. */
MECHC_STATIC int mechc_reach_saves_run(const mechc_reacher *reacher, int with_run)
{
    return with_run && reacher->hybrid.live && !mechc_has_events(&reacher->hybrid);
}

/* The bytes that saving the moment takes, with its run or without. */
MECHC_STATIC size_t mechc_reach_saved_size(mechc_reacher *reacher, int with_run)
{
    mechc_hybrid *hybrid = &reacher->hybrid;
    const size_t size = sizeof(mechc_saved_driver) + mechc_reach_memory(hybrid, MECHC_MEASURE, 0);
    if (!mechc_reach_saves_run(reacher, with_run)) return size;
    return size + hybrid->motion.unit->saved_size(hybrid->run);
}

MECHC_STATIC void mechc_reach_save(mechc_reacher *reacher, void *to, int with_run)
{
    mechc_hybrid *hybrid = &reacher->hybrid;
    const int has_run = mechc_reach_saves_run(reacher, with_run);
    const mechc_saved_driver at = {hybrid->options.t1, hybrid->inputs.segment, has_run};
    char *bytes = (char *)to + sizeof at;
    if (mechc_has_events(hybrid)) {
        mechc_reach_forget_ahead(reacher);
        reacher->anew = 1;
    }
    memcpy(to, &at, sizeof at);
    bytes += mechc_reach_memory(hybrid, MECHC_SAVE, bytes);
    if (has_run) hybrid->motion.unit->save(hybrid->run, bytes);
}

/* Restore a state and what was saved there; NULL: begin with the parameters of the options.  0 without
 * memory. */
MECHC_STATIC int mechc_reach_restore(mechc_reacher *reacher, double t, const double *y, const void *saved)
{
    mechc_hybrid *hybrid = &reacher->hybrid;
    mechc_saved_driver at = {0};
    char *bytes = (char *)saved + sizeof at;
    if (saved) memcpy(&at, saved, sizeof at);
    if (!at.has_run || !hybrid->live) mechc_reach_from(reacher, t, y);
    if (saved) bytes += mechc_reach_memory(hybrid, MECHC_RESTORE, bytes);
    if (at.has_run && !hybrid->live) mechc_reach_begin(reacher, t + 1.0, reacher->options.method);
    if (at.has_run && !hybrid->live) return 0;
    if (at.has_run) {
        hybrid->motion.unit->restore(hybrid->run, bytes);
        hybrid->options.t1 = hybrid->motion.last = at.t1;
        mechc_hybrid_back(hybrid, at.segment);
    }
    reacher->t = t;
    memmove(reacher->y, y, (size_t)hybrid->motion.width * sizeof *y);
    return 1;
}

/* The state at t1, later than before.  Returns MECHC_RUNNING or MECHC_FINISHED, or why the motion
 * has only come to reacher->t.  If the code of a method is missing, call again once it is there. */
MECHC_STATIC int mechc_reach_time(mechc_reacher *reacher, double t1, int changed)
{
    mechc_hybrid *hybrid = &reacher->hybrid;
    changed |= reacher->anew;
    reacher->anew = 0;
    if (hybrid->live) hybrid->options.max_steps = reacher->options.max_steps;
    const int status = (reacher->ahead ? mechc_reach_beyond : mechc_reach_exactly)(reacher, t1, changed);
    const int reached = status == MECHC_RUNNING || status == MECHC_FINISHED;
    if (hybrid->live && hybrid->run->wanted >= 0) return status;
    if (reached && reacher->ahead) {
        hybrid->motion.states(&hybrid->motion, 1, &t1, reacher->y);
        reacher->t = t1;
    } else mechc_reach_end(reacher);
    return status;
}
