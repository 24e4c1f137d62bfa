/* The pieces of a member's motion between resets of its state by events.
 *
 * A run ends at an event, and another one begins with the state after its reset; counters go on.
 */
#pragma once

#include <math.h>
#include <string.h>
#include "abi/model.h"
#include "events/resets.h"

typedef struct {
    const mechc_event_unit *unit; /* NULL: no events */
    const double *directions;
    const long *terminal;
    int coordinates, speeds, rows;
    long *counts;   /* out: zeros of each event, a row a member */
    double *latest; /* the last of each, s; NaN where there was none */
} mechc_batch_events;

typedef struct {
    mechc_watch watch;
    mechc_options options; /* of the member, for the pieces that follow */
    mechc_stats before;    /* of the pieces that ended */
    long crossings;        /* change points that they passed */
    int number;            /* pieces so far */
} mechc_pieces;

/* 0 without memory. */
static int mechc_pieces_make(const mechc_batch_events *events, const mechc_unit *unit,
                             mechc_pieces *pieces)
{
    if (!events->unit) return 1;
    if (!mechc_watch_make(&pieces->watch, unit, events->unit, events->coordinates, events->speeds,
                          events->rows))
        return 0;
    for (int k = 0; k < pieces->watch.count; k++) {
        pieces->watch.event[k].direction = events->directions[k];
        pieces->watch.event[k].terminal = events->terminal[k];
    }
    return 1;
}

/* A member's run has begun with these options. */
static void mechc_pieces_begin(const mechc_batch_events *events, mechc_pieces *pieces,
                               const mechc_options *options, const mechc_run *run)
{
    memset(&pieces->before, 0, sizeof pieces->before);
    pieces->before.least_singular = pieces->before.critical_gap = HUGE_VAL;
    pieces->crossings = 0;
    pieces->number = 1;
    pieces->options = *options;
    if (!events->unit) return;
    mechc_watch_begin(&pieces->watch, options);
    if (run->trajectory.count) mechc_watch_enter(&pieces->watch, run->t, run->trajectory.y);
}

/* Search the steps that are kept; see mechc_watch_step. */
static int mechc_pieces_look(const mechc_batch_events *events, mechc_pieces *pieces,
                             const mechc_trajectory *steps, double *stop)
{
    ptrdiff_t looked = 0;
    return events->unit ? mechc_watch_look(&pieces->watch, steps, &looked, stop) : MECHC_RUNNING;
}

/* Counters of all pieces, the one of these included. */
static mechc_stats mechc_pieces_stats(const mechc_pieces *pieces, const mechc_stats *now)
{
    mechc_stats all = pieces->before;
    all.steps += now->steps;
    all.rejected += now->rejected;
    all.rhs_evaluations += now->rhs_evaluations;
    all.closure_iterations += now->closure_iterations;
    all.least_singular = fmin(all.least_singular, now->least_singular);
    all.critical_gap = fmin(all.critical_gap, now->critical_gap);
    return all;
}

/* Whether a reset ends the run too. */
static int mechc_pieces_end(const mechc_pieces *pieces, int number)
{
    const mechc_event *event = pieces->watch.event + number;
    return event->terminal > 0 && event->count >= event->terminal;
}

/* Begin the next piece with the state y at time t, and inputs from there on; `crossings`: of the one
 * that ended.  The status with which the run goes on or ends; `code`: that of the reset. */
static int mechc_pieces_next(mechc_pieces *pieces, mechc_run *run, double t, double *y, int code,
                             long crossings, const mechc_inputs *inputs)
{
    const mechc_unit *unit = pieces->watch.unit;
    mechc_options *options = &pieces->options;
    const long left = options->max_steps - run->stats.steps - run->stats.rejected;
    const int ends = mechc_pieces_end(pieces, pieces->watch.cause[0]);
    mechc_options next;
    pieces->before = mechc_pieces_stats(pieces, &run->stats);
    pieces->crossings += crossings;
    pieces->number++;
    unit->release(run);
    options->first_step = 0.0;
    options->max_steps = left > 1 ? left : 1;
    next = *options;
    next.t0 = t;
    next.y0 = y;
    next.inputs = inputs;
    if (ends || code == MECHC_RESETS_ACCUMULATE) next.t1 = t;
    unit->start(run, &next);
    if (run->trajectory.count) mechc_watch_enter(&pieces->watch, t, run->trajectory.y);
    if (code == MECHC_RESETS_ACCUMULATE) return code;
    if (ends) return MECHC_STOPPED_BY_EVENT;
    return left > 0 ? MECHC_RUNNING : MECHC_TOO_MANY_STEPS;
}

static void mechc_pieces_report(const mechc_batch_events *events, const mechc_pieces *pieces,
                                ptrdiff_t member)
{
    const int count = events->unit ? pieces->watch.count : 0;
    for (int k = 0; k < count; k++) {
        events->counts[member * count + k] = pieces->watch.event[k].count;
        events->latest[member * count + k] = pieces->watch.event[k].latest;
    }
}
