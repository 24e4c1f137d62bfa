/* Events in model exchange: on which side of its zero each event is, and resets where it is
 * crossed.
 *
 * The importer finds the zeros of the indicators and asks for event mode; resets are then made as a run
 * of mechc makes them.  A unit with contacts has co-simulation alone. */
#pragma once

#include "fmu/instance.h"

#if MECHC_FMU_EVENTS > 0 && !MECHC_FMU_CONTACTS
/* The search for events, beginning at the present state. */
MECHC_STATIC mechc_watch *mechc_fmu_watch(mechc_fmu *fmu)
{
    mechc_watch *watch = &fmu->reacher.hybrid.watch;
    mechc_fmu_motion(fmu);
    watch->zeros = 0;
    mechc_watch_enter(watch, fmu->now.t, fmu->now.y);
    return watch;
}

/* The sign of an event from now on; at zero, that of its rate.  After a reset beyond the zero,
 * which an importer has stepped over, it is the side to which the event returns. */
MECHC_STATIC double mechc_fmu_side(const mechc_fmu *fmu, int number)
{
    const mechc_watch *watch = &fmu->reacher.hybrid.watch;
    const mechc_event *event = watch->event + number;
    const double before = fmu->now.side[number];
    const double value = mechc_event_value(watch, number, fmu->now.t, fmu->now.y);
    if (event->side != 0.0) return event->side;
    if (before * value < 0.0 && event->later * value < 0.0) return before;
    return copysign(1.0, value);
}

/* Whether an event with a reset has crossed its zero in its direction. */
MECHC_STATIC int mechc_fmu_is_crossed(const mechc_fmu *fmu, int number)
{
    const double side = mechc_fmu_side(fmu, number);
    return side != fmu->now.side[number] && side * mechc_fmu_scene.policy[number].direction >= 0.0
        && mechc_event_resets(&fmu->reacher.hybrid.watch, number);
}

/* Whether an event was crossed that the importer has not found. */
MECHC_STATIC int mechc_fmu_missed(mechc_fmu *fmu)
{
    int missed = 0;
    const mechc_watch *watch = mechc_fmu_watch(fmu);
    for (int k = 0; k < MECHC_FMU_EVENTS; k++) {
        const double value = mechc_event_value(watch, k, fmu->now.t, fmu->now.y);
        missed |= mechc_fmu_is_crossed(fmu, k);
        if (value * fmu->now.side[k] > 0.0) fmu->now.away[k] = 0;
    }
    return missed;
}

MECHC_STATIC void mechc_fmu_take_sides(mechc_fmu *fmu)
{
    mechc_fmu_watch(fmu);
    for (int k = 0; k < MECHC_FMU_EVENTS; k++) fmu->now.side[k] = mechc_fmu_side(fmu, k);
}

/* Reset one event and those that it causes; each is then on the side that its rate leads to, and is
 * removed from `crossed`. */
MECHC_STATIC int mechc_fmu_apply(mechc_fmu *fmu, int number, unsigned char *crossed)
{
    mechc_watch *watch = &fmu->reacher.hybrid.watch;
    const int status = mechc_watch_reset(watch, number, 0, fmu->now.t, fmu->now.y);
    fmu->evaluated = 0;
    mechc_fmu_take_sides(fmu);
    for (int i = 0; i < watch->causes; i++) {
        const int cause = watch->cause[i];
        const double later = watch->event[cause].later;
        crossed[cause] = 0;
        fmu->now.away[cause] = 1;
        if (later != 0.0) fmu->now.side[cause] = copysign(1.0, later);
    }
    return status;
}

/* Event mode: reset the events whose zero was crossed in their direction. */
MECHC_STATIC int mechc_fmu_cross(mechc_fmu *fmu, int *changed)
{
    unsigned char crossed[MECHC_FMU_EVENTS];
    int status = MECHC_RUNNING;
    mechc_fmu_watch(fmu);
    for (int k = 0; k < MECHC_FMU_EVENTS; k++) {
        crossed[k] = (unsigned char)mechc_fmu_is_crossed(fmu, k);
        /* far from its zero, and not back on its side since its last reset: the importer's steps do
         * not separate its resets */
        if (crossed[k] && fmu->now.away[k] && fmu->reacher.hybrid.watch.event[k].side == 0.0)
            status = MECHC_RESETS_ACCUMULATE;
        fmu->now.side[k] = mechc_fmu_side(fmu, k);
    }
    *changed = 0;
    for (int k = 0; k < MECHC_FMU_EVENTS && status == MECHC_RUNNING; k++)
        if (crossed[k]) {
            status = mechc_fmu_apply(fmu, k, crossed);
            *changed = 1;
        }
    return status;
}
#else
MECHC_STATIC void mechc_fmu_take_sides(mechc_fmu *fmu) { (void)fmu; }
MECHC_STATIC int mechc_fmu_missed(mechc_fmu *fmu) { return (void)fmu, 0; }
MECHC_STATIC int mechc_fmu_cross(mechc_fmu *fmu, int *changed)
{
    (void)fmu;
    *changed = 0;
    return MECHC_RUNNING;
}
#endif
