/* Advance of several runs of one method side by side. */
#pragma once

#include "lockstep/judge.h"
#include "lockstep/step.h"

#if MECHC_LOCKSTEP_CODE
/* Take whole turns out of a lane's coordinates. */
MECHC_STATIC void mechc_lockstep_take_turns(mechc_lockstep *a, mechc_integration *run, int lane)
{
    double q[MECHC_NQ_MAX];
    for (int i = 0; i < MECHC_NQ; i++) q[i] = a->y[i][lane];
    mechc_take_turns(q, run->turns);
    for (int i = 0; i < MECHC_NQ; i++) /* all lanes are loaded next, which waits for such stores */
        if (q[i] != a->y[i][lane]) a->y[i][lane] = q[i];
}

/* Record a step that was accepted; 0 without memory. */
MECHC_STATIC int mechc_lockstep_keep(const mechc_lockstep_method *method, mechc_lockstep *a,
                                     mechc_integration **runs, int lane, const mechc_vector *rows)
{
    mechc_trajectory *trajectory = &runs[lane]->head.trajectory;
    if (trajectory->last_only) return mechc_lockstep_keep_last(a, lane, runs[lane]);
    if (!mechc_make_room(trajectory)) return 0;
    const ptrdiff_t size = trajectory->width * trajectory->dense_rows;
    double *dense = trajectory->dense + (trajectory->count - 1) * size;
    for (ptrdiff_t i = 0; i < size; i++)
        dense[i] = i < method->dense_rows * MECHC_NX ? rows[i][lane] : 0.0;
    if (size) trajectory->methods[trajectory->count - 1] = (unsigned char)method->number;
    double *state = trajectory->y + trajectory->count * MECHC_NX;
    for (int i = 0; i < MECHC_NX; i++) state[i] = a->y[i][lane];
    trajectory->t[trajectory->count++] = a->t[lane];
    mechc_give_turns(runs[lane]->turns, state);
    return 1;
}

/* Whether some lane needs work of its own. */
MECHC_INLINE int mechc_lockstep_asks(const mechc_lockstep *a, mechc_mask accepted, mechc_mask leaves)
{
    mechc_mask asks = a->last | (a->stiff >= MECHC_STIFF);
    for (int k = 0; k < MECHC_PERIODICS; k++)
        asks |= mechc_size_of(a->y[mechc_periodic[k]]) > MECHC_FEW_TURNS * MECHC_TURN;
    return !a->last_only || mechc_any(leaves | (accepted & asks));
}

/* Decide what each run does next, after a step of all of them is judged; 1 if one is to leave. */
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
        mechc_lockstep_take_turns(a, run, lane);
        if (run->when_stiff && a->stiff[lane] >= MECHC_STIFF) {
            any = run->alone = 1;
            run->stiff = (int)a->stiff[lane];
            if (!mechc_use_method(run, mechc_for_stiff(run))) run->head.status = MECHC_NO_MEMORY;
            a->stiff[lane] = run->stiff;
        }
        any |= run->head.status != MECHC_RUNNING;
    }
    return any;
}

/* Judge a step of every lane and continue from it; 1 where a run is to leave. */
MECHC_INLINE int mechc_lockstep_go_on(const mechc_lockstep_method *method, mechc_lockstep *a,
                                      mechc_integration **runs, int count, int dense)
{
    mechc_vector rows[MECHC_MOST_DENSE * MECHC_NX_MAX];
    mechc_mask leaves;
    const mechc_mask accepted = mechc_lockstep_judge(method, a, &leaves);
    if (dense) method->dense(a, rows);
    mechc_lockstep_accept(method, a, accepted, leaves);
    if (!mechc_lockstep_asks(a, accepted, leaves)) return 0;
    return mechc_lockstep_part(method, a, runs, count, accepted, leaves, rows);
}

/* Make up to `steps` attempts of each run, fewer if one of them ends or continues alone; returns the number
 * of attempts.  Inlined into a function of each method, so that its table is constant. */
MECHC_INLINE long mechc_lockstep_advance(const mechc_lockstep_method *method, mechc_lockstep *a,
                                         mechc_integration **runs, int count, long steps)
{
    int dense = 0, parted = 0;
    long made = 0;
    a->last_only = 1;
    if (method->plans) memset(a->rates, 0, sizeof a->rates); /* it leaves none */
    for (int lane = 0; lane < MECHC_LANES; lane++) {
        /* idle lanes repeat the first run */
        const mechc_integration *run = runs[lane < count ? lane : 0];
        mechc_lockstep_load(a, lane, run);
        if (method->load) method->load(a, lane, run);
        dense |= run->head.trajectory.dense_rows;
        a->last_only &= run->head.trajectory.last_only;
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

/* Such a function of a method, whose own lanes have a type. */
#define MECHC_LOCKSTEP_TOGETHER(name, own_lanes, method)                                          \
    MECHC_SINGLE long name(mechc_integration **runs, int count, long steps)                       \
    {                                                                                             \
        own_lanes own;                                                                            \
        return mechc_lockstep_advance(&method, &own.lanes, runs, count, steps);                   \
    }
#endif
