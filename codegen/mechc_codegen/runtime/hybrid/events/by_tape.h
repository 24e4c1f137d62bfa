/* Functions of events and laws of contacts as tapes, which are run for one state. */
#pragma once

#ifndef MECHC_LANES
#define MECHC_LANES 1
#endif
#include "hybrid/events/functions.h"
#include "simd/bind_scalar.h"
#include "tape/run.h"
#include "simd/unbind.h"

/* The tapes of one event, or that of the contacts' quantities; -1: it has none.  Their arrays are the state, the
 * parameters, and what they write. */
typedef struct {
    const mechc_tape_code *code;
    int value, slopes, reset, contacts;
} mechc_event_tapes;

MECHC_STATIC double mechc_run_event_tape(const mechc_event_tapes *event, int tape, double t, const double *y,
                                         const double *p, double *out)
{
    double *arrays[] = {(double *)y, (double *)p, out};
    return mechc_scalar_run_tape(event->code, tape, arrays, &t, 0, 0, 0);
}

MECHC_STATIC double mechc_value_by_tape(void *event, double t, const double *y, const double *p)
{
    return mechc_run_event_tape(event, ((const mechc_event_tapes *)event)->value, t, y, p, 0);
}

MECHC_STATIC void mechc_slopes_by_tape(void *event, double t, const double *y, const double *p, double *slopes)
{
    mechc_run_event_tape(event, ((const mechc_event_tapes *)event)->slopes, t, y, p, slopes);
}

MECHC_STATIC int mechc_reset_by_tape(void *event, double t, const double *y, const double *p, double *after)
{
    mechc_run_event_tape(event, ((const mechc_event_tapes *)event)->reset, t, y, p, after);
    return 1;
}

MECHC_STATIC int mechc_contacts_by_tape(void *event, double t, const double *state, const double *p, double *table)
{
    mechc_run_event_tape(event, ((const mechc_event_tapes *)event)->contacts, t, state, p, table);
    return 1;
}
