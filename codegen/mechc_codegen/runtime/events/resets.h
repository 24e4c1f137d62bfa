/* Resets of the state by events: those of one instant, and what they leave of the motion. */
#pragma once

#include "events/search.h"
#include "events/stops.h"

#define MECHC_RESET_SETTLED 1e-12 /* of the largest rate at an instant: an approach so slow is none */
#define MECHC_RESET_PLASTIC 1e-9  /* of the rate before: what is left where the motion is not turned */
#define MECHC_RESET_SHORTEST 64.0 /* times the exactness of its time: nearer resets accumulate */
#define MECHC_RESETS_AT_ONCE 1000
#define MECHC_RESET_ROUNDS 4.0  /* times the rounding of an event's terms: its value may be zero */
#define MECHC_RESET_NEAR 16.0   /* times it: a value that tells its sign */
#define MECHC_RESET_FLIGHT 64.0 /* times it: how far it goes where a zero is told from the last */

/* Rates of all events with a reset along the motion, into event->later, and the roundings of their
 * values; 0 of others. */
static void mechc_event_rates(mechc_watch *watch, double t, const double *y)
{
    mechc_given *given = (mechc_given *)watch->prepared;
    watch->unit->give(watch->p, watch->inputs, given);
    watch->unit->rates(t, y, given, watch->rates);
    for (int k = 0; k < watch->count; k++) {
        double *slopes = watch->slopes, rate, terms;
        watch->event[k].later = watch->event[k].rounding = 0.0;
        if (!mechc_event_resets(watch, k)) continue;
        watch->functions[k].slopes(t, y, watch->p, slopes);
        rate = slopes[0];
        terms = fabs(slopes[0] * t);
        for (int i = 0; i < watch->width; i++) {
            rate += slopes[1 + i] * watch->rates[i];
            terms += fabs(slopes[1 + i] * y[i]);
        }
        watch->event[k].later = watch->sense * rate;
        watch->event[k].rounding = DBL_EPSILON * terms;
    }
}

/* Whether an event is zero as far as the motion is known; what is clearly still to come is found
 * later. */
static int mechc_event_touches(const mechc_watch *watch, int number, double t, const double *y)
{
    const double value = mechc_event_value(watch, number, t, y), rate = watch->event[number].later;
    const double soon = 2.0 * mechc_located(t) * fabs(rate)
                      + MECHC_RESET_ROUNDS * watch->event[number].rounding;
    const int passed = value * rate > 0.0 && fabs(value) <= mechc_event_nothing(watch, number);
    return fabs(value) <= soon || passed;
}

/* A motion begins at this state: the side of each event's zero on which it does. */
static void mechc_watch_enter(mechc_watch *watch, double t, const double *y)
{
    watch->start = t;
    mechc_event_rates(watch, t, y);
    for (int k = 0; k < watch->count; k++) {
        mechc_event *event = watch->event + k;
        const int at = event->later != 0.0 && mechc_event_touches(watch, k, t, y);
        event->side = at ? copysign(1.0, event->later) : 0.0;
        event->near = at ? MECHC_RESET_NEAR * event->rounding / fabs(event->later) : 0.0;
    }
}

/* Whether a zero at t, with the rate event->later there, is told from the last one by neither its
 * time nor the way between them. */
static int mechc_is_now(const mechc_event *event, double last, double t)
{
    const double way = fabs(t - last) * fmax(fabs(event->after), fabs(event->later));
    return fabs(t - last) <= MECHC_RESET_SHORTEST * mechc_located(t)
        || way <= MECHC_RESET_FLIGHT * event->rounding;
}

/* Whether a reset ends the motion towards the zero and leaves the state there. */
static int mechc_reset_stays(const mechc_watch *watch, int number, double t, const double *y)
{
    const mechc_event *event = watch->event + number;
    const int moved = fabs(event->rate) > MECHC_RESET_PLASTIC * event->fastest;
    const int ends = moved && fabs(event->later) <= MECHC_RESET_PLASTIC * fabs(event->rate);
    return ends
        && fabs(mechc_event_value(watch, number, t, y)) <= mechc_event_nothing(watch, number);
}

/* Another event that is zero and about to be crossed, or one that the last reset lets cross again;
 * -1: none. */
static int mechc_reset_caused(const mechc_watch *watch, double t, const double *y, double largest)
{
    for (int k = 0; k < watch->count; k++) {
        const mechc_event *event = watch->event + k;
        int crosses = !event->done && event->rate * event->later > 0.0;
        if (!mechc_event_resets(watch, k)) continue;
        if (event->direction)
            crosses = copysign(1.0, event->direction) * event->later
                    > MECHC_RESET_SETTLED * largest;
        if (crosses && !mechc_is_now(event, event->passed, t) && mechc_event_touches(watch, k, t, y))
            return k;
    }
    return -1;
}

/* The state after the reset of one event, on the constraints; 0 where there is none. */
static int mechc_reset_state(mechc_watch *watch, int number, double t, double *y)
{
    double *after = watch->rates + 2 * watch->width;
    if (watch->functions[number].restitution) {
        if (!mechc_stop_impact(watch, number, t, y)) return 0;
    } else {
        watch->functions[number].reset(t, y, watch->p, after);
        memcpy(y, after, (size_t)watch->width * sizeof(double));
    }
    for (int i = 0; i < watch->width; i++)
        if (!(fabs(y[i]) < HUGE_VAL)) return 0;
    return mechc_onto_constraints(watch, t, y);
}

/* The reset of an event whose rates before are in event->rate; those after come into event->later.
 */
static int mechc_reset_one(mechc_watch *watch, int number, double t, double *y, double *largest)
{
    mechc_event *event = watch->event + number;
    event->last = t;
    event->done = 1;
    if (!mechc_reset_note(watch, number, y)) return MECHC_NO_MEMORY;
    for (int k = 0; k < watch->count; k++)
        watch->event[k].fastest = fmax(watch->event[k].fastest, fabs(watch->event[k].rate));
    if (!mechc_reset_state(watch, number, t, y)) return MECHC_EVENT_FAILED;
    mechc_event_rates(watch, t, y);
    for (int k = 0; k < watch->count; k++)
        *largest = fmax(*largest, fmax(fabs(watch->event[k].rate), fabs(watch->event[k].later)));
    event->after = event->later;
    if (mechc_reset_stays(watch, number, t, y)) return MECHC_RESETS_ACCUMULATE;
    event->passed = event->rate * event->later > 0.0 ? t : NAN;
    return MECHC_RUNNING;
}

/* Whether parts that touch neither approach each other nor part: contact may last. */
static int mechc_stops_rest(const mechc_watch *watch, double t, const double *y, double largest)
{
    for (int k = 0; k < watch->count; k++) {
        const mechc_event *event = watch->event + k;
        if (!watch->functions[k].restitution || fabs(event->later) > MECHC_RESET_PLASTIC * largest)
            continue;
        const double nothing = fmax(mechc_event_nothing(watch, k),
                                    MECHC_RESET_ROUNDS * event->rounding);
        if (fabs(mechc_event_value(watch, k, t, y)) <= nothing) return 1;
    }
    return 0;
}

/* The state after the reset of the event that stopped the search, and those that it causes at the
 * same instant.  MECHC_RUNNING, MECHC_RESETS_ACCUMULATE, or why there is none. */
static int mechc_watch_reset(mechc_watch *watch, double t, double *y)
{
    int number = watch->stopped_by;
    const int accumulate = mechc_is_now(watch->event + number, watch->event[number].last, t);
    double largest = 0.0;
    watch->causes = 0;
    for (int k = 0; k < watch->count; k++) watch->event[k].done = 0;
    mechc_event_rates(watch, t, y);
    for (int i = 0; i < MECHC_RESETS_AT_ONCE; i++) {
        for (int k = 0; k < watch->count; k++) watch->event[k].rate = watch->event[k].later;
        if (i) {
            watch->event[number].count++;
            watch->event[number].latest = t;
        }
        const int code = mechc_reset_one(watch, number, t, y, &largest);
        if (code != MECHC_RUNNING) return code;
        number = mechc_reset_caused(watch, t, y, largest);
        if (number < 0) {
            const int rest = accumulate || mechc_stops_rest(watch, t, y, largest);
            return rest ? MECHC_RESETS_ACCUMULATE : MECHC_RUNNING;
        }
    }
    return MECHC_RESETS_ACCUMULATE;
}
