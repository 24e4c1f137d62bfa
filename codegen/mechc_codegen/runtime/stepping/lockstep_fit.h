/* The conditions for runs to continue side by side: one method, far from critical configurations. */
#pragma once

#include "run/method.h"

/* Of so many steps the last ones are watched for a jump about which they chatter, alone. */
#define MECHC_CHATTER_STEPS 4096
#define MECHC_CHATTER_WATCH 64
#define MECHC_IS_WATCHED(steps)                                                                   \
    (((steps) & (MECHC_CHATTER_STEPS - 1)) >= MECHC_CHATTER_STEPS - MECHC_CHATTER_WATCH)

/* Conditioning, or in blocks sine and share, below which a run continues alone. */
#define MECHC_LOCKSTEP_LOW 0.2
#define MECHC_LOCKSTEP_BACK 0.25 /* and above which it comes back */

/* Whether the run uses the requested method, or the one that replaces it outside lockstep. */
MECHC_STATIC int mechc_keeps_method(const mechc_integration *run)
{
    const mechc_method *asked = run->methods[run->number];
    const int alone = asked->alone && run->method->number == asked->alone && !run->resumed;
    return run->current == run->method && ((int)run->method->number == run->number || alone);
}

/* Whether the rows at the run's state are that far from dependence. */
MECHC_STATIC int mechc_is_regular(const mechc_integration *run, double low)
{
    if (MECHC_NC == 0 || (MECHC_NC == MECHC_NH && run->monitor.first >= low)) return 1;
#if MECHC_NC_MAX > MECHC_NH_MAX || MECHC_BLOCKS_CODE || (MECHC_GENERAL && MECHC_NC_MAX > 0)
    if (MECHC_NC == MECHC_NH && MECHC_ROW_BLOCKS == 0) return 0;
    mechc_scalar_place place;
    const double least = MECHC_NC > MECHC_NH ? low : MECHC_NARROW;
    if (MECHC_NH > 0 && run->monitor.first < least) return 0;
    mechc_locate(run->head.t, run->y, &run->given, &place);
    return mechc_scalar_regularity_at(&place) >= low * low;
#else
    return 0;
#endif
}

MECHC_STATIC int mechc_fits_lockstep(const mechc_integration *run)
{
    const mechc_method *asked = run->methods[run->number];
    const mechc_monitor *monitor = &run->monitor;
    const int alone = run->alone || monitor->tries || monitor->wanted != 0.0;
    const int all = asked->in_lockstep == MECHC_WITHOUT_SWITCHES;
    if ((all ? MECHC_SWITCHES : MECHC_FEATURES + MECHC_KNOTTED) > 0) return 0;
    if (!MECHC_LOCKSTEP || alone || run->limits || run->outer || !asked->in_lockstep) return 0;
    if (!mechc_keeps_method(run)) return 0;
    if (MECHC_NH > 0 && monitor->rank != MECHC_NH) return 0;
    return run->regular || mechc_is_regular(run, MECHC_LOCKSTEP_LOW);
}

/* Return to lockstep, if possible, after an accepted step of a run that was alone. */
MECHC_STATIC void mechc_return_to_lockstep(mechc_integration *run)
{
    run->last_step = run->last_factor = 0.0;
    if (MECHC_SWITCHES && MECHC_IS_WATCHED(run->head.stats.steps)) return;
    if (!mechc_is_loaded(run->current)) return; /* it has not been entered yet */
    if (run->current->stays_alone && run->current->stays_alone(run)) return;
    const mechc_monitor *monitor = &run->monitor;
    const int low = MECHC_NH > 0 && MECHC_NC == MECHC_NH && monitor->first <= MECHC_LOCKSTEP_BACK;
    if (!run->alone || (low && !monitor->leaving)) return;
    if (mechc_is_regular(run, MECHC_LOCKSTEP_BACK)) run->alone = 0;
}
