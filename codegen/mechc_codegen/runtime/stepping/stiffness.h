/* Where stability, not accuracy, limits the steps: the implicit method takes over. */
#pragma once

#include "run/integration.h"
#include "run/method.h"
#include "singularities/monitor.h"

#define MECHC_STIFF 15 /* such steps, with fewer than MECHC_EASY others in a row between */
#define MECHC_EASY 6

/* Count an accepted step. */
MECHC_STATIC void mechc_watch_stiffness(mechc_integration *run, double h, const double *end,
                                        double error)
{
    const mechc_method *method = run->method;
    if (!run->may_stiffen || run->current != method || !method->limited) return;
    if (MECHC_NH > 0 && run->monitor.first < MECHC_NARROW) return;
    const int limited = method->limited(run, h, end, error);
    run->stiff = limited ? run->stiff + 1 : run->stiff;
    run->easy = limited ? 0 : run->easy + 1;
    if (run->easy >= MECHC_EASY) run->stiff = 0;
}
