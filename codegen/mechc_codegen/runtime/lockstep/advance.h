/* Runs of one method continue side by side. */
#pragma once

#include "abi/run.h"
#include "lockstep/judge.h"
#include "lockstep/lanes_of_runs.h"
#include "lockstep/step.h"
#include "run/integration.h"
#include "run/method.h"
#include "run/trajectory.h"
#include "stepping/lockstep_fit.h"
#include "stepping/stiffness.h"

#if MECHC_LOCKSTEP
/* Keep the steps that were accepted. */
MECHC_STATIC int mechc_lockstep_keep(const mechc_lockstep_method *method, mechc_lockstep *a,
                                     mechc_integration **runs, int lane, const mechc_vector *rows)
{
    mechc_trajectory *trajectory = &runs[lane]->head.trajectory;
    double y[MECHC_NX], *turns = runs[lane]->turns;
    if (!mechc_make_room(trajectory)) return 0;
    const ptrdiff_t size = trajectory->width * trajectory->dense_rows;
    double *dense = trajectory->dense + (trajectory->count - 1) * size;
    for (ptrdiff_t i = 0; i < size; i++)
        dense[i] = i < method->dense_rows * MECHC_NX ? rows[i][lane] : 0.0;
    if (size) trajectory->methods[trajectory->count - 1] = (unsigned char)method->number;
    double *state = trajectory->y + trajectory->count * MECHC_NX;
    for (int i = 0; i < MECHC_NX; i++) state[i] = y[i] = a->y[i][lane];
    trajectory->t[trajectory->count++] = a->t[lane];
    mechc_give_turns(turns, state);
    mechc_take_turns(y, turns);
    for (int i = 0; i < MECHC_NQ; i++) /* all lanes are loaded next, which waits for such stores */
        if (y[i] != a->y[i][lane]) a->y[i][lane] = y[i];
    return 1;
}

/* What each run does next, once a step of all of them is judged; 1 where one is to leave. */
MECHC_STATIC int mechc_lockstep_part(const mechc_lockstep_method *method, mechc_lockstep *a,
                                     mechc_integration **runs, int count, mechc_mask accepted,
                                     mechc_mask leaves, const mechc_vector *rows)
{
    int any = 0;
    for (int lane = 0; lane < count; lane++) {
        mechc_integration *run = runs[lane];
        if (leaves[lane]) run->alone = any = 1;
        if (!accepted[lane]) continue;
        if (!mechc_lockstep_keep(method, a, runs, lane, rows)) run->head.status = MECHC_NO_MEMORY;
        else if (a->last[lane]) run->head.status = MECHC_FINISHED;
        if (run->may_stiffen && a->stiff[lane] >= MECHC_STIFF) {
            any = 1;
            if (!mechc_use_method(run, run->methods[MECHC_RADAU5]))
                run->head.status = MECHC_NO_MEMORY;
        }
        any |= run->head.status != MECHC_RUNNING;
    }
    return any;
}

/* Judge a step of every lane and continue from it; 1 where a run is to leave. */
MECHC_INLINE int mechc_lockstep_go_on(const mechc_lockstep_method *method, mechc_lockstep *a,
                                      mechc_integration **runs, int count, int dense)
{
    mechc_vector rows[MECHC_MOST_DENSE * MECHC_NX];
    mechc_mask leaves;
    const mechc_mask accepted = mechc_lockstep_judge(method, a, &leaves);
    if (dense) method->dense(a, rows);
    mechc_lockstep_accept(method, a, accepted, leaves);
    return mechc_lockstep_part(method, a, runs, count, accepted, leaves, rows);
}

/* Up to `steps` attempts of each run, fewer where one of them ends or continues alone; the attempts
 * made.  Inlined into a function of each method, so that its table is constant. */
MECHC_INLINE long mechc_lockstep_advance(const mechc_lockstep_method *method, mechc_lockstep *a,
                                         mechc_integration **runs, int count, long steps)
{
    int dense = 0, parted = 0;
    long made = 0;
    for (int lane = 0; lane < MECHC_LANES; lane++) {
        /* idle lanes repeat the first run */
        const mechc_integration *run = runs[lane < count ? lane : 0];
        mechc_lockstep_load(a, lane, run);
        if (method->load) method->load(a, lane, run);
        dense |= run->head.trajectory.dense_rows;
    }
    for (; made < steps && !parted; made++) {
        mechc_lockstep_next_step(a);
        method->step(a);
        parted = mechc_lockstep_go_on(method, a, runs, count, dense);
    }
    for (int lane = 0; lane < count; lane++) {
        mechc_lockstep_store(a, lane, runs[lane]);
        if (method->store) method->store(a, lane, runs[lane]);
    }
    return made;
}
#endif
