/* The parts of a step of every lane, for any method: its length, rates without projection, its
 * projected end. */
#pragma once

#include "lockstep/lanes_of_runs.h"
#include "simd/bind_vector.h"
#include "dynamics/stage.h"
#include "simd/rough.h"
#include "simd/unbind.h"
#include "simd/vector.h"
#include "stepping/control.h"

#define MECHC_LOCKSTEP_CLOSINGS 4

/* Rates of a state and, unless rows are known to be independent, the square of their distance from
 * dependence; turns, near: see mechc_vector_locate_near. */
MECHC_INLINE mechc_vector mechc_lockstep_rates_at(const mechc_lockstep *a, mechc_vector t,
                                                  const mechc_vector *state, mechc_vector *turns,
                                                  int near, int regular, mechc_vector *rates)
{
    mechc_vector_place place;
    mechc_vector_locate_near(t, state, &a->given, &place, turns, near,
                             regular ? 0.0 : MECHC_REDUNDANT);
    mechc_vector_coordinate_rates_of(t, state, state + MECHC_NQ, &a->given, rates);
    mechc_vector_accelerate(t, state, state + MECHC_NQ, &a->given, &place, rates + MECHC_NQ, 0);
#if MECHC_NC_MAX > 0
    if (!regular) return mechc_vector_regularity_at(&place);
#endif
    return mechc_spread(1.0);
}

MECHC_ONCE void mechc_lockstep_rates(const mechc_lockstep *a, mechc_vector t,
                                     const mechc_vector *state, mechc_vector *rates)
{
    mechc_lockstep_rates_at(a, t, state, 0, 0, 1, rates);
}

/* Rates of a state, and the distance of the rows from dependence there. */
MECHC_ONCE void mechc_lockstep_watched_rates(mechc_lockstep *a, mechc_vector t,
                                             const mechc_vector *state, mechc_vector *rates)
{
    a->met = mechc_lesser(mechc_lockstep_rates_at(a, t, state, 0, 0, 0, rates), a->met);
}

/* Close the loops at the ends; a lane that is closed is not moved further. */
MECHC_INLINE void mechc_lockstep_close(mechc_lockstep *a, mechc_vector t,
                                       mechc_vector_place *place)
{
#if MECHC_NH_MAX > 0
    for (int closing = 0;; closing++) {
        mechc_vector q[MECHC_NQ_MAX], rounding;
        mechc_vector_locate(t, a->end, &a->given, place);
        const mechc_vector gap = mechc_vector_gap_and_rounding(place, a->end, &rounding);
        const mechc_mask open = ~(gap <= 2.0 * rounding);
        a->closed = gap <= MECHC_CLOSES * rounding;
        a->configurations += 1 & (open | -(int64_t)(closing == 0));
        if (!mechc_any(open) || closing == MECHC_LOCKSTEP_CLOSINGS) return;
        memcpy(q, a->end, MECHC_NQ * sizeof *q);
        mechc_vector_correct(t, q, &a->given, place);
        for (int i = 0; i < MECHC_NQ; i++) a->end[i] = mechc_choose(open, q[i], a->end[i]);
    }
#else
    mechc_vector_locate(t, a->end, &a->given, place);
    a->closed = ~(mechc_mask){0};
    a->configurations += 1;
#endif
}

/* The conditioning at the ends, for the monitor. */
MECHC_INLINE mechc_vector mechc_lockstep_conditioning(const mechc_vector_place *place)
{
#if MECHC_MAY_HAVE_ONE_ROW
    if (MECHC_NH == 1 && MECHC_NC > 1) return mechc_vector_conditioning_of_row(place);
#endif
#if MECHC_NH_MAX > 0
    return mechc_vector_conditioning(place);
#else
    (void)place;
    return mechc_spread(1.0);
#endif
}

/* Project the ends onto the constraints, and compute their rates. */
MECHC_ONCE void mechc_lockstep_project(mechc_lockstep *a, mechc_vector t, mechc_vector *rates)
{
    mechc_vector_place place;
    mechc_vector *u = a->end + MECHC_NQ;
    mechc_lockstep_close(a, t, &place);
    mechc_vector_steady(&place, u);
    mechc_vector_coordinate_rates_of(t, a->end, u, &a->given, rates);
    mechc_vector_accelerate(t, a->end, u, &a->given, &place, rates + MECHC_NQ, 0);
    a->conditioning = mechc_lockstep_conditioning(&place);
#if MECHC_NC_MAX > 0
    a->met = mechc_lesser(mechc_vector_regularity_at(&place), a->met);
#endif
}

/* The weight of a component's error: 1 over its tolerance. */
MECHC_INLINE mechc_vector mechc_lockstep_weight(const mechc_lockstep *a, int i)
{
    const mechc_vector y = mechc_size_of(a->y[i]), end = mechc_size_of(a->end[i]);
    const mechc_vector size = mechc_choose(y > end, y, end);
    const mechc_vector asked = a->of_scale * a->scale[i] + (a->floor[i] + a->of_size * size);
    const mechc_vector digit = DBL_EPSILON * size;
    return mechc_vector_rough_inverse(mechc_choose(asked > digit, asked, digit));
}

/* The step to attempt, whether it is the last one, and the part of its tolerance. */
MECHC_INLINE void mechc_lockstep_next_step(mechc_lockstep *a)
{
    const mechc_vector left = a->t1 - a->t, size = mechc_size_of(left);
    const mechc_vector step = mechc_lesser(a->step, a->max_step);
    const mechc_vector ahead = mechc_choose(left < 0.0, -step, step);
    a->last = size <= MECHC_TO_END * step;
    a->h = mechc_choose(size < 2.0 * step, 0.5 * left, ahead);
    a->h = mechc_choose(a->last, left, a->h);
    a->met = mechc_spread(HUGE_VAL);
    if (!mechc_any(a->steps > MECHC_STEPS_OF_SHARE)) return;
    for (int lane = 0; lane < MECHC_LANES; lane++) a->part[lane] = mechc_part_of_share(a->steps[lane]);
}
