/* The runs of a unit continue: in lockstep where they are fit for it, else one by one. */
#pragma once

#include "abi/run.h"
#include "lockstep/judge.h"
#include "lockstep/lanes_of_runs.h"
#include "lockstep/step.h"
#include "methods/dormand_prince_tableaus.h"
#include "run/integration.h"
#include "run/method.h"
#include "run/trajectory.h"
#include "stepping/lockstep_fit.h"
#include "stepping/stiffness.h"

#if MECHC_LOCKSTEP
/* Keep the steps that were accepted. */
MECHC_STATIC int mechc_lockstep_keep(mechc_lockstep *a, mechc_integration **runs, int lane,
                                     const mechc_vector *rows)
{
    mechc_trajectory *trajectory = &runs[lane]->head.trajectory;
    double y[MECHC_NX];
    if (!mechc_make_room(trajectory)) return 0;
    const ptrdiff_t size = trajectory->width * trajectory->dense_rows;
    double *dense = trajectory->dense + (trajectory->count - 1) * size;
    for (ptrdiff_t i = 0; i < size; i++)
        dense[i] = i < mechc_dop853_tableau.dense_rows * MECHC_NX ? rows[i][lane] : 0.0;
    if (size) trajectory->methods[trajectory->count - 1] = MECHC_DOP853;
    for (int i = 0; i < MECHC_NX; i++) y[i] = a->y[i][lane];
    const int kept = mechc_append_turned(trajectory, a->t[lane], y, runs[lane]->turns);
    mechc_take_turns(y, runs[lane]->turns);
    for (int i = 0; i < MECHC_NQ; i++) a->y[i][lane] = y[i];
    return kept;
}

/* What each run does next, once a step of all of them is judged; 1 where one is to leave. */
MECHC_STATIC int mechc_lockstep_part(mechc_lockstep *a, mechc_integration **runs, int count,
                                     mechc_mask accepted, mechc_mask leaves,
                                     const mechc_vector *rows)
{
    int any = 0;
    for (int lane = 0; lane < count; lane++) {
        mechc_integration *run = runs[lane];
        if (leaves[lane]) run->alone = any = 1;
        if (!accepted[lane]) continue;
        if (!mechc_lockstep_keep(a, runs, lane, rows)) run->head.status = MECHC_NO_MEMORY;
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
MECHC_STATIC int mechc_lockstep_go_on(mechc_lockstep *a, mechc_integration **runs, int count,
                                      int dense)
{
    mechc_vector rows[MECHC_MOST_DENSE * MECHC_NX];
    mechc_mask leaves;
    const mechc_mask accepted = mechc_lockstep_judge(a, &leaves);
    if (dense) mechc_lockstep_dense(a, rows);
    mechc_lockstep_accept(a, accepted, leaves);
    return mechc_lockstep_part(a, runs, count, accepted, leaves, rows);
}

/* Up to `steps` attempts of each run, fewer where one of them ends or continues alone; the attempts
 * made. */
MECHC_SINGLE long mechc_lockstep_advance(mechc_integration **runs, int count, long steps)
{
    mechc_lockstep a;
    int dense = 0, parted = 0;
    long made = 0;
    for (int lane = 0; lane < MECHC_LANES; lane++) {
        /* idle lanes repeat the first run */
        const mechc_integration *run = runs[lane < count ? lane : 0];
        mechc_lockstep_load(&a, lane, run);
        dense |= run->head.trajectory.dense_rows;
    }
    for (; made < steps && !parted; made++) {
        mechc_lockstep_step(&a);
        parted = mechc_lockstep_go_on(&a, runs, count, dense);
    }
    for (int lane = 0; lane < count; lane++) mechc_lockstep_store(&a, lane, runs[lane]);
    return made;
}
#else
MECHC_STATIC long mechc_lockstep_advance(mechc_integration **runs, int count, long steps)
{
    (void)runs, (void)count, (void)steps;
    return 0;
}
#endif

/* Attempts that a run still has, of those asked for. */
MECHC_STATIC long mechc_lockstep_left(const mechc_integration *run, long steps)
{
    const long left = run->max_steps - run->head.stats.steps - run->head.stats.rejected;
    return left < steps ? left : steps;
}

/* Up to `steps` attempts of each of up to MECHC_LANES runs; returns early where one that ran beside
 * others has ended or continues alone. */
MECHC_STATIC void mechc_lockstep_advance_runs(mechc_run **heads, int count, long steps)
{
    mechc_integration *together[MECHC_LANES];
    int fit = 0;
    long least = steps;
    for (int i = 0; i < count; i++) {
        mechc_integration *run = (mechc_integration *)heads[i];
        if (run->head.status != MECHC_RUNNING) continue;
        if (mechc_lockstep_left(run, steps) > 0 && mechc_fits_lockstep(run)) {
            together[fit++] = run;
            least = mechc_lockstep_left(run, least);
        } else {
            run->driver->advance(run, steps);
        }
    }
    if (fit) mechc_lockstep_advance(together, fit, least);
}

MECHC_STATIC int mechc_lockstep_advance_run(mechc_run *head, long steps)
{
    mechc_integration *run = (mechc_integration *)head;
    while (head->status == MECHC_RUNNING && head->wanted < 0 && steps > 0) {
        const long most = mechc_lockstep_left(run, steps);
        if (most > 0 && mechc_fits_lockstep(run))
            steps -= mechc_lockstep_advance(&run, 1, most);
        else
            steps -= run->driver->advance(run, steps);
    }
    return head->status;
}
