/* After a step of every lane: which are accepted, what is kept of them, how long the next are. */
#pragma once

#include "lockstep/lanes_of_runs.h"
#include "methods/dormand_prince_tableaus.h"
#include "simd/bind_vector.h"
#include "methods/explicit_step.h"
#include "simd/rough.h"
#include "simd/unbind.h"
#include "run/integration.h"
#include "simd/vector.h"
#include "stepping/lockstep_fit.h"
#include "stepping/passages.h"
#include "stepping/stiffness.h"

#define MECHC_LOCKSTEP_SAFETY 0.84
#define MECHC_LOCKSTEP_GROWTH 2.0

/* Square of the step's error over what is tolerated: see mechc_pair_error. */
MECHC_INLINE mechc_vector mechc_lockstep_error(mechc_lockstep *a)
{
    mechc_vector first[MECHC_NX], second[MECHC_NX];
    mechc_vector squares = mechc_spread(0.0), second_squares = mechc_spread(0.0);
    const mechc_tableau *tableau = &mechc_dop853_tableau;
    mechc_vector_explicit_sum(a->rates, tableau->error, tableau->stages, first);
    mechc_vector_explicit_sum(a->rates, tableau->second_error, tableau->stages, second);
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_vector y = mechc_size_of(a->y[i]), end = mechc_size_of(a->end[i]);
        const mechc_vector size = mechc_choose(y > end, y, end);
        const mechc_vector asked = a->of_scale * a->scale[i] + (a->floor[i] + a->of_size * size);
        const mechc_vector digit = 2.220446049250313e-16 * size;
        const mechc_vector tolerated = mechc_choose(asked > digit, asked, digit);
        const mechc_vector weight = a->h * mechc_vector_rough_inverse(tolerated);
        squares += (first[i] * weight) * (first[i] * weight);
        second_squares += (second[i] * weight) * (second[i] * weight);
    }
    const mechc_vector both = squares + 0.01 * second_squares;
    return mechc_choose(squares > 0.0, squares * squares / (both * MECHC_NX), squares);
}

/* What the error lets the step grow by; it is expected to continue growing as it did.
 * Gustafsson (1991). */
MECHC_INLINE mechc_vector mechc_lockstep_factor(mechc_lockstep *a)
{
    const mechc_vector plain = MECHC_LOCKSTEP_SAFETY * mechc_vector_rough_root(a->error);
    const mechc_vector trend =
        mechc_size_of(a->h) * plain * mechc_vector_rough_inverse(a->last_step * a->last_factor);
    const mechc_mask known = (a->last_factor > 0.0) & (a->error <= 1.0);
    const mechc_vector factor = mechc_choose(known & (trend < 1.0), plain * trend, plain);
    const mechc_vector most =
        mechc_choose(a->refused, mechc_spread(1.0), mechc_spread(MECHC_LOCKSTEP_GROWTH));
    a->factor = plain;
    return mechc_lesser(mechc_choose(factor > 0.2, factor, mechc_spread(0.2)), most);
}

/* The lanes whose step may have passed a change point between its nodes: see passages.h. */
MECHC_INLINE mechc_mask mechc_lockstep_may_pass(const mechc_lockstep *a)
{
    mechc_mask far = {0};
    if (!mechc_any(a->watched)) return far;
    for (int i = 0; i < MECHC_NQ; i++) {
        const mechc_vector moved = a->end[i] - a->y[i], scale = MECHC_LEAST_NODES * a->scale[i];
        far |= moved * moved > a->met * (scale * scale);
    }
    return far & a->watched;
}

/* The lanes whose step is accepted, and those that leave the lockstep: what it does not treat, and
 * failures, are left to the driver of one run. */
MECHC_INLINE mechc_mask mechc_lockstep_judge(mechc_lockstep *a, mechc_mask *leaves)
{
    const mechc_vector *rates = a->rates[mechc_dop853_tableau.stages];
    mechc_vector sum = mechc_size_of(rates[0]);
    for (int i = 1; i < MECHC_NX; i++) sum += mechc_size_of(rates[i]);
    const mechc_vector t = mechc_size_of(a->t), left = mechc_size_of(a->t1 - a->t);
    const mechc_vector smallest = (16.0 * 2.220446049250313e-16) * mechc_choose(t > left, t, left);
    a->error = mechc_lockstep_error(a);
    const mechc_mask good = a->error <= 1.0, finite = a->error < HUGE_VAL;
    const mechc_mask small = ~a->last & (mechc_size_of(a->h) < smallest);
    const mechc_mask regular = a->closed & (sum < HUGE_VAL)
                                  & (a->met >= MECHC_LOCKSTEP_LOW * MECHC_LOCKSTEP_LOW)
                                  & ~mechc_lockstep_may_pass(a);
    *leaves = ~finite | small | (good & ~regular);
    return good & ~*leaves;
}

/* Count steps that stability limits: see mechc_pair_limited. */
MECHC_INLINE void mechc_lockstep_watch_stiffness(mechc_lockstep *a, mechc_mask accepted)
{
    const int stages = mechc_dop853_tableau.stages;
    mechc_vector rate = mechc_spread(0.0), state = rate;
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_vector weight = mechc_vector_rough_inverse(a->scale[i]);
        const mechc_vector change = weight * (a->rates[stages][i] - a->rates[stages - 1][i]);
        const mechc_vector apart = weight * (a->end[i] - a->last_stage[i]);
        rate += change * change;
        state += apart * apart;
    }
    const double square = mechc_dop853_tableau.stability * mechc_dop853_tableau.stability;
    const mechc_mask limited =
        accepted & (state > 0.0) & (a->h * a->h * rate > square * state);
    const mechc_mask easy = accepted & ~limited;
    a->stiff -= limited;
    a->easy = (a->easy - easy) & ~limited;
    a->stiff &= a->easy < MECHC_EASY;
}

/* Accept the steps that stand; the others are tried again, shorter. */
MECHC_ONCE void mechc_lockstep_accept(mechc_lockstep *a, mechc_mask accepted,
                                      mechc_mask leaves)
{
    const mechc_vector size = mechc_size_of(a->h), next = a->h + a->time_compensation;
    const mechc_vector t = mechc_choose(a->last, a->t1, a->t + next);
    const mechc_vector *rates = a->rates[mechc_dop853_tableau.stages];
    const mechc_mask worse = accepted & (a->conditioning < a->least);
    mechc_lockstep_watch_stiffness(a, accepted);
    a->step = mechc_choose(leaves, a->step, size * mechc_lockstep_factor(a));
    a->refused = (a->refused & leaves) | ~(accepted | leaves);
    a->steps -= accepted;
    a->rejected += 1 + accepted;
    a->time_compensation = mechc_choose(accepted, next - (t - a->t), a->time_compensation);
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
