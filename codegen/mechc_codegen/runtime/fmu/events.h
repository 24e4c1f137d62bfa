/* Events of a unit: the side of its zero on which each is, and the resets that crossings make.
 *
 * In model exchange the importer finds the zeros of the indicators and asks for event mode; in
 * co-simulation they are found on the dense output of the steps.  Both apply them as a run of
 * mechc does. */
#pragma once

#include "fmu/instance.h"

#if MECHC_FMU_EVENTS > 0
/* The events from the present state on. */
MECHC_STATIC void mechc_fmu_watch(mechc_fmu *fmu)
{
    mechc_fmu_scale(fmu, fmu->scale);
    fmu->watch.p = fmu->now.p;
    fmu->watch.inputs = MECHC_NI > 0 ? &fmu->held.head : 0;
    fmu->watch.scale = fmu->scale;
    fmu->watch.rtol = fmu->now.rtol;
    fmu->watch.sense = 1.0;
    fmu->watch.zeros = 0;
    mechc_watch_enter(&fmu->watch, fmu->now.t, fmu->now.y);
}

/* A motion begins: nothing has happened yet. */
MECHC_STATIC void mechc_fmu_begin_events(mechc_fmu *fmu)
{
    const mechc_options options = {.t0 = 0.0, .t1 = 1.0, .rtol = fmu->now.rtol};
    mechc_watch_begin(&fmu->watch, &options);
}

/* The sign that an event has from now on: where it is zero, that of its rate.  After a reset beyond
 * the zero, where an importer has stepped over it, it stays on the side to which it returns. */
MECHC_STATIC double mechc_fmu_side(const mechc_fmu *fmu, int number)
{
    const mechc_event *event = fmu->watch.event + number;
    const double before = fmu->now.side[number];
    const double value = mechc_event_value(&fmu->watch, number, fmu->now.t, fmu->now.y);
    if (event->side != 0.0) return event->side;
    if (before * value < 0.0 && event->later * value < 0.0) return before;
    return copysign(1.0, value);
}

/* Whether an event with a reset has come to the other side of its zero in its direction. */
MECHC_STATIC int mechc_fmu_is_crossed(const mechc_fmu *fmu, int number)
{
    const double side = mechc_fmu_side(fmu, number);
    return side != fmu->now.side[number] && side * mechc_fmu_scene.directions[number] >= 0.0
        && mechc_event_resets(&fmu->watch, number);
}

/* Whether one was crossed that the importer has not found. */
MECHC_STATIC int mechc_fmu_missed(mechc_fmu *fmu)
{
    int missed = 0;
    if (!MECHC_FMU_RESETS) return 0;
    mechc_fmu_current(fmu);
    mechc_fmu_watch(fmu);
    for (int k = 0; k < MECHC_FMU_EVENTS; k++) {
        const double value = mechc_event_value(&fmu->watch, k, fmu->now.t, fmu->now.y);
        missed |= mechc_fmu_is_crossed(fmu, k);
        if (value * fmu->now.side[k] > 0.0) fmu->now.away[k] = 0;
    }
    return missed;
}

/* Whether an event that was crossed is far from its zero and has not been back on its side since
 * its last reset: the importer's steps do not tell its resets apart. */
MECHC_STATIC int mechc_fmu_is_too_fast(const mechc_fmu *fmu, int number)
{
    return fmu->now.away[number] && fmu->watch.event[number].side == 0.0;
}

MECHC_STATIC void mechc_fmu_take_sides(mechc_fmu *fmu)
{
    mechc_fmu_watch(fmu);
    for (int k = 0; k < MECHC_FMU_EVENTS; k++) fmu->now.side[k] = mechc_fmu_side(fmu, k);
}

/* The reset of one event and of those that it causes, which are then on the side that their rates
 * lead to; `crossed` is cleared of them. */
MECHC_STATIC int mechc_fmu_apply(mechc_fmu *fmu, int number, unsigned char *crossed)
{
    mechc_watch *watch = &fmu->watch;
    watch->stopped_by = number;
    const int status = mechc_watch_reset(watch, fmu->now.t, fmu->now.y);
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

/* Event mode: resets of the events whose zero was crossed in their direction. */
MECHC_STATIC int mechc_fmu_cross(mechc_fmu *fmu, int *changed)
{
    unsigned char crossed[MECHC_FMU_EVENTS];
    int status = MECHC_RUNNING;
    mechc_fmu_current(fmu);
    mechc_fmu_watch(fmu);
    for (int k = 0; k < MECHC_FMU_EVENTS; k++) {
        crossed[k] = (unsigned char)mechc_fmu_is_crossed(fmu, k);
        if (crossed[k] && mechc_fmu_is_too_fast(fmu, k)) status = MECHC_RESETS_ACCUMULATE;
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

/* Co-simulation: a run begins at the present state. */
MECHC_STATIC void mechc_fmu_watch_run(mechc_fmu *fmu)
{
    mechc_fmu_watch(fmu);
    fmu->looked = 0;
    fmu->stop = HUGE_VAL;
}

/* Search the new steps of the run for the next reset. */
MECHC_STATIC int mechc_fmu_look(mechc_fmu *fmu)
{
    double stop = HUGE_VAL;
    const int status = mechc_watch_look(&fmu->watch, &fmu->run->trajectory, &fmu->looked, &stop);
    fmu->watch.zeros = 0;
    if (status == MECHC_STOPPED_BY_EVENT) fmu->stop = stop;
    return status == MECHC_STOPPED_BY_EVENT ? MECHC_RUNNING : status;
}

/* The state at the reset that the run has come to, and after it. */
MECHC_STATIC int mechc_fmu_reset_at_stop(mechc_fmu *fmu)
{
    unsigned char crossed[MECHC_FMU_EVENTS];
    fmu->now.t = fmu->stop;
    mechc_interpolate(&fmu->run->trajectory, fmu->now.p, MECHC_NI > 0 ? &fmu->held.head : 0, 1,
                      &fmu->stop, fmu->now.y);
    return mechc_fmu_apply(fmu, fmu->watch.stopped_by, crossed);
}
#else
MECHC_STATIC void mechc_fmu_begin_events(mechc_fmu *fmu) { (void)fmu; }
MECHC_STATIC void mechc_fmu_take_sides(mechc_fmu *fmu) { (void)fmu; }
MECHC_STATIC int mechc_fmu_missed(mechc_fmu *fmu) { return (void)fmu, 0; }
#endif
