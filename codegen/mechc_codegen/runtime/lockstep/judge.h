/* The judgement of a step of every lane: which are accepted, what is recorded, how long the next are. */
#pragma once

#include "lockstep/lanes_of_runs.h"
#include "simd/bind_vector.h"
#include "simd/rough.h"
#include "simd/unbind.h"
#include "simd/vector.h"
#include "stepping/lockstep_fit.h"
#include "stepping/passages.h"
#include "stepping/stiffness.h"

/* The factor of the step that the error allows; the error is expected to grow as it did before.
 * Gustafsson (1991). */
MECHC_INLINE mechc_vector mechc_lockstep_factor(const mechc_lockstep_method *method,
                                                 mechc_lockstep *a)
{
    const mechc_vector plain = method->plans
                             ? mechc_spread(1.0) : MECHC_LOCKSTEP_SAFETY * mechc_vector_rough_root(a->error);
    const mechc_vector trend =
        mechc_size_of(a->h) * plain * mechc_vector_rough_inverse(a->last_step * a->last_factor);
    const mechc_mask known = (a->last_factor > 0.0) & (a->error <= 1.0);
    const mechc_vector factor = mechc_choose(known & (trend < 1.0), plain * trend, plain);
    const mechc_vector most =
        mechc_choose(a->refused, mechc_spread(1.0), mechc_spread(method->growth));
    a->factor = plain;
    return mechc_lesser(mechc_choose(factor > MECHC_SHRINKS, factor, mechc_spread(MECHC_SHRINKS)), most);
}

/* The lanes whose step may have passed a change point between its nodes: see passages.h. */
MECHC_INLINE mechc_mask mechc_lockstep_may_pass(const mechc_lockstep *a)
{
    mechc_mask far = {0};
    if (!mechc_any(a->watched)) return far;
    const mechc_vector least = mechc_lesser(a->met, a->conditioning * a->conditioning);
    for (int i = 0; i < MECHC_NQ; i++) {
        const mechc_vector moved = a->end[i] - a->y[i], scale = MECHC_LEAST_NODES * a->scale[i];
        far |= moved * moved > least * (scale * scale);
    }
    return far & a->watched;
}

/* The lanes whose step is accepted, and those that leave the lockstep: what it does not treat, and
 * failures, are left to the driver of one run. */
MECHC_INLINE mechc_mask mechc_lockstep_judge(const mechc_lockstep_method *method,
                                             mechc_lockstep *a, mechc_mask *leaves)
{
    const mechc_vector *rates = a->rates[method->last_rate];
    mechc_vector sum = mechc_size_of(rates[0]);
    for (int i = 1; i < MECHC_NX; i++) sum += mechc_size_of(rates[i]);
    const mechc_vector smallest = MECHC_SMALLEST_STEP * mechc_size_of(a->t) + DBL_MIN;
    a->error = method->error(a);
    const mechc_mask good = a->error <= 1.0, finite = a->error < HUGE_VAL;
    const double least = MECHC_NC > MECHC_NH ? MECHC_LOCKSTEP_LOW : MECHC_NARROW;
    const mechc_mask small = ~a->last & (mechc_size_of(a->h) < smallest);
    const mechc_mask regular = a->closed & (sum < HUGE_VAL)
                                  & (a->met >= MECHC_LOCKSTEP_LOW * MECHC_LOCKSTEP_LOW)
                                  & (a->conditioning >= least)
                                  & ~mechc_lockstep_may_pass(a);
    *leaves = ~finite | small | (good & ~regular);
    if (MECHC_SWITCHES) *leaves |= MECHC_IS_WATCHED(a->steps);
    return good & ~*leaves;
}

/* Count steps that stability limits. */
MECHC_INLINE void mechc_lockstep_watch_stiffness(const mechc_lockstep_method *method,
                                                 mechc_lockstep *a, mechc_mask accepted)
{
    if (!method->limited) return;
    const mechc_mask limited = accepted & method->limited(a);
    const mechc_mask easy = accepted & ~limited;
    a->stiff -= limited;
    a->easy = (a->easy - easy) & ~limited;
    a->stiff &= a->easy < MECHC_EASY;
}

/* Accept the steps that succeeded; the others are tried again with a shorter step. */
MECHC_INLINE void mechc_lockstep_accept(const mechc_lockstep_method *method, mechc_lockstep *a,
                                        mechc_mask accepted, mechc_mask leaves)
{
    const mechc_vector size = mechc_size_of(a->h), next = a->h + a->time_compensation;
    const mechc_vector t = mechc_choose(a->last, a->t1, a->t + next);
    const mechc_vector *rates = a->rates[method->last_rate];
    const mechc_mask watched = MECHC_NC > 0 ? accepted : (mechc_mask){0}; /* no rows: nothing to be least */
    const mechc_mask worse = watched & (a->conditioning < a->least);
    mechc_lockstep_watch_stiffness(method, a, accepted);
    if (method->accept) method->accept(a, accepted);
    a->step = mechc_choose(leaves, a->step, size * mechc_lockstep_factor(method, a));
    a->refused = (a->refused & leaves) | ~(accepted | leaves);
    a->steps -= accepted;
    a->rejected += 1 + accepted;
    a->time_compensation = mechc_choose(accepted, next - (t - a->t), a->time_compensation);
    a->before[1] = mechc_choose(accepted, a->before[0], a->before[1]);
    a->before[0] = mechc_choose(accepted, a->t, a->before[0]);
    a->t = mechc_choose(accepted, t, a->t);
    for (int i = 0; i < MECHC_NX; i++) {
        a->y[i] = mechc_choose(accepted, a->end[i], a->y[i]);
        a->compensation[i] = mechc_choose(accepted, a->next_compensation[i], a->compensation[i]);
        a->rates[0][i] = mechc_choose(accepted, rates[i], a->rates[0][i]);
        const mechc_vector reached = mechc_size_of(a->y[i]);
        if (i >= MECHC_NQ) a->scale[i] = mechc_choose(reached > a->scale[i], reached, a->scale[i]);
    }
    a->least = mechc_choose(worse, a->conditioning, a->least);
    a->least_time = mechc_choose(worse, a->t, a->least_time);
    a->first = mechc_choose(accepted, a->conditioning, a->first);
    a->last_step = mechc_choose(accepted, size, a->last_step);
    a->last_factor = mechc_choose(accepted, a->factor, a->last_factor);
}
