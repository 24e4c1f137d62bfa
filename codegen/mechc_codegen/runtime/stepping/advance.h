/* Advance of runs: side by side if method and state allow it, otherwise one by one. */
#pragma once

#include "stepping/attempt.h"

/* The number of requested attempts that a run has left. */
MECHC_STATIC long mechc_attempts_left(const mechc_integration *run, long steps)
{
    const long left = run->max_steps - run->head.stats.steps - run->head.stats.rejected;
    return left < steps ? left : steps;
}

/* Change to the method in lockstep, or to the one that continues alone; 0 without memory. */
MECHC_STATIC int mechc_take_place(mechc_integration *run)
{
    const mechc_method *asked = run->methods[run->number];
    if (!asked->alone || !mechc_keeps_method(run)) return 1;
    const int number = mechc_fits_lockstep(run) ? run->number : (int)asked->alone;
    if ((int)run->method->number == number) return 1;
    if (mechc_use_method(run, run->methods[number])) return 1;
    run->head.status = MECHC_NO_MEMORY;
    return 0;
}

/* Whether its next steps can be taken side by side with other runs. */
MECHC_STATIC int mechc_runs_together(const mechc_integration *run, long steps)
{
    return run->current->together && mechc_attempts_left(run, steps) > 0
        && mechc_fits_lockstep(run);
}

/* Make up to `steps` attempts of each of up to MECHC_LANES runs of one method; returns early if one
 * that ran beside others has ended or continues alone. */
MECHC_STATIC void mechc_advance_runs(mechc_run **heads, int count, long steps)
{
    mechc_integration *together[MECHC_LANES];
    int fit = 0;
    long least = steps;
    for (int i = 0; i < count; i++) {
        mechc_integration *run = (mechc_integration *)heads[i];
        if (run->head.status != MECHC_RUNNING || !mechc_take_place(run)) continue;
        if (mechc_runs_together(run, steps)) {
            together[fit++] = run;
            least = mechc_attempts_left(run, least);
        } else {
            mechc_advance_alone(run, steps);
        }
    }
    if (fit == 1 && together[0]->current->by_itself) mechc_advance_alone(together[0], steps);
    else if (fit) together[0]->current->together(together, fit, least);
}

MECHC_STATIC int mechc_advance_run(mechc_run *head, long steps)
{
    mechc_integration *run = (mechc_integration *)head;
    while (head->status == MECHC_RUNNING && head->wanted < 0 && steps > 0) {
        if (!mechc_take_place(run)) break;
        if (!mechc_is_loaded(run->current) && !mechc_use_loaded(run)) break;
        steps -= !run->current->by_itself && mechc_runs_together(run, steps)
               ? run->current->together(&run, 1, mechc_attempts_left(run, steps))
               : mechc_advance_alone(run, steps);
    }
    return head->status;
}
