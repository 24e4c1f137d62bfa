/* Which runs may continue side by side: those of one method, far from critical configurations. */
#pragma once

#include "run/integration.h"
#include "run/method.h"

#define MECHC_LOCKSTEP_LOW 0.2   /* conditioning below which a run continues alone */
#define MECHC_LOCKSTEP_BACK 0.25 /* and above which it comes back */

/* Larger states and their stages leave the first cache. */
#define MECHC_LOCKSTEP (MECHC_NX <= 32 && MECHC_NC == MECHC_NH)

/* Does the run continue by the method asked for, or by the one that this leaves it to alone? */
MECHC_STATIC int mechc_keeps_method(const mechc_integration *run)
{
    const mechc_method *asked = run->methods[run->number];
    const int alone = asked->alone && run->method->number == asked->alone && !run->resumed;
    return run->current == run->method && ((int)run->method->number == run->number || alone);
}

MECHC_STATIC int mechc_fits_lockstep(const mechc_integration *run)
{
    const mechc_method *asked = run->methods[run->number];
    const mechc_monitor *monitor = &run->monitor;
    const int alone = run->alone || monitor->tries || monitor->wanted != 0.0;
    if (!MECHC_LOCKSTEP || alone || run->limits || !asked->in_lockstep) return 0;
    if (!mechc_keeps_method(run)) return 0;
    return MECHC_NH == 0 || (monitor->rank == MECHC_NH && monitor->first >= MECHC_LOCKSTEP_LOW);
}

/* After an accepted step of a run by itself. */
MECHC_STATIC void mechc_return_to_lockstep(mechc_integration *run)
{
    run->last_step = run->last_factor = 0.0;
    if (run->current->stays_alone && run->current->stays_alone(run)) return;
    if (MECHC_NH == 0 || run->monitor.first > MECHC_LOCKSTEP_BACK) run->alone = 0;
}
