/* Resets of the state by events, also several at one instant. */
#pragma once

#include "hybrid/events/search.h"

#define MECHC_RESET_SETTLED 1e-12 /* of the largest rate at an instant: an approach so slow is none */
#define MECHC_RESET_PLASTIC 1e-9  /* of the rate before: what is left where the motion is not turned */
#define MECHC_RESET_SHORTEST 64.0 /* times the exactness of its time: nearer resets accumulate */
#define MECHC_RESET_ROUNDS 4.0  /* times the rounding of an event's terms: its value may be zero */
#define MECHC_RESET_NEAR 16.0   /* times the rounding: a value that shows its sign */
#define MECHC_RESET_LEFT 0.5    /* of the distance at its rate since the last reset: an event so far from zero comes from that */
#define MECHC_RESET_FLIGHT 64.0 /* times the rounding: a distance between two zeros that are not one */

#define MECHC_RESET_TOUCHING 10.0 /* times rtol of an event's largest value: it may be zero */
#define MECHC_EVENT_CHANGE 1e-6   /* of a component's size: over such a change differences are taken */

/* The time below which two resets are one: steps do not resolve it, or zeros are not located so well. */
MECHC_STATIC double mechc_at_once(const mechc_watch *watch, double t)
{
    const double shortest = MECHC_SMALLEST_STEP * fmax(fabs(t), fabs(watch->motion->last - t));
    return MECHC_RESET_SHORTEST * fmax(mechc_located(watch, t), shortest);
}

/* The bound below which an event counts as zero, given how exactly the motion is known. */
MECHC_STATIC double mechc_event_nothing(const mechc_watch *watch, int number)
{
    return MECHC_RESET_TOUCHING * watch->motion->rtol * watch->event[number].size;
}

/* Derivatives of a caller's function by central differences; the rates of the state set the scale
 * of time. */
MECHC_STATIC void mechc_event_differences(const mechc_watch *watch, int number, double t, const double *y,
                                    double *slopes)
{
    const mechc_motion *motion = watch->motion;
    double *moved = watch->rates + motion->width, fastest = 0.0;
    for (int i = 0; i < motion->width; i++)
        fastest = fmax(fastest, fabs(watch->rates[i]) / (fabs(y[i]) + motion->scale[i]));
    const double step = MECHC_EVENT_CHANGE / (fastest > 0.0 ? fastest : 1.0);
    slopes[0] = (mechc_event_value(watch, number, t + step, y)
                 - mechc_event_value(watch, number, t - step, y)) / (2.0 * step);
    memcpy(moved, y, (size_t)motion->width * sizeof *y);
    for (int i = 0; i < motion->width; i++) {
        const double by = MECHC_EVENT_CHANGE * (fabs(y[i]) + motion->scale[i]);
        const double high = y[i] + by, low = y[i] - by;
        moved[i] = high;
        const double above = mechc_event_value(watch, number, t, moved);
        moved[i] = low;
        slopes[1 + i] = (above - mechc_event_value(watch, number, t, moved)) / (high - low);
        moved[i] = y[i];
    }
}

/* The rate of an event by the known rates of the state, and the rounding of its value. */
MECHC_STATIC double mechc_event_rate(mechc_watch *watch, int number, double t, const double *y)
{
    const mechc_motion *motion = watch->motion;
    const mechc_event_functions *functions = watch->functions + number;
    double *slopes = watch->slopes;
    if (functions->slopes) functions->slopes(functions->context, t, y, motion->p, slopes);
    else mechc_event_differences(watch, number, t, y, slopes);
    double rate = slopes[0], terms = fabs(slopes[0] * t);
    for (int i = 0; i < motion->width; i++) {
        rate += slopes[1 + i] * watch->rates[i];
        terms += fabs(slopes[1 + i] * y[i]);
    }
    watch->event[number].rounding = DBL_EPSILON * terms;
    return motion->sense * rate;
}

/* Compute the rates of all events with a reset into event->later, and the rounding of their values;
 * 0 for other events. */
MECHC_STATIC void mechc_event_rates(mechc_watch *watch, double t, const double *y)
{
    watch->motion->rates(watch->motion, t, y, watch->rates);
    for (int k = 0; k < watch->own; k++) {
        watch->event[k].later = watch->event[k].rounding = 0.0;
        if (mechc_event_resets(watch, k) && watch->functions[k].value)
            watch->event[k].later = mechc_event_rate(watch, k, t, y);
    }
}

/* Whether an event counts as zero; a zero that is clearly ahead is found later, and one that it comes from
 * has reset the state. */
MECHC_STATIC int mechc_event_touches(const mechc_watch *watch, int number, double t, const double *y)
{
    const double value = mechc_event_value(watch, number, t, y), rate = watch->event[number].later;
    const double since = fabs(t - watch->event[number].last);
    const int left = since > mechc_at_once(watch, t) && fabs(value) >= MECHC_RESET_LEFT * fabs(rate) * since;
    const double soon = 2.0 * mechc_located(watch, t) * fabs(rate)
                      + MECHC_RESET_ROUNDS * watch->event[number].rounding;
    const int passed = !left && value * rate > 0.0 && fabs(value) <= mechc_event_nothing(watch, number);
    return fabs(value) <= soon || passed;
}

/* Store the side of zero on which each event is at the start of a piece. */
MECHC_STATIC void mechc_watch_enter(mechc_watch *watch, double t, const double *y)
{
    watch->start = t;
    mechc_event_rates(watch, t, y);
    for (int k = 0; k < watch->own; k++) {
        mechc_event *event = watch->event + k;
        const int at = !event->idle && event->later != 0.0 && mechc_event_touches(watch, k, t, y);
        event->side = at ? copysign(1.0, event->later) : 0.0;
        event->near = at ? MECHC_RESET_NEAR * event->rounding / fabs(event->later) : 0.0;
    }
}

/* Whether a zero at t, with the rate event->later there, coincides with the last one: neither its
 * time nor the way between them separates the two. */
MECHC_STATIC int mechc_is_now(const mechc_watch *watch, const mechc_event *event, double last, double t)
{
    const double way = fabs(t - last) * fmax(fabs(event->after), fabs(event->later));
    return fabs(t - last) <= mechc_at_once(watch, t)
        || way <= MECHC_RESET_FLIGHT * event->rounding;
}

/* Whether a reset stops the motion towards the zero and leaves the state on it. */
MECHC_STATIC int mechc_reset_stays(const mechc_watch *watch, int number, double t, const double *y)
{
    const mechc_event *event = watch->event + number;
    const int moved = fabs(event->rate) > MECHC_RESET_PLASTIC * event->fastest;
    const int ends = moved && fabs(event->later) <= MECHC_RESET_PLASTIC * fabs(event->rate);
    return ends
        && fabs(mechc_event_value(watch, number, t, y)) <= mechc_event_nothing(watch, number);
}

/* The number of another event that is zero and about to be crossed, or of one that the last reset
 * allows to be crossed again; -1: none. */
MECHC_STATIC int mechc_reset_caused(const mechc_watch *watch, double t, const double *y, double largest)
{
    for (int k = 0; k < watch->own; k++) {
        const mechc_event *event = watch->event + k;
        const double direction = watch->policy[k].direction;
        int crosses = !event->done && event->rate * event->later > 0.0;
        if (!watch->functions[k].reset) continue;
        if (direction)
            crosses = copysign(1.0, direction) * event->later > MECHC_RESET_SETTLED * largest;
        if (crosses && !mechc_is_now(watch, event, event->passed, t) && mechc_event_touches(watch, k, t, y))
            return k;
    }
    return -1;
}

/* The state after the reset of one event, projected onto the constraints; parameters are adopted.
 * 0 if there is none. */
MECHC_STATIC int mechc_reset_state(mechc_watch *watch, int number, double t, double *y)
{
    mechc_motion *motion = watch->motion;
    const size_t width = (size_t)motion->width, parameters = (size_t)motion->parameters;
    const mechc_event_functions *functions = watch->functions + number;
    double *after = watch->reset;
    memcpy(after, y, width * sizeof *y);
    memcpy(after + width, motion->p, parameters * sizeof *y);
    if (!functions->reset(functions->context, t, y, motion->p, after)) return 0;
    if (!mechc_is_finite(after, motion->width) || !mechc_motion_may_have(motion, after + width)) return 0;
    memcpy(y, after, width * sizeof *y);
    if (memcmp(motion->p, after + width, parameters * sizeof *y)) {
        memcpy(motion->p, after + width, parameters * sizeof *y);
        mechc_motion_renew(motion);
    }
    return mechc_onto_constraints(motion, t, y, watch->room);
}

/* Reset one event; event->rate holds the rates before, event->later gets those after. */
MECHC_STATIC int mechc_reset_one(mechc_watch *watch, int number, double t, double *y, double *largest)
{
    mechc_event *event = watch->event + number;
    event->last = t;
    event->done = 1;
    for (int k = 0; k < watch->own; k++)
        watch->event[k].fastest = fmax(watch->event[k].fastest, fabs(watch->event[k].rate));
    if (!mechc_reset_state(watch, number, t, y)) return MECHC_EVENT_FAILED;
    mechc_event_rates(watch, t, y);
    for (int k = 0; k < watch->own; k++)
        *largest = fmax(*largest, fmax(fabs(watch->event[k].rate), fabs(watch->event[k].later)));
    event->after = event->later;
    if (mechc_reset_stays(watch, number, t, y)) return MECHC_RESETS_ACCUMULATE;
    event->passed = event->rate * event->later > 0.0 ? t : NAN;
    return MECHC_RUNNING;
}

/* Reset the state by an event and by those that it causes at once, all recorded as zeros in
 * `piece`.  Returns MECHC_RUNNING, MECHC_RESETS_ACCUMULATE, or why it failed. */
MECHC_STATIC int mechc_watch_reset(mechc_watch *watch, int number, int piece, double t, double *y)
{
    double largest = 0.0;
    watch->causes = 0;
    for (int k = 0; k < watch->own; k++) watch->event[k].done = 0;
    mechc_event_rates(watch, t, y);
    const int accumulate = mechc_is_now(watch, watch->event + number, watch->event[number].last, t);
    for (int i = 0; i < MECHC_RESETS_AT_ONCE; i++) {
        for (int k = 0; k < watch->own; k++) watch->event[k].rate = watch->event[k].later;
        if (i && !mechc_watch_keep(watch, number, t, piece, y)) return MECHC_NO_MEMORY;
        watch->event[number].latest = t;
        watch->cause[watch->causes++] = number;
        const int code = mechc_reset_one(watch, number, t, y, &largest);
        if (code != MECHC_RUNNING) return code;
        number = mechc_reset_caused(watch, t, y, largest);
        if (number < 0) return accumulate ? MECHC_RESETS_ACCUMULATE : MECHC_RUNNING;
    }
    return MECHC_RESETS_ACCUMULATE;
}
