/* One step of every lane: its stages as the equations stand, its end on the constraints. */
#pragma once

#include "lockstep/lanes_of_runs.h"
#include "methods/dormand_prince_tableaus.h"
#include "simd/bind_vector.h"
#include "dynamics/stage.h"
#include "methods/explicit_step.h"
#include "simd/unbind.h"
#include "run/integration.h"
#include "simd/vector.h"

#define MECHC_LOCKSTEP_CLOSINGS 4

MECHC_INLINE mechc_vector mechc_lockstep_rates_at(const mechc_lockstep *a, mechc_vector t,
                                                  const mechc_vector *state, int regular,
                                                  mechc_vector *rates)
{
    mechc_vector_place place;
    mechc_vector_locate_near(t, state, &a->given, &place, 0, 0, regular);
    mechc_vector_coordinate_rates_of(t, state, state + MECHC_NQ, &a->given, rates);
    mechc_vector_accelerate(t, state, state + MECHC_NQ, &a->given, &place, rates + MECHC_NQ, 0);
#if MECHC_NH > 0
    if (!regular) return mechc_vector_conditioning_at(&place);
#endif
    return mechc_spread(1.0);
}

MECHC_ONCE void mechc_lockstep_rates(const mechc_lockstep *a, mechc_vector t,
                                     const mechc_vector *state, mechc_vector *rates)
{
    mechc_lockstep_rates_at(a, t, state, 1, rates);
}

/* Likewise, and how well conditioned the rows are there. */
MECHC_ONCE void mechc_lockstep_watched_rates(mechc_lockstep *a, mechc_vector t,
                                             const mechc_vector *state, mechc_vector *rates)
{
    a->met = mechc_lesser(mechc_lockstep_rates_at(a, t, state, 0, rates), a->met);
}

/* Close the loops of the ends; a lane that is closed is not moved on. */
MECHC_INLINE void mechc_lockstep_close(mechc_lockstep *a, mechc_vector t,
                                       mechc_vector_place *place)
{
#if MECHC_NH > 0
    for (int closing = 0;; closing++) {
        mechc_vector q[MECHC_NQ], rounding;
        mechc_vector_locate(t, a->end, &a->given, place);
        const mechc_vector gap = mechc_vector_gap_and_rounding(place, a->end, &rounding);
        const mechc_mask open = ~(gap <= 2.0 * rounding);
        a->closed = gap <= 16.0 * rounding;
        a->configurations += 1 & (open | -(int64_t)(closing == 0));
        if (!mechc_any(open) || closing == MECHC_LOCKSTEP_CLOSINGS) return;
        memcpy(q, a->end, sizeof q);
        mechc_vector_correct(t, q, &a->given, place);
        for (int i = 0; i < MECHC_NQ; i++) a->end[i] = mechc_choose(open, q[i], a->end[i]);
    }
#else
    mechc_vector_locate(t, a->end, &a->given, place);
    a->closed = ~(mechc_mask){0};
    a->configurations += 1;
#endif
}

/* The ends on the constraints, and their rates. */
MECHC_ONCE void mechc_lockstep_project(mechc_lockstep *a, mechc_vector t, mechc_vector *rates)
{
    mechc_vector_place place;
    mechc_vector *u = a->end + MECHC_NQ;
    mechc_lockstep_close(a, t, &place);
    mechc_vector_steady(&place, u);
    mechc_vector_coordinate_rates_of(t, a->end, u, &a->given, rates);
    mechc_vector_accelerate(t, a->end, u, &a->given, &place, rates + MECHC_NQ, 0);
#if MECHC_NH > 0
    a->conditioning = mechc_vector_conditioning(&place);
    a->met = mechc_lesser(a->conditioning * a->conditioning, a->met);
#else
    a->conditioning = mechc_spread(1.0);
#endif
}

/* The stages whose conditioning is monitored: with both ends, no stage is far from one of them. */
MECHC_INLINE int mechc_lockstep_watches(int stage) { return stage == 5 || stage == 8; }

/* Rates of stage i; those of the dense output, after the end, are not watched. */
MECHC_INLINE int mechc_lockstep_stage(void *owner, int i, mechc_vector t, mechc_vector *state,
                                      mechc_vector *rates)
{
    mechc_lockstep *a = owner;
    const int stages = mechc_dop853_tableau.stages;
    if (i == stages) {
        mechc_lockstep_project(a, t, rates);
        return MECHC_RUNNING;
    }
    if (MECHC_NH > 0 && mechc_lockstep_watches(i)) mechc_lockstep_watched_rates(a, t, state, rates);
    else mechc_lockstep_rates(a, t, state, rates);
    if (i == stages - 1) memcpy(a->last_stage, state, sizeof a->last_stage);
    return MECHC_RUNNING;
}

MECHC_INLINE mechc_vector_explicit_data mechc_lockstep_data(mechc_lockstep *a)
{
    return (mechc_vector_explicit_data){
        a->t, a->h, a->y, a->compensation, a->next_compensation, a->rates,
    };
}

/* The step to attempt, and whether it is the last. */
MECHC_INLINE void mechc_lockstep_next_step(mechc_lockstep *a)
{
    const mechc_vector left = a->t1 - a->t, size = mechc_size_of(left);
    const mechc_vector step = mechc_lesser(a->step, a->max_step);
    const mechc_vector ahead = mechc_choose(left < 0.0, -step, step);
    a->last = size <= 1.01 * step;
    a->h = mechc_choose(size < 2.0 * step, 0.5 * left, ahead);
    a->h = mechc_choose(a->last, left, a->h);
}

MECHC_ONCE void mechc_lockstep_step(mechc_lockstep *a)
{
    mechc_lockstep_next_step(a);
    a->met = mechc_spread(HUGE_VAL);
    const mechc_vector_explicit_data step = mechc_lockstep_data(a);
    mechc_vector_explicit_step(&mechc_dop853_tableau, &step, mechc_lockstep_stage, a, a->end);
}

/* The extra stages of the dense output, and its rows. */
MECHC_ONCE void mechc_lockstep_dense(mechc_lockstep *a, mechc_vector *rows)
{
    const mechc_tableau *tableau = &mechc_dop853_tableau;
    const mechc_vector_explicit_data step = mechc_lockstep_data(a);
    mechc_vector state[MECHC_NX];
    mechc_vector_explicit_stages(tableau, &step, tableau->stages + 1, tableau->rates - 1,
                                 mechc_lockstep_stage, a, state);
    mechc_vector_explicit_dense(tableau, &step, a->end, tableau->dense_rows, rows);
}
